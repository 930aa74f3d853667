"""Curves of events in two parameters: where orbits are born, lose stability or touch a boundary of contact."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.curve import SETTINGS, event_at, find_event, follow_curve
from gearchaos.continuation.curve_data import CurveData, as_data
from gearchaos.continuation.defining import EventSeed, seed_of
from gearchaos.continuation.events import FLIP, FOLD, GRAZE, NEIMARK_SACKER
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import check_period, find_cycle
from gearchaos.datasets import new_dataset, provenance
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.quantities import Rule
from gearchaos.studies.axis import Axis, as_range
from gearchaos.studies.curve_dataset import (
    check_inside,
    ends_of,
    parameter_plane,
    point_variables,
    special_variables,
)
from gearchaos.studies.operating_point import at_axis_starts
from gearchaos.validation import check_rule, to_float

if TYPE_CHECKING:
    import xarray as xr

EVENTS = (FOLD, FLIP, NEIMARK_SACKER, GRAZE)
"""The events whose curves can be followed."""

_BRANCH = Settings()
"""Steps along the branch on which the first event is searched."""

_MOST_POINTS = 1_000_000
_LONGEST_STEP = Rule(lambda v: (v >= 1e-5) & (v <= 1), "must lie in [1e-5, 1]")


def curve(
    model: AnyModel, event: str, x: Axis | str, y: Axis | str, *, start: Mapping[str, float] | None = None,
    period: int | None = None, longest_step: float = SETTINGS.longest, max_points: int = 10_000,
) -> xr.Dataset:
    """Follow the curve of an event in two parameters, in both directions, with its points of codimension 2.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The curve begins at the event nearest to the model's own value of ``x``, on the branch of an orbit along ``x``.
        If the orbit at the model's own values is at such an event already, the curve begins there.
    event : str
        "fold", "flip", "neimark-sacker" or "graze" (at either boundary of contact, whichever is nearer).
    x, y : Axis or str
        The parameters and their ranges, "omega=0.2:2.5"; a number of values is accepted and has no effect.
    start : mapping of str to float, optional
        Initial values near an orbit of the branch; by default the branch begins with the motion that the model's own
        lead to, or with another period than that of this motion as `orbit` does.
    period : int, optional
        Minimal period in mesh periods, at most 1024; by default that of the motion that the start leads to.
    longest_step : float
        Longest step along the curve. A step has length 1 if a parameter changes by its whole range, or if the root mean
        square distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the curve: both parameters as coordinates, ``section_<coordinate>`` (point,
        cycle), ``multipliers_real`` and ``multipliers_imag`` (point, exponent), ``residual``, and for Neimark-Sacker
        ``angle``, the argument of the critical multiplier in radians. Over ``special``, the points of codimension 2:
        ``special_kind`` and both parameters, ``special_<parameter>``. Attributes: ``event``, ``period``, ``boundary``
        (1 or −1 for a graze, otherwise 0); ``ends`` and ``closed`` are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, the model's own values lie outside the axes, there is no orbit of this period
        near the start, or its branch has no such event; the message then has those that it has.

    Notes
    -----
    Pseudo-arclength continuation of the orbit together with the condition of the event: a singular matrix of the linear
    equations with the critical multiplier (W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria,
    2000), or an extremum of z on a boundary. Every point of a result can be the start of the same curve: set both
    parameters in the model, and give ``section_<coordinate>`` as ``start``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.9, zeta=0.05, eps1=0.02, kind="single")
    >>> found = gc.curve(model, "flip", "omega=1.7:2.1", "eps1=0:0.06", period=1)
    >>> found.attrs["period"]
    1
    """
    if event not in EVENTS:
        raise unknown_name("event", str(event), EVENTS)
    x, y = as_range(x, "x"), as_range(y, "y")
    settings = _settings(longest_step, max_points)
    if period is not None:
        check_period(period)
    family = parameter_plane(as_model(at_axis_starts(model, [x, y])), x, y)
    check_inside(family, x, y)
    seed = _first_event(family, event, x, start, period)
    found = _followed(family, seed, x, y, settings)
    attributes = provenance(
        "curve", family.model, x=[x.name, x.start, x.stop], y=[y.name, y.start, y.stop],
        longest_step=settings.longest, max_points=settings.points)
    return _dataset(family, found, attributes)


def _settings(longest_step: Any, max_points: Any) -> Settings:
    """The lengths of steps along the curve; raises `InputError` if an argument is out of range."""
    longest = to_float("longest_step", longest_step)
    check_rule("longest_step", longest, _LONGEST_STEP)
    points = whole_number("max_points", max_points, 2, _MOST_POINTS)
    return Settings(min(SETTINGS.first, longest), longest, min(SETTINGS.shortest, longest), SETTINGS.finest, points)


def _first_event(
    family: ParameterFamily, event: str, x: Axis, start: Mapping[str, float] | None, period: int | None
) -> EventSeed:
    """The event at the model's own values, or the nearest one on the branch along x."""
    along_x, cycle = find_cycle(family.model, (x.name,), period, start, names=family.names)
    seed = event_at(cycle, family.start, event)
    if seed is not None:
        return seed
    found = find_event(along_x, cycle, event, (x.start, x.stop), _BRANCH)
    return seed_of(found, np.array([found.cycle.values[0], family.start[1]]))


def _followed(family: ParameterFamily, seed: EventSeed, x: Axis, y: Axis, settings: Settings) -> CurveData:
    """The curve of an event; raises `InputError` if it cannot be followed."""
    try:
        return as_data(follow_curve(family, seed, ((x.start, x.stop), (y.start, y.stop)), settings))
    except Stopped as stop:
        raise InputError("event", "must be one whose curve can be followed", seed.kind,
                         f"At {x.name} = {seed.values[0]:.10g} it cannot: {stop}.") from None


def _dataset(family: ParameterFamily, found: CurveData, attributes: dict[str, Any]) -> xr.Dataset:
    """The Dataset that `curve` returns."""
    data, coordinates = point_variables(family, [found])
    own = {
        "event": found.kind, "period": found.period, "boundary": found.boundary or 0,
        "ends": json.dumps(ends_of(family, found)), "closed": json.dumps(found.closed),
    }
    return new_dataset({**data, **special_variables(family, [found])}, coordinates, {**attributes, **own})
