"""What a study may take, estimated before any work: refused if it cannot end, said if it takes long."""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np

from gearchaos.errors import InputError
from gearchaos.execute.machine import cores, memory
from gearchaos.execute.tiles import TILE, side_by_side
from gearchaos.flow.layout import STEP_ANGLE, WIDTH
from gearchaos.flow.tables import rate, shared
from gearchaos.model.switched import SwitchedAffine

MOST_STEPS = 1_000_000
"""Steps in a mesh period: so many take a tenth of a second."""

LONG = 20.0
"""Seconds after which whoever waits wants to know how long."""

_SPEED = 3e7
"""Steps of eight motions that a core takes in a second, times one more than the coordinates, at least."""

_OWN, _FORCING, _STIFFNESS = 2.5, 0.2, 0.1
"""What a step costs, with matrices of its own, if a shared one costs 1; and what each harmonic of the forcing after the
first, and each of the stiffness, adds. Measured on a motion of many contact switches, and rounded up."""

_NEVER = 100 * 86400 * 365.25
"""What takes longer, in seconds, was hardly meant."""

_STATES = 3
"""Contact states, each with its step matrices."""

_SHARE = 4
"""The part of the memory that step matrices may take: a quarter."""


@dataclass(frozen=True)
class Cost:
    """How much a study computes at most.

    Attributes
    ----------
    motions, periods : int
        So many motions, side by side, are followed for so many mesh periods.
    sequential : int
        Mesh periods of one motion for which all others wait, as in a sweep.
    steps : int
        Steps in a mesh period, on the average of the points.
    table : int
        Bytes of the step matrices of the point that has most.
    dimension : int
        Coordinates of a motion.
    cost : float
        Of a step, at most, where 1 is that of one with few harmonics.
    """

    motions: int
    periods: int
    sequential: int
    steps: int
    table: int
    dimension: int
    cost: float = 1.0

    def seconds(self, threads: int | None = None) -> float:
        """How long it takes at most, in so many threads, by default one per core."""
        followed = -(-self.motions // WIDTH) * self.periods / side_by_side(self.motions, threads) + self.sequential
        return followed * self.steps * (self.dimension + 1) * self.cost / _SPEED

    def warning(self, threads: int | None = None) -> str | None:
        """How long it may take, in words; None if that is not long."""
        seconds = self.seconds(threads)
        if seconds <= LONG:
            return None
        return f"this may take up to about {_span(seconds)}. {self.size}"

    @property
    def size(self) -> str:
        """How much it is, in words."""
        many = f"{self.motions:,} motions are" if self.motions > 1 else "One motion is"
        return f"{many} followed for at most {self.periods + self.sequential:,} mesh periods of {self.steps:,} steps."

    def largest(self, threads: int | None = None) -> int:
        """Most parameter points whose step matrices one of so many threads may hold at once."""
        return int(min(TILE, max(WIDTH, memory() // _SHARE // (threads or cores()) // self.table)))

    def announce(self, wanted: bool = True, threads: int | None = None) -> None:
        """Say on stderr how long it may take, if that is long, and if it is wanted."""
        warning = self.warning(threads) if wanted else None
        if warning:
            print(warning, file=sys.stderr, flush=True)


def estimate(system: SwitchedAffine, motions: int, periods: int, sequential: int = 0, samples: int = 0) -> Cost:
    """What a study takes at most.

    Parameters
    ----------
    system : SwitchedAffine
        At the parameter points that need most: the corners of a map.
    motions, periods, sequential
        As in `Cost`.
    samples : int
        Instants of a mesh period that steps must begin at.

    Raises
    ------
    InputError
        If it cannot end: a mesh period needs too many steps, or all of them too many years.
    """
    steps, d = _steps(system), system.dimension
    steps = samples * np.ceil(steps / samples) if samples else steps
    table = (2 if shared(system) and not samples else int(steps.max())) * _STATES * (d * d + d) * 8
    found = Cost(motions, periods, sequential, int(np.ceil(steps.mean())), table, d, _cost(system))
    if found.seconds() > _NEVER * found.cost:  # harmonics make it longer, but never too long
        raise InputError("the study", f"must end within {_span(_NEVER)}", _span(found.seconds()), found.size)
    return found


def _cost(system: SwitchedAffine) -> float:
    """What a step costs at most, where 1 is a step of one harmonic."""
    forcing, stiffness = system.f_cos.shape[1], system.chi_cos.shape[1]
    return (1.0 if shared(system) else _OWN) + _FORCING * max(0, forcing - 1) + _STIFFNESS * stiffness


def _steps(system: SwitchedAffine) -> np.ndarray:
    """Steps in a mesh period at all points (P,); raises if they are too many."""
    fastest = rate(system)
    needed = 2 * np.pi / system.omega * fastest / STEP_ANGLE
    worst = int(np.argmax(needed))
    if needed[worst] <= MOST_STEPS:
        return np.ceil(needed)
    raise InputError(
        "steps of a mesh period", f"must be at most {MOST_STEPS:,}", float(f"{needed[worst]:.3g}"),
        f"The fastest rate of the motion is {fastest[worst]:.3g}, the mesh frequency omega {system.omega[worst]:.3g}: "
        "raise omega or J, or lower zeta, zeta_support or kappa/mu.",
    )


_UNITS = ((86400 * 365.25, "year"), (86400, "day"), (3600, "hour"), (60, "minute"))


def _span(seconds: float) -> str:
    """A time in words, two digits of it."""
    for size, name in _UNITS:
        if seconds >= 2 * size:
            return f"{float(f'{seconds / size:.2g}'):,.0f} {name}s"
    return f"{seconds:.0f} seconds"
