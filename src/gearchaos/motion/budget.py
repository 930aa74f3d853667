"""How long to wait and how hard to look."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError, whole_number


@dataclass(frozen=True)
class Budget:
    """How long to wait and how hard to look, in mesh periods.

    Attributes
    ----------
    looks : tuple of int
        Stretches of transient; after each one all motions that nearly return are polished. Every stretch is longer
        than ``longest``.
    longest : int
        Longest period looked for in the transient, in stretches that hold two rounds of it; four times as long a one
        is looked for in the exponent runs.
    exponent : int
        Length of the run that yields the Lyapunov exponents of what has not returned; doubled up to
        ``extensions`` times while the verdict is open.
    patience : int
        A motion that looks chaotic is followed until so many periods have passed, since chaos may be a transient:
        of 2000 random cells of the paper's maps one in 50 settles on an orbit only after more than 1280 periods,
        one in 500 after more than 10 000.
    measured : int
        Periods over which the levels of a motion that does not return are averaged.
    """

    looks: tuple[int, ...] = (80, 80, 160, 320, 640)
    longest: int = 64
    exponent: int = 250
    extensions: int = 4
    patience: int = 10_000
    measured: int = 96

    def __post_init__(self) -> None:
        if isinstance(self.looks, str) or not isinstance(self.looks, Iterable):
            raise InputError("budget.looks", "must be a list of whole numbers", self.looks, "E.g. (80, 80, 160).")
        object.__setattr__(self, "looks", tuple(whole_number("budget.looks", n, 3, _MOST) for n in self.looks))
        for name, (least, most) in _RANGES.items():
            whole_number(f"budget.{name}", getattr(self, name), least, most)
        for stretch in (*self.looks, self.exponent):
            if stretch <= self.longest:
                raise InputError("budget", f"must have stretches longer than longest = {self.longest}", stretch,
                                 "A return after n periods shows only in more than n sections.")
        if self.exponent << self.extensions > _MOST:
            raise InputError("budget.exponent", f"must be at most {_MOST:,} periods after all extensions",
                             f"{self.exponent} x 2^{self.extensions}", "Lower budget.extensions.")

    @property
    def most(self) -> int:
        """Mesh periods that a motion is followed at most: transients, exponent runs before and after chaos is waited
        out, and the levels."""
        runs = self.exponent * (2 ** (self.extensions + 1) - 1)
        return sum(self.looks) + 2 * runs + self.patience + self.measured


_MOST = 10_000_000
_RANGES = {
    "longest": (1, 100_000), "exponent": (21, _MOST), "extensions": (0, 20), "patience": (0, _MOST),
    "measured": (1, _MOST),
}
"""An exponent needs 20 blocks after a twentieth of the run is dropped."""


def as_budget(budget: Any) -> Budget | None:
    """A budget as it is, or None for that of the study; raises `InputError` for anything else."""
    if budget is None or isinstance(budget, Budget):
        return budget
    raise InputError("budget", "must be a Budget", budget, "E.g. gearchaos.Budget(patience=20_000).")
