"""Curves of events in two parameters: where orbits are born, lose stability or touch a boundary of contact."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import MISSING, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.curve import SETTINGS, CurveData, event_at, find_event, follow_curve
from gearchaos.continuation.defining import seed_of
from gearchaos.continuation.events import GRAZE
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.datasets import new_dataset, provenance, variables
from gearchaos.errors import InputError
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import RANGE, axis_option, option
from gearchaos.studies.orbits.following import (
    FollowingStudy,
    check_inside,
    parameter_plane,
    section_variables,
    step_option,
)

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Curve(FollowingStudy):
    """Follow the curve of an event of periodic orbits over two parameters.

    It is followed in both directions, with its points of codimension 2.

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

    As a value
    ----------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.9, zeta=0.05, eps1=0.02, kind="single")
    >>> gc.Curve(model, "flip", "omega=1.7:2.1", "eps1=0:0.06", period=1).event
    'flip'
    """

    kind: ClassVar[str] = "curve"
    rank: ClassVar[int] = 8
    group: ClassVar[str] = "Bifurcations"
    summary: ClassVar[str] = "curve"
    model_words: ClassVar[str] = (
        "The curve begins at the event nearest to the model's own value of ``x``, on the branch of an orbit along "
        "``x``. If the orbit at the model's own values is at such an event already, the curve begins there.")
    steps: ClassVar[Settings] = SETTINGS

    event: Literal["fold", "flip", "neimark-sacker", "graze"] = option(
        MISSING, "The event whose curve is followed. A graze may be at either boundary of contact, whichever is "
        "nearer.", keyword=False)
    x: Axis = axis_option(
        'A parameter and its range, "omega=0.2:2.5"; a number of values is accepted and has no effect.', RANGE)
    y: Axis = axis_option("Another one.", RANGE)
    longest_step: float = step_option(SETTINGS.longest)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.event == GRAZE and self.model.law.releases:
            raise InputError("event", "must not be a graze where contact ends with its force", self.event,
                             f"With the damping law {self.model.damping_law} it is a border collision, which has no "
                             "curve here. The law contact has curves of grazes.")
        check_inside(self._family.model, self.x, self.y)

    @cached_property
    def _family(self) -> ParameterFamily:
        return parameter_plane(self.model, self.x, self.y)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        x, y, family, settings = self.x, self.y, self._family, self.step_lengths
        along_x, cycle = find_cycle(family.model, (x.name,), self.period, self.start, names=family.names)
        seed = event_at(cycle, family.start, self.event)
        if seed is None:  # the nearest one on the branch along x
            event = find_event(along_x, cycle, self.event, (x.start, x.stop), Settings())
            seed = seed_of(event, np.array([event.cycle.values[0], family.start[1]]))
        try:
            found = follow_curve(family, seed, ((x.start, x.stop), (y.start, y.stop)), settings)
        except Stopped as stop:
            raise InputError("event", "must be one whose curve can be followed", seed.kind,
                             f"At {x.name} = {seed.values[0]:.10g} it cannot: {stop}.") from None
        data, coordinates = point_variables(family, [found])
        attributes = provenance(
            self.kind, family.model, x=[x.name, x.start, x.stop], y=[y.name, y.start, y.stop],
            longest_step=settings.longest, max_points=settings.points)
        return new_dataset({**data, **special_variables(family, [found])}, coordinates, {
            **attributes, "event": found.kind, "period": found.period, "boundary": found.boundary or 0,
            "ends": json.dumps(curve_ends(family, found)), "closed": json.dumps(found.closed)})


curve = function_of(Curve)


def point_variables(
    family: ParameterFamily, curves: Sequence[CurveData]
) -> tuple[dict[str, xr.Variable], dict[str, xr.Variable]]:
    """The variables over the points of curves, one curve after another, and the parameters as their coordinates."""

    def joined(name: str, *empty: int) -> np.ndarray:
        return np.concatenate([np.zeros((0, *empty)), *(getattr(curve, name) for curve in curves)])

    multipliers, angle = joined("multipliers", family.dimension), joined("angle")
    data = section_variables(family, [(curve.values, curve.points) for curve in curves])
    data |= variables(("point", "exponent"), {
        "multipliers_real": multipliers.real, "multipliers_imag": multipliers.imag, "residual": joined("residual"),
        **({"angle": angle} if np.any(np.isfinite(angle)) else {})})
    return data, variables(("point",), dict(zip(family.axes, joined("values", 2).T, strict=True)))


def special_variables(family: ParameterFamily, curves: Sequence[CurveData]) -> dict[str, xr.Variable]:
    """The variables over the points of codimension 2 of all curves."""
    found = [special for curve in curves for special in curve.special]
    values = np.array([v for _, v in found], float).reshape(-1, 2)
    return variables(("special",), {
        "special_kind": np.array([kind for kind, _ in found], dtype=object),
        **{f"special_{name}": v for name, v in zip(family.axes, values.T, strict=True)}})


def curve_ends(family: ParameterFamily, curve: CurveData) -> list[dict[str, Any]]:
    """The ends of a curve: both parameters by name, and why it ends there."""
    x, y = family.axes
    return [{x: float(end[0]), y: float(end[1]), "why": end[2]} for end in curve.ends]
