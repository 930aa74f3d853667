"""Proofs of a periodic motion for every model in a box of parameters, such as the tolerances of a drawing."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING

from gearchaos.continuation.orbit import Orbit
from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operating import AnyModel
from gearchaos.model import SCALARS, MeshModel
from gearchaos.quantities import parse_harmonic
from gearchaos.studies.proofs import check_installed, orbit_points
from gearchaos.studies.verdict import Verdict
from gearchaos.validation import to_float

if TYPE_CHECKING:
    from gearchaos.proof.box_certificate import BoxCertificate
    from gearchaos.proof.certificate import Unproved


def prove_box(
    subject: AnyModel | Verdict | Orbit, widths: Mapping[str, float], bits: int = 128
) -> BoxCertificate | Unproved:
    """Prove a periodic orbit for every model in a box of parameters.

    Parameters
    ----------
    subject : MeshModel, GearPair, GearDesign, Verdict or Orbit
        The centre of the box, with two-level or stepped stiffness; as for `prove`.
    widths : mapping of str to float
        Half-widths of the box by parameter: scalars (``omega``), amplitudes of the transmission error that are not 0
        (``eps1``), ``chi1`` and ``chi2``. A pair (``q0``, ``chi0``) has one half-width: both members
        differ from their values by the same amount. Named one by one, each is anywhere in its own interval.
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
    check_installed()
    whole_number("bits", bits, 53, 800)
    from gearchaos.proof.box_certificate import prove_parameter_box

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
        raise InputError("stiffness", "must be two-level or stepped for a box of parameters", "Fourier series")
    parameters, harmonic, members = exact_parameters(model), parse_harmonic(name), tuple(model.set_by(name))
    if harmonic and harmonic.family == "eps":
        if model.value(name) == 0:
            raise InputError(name, "must not be 0 at the centre of the box", 0.0)
    elif any(m not in model.stiffness.level_names and not (m in SCALARS and m in parameters) for m in members):
        raise InputError(name, "must be a parameter that a box can vary", name,
                         "Scalars of the model, amplitudes of the transmission error, chi1 and chi2.")
    return members
