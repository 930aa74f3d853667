"""Points in the coordinates of the exact equations.

Which coordinates have no effect on z is decided on exact fractions here, elsewhere to rounding. So approximate points
may lack coordinates that the exact equations have: the rotation x2', or y1 and y2 instead of y.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from gearchaos.errors import InputError
from gearchaos.proof.equations import MeshEquations

_NAMES = {
    2: ("z", "z_dot"), 3: ("z", "z_dot", "x2_dot"), 4: ("z", "z_dot", "y", "y_dot"),
    5: ("z", "z_dot", "x2_dot", "y", "y_dot"), 6: ("z", "z_dot", "y1", "y1_dot", "y2", "y2_dot"),
    7: ("z", "z_dot", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"),
}
"""The coordinates of a state by their number."""


def lifted(points: np.ndarray, equations: MeshEquations) -> list[list[Fraction]]:
    """Points (n, d) in the coordinates of the equations, as exact fractions.

    A rotation x2' that is missing starts at 0, from where Newton's method finds it; y1 and y2 share y equally.

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
    return [[_value(name, dict(zip(known, row, strict=True))) for name in wanted] for row in points.tolist()]


def _value(name: str, at: dict[str, float]) -> Fraction:
    """A coordinate of a state whose coordinates may be others."""
    if name in at:
        return Fraction(at[name])
    if name in ("y", "y_dot"):
        return Fraction(at[f"y1{name[1:]}"]) - Fraction(at[f"y2{name[1:]}"])
    if name[0] == "y":
        return Fraction(at[f"y{name[2:]}"]) / (2 if name[1] == "1" else -2)
    return Fraction(0)
