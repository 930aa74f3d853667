"""The price of a study, its computing time: told before the work, from the time that a small part of it takes."""

from __future__ import annotations

import sys
import textwrap
import time
from typing import Any, Protocol, Self

from gearchaos.studies.cost import Cost, duration

TOLD_SECONDS = 10.0
"""A longer computing time, in seconds, is told."""

_LONG = 60.0
"""Of a longer one, in seconds, a smaller choice is told too."""

_TRIAL = 0.4
"""Least computing time of a trial, in seconds, unless it is already a large part of the work."""

_FIRST, _GROWTH, _LARGEST = 1 / 1024, 4, 0.1
"""Share of the work that the first trial does, its growth from one to the next, and the largest."""

_SMALLER = 0.25
"""Share of the work that the smaller choice is."""


class Priced(Protocol):
    """Work that can be told a price: a study, or a search along the speed."""

    @property
    def cost(self) -> Cost:
        """Upper bound of the computing time."""

    def thinned(self, share: float) -> Self:
        """About this share of the work, spread over all of it: at least as much as fills the vectors of a core."""

    def smaller(self, share: float) -> tuple[str, Self] | None:
        """About this share of the work as a user can ask for it, in words; None if there is no smaller choice."""

    def run(self, *, threads: int | None = None) -> Any:
        """Do the work."""


def price(work: Priced, threads: int | None = None) -> float:
    """The computing time of a work in seconds, from trials of parts that grow until one takes long enough.

    The first trial loads the kernels and does not count. What a motion takes until it is known is measured with it,
    and the ratio of the work to its part is that of the upper bounds of both.
    """
    share, took, part = _FIRST, 0.0, work.thinned(_FIRST)
    part.run(threads=threads)
    while True:
        begun = time.perf_counter()
        part.run(threads=threads)
        took = time.perf_counter() - begun
        if took >= _TRIAL or share >= _LARGEST:
            return took * work.cost.seconds(threads) / part.cost.seconds(threads)
        share *= _GROWTH
        part = work.thinned(share)


def announce(work: Priced, progress: bool = True, threads: int | None = None) -> None:
    """Print on stderr how long a work takes, if that is long and progress is wanted, and of a very long one a smaller
    choice with its price."""
    if not progress or work.cost.seconds(threads) < TOLD_SECONDS or sys.stderr is None:
        return
    seconds = price(work, threads)
    if seconds < TOLD_SECONDS:
        return
    words = f"this takes about {duration(seconds)}. {work.cost.summary}"
    if seconds > _LONG and (choice := work.smaller(_SMALLER)):
        less = seconds * choice[1].cost.seconds(threads) / work.cost.seconds(threads)
        words += f" With {choice[0]} it takes about {duration(less)}."
    print(textwrap.fill(words, 80, break_on_hyphens=False), file=sys.stderr, flush=True)
