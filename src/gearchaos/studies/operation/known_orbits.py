"""Motions that end on orbits that are known already: they need no verdict of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gearchaos.dynamics.orbits import sections
from gearchaos.flow import OK
from gearchaos.studies.core.initial_value_problems import Motions

_RUNS = (2, 2, 4, 8, 16, 32)  # mesh periods of the runs after which motions are compared with the orbits
LONGEST = sum(_RUNS)
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
    going = np.arange(len(points))
    halves = 2 if flow.points_kept and flow.step_count.max() > _MANY_STEPS else 1
    for periods in (run // halves for run in _RUNS for _ in range(halves)):
        run = flow.advance(w[:, going], periods, points=points[going])
        bounded = run.status == OK
        going, after = going[bounded], run.w[:, bounded]
        w[:, going] = after
        distance = np.abs(targets[points[going]] - after.T[:, None]).max(axis=2)
        nearest = distance.argmin(axis=1)
        there = distance[np.arange(len(going)), nearest] < _REACHED
        reached[going[there]] = owner[points[going[there]], nearest[there]]
        going = going[~there]
        if not len(going):
            break
    return reached
