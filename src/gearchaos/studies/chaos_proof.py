"""Proof that a model with two coordinates has a chaotic set."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from typing import TYPE_CHECKING

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.manifolds import saddles
from gearchaos.errors import InputError
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.quantities import parse_harmonic
from gearchaos.studies.covering_search import find_horseshoe
from gearchaos.studies.proofs import check_can_prove
from gearchaos.validation import to_float

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.families.chaos import ChaoticSet

_LONGEST_PERIOD = 3
"""Largest period of a saddle, in mesh periods."""

_SIZES = ((0.1, 0.1), (0.1, 0.05), (0.05, 0.05), (0.2, 0.05), (0.02, 0.02))
"""Half axes of the home set that are tried, in half backlashes."""

_MOST_PROOFS = 3
"""Most candidates whose proof is tried."""


def prove_chaos(
    model: AnyModel, *, tolerances: Mapping[str, float] | None = None, bits: int = 128
) -> ChaoticSet | Unproved:
    """Prove that there is a chaotic set, and a lower bound of the topological entropy.

    The set need not attract: such sets exist inside periodic windows too. What motion an initial state leads to is
    said by `regime`.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point; its relative motion must have two coordinates, z and z_dot.
    tolerances : mapping of str to float, optional
        Amplitudes of the transmission error by name, e.g. ``{"eps1": 1e-6}``: the theorem then holds for all values
        that differ by at most this from those of the model.
    bits : int
        Precision, 53 to 800.

    Returns
    -------
    ChaoticSet or Unproved
        `ChaoticSet` states what is proved (``theorem``, ``entropy``); ``write`` saves it for ``gearchaos verify``.
        `Unproved` has the ``reason``; it does not say that there is no chaotic set.

    Raises
    ------
    InputError
        If python-flint is not installed, the relative motion has more than two coordinates, or an argument is out of
        range.

    Notes
    -----
    Covering relations along homoclinic orbits of a saddle: P. Zgliczynski, M. Gidea, J. Differential Equations 202,
    2004. Saddles of periods up to 3 are found by Newton's method from many initial states.

    Examples
    --------
    >>> import gearchaos as gc
    >>> result = gc.prove_chaos(gc.MeshModel.of(omega=1.6, q0=2.0, eps1=0.0, chi1=0.0, chi2=0.0))  # no saddle
    >>> result.proved, result.reason
    (False, 'no saddle')
    """
    check_can_prove(bits)
    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.families.chaos import prove_chaotic_set

    family = ParameterFamily(as_model(model), ())
    if family.dimension != 2:
        raise InputError("model", "must have two coordinates for a proof of a chaotic set", family.dimension,
                         "Use a single model, or a torsional one with the same β/J of both wheels.")
    sizes = _checked(tolerances)
    found = saddles(family, family.start, _LONGEST_PERIOD)
    candidates = (find_horseshoe(family, saddle, axes) for saddle in found for axes in _SIZES)
    result: ChaoticSet | Unproved = Unproved("no homoclinic orbit" if found else "no saddle", float("nan"), bits)
    for horseshoe in islice(filter(None, candidates), _MOST_PROOFS):
        result = prove_chaotic_set(family.model, horseshoe.sets, horseshoe.loops, bits, sizes)
        if result.proved:
            break
    return result


def _checked(tolerances: Mapping[str, float] | None) -> dict[str, str]:
    """The tolerances as decimal numbers; raises `InputError` for names of no amplitude, or negative values."""
    out: dict[str, str] = {}
    for name, value in (tolerances or {}).items():
        harmonic = parse_harmonic(str(name))
        if harmonic is None or harmonic.family != "eps":
            raise InputError("tolerances", "must be of amplitudes of the transmission error", name, "E.g. 'eps1'.")
        size = to_float(f"tolerances.{name}", value)
        if not 0 <= size < 1:
            raise InputError(f"tolerances.{name}", "must be in [0, 1)", size)
        out[str(name)] = repr(size)
    return out
