"""The plain arrays that kernels work on: what stands where.

Trajectories are *lanes*. A block of lanes takes affine steps, `WIDTH` of them side by side; the few lanes that may
switch contact in a step are resolved in chunks of `WIDTH`, whose workspace is one flat array with constant offsets, so
that the compiler sees straight vector code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.jit import kernel
from gearchaos.flow.simd import WIDTH

ORDER = 14
"""Degree of the Taylor polynomials on a step."""

STEP_ANGLE = 0.45
"""Longest step times the fastest rate of the motion, in radians: 0.45^15 / 15! is 5e-18."""

BLOCK = 256
"""Most lanes that one kernel call advances side by side; their step matrices fit the first-level cache."""

MAX_SWITCHES = 64
"""Contact switches within one step after which a lane gets the status CHATTER."""

DIVERGED_AT = 1e8
"""|z| or |z'| beyond this many half backlashes counts as diverged."""

OK, DIVERGED, CHATTER = 0, 1, 2
"""Status of a lane."""

FRONT_TIME, BACK_TIME, Z, Z_SQUARE, Z_DOT_SQUARE, VELOCITY, VELOCITY_SQUARE = range(7)
Z_MAX, Z_MIN, Z_DOT_MAX, Z_DOT_MIN, FORCE_MAX, FORCE_MIN, SWITCHES = range(7, 14)
"""Rows of the measures: times and integrals over τ, then extremes, then the number of contact switches."""
MEASURES = 14


class Parameters(NamedTuple):
    """Columns of the parameter array (P, total): where each array of `SwitchedAffine` stands, flattened."""

    A: int
    b: int
    f0: int
    levels: int
    omega: int
    bound0: int
    bound: int
    damping: int
    velocity: int
    velocity0: int
    f_cos: int
    f_sin: int
    chi_cos: int
    chi_sin: int
    velocity_cos: int
    velocity_sin: int
    total: int


@kernel
def parameters(d, h, k):
    """Columns for d coordinates, h forcing and k stiffness harmonics."""
    b = d * d
    levels = b + 2 * d
    bound0 = levels + 3
    damping = bound0 + 2 + d
    f_cos = damping + 2 + d
    chi_cos = f_cos + 2 * h
    v_cos = chi_cos + 2 * k
    return Parameters(
        0, b, b + d, levels, levels + 2, bound0, bound0 + 2, damping, damping + 1, damping + 1 + d, f_cos, f_cos + h,
        chi_cos, chi_cos + k, v_cos, v_cos + h, v_cos + 2 * h,
    )


class Rows(NamedTuple):
    """Rows of the flat chunk workspace: row r of lane l stands at r * WIDTH + l.

    A, -b and f0 come first; coef, forcing, chi and the output series hold ORDER + 1 coefficients. From
    ``phase`` on follow cos and sin of jωτ at the start of the piece for every harmonic, then the factors of both in
    the forcing of z'', then those in the stiffness.
    """

    minus_b: int
    f0: int
    coef: int  # of the state, (ORDER + 1) * d rows
    forcing: int  # of the harmonic forcing of z''
    chi: int  # of the stiffness, zero in free flight
    series: int  # of x1' and of the mesh force, for the measures
    start: int  # state or tangent vector at the start of the piece
    end: int  # and at its end
    pull: int  # what acts on z - σ: the first column of A, with the stiffness at the start of the piece in contact
    push: int  # constant forcing, with what A makes of σ
    h: int  # length of the piece in τ
    omega: int  # mesh frequency
    level: int  # mean stiffness on the step
    sigma: int  # contact state
    beyond: int  # contact state after the piece
    share: int  # share of the piece done
    gain: int  # two rows: factors of a cosine and a sine
    phase: int


@kernel
def rows(d):
    """Rows of the workspace for d coordinates."""
    n = ORDER + 1
    coef = d * d + 2 * d
    forcing = coef + n * d
    start = forcing + 4 * n
    h = start + 4 * d
    return Rows(
        d * d, d * d + d, coef, forcing, forcing + n, forcing + 2 * n, start, start + d, start + 2 * d, start + 3 * d,
        h, h + 1, h + 2, h + 3, h + 4, h + 5, h + 6, h + 8,
    )


class Nodes(NamedTuple):
    """The N steps of a period: piece (N,) of the step tables, level (N,) 0 or 1 of the stiffness, length (N, Q) as a
    share of the period, wave (N, 2, harmonics, Q) cos and sin of jωτ at the start; Q = 1 where all points share their
    phases, else P."""

    piece: np.ndarray
    level: np.ndarray
    length: np.ndarray
    wave: np.ndarray


def row_length(lanes: int) -> int:
    """Floats in the rows of a block of so many lanes, B: whole chunks, and an odd number of them.

    Rows that stand a power of two apart all fall into the same few sets of the first-level cache, and drive each other
    out of it.
    """
    return (-(-lanes // WIDTH) | 1) * WIDTH


class Lanes(NamedTuple):
    """The trajectories of one block, lanes last; states before and after a step by parity."""

    point: np.ndarray  # (B,) parameter point
    sigma: np.ndarray  # (B,) contact state
    w: np.ndarray  # (2, d, B)
    v: np.ndarray  # (2, K, d, B) tangent vectors
    status: np.ndarray  # (B,)
    measures: np.ndarray  # (MEASURES, B)


class Chunk(NamedTuple):
    """What resolving a chunk of lanes works on."""

    ws: np.ndarray  # (rows * WIDTH,), see `Rows`
    lane: np.ndarray  # (BLOCK + WIDTH,) the lanes to resolve, then those of one chunk
    found: np.ndarray  # (MEASURES * WIDTH,) measures of the piece
    points: np.ndarray  # (WIDTH,) parameter points


def chunk(d: int, h: int, k: int) -> Chunk:
    """An empty workspace for d coordinates, h forcing and k stiffness harmonics."""
    total = rows(d).phase + 2 * (max(h, k) + h + k)
    return Chunk(
        np.zeros(total * WIDTH), np.zeros(BLOCK + WIDTH, np.int64), np.zeros(MEASURES * WIDTH),
        np.zeros(WIDTH, np.int64),
    )
