"""The smallest destabilising perturbation: a sudden change of the state after which a motion leaves its attractor.

In the literature on multistability its norm is the magnitude of the minimal critical (or fatal) shock: L. Halekotte,
U. Feudel, *Minimal fatal shocks in multistable complex networks*, Sci. Rep. 10 (2020) 11783.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.dynamics import ON_ATTRACTOR, Classification, Label, Reason, Verdicts
from gearchaos.flow import ExactFlow
from gearchaos.studies.attractor_set import Attractor, AttractorSet
from gearchaos.studies.batch_classification import classify_batch
from gearchaos.studies.initial_value_problems import Motions

_MAX_POINTS = 16
"""Largest number of stroboscopic points of the attractor that are perturbed."""

_NORMS = np.geomspace(1e-3, 4.0, 25)
"""Norms of the perturbations tried in each random direction."""

_IMPROVEMENTS = 12
"""Number of rounds that improve the best perturbation."""

_NEIGHBOURS = 32
"""Number of directions near the best one that a round tries."""

_REDUCTIONS = np.array([0.5, 0.7, 0.85, 0.93, 0.97, 0.99])
"""Norms that a round tries in each direction, relative to the best one."""

_DECIDED = (*ON_ATTRACTOR, Label.DIVERGED)
"""Labels of motions that can have left the attractor; an undecided motion does not count."""

MOTIONS_PER_DIRECTION = _MAX_POINTS * len(_NORMS)
"""Largest number of motions followed for each direction."""

BYTES_PER_DIRECTION = 1200 * MOTIONS_PER_DIRECTION
"""Upper bound of the memory that they take, in bytes."""


@dataclass(frozen=True)
class Perturbation:
    """A sudden change of the state, in the dimensionless coordinates of the dynamic state.

    Attributes
    ----------
    norm : float
        Euclidean norm of the change.
    change : (d,)
    point : (d,)
        The state at phase 0 to which the change is added.
    """

    norm: float
    change: np.ndarray
    point: np.ndarray


@dataclass(frozen=True)
class _Search:
    """Search for perturbations after which motions leave an attractor; the fields are those of
    `smallest_perturbation`."""

    flow: ExactFlow
    attractor: Attractor
    settings: Classification | None
    threads: int | None

    def leaves(self, w: np.ndarray, progress: str | None = None) -> np.ndarray:
        """Whether motions from w (d, L) settle on another attractor or diverge, (L,)."""

        def collect(_: np.ndarray, __: Motions, found: Verdicts) -> dict[str, np.ndarray]:
            attractor, neutral = self.attractor, found.reason == Reason.NEUTRAL
            alike = np.flatnonzero((found.label == attractor.label) & (found.period == attractor.period)
                                   & (neutral == attractor.neutral))
            leaves = np.isin(found.label, _DECIDED)
            leaves[alike[AttractorSet(self.flow).contains(attractor, found.w[:, alike])]] = False
            return {"leaves": leaves}

        return classify_batch(
            Motions.at(self.flow, w).take, collect, np.arange(w.shape[1]), settings=self.settings, response=False,
            progress=progress, threads=self.threads,
        )["leaves"]

    def first(self, directions: np.ndarray, progress: str | None) -> Perturbation | None:
        """The shortest perturbation tried in directions (D, d) after which a motion leaves; None if none does."""
        section = self.attractor.section
        points = section[np.unique(np.linspace(0, len(section) - 1, _MAX_POINTS).astype(int))]
        point, direction, step = (
            i.ravel() for i in np.meshgrid(*(np.arange(n) for n in (len(points), len(directions), len(_NORMS))))
        )
        changes = _NORMS[step, None] * directions[direction]
        leaving = np.flatnonzero(self.leaves((points[point] + changes).T, progress))
        if len(leaving) == 0:
            return None
        best = leaving[np.argmin(step[leaving])]
        return Perturbation(float(_NORMS[step[best]]), changes[best], points[point[best]])

    def improved(self, best: Perturbation, deviation: float, rng: np.random.Generator) -> Perturbation:
        """A shorter perturbation in a similar direction after which the motion also leaves; ``best`` if none is found.

        ``deviation`` is the standard deviation of the random change of direction.
        """
        unit = best.change / best.norm
        around = _units(unit + deviation * rng.normal(size=(_NEIGHBOURS, len(unit))) / np.sqrt(len(unit)))
        around[0] = unit
        changes = (best.norm * _REDUCTIONS[:, None, None] * around).reshape(-1, len(unit))
        leaving = np.flatnonzero(self.leaves((best.point + changes).T))
        if len(leaving) == 0:
            return best
        shortest = changes[leaving[0]]
        return Perturbation(float(np.linalg.norm(shortest)), shortest, best.point)


def smallest_perturbation(
    flow: ExactFlow, attractor: Attractor, directions: int, *, settings: Classification | None = None,
    progress: str | None = None, threads: int | None = None,
) -> Perturbation | None:
    """The smallest perturbation found after which a motion leaves an attractor.

    Parameters
    ----------
    flow : ExactFlow
        Its first parameter point is the operating point.
    attractor : Attractor
        The attractor that the motion leaves.
    directions : int
        Number of random directions tried, with 25 norms from 1e-3 to 4, at up to 16 stroboscopic points. The best
        perturbation is then improved by random changes of its direction and smaller norms.
    settings, progress, threads
        As in `classify_batch`.

    Returns
    -------
    Perturbation or None
        None if none up to the norm 4 was found. The norm is Euclidean over the d coordinates, in half backlashes and
        their velocities. It is an upper bound of the smallest one: narrow tongues of other basins between the
        directions are missed.
    """
    search, rng = _Search(flow, attractor, settings, threads), np.random.default_rng(0)
    best = search.first(_units(rng.normal(size=(directions, flow.dimension))), progress)
    if best is None:
        return None
    deviation = 0.5
    for _ in range(_IMPROVEMENTS):
        improved = search.improved(best, deviation, rng)
        deviation = deviation if improved is not best else deviation / 2
        best = improved
    return best


def _units(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors in the directions of vectors (N, d)."""
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
