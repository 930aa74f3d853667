"""Upper bounds of the computing time and memory of a study, by which one that cannot end is refused before any work."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.errors import InputError
from gearchaos.execute.machine import cores, memory
from gearchaos.execute.tiles import TILE, useful_threads
from gearchaos.flow import WIDTH, fastest_rate, min_steps_per_period, steps_share_matrices
from gearchaos.model.base import GearModel
from gearchaos.model.switched import SwitchedAffine

MAX_STEPS = 1_000_000
"""Largest number of steps in a mesh period; they take a tenth of a second."""

_SPEED = 3e7
"""Lower bound of (d + 1) times the steps per second of one core, for a pack of eight motions with d coordinates."""

_UNSHARED, _LEVEL, _FORCING, _STIFFNESS = 2.5, 0.1, 0.2, 0.1
"""Cost of a step with matrices of its own, relative to a step with matrices that all steps on one of two stiffness
levels share; the additional cost of each level after the second, up to the cost of matrices of its own; that of each
harmonic of the forcing after the first, and of each harmonic of the stiffness. Measured on a motion with many contact
switches, and rounded up."""

_MAX_SECONDS = 100 * 86400 * 365.25
"""A study that takes longer, in seconds, is refused: a hundred years."""

_STATES = 3
"""Number of contact states, each with its own step matrices."""

_MEMORY_DIVISOR = 4
"""Step matrices may take the memory of the machine divided by this."""


@dataclass(frozen=True)
class Cost:
    """Upper bound of what a study computes: motions, in parallel, and the mesh periods for which each is followed."""

    motions: int
    periods: int
    sequential: int  # mesh periods computed one after another before or after these, as in a sweep
    steps: int  # in a mesh period, averaged over the parameter points
    table_bytes: int  # of the step matrices of one parameter point, the largest over the points
    dimension: int  # the number d of coordinates of the dynamic state
    step_cost: float = 1.0  # computing time of a step, relative to one with shared matrices and one harmonic

    def seconds(self, threads: int | None = None) -> float:
        """Upper bound of the computing time in seconds, with this many threads, by default one per core."""
        followed = -(-self.motions // WIDTH) * self.periods / useful_threads(self.motions, threads) + self.sequential
        return followed * self.steps * (self.dimension + 1) * self.step_cost / _SPEED

    @property
    def summary(self) -> str:
        """A sentence on the amount of work."""
        many = f"{self.motions:,} motions are" if self.motions > 1 else "One motion is"
        return f"{many} followed for at most {self.periods + self.sequential:,} periods of {self.steps:,} steps."

    def check_time(self) -> None:
        """Raise `InputError` if this machine would compute for more than a hundred years."""
        seconds = self.seconds()
        if seconds > _MAX_SECONDS * self.step_cost:  # the limit does not depend on the number of harmonics
            limit = duration(_MAX_SECONDS)
            raise InputError("the study", f"must end within {limit}", duration(seconds), self.summary)

    def max_parameter_points(self, threads: int | None = None) -> int:
        """Largest number of parameter points whose step matrices each of this many threads may hold at once."""
        return int(min(TILE, max(WIDTH, memory() // _MEMORY_DIVISOR // (threads or cores()) // self.table_bytes)))


class TooManyStepsError(InputError):
    """A mesh period needs more than `MAX_STEPS` steps; its value is how many."""


def estimate(
    system: SwitchedAffine, motions: int, periods: int, sequential: int = 0, samples: int = 0, *,
    model: GearModel | None = None,
) -> Cost:
    """The cost at the parameter points of a system where it is largest, such as the corners of a map.

    At ``samples`` equidistant instants of a mesh period steps must begin. The ``model`` of the system says what makes
    steps short. Raises `InputError` if a mesh period needs more than `MAX_STEPS` steps, or the study more than a
    hundred years.
    """
    needed, d = min_steps_per_period(system), system.dimension
    levels = (system.levels if system.contacts is None else system.contacts.edges).shape[1]
    worst = int(np.argmax(needed))
    if not needed[worst] <= MAX_STEPS:
        period = "common" if model is not None and model.mesh_names else "mesh"
        raise TooManyStepsError(
            f"steps of a {period} period", f"must be at most {MAX_STEPS:,}", float(f"{needed[worst]:.3g}"),
            "" if model is None else model.fastest_in_words(fastest_rate(system)[worst], system.omega[worst]))
    steps = np.ceil(needed) + max(levels - 2, 0)  # the number of steps on each level is rounded up
    steps = samples * np.ceil(steps / samples) if samples else steps
    shared = steps_share_matrices(system) and not samples
    numbers = d * d + d + (2 * d * system.f_cos.shape[1] if shared else 0)
    table = (levels if shared else int(steps.max())) * _STATES * numbers * 8
    tables = min(_UNSHARED, 1.0 + _LEVEL * (max(levels, 2) - 2)) if steps_share_matrices(system) else _UNSHARED
    step_cost = tables + _FORCING * max(0, system.f_cos.shape[1] - 1) + _STIFFNESS * system.chi_cos.shape[1]
    found = Cost(motions, periods, sequential, int(np.ceil(steps.mean())), table, d, step_cost)
    found.check_time()
    return found


_UNITS = ((86400 * 365.25, "year"), (86400, "day"), (3600, "hour"), (60, "minute"))


def duration(seconds: float) -> str:
    """A duration as text, rounded to two digits and to the largest unit of which there are at least two."""
    for size, name in _UNITS:
        if seconds >= 2 * size:
            return f"{float(f'{seconds / size:.2g}'):,.0f} {name}s"
    return f"{seconds:.0f} seconds"
