"""Whether the curves of a skeleton explain the boundaries of the periodic cells of a map.

The motion of a cell ends at the side to a neighbour with another motion for one of two reasons. Either its orbit is
stable there too, and the same initial state leads elsewhere: the side lies on a basin boundary, which is no
bifurcation. Or the orbit has lost its stability or does not exist: then a curve of its family must pass between the two
cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.arclength import from_polyline
from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.events import KINDS
from gearchaos.continuation.family import ParameterFamily
from gearchaos.dynamics import Classification, Label, classify, orbits

CURVE, BASIN, UNEXPLAINED = 1, 2, 3
"""Why a motion ends at the side of a cell: a curve of its family, a basin boundary, or neither was found."""

_WITHIN = 1.0
"""A curve passes between two neighbouring cells if it comes within this distance of the line between their centres, in
units of the distance of cells."""

_SAME_FAMILY = 0.5
"""Largest difference of a coordinate between the orbits of one family at neighbouring cells, relative to the larger of
1 and the largest coordinate."""

_TILE = 4096


@dataclass(frozen=True, eq=False)
class Sides:
    """The sides of cells at which a periodic motion ends.

    A curve is seen if it passes one of them that is not on a basin boundary, and at which it can end the motion. One
    that is not seen belongs to motions that coexist with those of the map.
    """

    cell: np.ndarray  # (S, 2) row and column of the cell with the motion
    neighbour: np.ndarray  # (S, 2) row and column of the neighbour with another motion
    period: np.ndarray  # (S,) of the motion
    cause: np.ndarray  # (S,) `CURVE`, `BASIN` or `UNEXPLAINED`
    curve: np.ndarray  # (S,) index of the curve, −1 for none; the first one if there are several
    seen: np.ndarray  # (C,) whether each curve is


def explain_sides(family: ParameterFamily, x: np.ndarray, y: np.ndarray, label: np.ndarray, period: np.ndarray,
                  curves: Sequence[CurveData], longest: int, settings: Classification | None = None) -> Sides:
    """Find why periodic motions end at the sides of the cells of a map, at parameters x (X,) and y (Y,).

    ``label`` and ``period`` (Y, X) are the motions from the initial values of the family, as codes of `Label`, and
    their periods, computed with these settings; ``longest`` is the largest period considered.
    """
    motion = np.where(label == Label.PERIODIC, period, 0)
    cells, neighbours = _sides(label, motion, longest)
    values = np.stack([x[cells[:, 1]], y[cells[:, 0]]], axis=1)
    beyond = np.stack([x[neighbours[:, 1]], y[neighbours[:, 0]]], axis=1)
    n = motion[cells[:, 0], cells[:, 1]]
    cause = np.full(len(cells), UNEXPLAINED)
    for first in range(0, len(cells), _TILE):
        tile = slice(first, first + _TILE)
        cause[tile][_continues(family, values[tile], beyond[tile], n[tile], settings)] = BASIN
    spacing = np.array([np.ptp(x) / max(len(x) - 1, 1), np.ptp(y) / max(len(y) - 1, 1)])
    index = np.full(len(cells), -1)
    seen = np.zeros(len(curves), bool)
    for number, curve in enumerate(curves):
        ended = [multiple * curve.period for multiple in KINDS[curve.kind].ended]
        possible = np.flatnonzero((cause != BASIN) & np.isin(n, ended))
        line, middle = curve.values / spacing, 0.5 * (values[possible] / spacing + beyond[possible] / spacing)
        close = np.all((middle >= line.min(axis=0) - _WITHIN - 1) & (middle <= line.max(axis=0) + _WITHIN + 1), axis=1)
        hit = np.array([i for i, at in zip(possible[close], middle[close], strict=True)
                        if from_polyline(line, at)[0].min() <= _WITHIN], int)
        seen[number] = len(hit) > 0
        first_hit = hit[cause[hit] == UNEXPLAINED]
        cause[first_hit], index[first_hit] = CURVE, number
    return Sides(cells, neighbours, n, cause, index, seen)


def _sides(label: np.ndarray, motion: np.ndarray, longest: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns (S, 2) of periodic cells, and of their neighbours with another kind of motion or period."""
    at = np.indices(motion.shape).reshape(2, -1).T
    cells, neighbours = [], []
    for step in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        other = at + step
        inside = np.all((other >= 0) & (other < motion.shape), axis=1)
        here, there = at[inside], other[inside]
        own = motion[here[:, 0], here[:, 1]]
        different = (own != motion[there[:, 0], there[:, 1]]) & (own > 0) & (own <= longest)
        different &= label[there[:, 0], there[:, 1]] != 0
        cells.append(here[different])
        neighbours.append(there[different])
    return np.concatenate(cells), np.concatenate(neighbours)


def _continues(family: ParameterFamily, values: np.ndarray, beyond: np.ndarray, period: np.ndarray,
               settings: Classification | None) -> np.ndarray:
    """Whether the stable orbits at parameters (S, 2) are also stable at neighbouring ones (S, 2), (S,) of bool."""
    flow = family.exact_flow(values)
    points = np.arange(len(values))
    found = classify(flow, family.initial_states(values).T.copy(), settings=settings, response=False)
    same = (found.label == Label.PERIODIC) & (found.period == period)
    there = orbits.polish(family.exact_flow(beyond), found.w, points, period)
    size = np.maximum(1.0, np.abs(found.w).max(axis=0))
    near = np.abs(found.w - there.w).max(axis=0) / size < _SAME_FAMILY
    shorter = orbits.minimal_period(family.exact_flow(beyond), there.w, points, period) < period
    return same & there.stable & near & ~shorter
