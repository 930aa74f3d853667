"""Curves of events as plain arrays, which processes can send and files can keep."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.curve import Curve
from gearchaos.continuation.defining import EventSeed

_ON_CURVE = 4e-3
"""An event is on a curve if it lies within this distance of it, in units of the axes' lengths …"""

_SAME_ORBIT = 0.3
"""… and no coordinate of the two orbits differs by more than this, relative to the largest coordinate."""


@dataclass(frozen=True, eq=False)
class CurveData:
    """A curve as plain arrays.

    Attributes
    ----------
    kind : str
    period : int
    values : (P, 2)
        Both parameters.
    points : (P, n, d)
        The orbits.
    multipliers : (P, d)
    residual : (P,)
    angle : (P,)
        For a Neimark–Sacker curve, the argument of the critical multiplier, in radians; otherwise NaN.
    special : list of (str, (2,))
        Points of codimension 2.
    ends : list of (float, float, str)
    closed : bool
    boundary : int or None
    """

    kind: str
    period: int
    values: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray
    residual: np.ndarray
    angle: np.ndarray
    special: list[tuple[str, np.ndarray]]
    ends: list[tuple[float, float, str]]
    closed: bool
    boundary: int | None


def as_data(curve: Curve) -> CurveData:
    """A curve as plain arrays."""
    states = [point.data for point in curve.points]
    return CurveData(
        curve.kind, curve.period, curve.values, np.stack([s.cycle.points for s in states]),
        np.stack([s.cycle.multipliers for s in states]), np.array([p.residual for p in curve.points]),
        np.array([np.nan if s.angle is None else s.angle for s in states]),
        [(s.kind, s.point.data.cycle.values) for s in curve.special],
        [(e.x, e.y, e.why) for e in curve.ends], curve.closed, curve.boundary,
    )


def on_curve(seed: EventSeed, curve: CurveData, spans: np.ndarray) -> bool:
    """Whether an event lies on a curve, with about the same orbit; ``spans`` (2,) are the lengths of the axes."""
    if (seed.kind, seed.period, seed.boundary) != (curve.kind, curve.period, curve.boundary):
        return False
    a, b = curve.values[:-1] / spans, curve.values[1:] / spans
    direction, offset = b - a, seed.values / spans - a
    share = np.clip((offset * direction).sum(1) / np.maximum((direction**2).sum(1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - share[:, None] * direction, axis=1)
    size = max(1.0, float(np.abs(seed.points).max()))
    for i in np.flatnonzero(distance < _ON_CURVE):
        points = curve.points[i] + share[i] * (curve.points[i + 1] - curve.points[i])
        gaps = [np.abs(np.roll(points, -k, axis=0) - seed.points).max() for k in range(seed.period)]
        if min(gaps) < _SAME_ORBIT * size:
            return True
    return False


def same_curve(new: CurveData, old: CurveData, spans: np.ndarray) -> bool:
    """Whether the middle and both quarters of a curve lie on another one."""
    count = len(new.values)
    return all(
        on_curve(EventSeed(new.kind, new.points[i], new.values[i], new.boundary), old, spans)
        for i in (count // 4, count // 2, 3 * count // 4))
