"""Proofs of events: that a flip, fold, graze or Neimark-Sacker bifurcation lies where it was located."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.datasets import model_from_json
from gearchaos.dynamics.orbits import sections
from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import MeshModel
from gearchaos.studies.box_proofs import box_parameters
from gearchaos.studies.proofs import check_installed
from gearchaos.validation import to_float

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.event import EventCertificate

_LARGEST_WIDTH = 1e-3


def prove_event(
    subject: AnyModel | xr.Dataset, kind: str | None = None, axis: str | None = None, value: float | None = None, *,
    period: int | None = None, near: Mapping[str, float] | None = None, width: float = 1e-9, bits: int = 128,
) -> EventCertificate | Unproved:
    """Prove that an event of periodic orbits lies in an interval of a parameter.

    Proved are opposite facts at the two ends of the interval. For a flip: an orbit of period n has one multiplier more
    outside the unit circle at one end than at the other, and at one of them there is an orbit of period 2 n beside it.
    For a Neimark-Sacker bifurcation: two more. For a graze: the contact switches of the orbit have different sequences.
    For a fold: at one end there are two orbits, one with one multiplier more outside, and at the other none in a region
    about both. Between the ends, the orbit of the first three exists for every value of the parameter; no orbit crosses
    the border of the region of a fold.

    Parameters
    ----------
    subject : MeshModel, GearPair, GearDesign or xarray.Dataset
        A model; or the result of `branch` with one event selected, ``result.isel(event=3)``, which gives everything
        else.
    kind : {"flip", "fold", "graze", "neimark-sacker"}
    axis : str
        Name of the parameter, one of those of `prove_box`.
    value : float
        Where the event was located.
    period : int
        Minimal period n of the orbit; of the shorter one at a flip.
    near : mapping of str to float, optional
        Initial values on the orbit at the event; by default the orbit is sought as by `orbit`.
    width : float
        Width of the interval, at most 1e-3. Its middle is ``value``.
    bits : int
        First precision of the proofs.

    Returns
    -------
    EventCertificate or Unproved

    Raises
    ------
    InputError
        If an argument is missing or out of range, if no orbit is found, or if python-flint is not installed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> branch = gc.branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0.19:0.21")
    >>> flip = int(branch.event_kind.values.tolist().index("flip"))
    >>> gc.prove_event(branch.isel(event=flip)).proved
    True
    """
    check_installed()
    from gearchaos.proof.event import KINDS, prove_event_facts

    if not isinstance(subject, MeshModel) and hasattr(subject, "data_vars"):
        return prove_event(**_event_of(subject), width=width, bits=bits)
    if kind not in KINDS:
        raise InputError("kind", f"must be one of {', '.join(KINDS)}", kind)
    if axis is None or value is None:
        raise InputError("axis and value", "must be given", None, 'E.g. prove_event(model, "flip", "eps1", 0.2).')
    model, value = as_model(subject), to_float("value", value)
    width = to_float("width", width)
    if not 0 < width <= _LARGEST_WIDTH:
        raise InputError("width", f"must be positive and at most {_LARGEST_WIDTH:g}", width)
    low, high = _interval(value, width)
    lower, model, upper = (model.with_values({axis: v}) for v in (low, value, high))
    for varied in (lower, model, upper):
        box_parameters(varied, axis)
    return prove_event_facts(kind, axis, [(lower, low), (upper, high)], _points(model, period, near), bits)


def _interval(value: float, width: float) -> tuple[float, float]:
    """Floats about a value that are at most ``width`` apart."""
    low, high = value - width / 2, value + width / 2
    while Fraction(high) - Fraction(low) > Fraction(width):
        high = float(np.nextafter(high, low))
    if not low < high:
        raise InputError("width", f"must be larger than the spacing of floats at {value:g}", width)
    return low, high


def _points(model: MeshModel, period: int | None, near: Mapping[str, float] | None) -> np.ndarray:
    """Approximate states w (n, d) at τ = k T of the orbit at the event."""
    if near is None or period is None:
        _, cycle = find_cycle(model, (), period, near)
        return cycle.points
    period = whole_number("period", period, 1)
    family = ParameterFamily(model.with_values(near), ())
    w = family.initial_states(family.start[None]).T.copy()
    return sections(family.exact_flow(family.start[None]), w, np.zeros(1, int), np.array([period]))[0]


def _event_of(branch: Any) -> dict[str, Any]:
    """The arguments of `prove_event` for the event of a branch."""
    if "event_kind" not in branch or branch["event_kind"].ndim:
        raise InputError("subject", "must be a branch with one event selected", dict(branch.sizes),
                         "E.g. branch.isel(event=0).")
    prefix = "event_section_"
    near = {str(name)[len(prefix):]: float(v) for name, v in branch.data_vars.items() if str(name).startswith(prefix)}
    return {
        "subject": model_from_json(branch.attrs["model"]), "kind": str(branch["event_kind"].item()),
        "axis": str(branch["event_value"].attrs["quantity"]), "value": float(branch["event_value"]),
        "period": int(branch["event_period"]), "near": near,
    }
