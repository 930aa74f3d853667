"""The smallest sudden change of the state after which a motion settles elsewhere, searched for in all coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.dynamics import Classification, Label, Reason, Verdicts
from gearchaos.flow import ExactFlow
from gearchaos.studies.attractor_set import Attractor, AttractorSet
from gearchaos.studies.classification import classify_batch

_POINTS = 16
_LADDER = np.geomspace(1e-3, 4.0, 25)
_ROUNDS = 12

TRIED = _POINTS * len(_LADDER)
"""Motions followed for every direction in which a kick is looked for, at most."""

EACH = 1200 * TRIED
"""Bytes that they take."""

_NEIGHBOURS = 32
_CLOSER = np.array([0.5, 0.7, 0.85, 0.93, 0.97, 0.99])
_ELSEWHERE = (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC, Label.DIVERGED)


@dataclass(frozen=True)
class Kick:
    """A sudden change of the state (d,), the section point (d,) where it strikes, and its length."""

    size: float
    change: np.ndarray
    point: np.ndarray


@dataclass(frozen=True)
class _Search:
    """Where kicked motions of one attractor go."""

    flow: ExactFlow
    attractor: Attractor
    settings: Classification | None
    threads: int | None

    def leaves(self, w: np.ndarray, progress: str | None = None) -> np.ndarray:
        """Whether motions from w (d, L) settle elsewhere, or run away; undecided ones do not count."""

        def initial_states(tile: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
            return self.flow, w[:, tile].copy(), np.zeros(len(tile), dtype=int)

        def keep(_: np.ndarray, __: ExactFlow, ___: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
            return {"away": np.isin(found.label, _ELSEWHERE) & ~self._stays(found)}

        return classify_batch(
            initial_states, keep, np.arange(w.shape[1]), settings=self.settings, levels=False, progress=progress,
            threads=self.threads,
        )["away"]

    def _stays(self, found: Verdicts) -> np.ndarray:
        kind = self.attractor
        neutral = found.reason == Reason.NEUTRAL
        same = (found.label == kind.label) & (found.period == kind.period) & (neutral == kind.neutral)
        alike = np.flatnonzero(same)
        catalogue = AttractorSet(self.flow, known=[self.attractor])
        out = np.zeros(len(found.label), dtype=bool)
        out[alike] = catalogue.holds(self.attractor, found.w[:, alike])
        return out

    def first(self, directions: np.ndarray, progress: str | None) -> Kick | None:
        """The shortest step of the ladder, from any point of the section in any of the directions, that leaves."""
        section = self.attractor.section
        points = section[np.unique(np.linspace(0, len(section) - 1, _POINTS).astype(int))]
        point, direction, step = (
            i.ravel() for i in np.meshgrid(*(np.arange(n) for n in (len(points), len(directions), len(_LADDER))))
        )
        changes = _LADDER[step, None] * directions[direction]
        away = np.flatnonzero(self.leaves((points[point] + changes).T, progress))
        if len(away) == 0:
            return None
        best = away[np.argmin(step[away])]
        return Kick(float(_LADDER[step[best]]), changes[best], points[point[best]])

    def shorter(self, kick: Kick, wander: float, rng: np.random.Generator) -> Kick:
        """The shortest of some kicks about as short and in about the same direction that leaves too, or the same."""
        unit = kick.change / kick.size
        around = _units(unit + wander * rng.normal(size=(_NEIGHBOURS, len(unit))) / np.sqrt(len(unit)))
        around[0] = unit
        changes = (kick.size * _CLOSER[:, None, None] * around).reshape(-1, len(unit))
        away = np.flatnonzero(self.leaves((kick.point + changes).T))
        if len(away) == 0:
            return kick
        best = changes[away[0]]
        return Kick(float(np.linalg.norm(best)), best, kick.point)


def smallest_kick(
    flow: ExactFlow, attractor: Attractor, directions: int, *, settings: Classification | None = None,
    progress: str | None = None, threads: int | None = None,
) -> Kick | None:
    """The smallest kick found that the motion on an attractor does not survive; None if none up to length 4 leaves.

    Parameters
    ----------
    flow : ExactFlow
        With the operating point as its first point.
    directions : int
        How many directions are tried from up to 16 points of the section, in 25 lengths; the best is then improved.
    settings, progress, threads
        As in `classify_batch`.

    The length is Euclid's over the d coordinates, in half backlashes and their velocities. It is an upper bound: thin
    tongues of other basins between the directions are missed.
    """
    search, rng = _Search(flow, attractor, settings, threads), np.random.default_rng(0)
    kick = search.first(_units(rng.normal(size=(directions, flow.dimension))), progress)
    if kick is None:
        return None
    wander = 0.5
    for _ in range(_ROUNDS):
        shorter = search.shorter(kick, wander, rng)
        wander = wander if shorter is not kick else wander / 2
        kick = shorter
    return kick


def _units(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]
