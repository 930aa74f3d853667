"""How long to wait and how hard to look."""

from __future__ import annotations

from dataclasses import dataclass

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
        for name, least in _LEAST.items():
            whole_number(f"budget.{name}", getattr(self, name), least)
        for stretch in self.looks:
            whole_number("budget.looks", stretch, 3)
        for stretch in (*self.looks, self.exponent):
            if stretch <= self.longest:
                raise InputError("budget", f"must have stretches longer than longest = {self.longest}", stretch,
                                 "A return after n periods shows only in more than n sections.")


_LEAST = {"longest": 1, "exponent": 21, "extensions": 0, "patience": 0, "measured": 1}
"""An exponent needs 20 blocks after a twentieth of the run is dropped."""
