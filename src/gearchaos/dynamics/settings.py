"""Settings of the classification: lengths of its transient, exponent and averaging runs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from gearchaos.errors import InputError, whole_number


@dataclass(frozen=True)
class Classification:
    """Lengths of the runs by which a motion is classified, in mesh periods; a run follows the motion for that long.

    Attributes
    ----------
    transient_lengths : tuple of int
        Lengths of consecutive runs in which the transient decays. After each one, motions with a near return are tested
        for a periodic orbit. Each length exceeds ``longest_period``.
    longest_period : int
        Longest period searched for after transient runs; after exponent runs the limit is four times as long, and
        sixteen times, or half of ``longest_transient``, for a motion with negative exponents that is unresolved then.
    exponent_run : int
        Length of the first run for the Lyapunov exponents of a motion without a periodic orbit so far.
    doublings : int
        How many times the exponent run is repeated, each time twice as long, while the motion is unresolved.
    longest_transient : int
        A motion with a positive exponent is followed for this long before it is called chaotic, since chaos may be
        transient: of 2000 random cells of the paper's maps one in 50 settles on an orbit only after more than 1280
        periods, one in 500 after more than 10 000.
    averaging_periods : int
        Periods over which the response measures of a motion without a period are averaged.

    Raises
    ------
    InputError
        If a length is out of range, or a run is too short for ``longest_period``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> settings = gc.Classification(longest_transient=20_000)
    >>> gc.regime(gc.MeshModel.of(q0=0.1, eps1=0.206), settings=settings).label
    '8T'
    """

    transient_lengths: tuple[int, ...] = (80, 80, 160, 320, 640)
    longest_period: int = 64
    exponent_run: int = 250
    doublings: int = 4
    longest_transient: int = 10_000
    averaging_periods: int = 96

    def __post_init__(self) -> None:
        lengths = self.transient_lengths
        if isinstance(lengths, str) or not isinstance(lengths, Iterable):
            raise InputError("classification.transient_lengths", "must be a list of whole numbers", lengths,
                             "E.g. (80, 80, 160).")
        lengths = tuple(whole_number("classification.transient_lengths", n, 3, _MAX_PERIODS) for n in lengths)
        object.__setattr__(self, "transient_lengths", lengths)
        for name, (least, most) in _RANGES.items():
            whole_number(f"classification.{name}", getattr(self, name), least, most)
        for length in (*lengths, self.exponent_run):
            if length <= self.longest_period:
                raise InputError("classification", f"must have runs longer than longest_period = {self.longest_period}",
                                 length, "A return after n periods shows only in more than n sections.")
        if self.exponent_run << self.doublings > _MAX_PERIODS:
            raise InputError(
                "classification.exponent_run", f"must be at most {_MAX_PERIODS:,} periods after all doublings",
                f"{self.exponent_run} x 2^{self.doublings}", "Lower classification.doublings.")

    def over(self, cycles: int) -> Classification:
        """These settings where a period has so many mesh cycles: of more than `_CYCLES` the runs have as many periods
        less, but no fewer than they need. A vibration decays within cycles, however many of them have a period."""
        parts = cycles / _CYCLES
        if parts <= 1:
            return self
        longest = max(1, round(self.longest_period / parts))

        def shorter(periods: int, least: int) -> int:
            return min(periods, max(least, round(periods / parts)))

        return replace(
            self, transient_lengths=tuple(shorter(n, max(3, longest + 1)) for n in self.transient_lengths),
            longest_period=longest, exponent_run=shorter(self.exponent_run, max(21, longest + 1)),
            longest_transient=shorter(self.longest_transient, 0), averaging_periods=shorter(self.averaging_periods, 1))

    @property
    def max_periods(self) -> int:
        """Upper bound of the mesh periods computed for one motion: transient runs, exponent runs before and after the
        longest transient, and averages."""
        runs = self.exponent_run * (2 ** (self.doublings + 1) - 1)
        return sum(self.transient_lengths) + 2 * runs + self.longest_transient + self.averaging_periods


_CYCLES = 16
"""Most mesh cycles in a period of which runs are not shortened."""

_MAX_PERIODS = 10_000_000
_RANGES = {
    "longest_period": (1, 100_000), "exponent_run": (21, _MAX_PERIODS), "doublings": (0, 20),
    "longest_transient": (0, _MAX_PERIODS), "averaging_periods": (1, _MAX_PERIODS),
}
"""Smallest and largest value of each field. An exponent run of 21 periods without its first twentieth is one period
for each of the 20 blocks of the confidence interval."""


SINGLE_MOTION = Classification(exponent_run=2000, doublings=2, longest_transient=20_000, averaging_periods=1000)
"""A single motion is given longer runs than a cell of a map, for chaotic transients of up to 20 000 periods."""


def as_settings(settings: Any) -> Classification | None:
    """The settings unchanged, or None for the defaults of a study; raises `InputError` for anything else."""
    if settings is None or isinstance(settings, Classification):
        return settings
    raise InputError("settings", "must be a Classification", settings,
                     "E.g. gearchaos.Classification(longest_transient=20_000).")
