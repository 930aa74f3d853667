"""The parameters of a model as exact numbers, in the form that a certificate states them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from gearchaos.model.parameters import MeshModel
from gearchaos.model.waveforms import SteppedStiffness, TwoLevelStiffness
from gearchaos.proof.balls import to_text

_ALL_KINDS = ("omega", "zeta", "J1", "J2", "q1", "q2", "beta1", "beta2")
_FULL = ("mu1", "mu2", "kappa1", "kappa2", "zeta_support1", "zeta_support2")


def exact_parameters(model: MeshModel) -> dict[str, Any]:
    """The parameters of a model as they stand in a certificate: every number a string, exactly the float it had.

    Returns
    -------
    dict
        ``kind``; the parameters of `docs/model.md` by name, those of the supports for ``full`` alone; ``eps`` and
        ``theta``, lists from harmonic 1 on; ``stiffness``, a dict with its ``form`` and values.
    """
    names = _ALL_KINDS + (_FULL if model.kind == "full" else ())
    return {
        "kind": model.kind,
        **{name: _text(getattr(model, name)) for name in names},
        "eps": _texts(model.error.amplitudes), "theta": _texts(model.error.phases),
        "stiffness": _stiffness(model),
    }


def _stiffness(model: MeshModel) -> dict[str, Any]:
    """The stiffness of a model as it stands in a certificate."""
    stiffness = model.stiffness
    if isinstance(stiffness, TwoLevelStiffness):
        values = {name: _text(getattr(stiffness, name)) for name in ("chi1", "chi2", "contact_ratio")}
        return {"form": "two-level", **values}
    if isinstance(stiffness, SteppedStiffness):
        return {"form": "stepped", "levels": _texts(stiffness.levels), "starts": _texts(stiffness.starts)}
    return {"form": "fourier", "c": _texts(stiffness.amplitudes), "alpha": _texts(stiffness.phases)}


def _text(value: float) -> str:
    """A float as an exact hexadecimal string."""
    return to_text(Fraction(value))


def _texts(values: tuple[float, ...]) -> list[str]:
    """Floats as exact hexadecimal strings."""
    return [_text(value) for value in values]
