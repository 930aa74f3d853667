"""The price of a study, its computing time: told before the work, from the time that a small part of it takes."""

from __future__ import annotations

import sys
import textwrap
import time
from typing import Any, Protocol, Self

from gearchaos.execute.progress import told_end
from gearchaos.studies.core.cost import Cost, duration

TOLD_SECONDS = 20.0
"""A longer computing time, in seconds, is told."""

_LONG, _SMALLER = 60.0, 0.25
"""Of a longer one, in seconds, a smaller choice is told too, about this share of the work."""

_WORTH = 0.8
"""Of its time, above which a smaller choice is not worth telling."""

_TRIAL = 0.7
"""Least time in seconds that a trial takes of the processors, so that a busy machine makes it no smaller."""

_FIRST, _LARGEST = 1 / 1024, 0.1
"""Share of the work that the first trial does, and from which no further one follows."""

_GROWTH, _UNTOLD_GROWTH, _MORE = 16.0, 3.0, 1.2
"""Largest growth of the share from one trial to the next, that after a trial which does not tell enough, and the
time of the next, as a multiple of the least one."""

_SOON = 0.5
"""A work of which even a small trial shows that it takes less than this part of `TOLD_SECONDS` is not tried further."""


class Priced(Protocol):
    """Work that can be told a price: a study, or a search along the speed."""

    @property
    def cost(self) -> Cost:
        """Upper bound of the computing time."""

    def thinned(self, share: float) -> Self:
        """About this share of the work, spread over all of it, or the least part that is possible."""

    def smaller(self, share: float) -> tuple[str, Self] | None:
        """About this share of the work with the words by which a user asks for it; None where nothing is smaller."""

    def needed(self, found: Any) -> float:
        """The share of the bound that the whole needs, as far as what this part has found tells; 1 if that is not
        told."""

    def tells(self, found: Any) -> bool:
        """Whether what this part has found is enough to go by, if it took long enough."""

    def run(self, *, threads: int | None = None) -> Any:
        """Do the work."""


def price(work: Priced, threads: int | None = None) -> float:
    """The computing time of a work in seconds, from trials of parts that grow until one takes long enough, or shows
    that the whole is soon done.

    A part before them loads the kernels. A trial measures both the rate of this machine and how soon motions of this
    model are known; the ratio of the work to its part is that of the upper bounds of both, as far as it is `needed`.
    """
    work.thinned(0.0).run(threads=threads)
    share, bound = _FIRST, work.cost.seconds(threads)
    while True:
        part = work.thinned(share)
        begun, spent = time.perf_counter(), time.process_time()
        found = part.run(threads=threads)
        took, spent = time.perf_counter() - begun, time.process_time() - spent
        seconds = took * bound / part.cost.seconds(threads) * part.needed(found)
        if (spent >= _TRIAL and part.tells(found)) or share >= _LARGEST or seconds < _SOON * TOLD_SECONDS:
            return seconds
        done = max(share, part.cost.seconds(threads) / bound)
        share = min(_LARGEST, _UNTOLD_GROWTH * done) if spent >= _TRIAL else done * min(
            _GROWTH, _MORE * _TRIAL / max(spent, 1e-3))


def announce(work: Priced, progress: bool = True, threads: int | None = None) -> None:
    """Print on stderr how long a work takes, if that is long and progress is wanted, and of a very long one a smaller
    choice with its price. Bars of progress then count on that time, and on more where it turns out too short."""
    told_end.set(None)
    if not progress or (bound := work.cost.seconds(threads)) < TOLD_SECONDS:
        return
    if (seconds := price(work, threads)) < TOLD_SECONDS:
        return
    told_end.set(time.monotonic() + seconds)
    words = f"this takes about {duration(seconds)}. {work.cost.summary}"
    if seconds > _LONG and (choice := work.smaller(_SMALLER)) and (
            less := seconds * choice[1].cost.seconds(threads) / bound) < _WORTH * seconds:
        words += f" With {choice[0]} it takes about {duration(less)}."
    print(textwrap.fill(words, 80, break_on_hyphens=False), file=sys.stderr, flush=True)
