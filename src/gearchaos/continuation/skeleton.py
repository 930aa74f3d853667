"""The skeleton of a map: all curves in it on which orbits are born, lose stability or touch a boundary of contact.

Branches on some lines of the map give events, and each event that lies on no known curve gives another curve.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.curve import SETTINGS, Bounds, Curve, follow_curve
from gearchaos.continuation.defining import EventSeed
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.lines import Line, line_seeds
from gearchaos.execute.pools import Pool
from gearchaos.execute.progress import bar
from gearchaos.model import MeshModel

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
    special: list[tuple[str, np.ndarray]]
    ends: list[tuple[float, float, str]]
    closed: bool
    boundary: int | None


@dataclass(frozen=True)
class CurveWork:
    """What a worker needs to follow curves."""

    model: MeshModel
    axes: tuple[str, str]
    bounds: Bounds
    settings: Settings

    def __call__(self, seed: EventSeed) -> CurveData | str:
        """The curve of a seed, or why there is none."""
        family = ParameterFamily(self.model, self.axes)
        try:
            return as_data(follow_curve(family, seed, self.bounds, self.settings))
        except Stopped as stop:
            return str(stop)


def as_data(curve: Curve) -> CurveData:
    """The curve as plain arrays, which another process can send."""
    cycles = [point.data.cycle for point in curve.points]
    return CurveData(
        curve.kind, curve.period, curve.values, np.stack([c.points for c in cycles]),
        np.stack([c.multipliers for c in cycles]), np.array([c.residual for c in cycles]),
        [(s.kind, s.point.data.cycle.values) for s in curve.special],
        [(e.x, e.y, e.why) for e in curve.ends], curve.closed, curve.boundary,
    )


def find_curves(
    model: MeshModel, axes: tuple[str, str], bounds: Bounds, pool: Pool, *, period: int, lines: tuple[int, int],
    cells: tuple[int, int], starts: int, settings: Settings = SETTINGS, progress: bool = False,
) -> tuple[list[CurveData], list[tuple[EventSeed, str]]]:
    """The curves of all events of orbits up to a period that are found in a window.

    Parameters
    ----------
    model : MeshModel
    axes : (str, str)
    bounds : two pairs of float
        Ends of both axes.
    pool : Pool
        Computes lines and curves.
    period : int
        Largest period of the orbits.
    lines : (int, int)
        Numbers of lines along the first and along the second axis on which branches are followed.
    cells : (int, int)
        Numbers of places on these lines at which stable motions are searched.
    starts : int
        Number of initial states at each place, besides the model's own.

    Returns
    -------
    list of CurveData
    list of (EventSeed, str)
        Events whose curve could not be followed, and why.
    """
    work = [
        Line(model, axes, bounds, along, value, cells[along], starts, period)
        for along in (0, 1) for value in _inner(bounds[1 - along], lines[along])
    ]
    spans = np.array([high - low for low, high in bounds])
    curves, failed, waiting = list[CurveData](), list[tuple[EventSeed, str]](), list[EventSeed]()
    follow = CurveWork(model, axes, bounds, settings)
    pending: dict[Future[Any], Line | EventSeed] = {pool.submit(line_seeds, line): line for line in work}
    with bar("skeleton" if progress else None, len(work)) as done:
        while pending or waiting:
            _submit(pool, follow, pending, waiting, curves, spans)
            finished, _ = wait(pending, return_when=FIRST_COMPLETED)
            for future in finished:
                item = pending.pop(future)
                if isinstance(item, Line):
                    waiting += future.result()
                    done(1)
                elif isinstance(result := future.result(), str):
                    failed.append((item, result))
                elif not any(_same_curve(result, curve, spans) for curve in curves):
                    curves.append(result)
    return curves, failed


def _submit(
    pool: Pool, follow: CurveWork, pending: dict[Future[Any], Line | EventSeed], waiting: list[EventSeed],
    curves: Sequence[CurveData], spans: np.ndarray,
) -> None:
    """Submit waiting events that lie on no curve known or being followed, as long as there are idle workers."""
    active = [item for item in pending.values() if isinstance(item, EventSeed)]
    later = []
    while waiting:
        seed = waiting.pop()
        if any(on_curve(seed, curve, spans) for curve in curves):
            continue
        if len(active) >= 2 * pool.workers() or any(_alike(seed, other) for other in active):
            later.append(seed)
            continue
        pending[pool.submit(follow, seed)] = seed
        active.append(seed)
    waiting += later


def _alike(seed: EventSeed, other: EventSeed) -> bool:
    """Whether two events may lie on one curve."""
    return (seed.kind, seed.period, seed.boundary) == (other.kind, other.period, other.boundary)


def _inner(bounds: tuple[float, float], count: int) -> np.ndarray:
    """Equidistant values inside a range, (count,)."""
    return np.linspace(*bounds, 2 * count + 1)[1::2]


def on_curve(seed: EventSeed, curve: CurveData, spans: np.ndarray) -> bool:
    """Whether an event lies on a curve, with about the same orbit."""
    if (seed.kind, seed.period, seed.boundary) != (curve.kind, curve.period, curve.boundary):
        return False
    a, b = curve.values[:-1] / spans, curve.values[1:] / spans
    direction, offset = b - a, seed.values / spans - a
    share = np.clip((offset * direction).sum(1) / np.maximum((direction**2).sum(1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - share[:, None] * direction, axis=1)
    near = np.flatnonzero(distance < _ON_CURVE)
    size = max(1.0, float(np.abs(seed.points).max()))
    for i in near:
        points = curve.points[i] + share[i] * (curve.points[i + 1] - curve.points[i])
        gaps = [np.abs(np.roll(points, -k, axis=0) - seed.points).max() for k in range(seed.period)]
        if min(gaps) < _SAME_ORBIT * size:
            return True
    return False


def _same_curve(new: CurveData, old: CurveData, spans: np.ndarray) -> bool:
    """Whether the middle and both quarters of a curve lie on another one."""
    count = len(new.values)
    return all(
        on_curve(EventSeed(new.kind, new.points[i], new.values[i], new.boundary), old, spans)
        for i in (count // 4, count // 2, 3 * count // 4))

