"""Constants used by the kernels and by the functions that call them."""

from __future__ import annotations

from enum import IntEnum

TWO_PI = 6.283185307179586

WIDTH = 8
"""Lanes in a pack, and floats in a vector: one register with 512 bits, two with 256."""

ORDER = 14
"""Degree of the Taylor polynomials on a step."""

SLOTS = 32
"""Most packs that one kernel call advances at the same time; for d = 2 their step matrices fit the first-level
cache."""

MAX_SWITCHES = 64
"""Contact switches within one step after which a lane gets the status `CHATTER`."""

DIVERGED_AT = 1e8
"""A trajectory has diverged when |z| or |z'| reaches this value, in half backlashes (per unit of τ)."""

OK, DIVERGED, CHATTER = 0, 1, 2
"""Status of a trajectory."""


class Measure(IntEnum):
    """Rows of the array of measures (`len(Measure)`, L), each accumulated along the motion.

    Times are in units of τ; z in half backlashes; the mesh force 2ζz' + χ f(z) as in (2.5) of the paper.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> from gearchaos.flow import Measure
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = problem.flow.advance(problem.w, periods=10, measured=True)
    >>> result.measures[Measure.SWITCHES].tolist()
    [18.0]
    """

    FRONT_TIME = 0
    """Time in contact with the front flank, z > 1."""
    BACK_TIME = 1
    """Time in contact with the back flank, z < -1."""
    Z = 2
    """Integral of z."""
    Z_SQUARE = 3
    """Integral of z²."""
    Z_DOT_SQUARE = 4
    """Integral of z'²."""
    VELOCITY = 5
    """Integral of x1' (of z' in the single model)."""
    VELOCITY_SQUARE = 6
    """Integral of the square of that velocity."""
    Z_MAX = 7
    """Largest z; the next three are the smallest z and the largest and smallest z'."""
    Z_MIN = 8
    Z_DOT_MAX = 9
    Z_DOT_MIN = 10
    FORCE_MAX = 11
    """Largest mesh force."""
    FORCE_MIN = 12
    SWITCHES = 13
    """Number of contact switches."""
