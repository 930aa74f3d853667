"""The curves on which periodic orbits are born, change stability or touch a boundary of contact, over the map."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.lines import Line, line_seeds
from gearchaos.continuation.skeleton import CurveData, CurveWork, on_curve, same_curve
from gearchaos.errors import InputError
from gearchaos.explorer.view.bounds import BRANCH_POINTS, SKELETON_LINES
from gearchaos.explorer.view.state import View
from gearchaos.model import state_names

_PLACES = (32, 20)
"""Numbers of places on a line along x and along y at which stable motions are searched."""

_STARTS = 3
"""Number of initial states at each place, besides those of the model."""

_SETTINGS = Settings(first=5e-3, longest=2e-2, shortest=1e-6, points=BRANCH_POINTS)
"""Steps along a curve."""


@dataclass(frozen=True)
class EventCurve:
    """A curve of one kind of event.

    Attributes
    ----------
    kind : str
        "fold", "flip", "neimark-sacker" or "graze".
    period : int
        Of its orbits, in mesh periods.
    x, y : (P,)
        Both parameters of the map.
    """

    kind: str
    period: int
    x: np.ndarray
    y: np.ndarray


@dataclass(frozen=True)
class Skeleton:
    """The curves found in the window of a map, possibly before all lines have been searched.

    Attributes
    ----------
    period : int
        Largest period of the orbits, in mesh periods.
    curves : tuple of EventCurve
    failed : int
        Number of events whose curve could not be followed.
    searched, lines : int
        Numbers of lines that have been searched for events, and of all.
    """

    period: int
    curves: tuple[EventCurve, ...]
    failed: int
    searched: int
    lines: int


def skeleton(view: View, period: int) -> Generator[Skeleton]:
    """The curves of the events of orbits up to a period in the window of a map, once for every curve and line.

    The method is that of `gearchaos.skeleton`. The curves of a line are followed before the next line is searched, so
    that the first ones are soon shown.

    Raises
    ------
    InputError
        If an axis of the map is an initial value.
    """
    bounds = (view.x.start, view.x.stop), (view.y.start, view.y.stop)
    spans = np.array([high - low for low, high in bounds])
    follow = CurveWork(view.operating_point, (view.x.name, view.y.name), bounds, _SETTINGS)
    lines = list(_lines(view, period))
    curves, shown, failed = list[CurveData](), list[EventCurve](), 0
    yield Skeleton(period, (), 0, 0, len(lines))
    for searched, line in enumerate(lines):
        for seed in line_seeds(line):
            if any(on_curve(seed, curve, spans) for curve in curves):
                continue
            found = follow(seed)
            if isinstance(found, str):
                failed += 1
            elif not any(same_curve(found, curve, spans) for curve in curves):
                curves.append(found)
                shown.append(EventCurve(found.kind, found.period, *found.values.T))
                yield Skeleton(period, tuple(shown), failed, searched, len(lines))
        yield Skeleton(period, tuple(shown), failed, searched + 1, len(lines))


def _lines(view: View, period: int) -> Iterator[Line]:
    """The lines that are searched for events, in turn along y and along x, from the middle of the map outwards."""
    axes = view.x, view.y
    for axis in axes:
        if axis.name in state_names(view.model.kind):
            raise InputError("axis", "must be a parameter for bifurcation curves", axis.name,
                             "Orbits do not depend on initial values: choose another axis.")
    names, bounds = (view.x.name, view.y.name), ((view.x.start, view.x.stop), (view.y.start, view.y.stop))
    for share in SKELETON_LINES:
        for along in (1, 0):
            across = axes[1 - along]
            value = across.start + share * (across.stop - across.start)
            yield Line(view.operating_point, names, bounds, along, value, _PLACES[along], _STARTS, period)
