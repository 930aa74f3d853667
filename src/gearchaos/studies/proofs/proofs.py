"""Proofs: a periodic verdict or an orbit of any stability, for one model or a box of them, and events, as theorems."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import Orbit, find_cycle
from gearchaos.datasets import model_from_json
from gearchaos.dynamics.orbits import sections
from gearchaos.errors import InputError, missing_package, whole_number
from gearchaos.files import write_bytes
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import COORDINATES, SCALARS, STIFFNESS_KINDS, MeshModel, vary
from gearchaos.model.coordinates import from_physical, transmission_error_at_start
from gearchaos.model.switched import coordinates
from gearchaos.quantities import parse_harmonic
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.motion.regime import Verdict, regime
from gearchaos.validation import to_float

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.proof.families.boxes import BoxCertificate
    from gearchaos.proof.families.events import EventCertificate

_LEAST_BITS, _MOST_BITS = 53, 800

_LARGEST_WIDTH = 1e-3  # largest width of the interval of an event


def prove(subject: AnyModel | Verdict | Orbit, bits: int = 128) -> Certificate | Unproved:
    """Prove a periodic orbit in ball arithmetic.

    Parameters
    ----------
    subject : MeshModel, GearPair, GearDesign, Verdict or Orbit
        A model stands for the motion that `regime` finds. Orbits of `gearchaos.orbit` may be unstable.
    bits : int
        First precision, 53 to 800; up to 512 bits are tried where rounding errors are the cause of a failure.

    Returns
    -------
    Certificate or Unproved
        `Certificate` states what is proved (``theorem``); ``write`` saves it for ``gearchaos verify``. `Unproved` has
        the ``reason`` and the ``margin`` by which the proof failed; it does not say that the verdict is wrong.

    Raises
    ------
    InputError
        If python-flint is not installed, the precision is out of range, the verdict is not periodic, or the mesh
        damping of the model does not act always.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> certificate = gc.prove(model)
    >>> certificate.proved, certificate.period
    (True, 8)
    """
    check_can_prove(subject, bits)
    from gearchaos.proof.prove import prove_at_some_phase

    return prove_at_some_phase(*orbit_points(subject), bits)


def prove_box(
    subject: AnyModel | Verdict | Orbit, widths: Mapping[str, float], bits: int = 128
) -> BoxCertificate | Unproved:
    """Prove a periodic orbit for every model in a box of parameters.

    Parameters
    ----------
    subject : MeshModel, GearPair, GearDesign, Verdict or Orbit
        The centre of the box, with a stiffness in levels, two-level or stepped; as for `prove`.
    widths : mapping of str to float
        Half-widths of the box by parameter: scalars (``omega``), amplitudes of the transmission error that are not 0
        (``eps1``), levels of the stiffness (``chi1``, ``chi2``). A pair (``q0``, ``chi0``) has one half-width: both
        members differ from their values by the same amount. Named one by one, each is anywhere in its own interval.
    bits : int
        Precision, 53 to 800.

    Returns
    -------
    BoxCertificate or Unproved
        If the box cannot be proved, a certificate of the largest one of the same shape that bisection finds; its
        ``scale`` is then less than 1.

    Raises
    ------
    InputError
        If python-flint is not installed, the motion is not periodic, or a width is wrong.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> gc.prove_box(model, {"eps1": 1e-8}).proved
    True
    """
    check_can_prove(subject, bits)
    from gearchaos.proof.families.boxes import prove_parameter_box

    model, points = orbit_points(subject)
    if not widths:
        raise InputError("widths", "must name a parameter", dict(widths), 'E.g. {"eps1": 0.001}.')
    directions = {}
    for name, value in widths.items():
        width = to_float("width", value)
        if not width > 0:
            raise InputError(name, "must have a positive half-width", width)
        directions[name] = dict.fromkeys(box_parameters(model, name), Fraction(width))
    varied = [member for together in directions.values() for member in together]
    if len(varied) > len(set(varied)):
        raise InputError("widths", "must name each parameter once", list(widths))
    return prove_parameter_box(model, points, directions, bits)


def box_parameters(model: MeshModel, name: str) -> tuple[str, ...]:
    """The parameters that a name sets; raises `InputError` if proofs for all values in an interval cannot vary them."""
    from gearchaos.proof.parameters import exact_parameters

    if not model.stiffness.jumps:
        forms = " or ".join(kind.form for kind in STIFFNESS_KINDS.values() if kind.example().jumps and not kind.shared)
        raise InputError("stiffness", f"must be {forms} for a box of parameters", model.stiffness.form)
    parameters, harmonic, members = exact_parameters(model), parse_harmonic(name), tuple(model.set_by(name))
    if harmonic and harmonic.family == "eps":
        if model.value(name) == 0:
            raise InputError(name, "must not be 0 at the centre of the box", 0.0)
    elif any(m not in model.stiffness.level_names and not (m in SCALARS and m in parameters) for m in members):
        *names, last = "Scalars of the model", "amplitudes of the transmission error", *model.stiffness.level_names
        raise InputError(name, "must be a parameter that a box can vary", name, f"{', '.join(names)} and {last}.")
    return members


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
    from gearchaos.proof.families.events import KINDS, prove_event_facts

    if not isinstance(subject, MeshModel) and hasattr(subject, "data_vars"):
        return prove_event(**_event_of(subject), width=width, bits=bits)
    if kind not in KINDS:
        raise InputError("kind", f"must be one of {', '.join(KINDS)}", kind)
    if axis is None or value is None:
        raise InputError("axis and value", "must be given", None, 'E.g. prove_event(model, "flip", "eps1", 0.2).')
    check_can_prove(subject, bits)
    model, value = as_model(subject), to_float("value", value)
    width = to_float("width", width)
    if not 0 < width <= _LARGEST_WIDTH:
        raise InputError("width", f"must be positive and at most {_LARGEST_WIDTH:g}", width)
    low, high = value - width / 2, value + width / 2
    while Fraction(high) - Fraction(low) > Fraction(width):
        high = float(np.nextafter(high, low))
    if not low < high:
        raise InputError("width", f"must be larger than the spacing of floats at {value:g}", width)
    lower, model, upper = (model.with_values({axis: v}) for v in (low, value, high))
    for varied in (lower, model, upper):
        box_parameters(varied, axis)
    if near is None or period is None:
        points = find_cycle(model, (), period, near)[1].points
    else:
        family, period = ParameterFamily(model.with_values(near), ()), whole_number("period", period, 1)
        w = family.initial_states(family.start[None]).T.copy()
        points = sections(family.exact_flow(family.start[None]), w, np.zeros(1, int), np.array([period]))[0]
    return prove_event_facts(kind, axis, [(lower, low), (upper, high)], points, bits)


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


def check_installed() -> None:
    """Raise `InputError` unless python-flint is installed."""
    if find_spec("flint") is None:
        raise missing_package("prove", "python-flint", "proof")


def check_can_prove(subject: AnyModel | Verdict | Orbit, bits: int = _LEAST_BITS) -> None:
    """Raise `InputError` unless python-flint is installed, and proofs exist for the model and have this precision."""
    check_installed()
    from gearchaos.proof.parameters import check_provable

    whole_number("bits", bits, _LEAST_BITS, _MOST_BITS)
    check_provable(subject.model if isinstance(subject, (Verdict, Orbit)) else as_model(subject))


def write_verifier(path: Path) -> None:
    """Write the verifier of certificates, a program in one file that needs Python and python-flint alone."""
    write_bytes(path, files("gearchaos.proof").joinpath("verifier.py").read_bytes())


def orbit_points(subject: AnyModel | Verdict | Orbit) -> tuple[MeshModel, np.ndarray]:
    """The model of an orbit and its states w (n, d) at τ = k T."""
    if isinstance(subject, Orbit):
        batch = vary(subject.model, {})
        names, points = coordinates(batch), subject.points
        if set(names) <= set(points):
            return subject.model, np.stack([points[name] for name in names], axis=1)
        zero = np.zeros_like(next(iter(points.values())))
        known = {name: points.get(name, zero) for name in COORDINATES["full"]}
        return subject.model, from_physical(names, known, *transmission_error_at_start(batch))
    verdict = subject if isinstance(subject, Verdict) else regime(subject)
    if verdict.period is None:
        raise InputError(
            "prove", "must be given a periodic motion", verdict.label,
            "What is proved are periodic orbits; gearchaos.orbit finds unstable ones too.")
    flow, w = initial_value_problems(verdict.model).flow, verdict.verdicts.w[:, :1].copy()
    return verdict.model, sections(flow, w, np.zeros(1, int), np.array([verdict.period]))[0]
