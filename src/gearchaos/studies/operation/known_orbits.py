"""Motions that end on orbits that are known already: they need no verdict of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gearchaos.dynamics.orbits import sections
from gearchaos.flow import OK, ExactFlow
from gearchaos.studies.core.initial_value_problems import Motions

_RUNS = (2, 2, 4, 8, 16, 32)  # mesh periods of the runs after which motions are compared with the orbits
LONGEST = sum(_RUNS)
_WORST = 1e10  # condition of the modes of an orbit with which differences from it are told by them
_MANY_STEPS = 1000  # of a period, in which a motion may come so near that another comparison half way pays
LONGEST_ORBIT = 32  # mesh periods: a motion is compared with each stroboscopic point of each orbit
_REACHED = 1e-3  # largest distance from a point of a stable orbit, in half backlashes, at which it is reached


class Orbit(Protocol):
    """A stable periodic motion: its period in mesh periods, and a state (d,) on it."""

    period: int
    w: np.ndarray


@dataclass
class KnownOrbit:
    """An `Orbit` of which nothing else is known."""

    period: int
    w: np.ndarray


@dataclass(frozen=True)
class LinearBasin:
    """States from which the motion surely comes to an orbit by itself: its linear modes decay, and all together do not
    reach a change of contact beside those of the orbit."""

    w: np.ndarray  # (d,), on the orbit
    modes: np.ndarray  # (d, d), in columns: the real ones, then the real and the imaginary parts of the others
    real: int  # number of the real ones
    shares: np.ndarray  # (d,) of the way to a change of contact that each takes, see `ExactFlow.contact_shares`

    @classmethod
    def of(cls, flow: ExactFlow, orbit: Orbit, point: int) -> LinearBasin | None:
        """That of an orbit at a parameter point of a flow; None where none is known."""
        tangent = np.eye(len(orbit.w))[:, :, None]
        run = flow.advance(orbit.w[:, None], 1, points=np.array([point]), tangent=tangent)
        values, modes = np.linalg.eig(run.tangent[:, :, 0].T)
        real, upper = modes[:, values.imag == 0].real, modes[:, values.imag > 0]
        modes = np.hstack([real, upper.real, upper.imag])
        shares = flow.contact_shares(orbit.w, modes.T, point)
        if shares is None or np.abs(values).max() >= 1 or np.linalg.cond(modes) > _WORST:
            return None
        return cls(orbit.w, modes, real.shape[1], shares)

    def has(self, w: np.ndarray) -> np.ndarray:
        """Whether states w (d, L) surely are in it, (L,)."""
        ends = self.real, (self.real + len(self.w)) // 2
        sizes = np.split(np.linalg.solve(self.modes, w - self.w[:, None]), ends)
        shares = np.split(self.shares, ends)
        return shares[0] @ np.abs(sizes[0]) + (shares[1] + shares[2]) @ np.hypot(sizes[1], sizes[2]) < 1.0


def reach(motions: Motions, known: Sequence[Sequence[Orbit]]) -> np.ndarray:
    """Follow motions until they are at a stable orbit known at their parameter point, for `LONGEST` periods at most.

    ``known`` has those of each parameter point. Returns the number of the one reached among these, (L,), −1 where there
    is none; the states of ``motions`` become those to which they were followed.
    """
    flow, w, points = motions.flow, motions.w, motions.points
    reached = np.full(len(points), -1)
    at, number, orbits = zip(*((p, i, one) for p, some in enumerate(known) for i, one in enumerate(some)), strict=True)
    period = np.array([each.period for each in orbits])
    states = sections(flow, np.stack([each.w for each in orbits], axis=1), np.array(at), period)
    size = np.bincount(np.repeat(at, period), minlength=len(known))
    targets, owner = np.full((len(known), size.max(), len(w)), np.inf), np.zeros((len(known), size.max()), int)
    filled = np.zeros(len(known), int)
    for p, i, each in zip(at, number, states, strict=True):
        where = slice(filled[p], filled[p] + len(each))
        targets[p, where], owner[p, where], filled[p] = each, i, where.stop
    basins = [(a, i, basin) for a, i, each in zip(at, number, orbits, strict=True)
              if flow.leaps_in_contact and each.period == 1 and (basin := LinearBasin.of(flow, each, a))]
    going = np.arange(len(points))
    halves = 2 if flow.step_count.max() > _MANY_STEPS else 1
    for periods in (run // halves for run in _RUNS for _ in range(halves)):
        run = flow.advance(w[:, going], periods, points=points[going])
        bounded = run.status == OK
        going, after = going[bounded], run.w[:, bounded]
        w[:, going] = after
        distance = np.abs(targets[points[going]] - after.T[:, None]).max(axis=2)
        nearest = distance.argmin(axis=1)
        there = distance[np.arange(len(going)), nearest] < _REACHED
        reached[going[there]] = owner[points[going[there]], nearest[there]]
        for a, i, basin in basins:
            near = (points[going] == a) & (reached[going] < 0)
            reached[going[near][basin.has(after[:, near])]] = i
        going = going[reached[going] < 0]
        if not len(going):
            break
    return reached
