"""The plain arrays that kernels work on: what stands where.

Lanes (trajectories) always run along the last axis, so that every loop over lanes is a loop over neighbours in memory.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

ORDER = 14
"""Degree of the Taylor polynomials on a step."""

STEP_ANGLE = 0.45
"""Longest step times the fastest rate of the motion, in radians: 0.45^15 / 15! is 5e-18."""

BLOCK = 256
"""Most lanes that one kernel call advances side by side; their step matrices fit the first-level cache."""

MAX_SWITCHES = 64
"""Contact switches within one step after which a lane gets the status CHATTER."""

DIVERGED_AT = 1e8
"""A coordinate beyond this many half backlashes counts as diverged."""

OK, DIVERGED, CHATTER = 0, 1, 2
"""Status of a lane."""

FRONT_TIME, BACK_TIME, Z, Z_SQUARE, Z_DOT_SQUARE, VELOCITY, VELOCITY_SQUARE = range(7)
Z_MAX, Z_MIN, Z_DOT_MAX, Z_DOT_MIN, FORCE_MAX, FORCE_MIN, SWITCHES = range(7, 14)
"""Rows of the measures: times and integrals over τ, then extremes, then the number of contact switches."""
MEASURES = 14


class Physics(NamedTuple):
    """The switched affine system with points last: A (d*d, P), b (d, P), f0 (d, P), f_cos and f_sin (H*d, P),
    levels (2, P), chi_cos and chi_sin (K, P), velocity (d, P), velocity0 (P,), velocity_cos and velocity_sin (H, P),
    damping (P,), omega (P,), and the rows that bound z'' and z''' (2, P) and (d, P); see `tables.bounds`."""

    A: np.ndarray
    b: np.ndarray
    f0: np.ndarray
    f_cos: np.ndarray
    f_sin: np.ndarray
    levels: np.ndarray
    chi_cos: np.ndarray
    chi_sin: np.ndarray
    velocity: np.ndarray
    velocity0: np.ndarray
    velocity_cos: np.ndarray
    velocity_sin: np.ndarray
    damping: np.ndarray
    omega: np.ndarray
    bound0: np.ndarray
    bound: np.ndarray


class Nodes(NamedTuple):
    """The N steps of a period: piece (N,) of the step tables, level (N,) 0 or 1, length (N, Q) in τ... of the mesh
    period, cos and sin (N, harmonics, Q) of jωτ at the start; Q = 1 where all points share their phases, else P."""

    piece: np.ndarray
    level: np.ndarray
    length: np.ndarray
    cos: np.ndarray
    sin: np.ndarray


class Steps(NamedTuple):
    """Affine steps tabulated: table (pieces, 2, rows, P), free and in contact.

    Rows: E (d*d), constant (d), cosine and sine response (2*H*d, or none where they are folded into the constant),
    response to the sign of the contact state (d).
    """

    table: np.ndarray
    harmonics: int


class Piece(NamedTuple):
    """Workspace for one piece of motion in one contact state, lanes last; filled by `taylor.gather`."""

    start: np.ndarray  # (d, B) state, or a tangent vector
    h: np.ndarray  # (B,) length in τ
    sigma: np.ndarray  # (B,) contact state -1, 0, 1
    level: np.ndarray  # (B,) mean stiffness, 0 in free flight
    A: np.ndarray  # (d*d, B)
    b: np.ndarray  # (d, B)
    f0: np.ndarray  # (d, B)
    f_cos: np.ndarray  # (H*d, B)
    f_sin: np.ndarray  # (H*d, B)
    chi_cos: np.ndarray  # (K, B)
    chi_sin: np.ndarray  # (K, B)
    angle: np.ndarray  # (B,) ωh
    cos: np.ndarray  # (ORDER + 1, harmonics, B) Taylor coefficients of cos jωτ
    sin: np.ndarray  # (ORDER + 1, harmonics, B)
    chi: np.ndarray  # (ORDER + 1, B) of the stiffness
    force: np.ndarray  # (ORDER + 1, B) of χ (z - σ)
    coef: np.ndarray  # (ORDER + 1, d, B) of the state


def piece_workspace(d: int, h: int, k: int, lanes: int = BLOCK) -> Piece:
    """An empty workspace for d coordinates, h forcing and k stiffness harmonics."""
    n = ORDER + 1
    shapes = dict(
        start=(d,), h=(), sigma=(), level=(), A=(d * d,), b=(d,), f0=(d,), f_cos=(h * d,), f_sin=(h * d,),
        chi_cos=(k,), chi_sin=(k,), angle=(), cos=(n, max(h, k)), sin=(n, max(h, k)), chi=(n,), force=(n,),
        coef=(n, d),
    )
    return Piece(**{name: np.zeros((*shape, lanes)) for name, shape in shapes.items()})
