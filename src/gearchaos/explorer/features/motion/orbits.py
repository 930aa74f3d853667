"""What follows periodic orbits: the branch of the motion at a point, and the bifurcation curves over the map."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import follow_branch
from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.orbit import find_cycle
from gearchaos.continuation.skeleton import CurveWork, Line, line_seeds, on_curve, same_curve
from gearchaos.datasets import provenance, variable
from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import BRANCH_POINTS, SKELETON_LINES
from gearchaos.explorer.core.state import View
from gearchaos.explorer.features.motion.point import PointMotion, in_units
from gearchaos.model import MeshModel
from gearchaos.studies.orbits.branch import branch_dataset

_BRANCH_SETTINGS = Settings(longest=2e-2, points=BRANCH_POINTS)
"""Steps short enough that a branch looks smooth over the whole range of the diagram."""


@dataclass(frozen=True)
class PeriodicMotion:
    """A periodic motion whose branch can be followed."""

    model: MeshModel  # the operating point
    label: str  # e.g. "2T"
    period: int  # minimal, in mesh periods
    state: tuple[tuple[str, float], ...]  # a stroboscopic point of its orbit, by names of initial values


def obstacle(found: PointMotion) -> str:
    """Why the branch of a motion cannot be followed; empty for a periodic motion."""
    if found.verdict.period is not None and found.verdict.section:
        return ""
    so_far = "" if found.final else " so far"
    return f"Only a periodic motion can be followed along a parameter; this one is {found.verdict.label}{so_far}."


def periodic_motion(found: PointMotion) -> PeriodicMotion:
    """The motion at a point as one to follow; raises `InputError` if it is not periodic."""
    verdict, reason = found.verdict, obstacle(found)
    if reason or verdict.period is None:
        raise InputError("motion", "must be periodic", verdict.label, reason)
    state = tuple((n, float(verdict.section[n][0])) for n in found.model.coordinate_names)
    return PeriodicMotion(found.model, verdict.label, verdict.period, state)


def branch(view: View, motion: PeriodicMotion) -> Generator[xr.Dataset]:
    """The branch of a motion along the line of the diagram, over its whole range, in the units that the view shows.

    The only result is a Dataset as from `gearchaos.branch`, with the displacement z at the stroboscopic points of all
    orbits, ``section_z`` (point, cycle), and of those at the events, ``event_section_z`` (event, cycle). Its attributes
    have the period of the orbits too. An `InputError` says that the line varies an initial value, or that no orbit is
    found at the motion.
    """
    axis = view.line_axis
    if axis.name in motion.model.state_names:
        raise InputError("line", "must vary a parameter", axis.name,
                         "Along an initial value the orbit stays the same: choose another axis or the other line.")
    try:
        family, cycle = find_cycle(motion.model, (axis.name,), motion.period, dict(motion.state))
    except InputError as error:
        rule = f"must lie on an orbit of minimal period {motion.period} that Newton's method finds"
        raise InputError("motion", rule, motion.label, error.advice) from None
    found = follow_branch(family, cycle, (axis.start, axis.stop), _BRANCH_SETTINGS)
    attributes = provenance("branch", family.model, axis=[axis.name, axis.start, axis.stop], period=found.period)
    dataset = branch_dataset(found, [], [], [], axis, {**attributes, "period": found.period})
    for prefix, along, cycles in (("", "point", [p.data for p in found.points]),
                                  ("event_", "event", [e.cycle for e in found.events])):
        z = np.array([cycle.points[:, 0] for cycle in cycles]).reshape(-1, found.period)
        dataset[f"{prefix}section_z"] = variable(f"{prefix}section_z", (along, "cycle"), z)
    yield in_units(dataset, view)


_PLACES = (32, 20)  # numbers of places on a line along x and along y at which stable motions are searched
_STARTS = 3  # number of initial states at each place, besides those of the model
_CURVE_SETTINGS = Settings(first=5e-3, longest=2e-2, shortest=1e-6, points=BRANCH_POINTS)  # steps along a curve


@dataclass(frozen=True)
class EventCurve:
    """A curve of one kind of event."""

    kind: str  # "fold", "flip", "neimark-sacker" or "graze"
    period: int  # of its orbits, in mesh periods
    x: np.ndarray  # (P,) both parameters of the map
    y: np.ndarray


@dataclass(frozen=True)
class Skeleton:
    """The curves found in the window of a map, possibly before all lines have been searched."""

    period: int  # largest one of the orbits, in mesh periods
    curves: tuple[EventCurve, ...]
    failed: int  # number of events whose curve could not be followed
    searched: int  # number of lines that have been searched for events
    lines: int


def skeleton(view: View, period: int) -> Generator[Skeleton]:
    """The curves of the events of orbits up to a period in the window of a map, once for every curve and line.

    The method is that of `gearchaos.skeleton`. The curves of a line are followed before the next line is searched, so
    that the first ones are soon shown. An `InputError` says that an axis of the map is an initial value.
    """
    axes = view.x, view.y
    for axis in axes:
        if axis.name in view.model.state_names:
            raise InputError("axis", "must be a parameter for bifurcation curves", axis.name,
                             "Orbits do not depend on initial values: choose another axis.")
    names, bounds, lines = (view.x.name, view.y.name), ((view.x.start, view.x.stop), (view.y.start, view.y.stop)), []
    spans = np.array([high - low for low, high in bounds])
    for share in SKELETON_LINES:  # in turn along y and along x, from the middle of the map outwards
        for along in (1, 0):
            across = axes[1 - along]
            value = across.start + share * (across.stop - across.start)
            lines.append(Line(view.operating_point, names, bounds, along, value, _PLACES[along], _STARTS, period))
    follow = CurveWork(view.operating_point, names, bounds, _CURVE_SETTINGS)
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
