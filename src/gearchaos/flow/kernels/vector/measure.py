"""The measures that are accumulated along a motion, one row each, and how those of its parts combine.

`measures.py` computes them.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Self

import numpy as np

FIRST: dict[np.ufunc, float] = {np.add: 0.0, np.maximum: -np.inf, np.minimum: np.inf}
"""The value with which each way of combining begins."""


class Measure(IntEnum):
    """Rows of the array of measures (`len(Measure)`, L), each accumulated along the motion.

    A system of K meshes has K times as many: those of the first mesh, then those of the next.

    Times are in units of τ; z in half backlashes; the mesh force 2ζz' + χ f(z) as in (2.5) of the paper. The integrals
    of z are about a value that it has on the motion, so that the difference of which its variance is made is not one of
    large numbers.

    Attributes
    ----------
    combined : ufunc
        What makes the measure of a motion from those of its parts; `gearchaos.flow.combine_measures` does.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> from gearchaos.flow import Measure
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = problem.flow.advance(problem.w, periods=10, measured=True)
    >>> result.measures[Measure.SWITCHES].tolist()
    [18.0]
    """

    combined: np.ufunc

    def __new__(cls, row: int, combined: np.ufunc) -> Self:
        self = int.__new__(cls, row)
        self._value_, self.combined = row, combined
        return self

    FRONT_TIME = 0, np.add
    """Time in contact with the front flank, z > 1."""
    BACK_TIME = 1, np.add
    """Time in contact with the back flank, z < -1."""
    Z = 2, np.add
    """Integral of z − `Z_REFERENCE`."""
    Z_SQUARE = 3, np.add
    """Integral of (z − `Z_REFERENCE`)²."""
    Z_DOT_SQUARE = 4, np.add
    """Integral of z'²."""
    VELOCITY = 5, np.add
    """Integral of x1' (of z' in the single model)."""
    VELOCITY_SQUARE = 6, np.add
    """Integral of the square of that velocity."""
    Z_MAX = 7, np.maximum
    """Largest z; the next three are the smallest z and the largest and smallest z'."""
    Z_MIN = 8, np.minimum
    Z_DOT_MAX = 9, np.maximum
    Z_DOT_MIN = 10, np.minimum
    FORCE_MAX = 11, np.maximum
    """Largest mesh force."""
    FORCE_MIN = 12, np.minimum
    SWITCHES = 13, np.add
    """Number of contact switches."""
    Z_REFERENCE = 14, np.maximum
    """z at the start of the motion."""
    FORCE = 15, np.add
    """Integral of the mesh force; this and the next two for systems of several contacts alone, else 0."""
    FORCE_SQUARE = 16, np.add
    """Integral of its square."""
    CONTACT_FORCE = 17, np.add
    """Integral of the mesh force, positive where it presses the flanks together: the impulse of all contacts."""
