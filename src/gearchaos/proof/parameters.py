"""A model and points of its motion as exact numbers: parameters as a certificate states them, states as fractions."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.parameters import MeshModel
from gearchaos.model.waveforms import SteppedStiffness, TwoLevelStiffness
from gearchaos.proof.balls import to_text

if TYPE_CHECKING:
    from gearchaos.proof.equations import MeshEquations

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


_NAMES = {
    2: ("z", "z_dot"), 3: ("z", "z_dot", "x2_dot"), 4: ("z", "z_dot", "y", "y_dot"),
    5: ("z", "z_dot", "x2_dot", "y", "y_dot"), 6: ("z", "z_dot", "y1", "y1_dot", "y2", "y2_dot"),
    7: ("z", "z_dot", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"),
}
"""The coordinates of a state by their number."""


def lifted(points: np.ndarray, equations: MeshEquations) -> list[list[Fraction]]:
    """Points (n, d) in the coordinates of the equations, as exact fractions.

    Which coordinates have no effect on z is decided on exact fractions here, elsewhere to rounding. So approximate
    points may lack coordinates of the exact equations: the rotation x2', or y1 and y2 instead of y. A missing rotation
    starts at 0, from where Newton's method finds it; y1 and y2 share y equally.

    Raises
    ------
    InputError
        If the points do not have as many coordinates as a state of the model.
    """
    known, wanted = _NAMES.get(points.shape[1], ()), equations.names
    if known == wanted:
        return [[Fraction(v) for v in row] for row in points.tolist()]
    if not known or known[-1].startswith("y") != wanted[-1].startswith("y"):
        raise InputError("points", f"must have the {len(wanted)} coordinates {', '.join(wanted)}", points.shape)

    def value(name: str, at: dict[str, float]) -> Fraction:
        if name in at:
            return Fraction(at[name])
        if name in ("y", "y_dot"):
            return Fraction(at[f"y1{name[1:]}"]) - Fraction(at[f"y2{name[1:]}"])
        if name[0] == "y":
            return Fraction(at[f"y{name[2:]}"]) / (2 if name[1] == "1" else -2)
        return Fraction(0)

    return [[value(name, dict(zip(known, row, strict=True))) for name in wanted] for row in points.tolist()]
