"""A model and points of its motion as exact numbers: parameters as a certificate states them, states as fractions."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model import SCALARS, STIFFNESS_FORMS, SUPPORTS, MeshModel
from gearchaos.proof.balls import from_text, to_text
from gearchaos.proof.verifier import STIFFNESS
from gearchaos.quantities import parse


def exact_parameters(model: MeshModel) -> dict[str, Any]:
    """The parameters of a model as they stand in a certificate: every number a string, exactly the float it had.

    Returns
    -------
    dict
        ``kind``; the parameters of `docs/model.md` by name, those of the supports for ``full`` alone; ``eps`` and
        ``theta``, lists from harmonic 1 on; ``stiffness``, a dict with its ``form`` and values.

    Raises
    ------
    InputError
        For a kind of stiffness that the program which checks certificates does not know.
    """
    if model.stiffness.form not in STIFFNESS:
        raise InputError("stiffness", f"must be of a form that can be verified: {', '.join(STIFFNESS)}",
                         model.stiffness.form, "Add it to proof/verifier.py, which reads certificates in its own way.")
    names = [n for n in SCALARS if model.kind == "full" or parse(n).family not in SUPPORTS]
    return {
        "kind": model.kind,
        **{name: _text(getattr(model, name)) for name in names},
        "eps": _texts(model.error.amplitudes), "theta": _texts(model.error.phases),
        "stiffness": {"form": model.stiffness.form, **{
            name: _texts(value) if isinstance(value, tuple) else _text(value)
            for name, value in model.stiffness.numbers().items()}},
    }


def exact_parts(stiffness: Mapping[str, Any]) -> list[tuple[Fraction, Fraction]]:
    """(start, χ) of each part of a stiffness of a certificate in which it is constant; none for a Fourier stiffness."""
    numbers = {name: [*map(from_text, value)] if isinstance(value, list) else from_text(value)
               for name, value in stiffness.items() if name != "form"}
    return [(Fraction(start), level) for start, level in STIFFNESS_FORMS[stiffness["form"]].parts(numbers)]


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


def lifted(points: np.ndarray, wanted: tuple[str, ...]) -> list[list[Fraction]]:
    """Points (n, d) in the coordinates ``wanted`` of some equations, as exact fractions.

    Which coordinates have no effect on z is decided on exact fractions here, elsewhere to rounding. So approximate
    points may lack coordinates of the exact equations: the rotation x2', or y1 and y2 instead of y. A missing rotation
    starts at 0, from where Newton's method finds it; y1 and y2 share y equally.

    Raises
    ------
    InputError
        If the points do not have as many coordinates as a state of the model.
    """
    known = _NAMES.get(points.shape[1], ())
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
