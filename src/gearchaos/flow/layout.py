"""The plain arrays that kernels work on: what stands where.

Trajectories are *lanes*. `WIDTH` lanes whose points share their steps make a *chunk*; each chunk sits on one *seat* and
takes affine steps by its own clock, until it has had its periods and another chunk takes the seat. The few
lanes that may switch contact in a step are gathered from all seats and resolved `WIDTH` at a time, in a workspace that
is one flat array with constant offsets, so that the compiler sees straight vector code.
"""

from __future__ import annotations

from math import prod
from typing import NamedTuple

import numpy as np

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.simd import WIDTH

ORDER = 14
"""Degree of the Taylor polynomials on a step."""

STEP_ANGLE = 0.45
"""Longest step times the fastest rate of the motion, in radians: 0.45^15 / 15! is 5e-18."""

SEATS = 32
"""Chunks that one kernel call advances side by side; for d = 2 their step matrices fit the first-level cache."""

_SHIFT = WIDTH.bit_length() - 1
"""By which the number of a lane is shifted for that of its seat."""

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

    A, -b, f0, both levels of the stiffness and ω come first; coef, forcing, chi and the output series hold ORDER + 1
    coefficients. From ``phase`` on follow cos and sin of jωτ at the start of the piece for every harmonic, then the
    factors of both in the forcing of z'', then those in the stiffness; at last, for the measures, the factors that
    make the mesh force and x1'.
    """

    minus_b: int
    f0: int
    levels: int  # two rows: mean stiffness on both parts of the period
    omega: int  # mesh frequency
    coef: int  # of the state, (ORDER + 1) * d rows
    forcing: int  # of the harmonic forcing of z''
    chi: int  # of the stiffness, zero in free flight
    series: int  # of x1' and of the mesh force, for the measures
    start: int  # state or tangent vector at the start of the piece
    end: int  # and at its end
    pull: int  # what acts on z - σ: the first column of A, with the stiffness at the start of the piece in contact
    push: int  # constant forcing, with what A makes of σ
    h: int  # length of the piece in τ
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
    levels = d * d + 2 * d
    coef = levels + 3
    forcing = coef + n * d
    start = forcing + 4 * n
    h = start + 4 * d
    return Rows(
        d * d, d * d + d, levels, levels + 2, coef, forcing, forcing + n, forcing + 2 * n, start, start + d,
        start + 2 * d, start + 3 * d, h, h + 1, h + 2, h + 3, h + 4, h + 5, h + 7,
    )


@kernel
def output_row(d, h, k):
    """The row from which on stand the factor of the damping force, those of d coordinates and the constant in x1', then
    those of its cosines and of its sines."""
    return rows(d).phase + 2 * (max(h, k) + h + k)


@kernel
def kept_rows(d, h, k):
    """How many rows depend on a lane's point alone: those before ``coef``, and from the factors of waves on."""
    return rows(d).coef + 2 * (h + k) + d + 2 + 2 * h


class Nodes(NamedTuple):
    """The steps of all periods that points may have, one period after the other, T in all."""

    piece: np.ndarray  # (T,) of the step tables
    until: np.ndarray  # (T,) number in its period of the next step that is of another piece
    sample: np.ndarray  # (T,) number of the sample that is taken at the start, or -1
    values: np.ndarray  # (T, 2 + 2 * harmonics) see `LENGTH` and what follows


LENGTH, LEVEL, WAVES = range(3)
"""Columns of the values of nodes: share of the period, stiffness level 0 or 1, then cos and sin of jωτ at the start for
every harmonic."""


class Courses(NamedTuple):
    """How each of P points goes through its period."""

    node: np.ndarray  # (P,) its first node
    steps: np.ndarray  # (P,) how many it takes
    stride: np.ndarray  # (P,) how many of them between two orthonormalisations
    row: np.ndarray  # (P,) its first row of the step tables


class Points(NamedTuple):
    """All that is known of P parameter points beforehand."""

    phys: np.ndarray  # (P, total), see `Parameters`
    nodes: Nodes
    courses: Courses
    table: np.ndarray  # (all pieces of all points, 3, rows), see `tables.tabulate`
    h: int  # harmonics of the forcing
    k: int  # of the stiffness
    kept: int  # of the forcing that keep their own rows in the step tables


class Call(NamedTuple):
    """What is asked for L trajectories, in C chunks, and where it is put; see `Flowed`."""

    who: np.ndarray  # (C, WIDTH) the lanes of each chunk, those that go on longest first; -1 for none
    ends: np.ndarray  # (L,) mesh periods
    points: np.ndarray  # (L,)
    w: np.ndarray  # (d, L) at the start, and in the end
    v: np.ndarray  # (K, d, L) tangent vectors, as well
    growth: np.ndarray  # (periods, K, L)
    sections: np.ndarray  # (S, d, L)
    measures: np.ndarray  # (MEASURES, L)
    samples: np.ndarray  # (periods, samples, d + 1, L)
    status: np.ndarray  # (L,)


class Lanes(NamedTuple):
    """The trajectories on S seats, B = S * WIDTH lanes.

    The R vectors of a seat: d of the states at even ticks of the clock, d at odd ones, then for every slot d bounds
    that tell a harmless step, and the step matrices of the lanes' contact states as the step tables have them. There is
    a slot for every piece of the period, or one for all.
    """

    number: np.ndarray  # (B,) in the call
    point: np.ndarray  # (B,)
    node: np.ndarray  # (B,) first node
    row: np.ndarray  # (B,) first row of the step tables
    status: np.ndarray  # (B,)
    sigma: np.ndarray  # (B,) contact state
    of: np.ndarray  # (slots, B) the contact state that the matrices are of
    measures: np.ndarray  # (S * MEASURES * WIDTH,), none if nothing is measured
    kept: np.ndarray  # (S * rows * WIDTH,) what measuring needs of the lanes' points, see `kept_rows`
    vectors: np.ndarray  # (S * R * WIDTH,)
    tangents: np.ndarray  # (S, 2, K, d, WIDTH) tangent vectors at even and at odd ticks


class Seats(NamedTuple):
    """Where the chunk on each of S seats is; those that are taken come first. All seats step at the ticks of one
    clock."""

    live: np.ndarray  # (S,) lanes that still go on
    period: np.ndarray  # (S,)
    ahead: np.ndarray  # (S,) how far the number of its step in the period is ahead of the clock
    node: np.ndarray  # (S,) how far the number of its first lane's step among all nodes is ahead of the clock
    pause: np.ndarray  # (S,) the next step before which there is something to do
    due: np.ndarray  # (S,) the tick at which it is reached
    slot: np.ndarray  # (S,) of the step matrices
    at: np.ndarray  # (S,) where their vectors begin
    state: np.ndarray  # (3,) how many seats are taken, how many chunks have come so far, and the clock


class Chunk(NamedTuple):
    """What resolving a chunk of lanes works on."""

    ws: np.ndarray  # (rows * WIDTH,), see `Rows`
    lane: np.ndarray  # (SEATS * WIDTH + WIDTH,) the lanes that are listed
    flags: np.ndarray  # (SEATS,) the lanes to be resolved, a bit each
    found: np.ndarray  # (MEASURES * WIDTH,) their measures
    points: np.ndarray  # (WIDTH,) parameter points
    nodes: np.ndarray  # (WIDTH,)


_LINE, _PAGE = 64, 4096
"""Bytes in a line of the cache, and in a vector; and in a page of memory."""


def aligned(*shape: int, to: int = _LINE) -> np.ndarray:
    """An array of zeros that begins with a line of the cache, or a page: no vector then stands in two lines."""
    size, step = prod(shape), to // 8
    room = np.zeros(size + step)
    skip = -(room.ctypes.data // 8) % step
    return room[skip : skip + size].reshape(shape)


def chunk(d: int, h: int, k: int) -> Chunk:
    """An empty workspace for d coordinates, h forcing and k stiffness harmonics.

    It begins with a page. Where its address ended in 0x600 to 0x9c0, d = 2 took 6 to 8 % more time in worker threads,
    wherever all else stood: as the hot part of their stacks does, so that loads likely waited for stores that are none
    of theirs (4K aliasing).
    """
    total = output_row(d, h, k) + d + 2 + 2 * h
    return Chunk(
        aligned(total * WIDTH, to=_PAGE), np.zeros((SEATS + 1) * WIDTH, np.int64), np.zeros(SEATS, np.int64),
        aligned(MEASURES * WIDTH), np.zeros(WIDTH, np.int64), np.zeros(WIDTH, np.int64),
    )


def lanes(d: int, k: int, rows: int, slots: int, seats: int, kept: int) -> Lanes:
    """Lanes for so many seats, with d coordinates, k tangent vectors and step matrices of so many rows.

    Of each lane so many rows are ``kept`` for measuring, if anything is measured.
    """
    b = seats * WIDTH
    number, point, node, row, status = np.zeros((5, b), np.int64)
    return Lanes(
        number, point, node, row, status, aligned(b), aligned(slots, b), aligned(b * MEASURES if kept else 0),
        aligned(b * kept), aligned(b * (2 * d + slots * (d + rows))), aligned(seats, 2, k, d, WIDTH),
    )


def seats(count: int) -> Seats:
    """So many seats, all due for their first chunk."""
    live, period, ahead, node, pause, due, slot, at = np.zeros((8, count), np.int64)
    return Seats(live, period, ahead, node, pause, due, slot, at, np.array([count, 0, 0]))


@inlined
def seat_rows(lanes):
    """How many vectors stand on a seat, R."""
    return len(lanes.vectors) // len(lanes.number)


@inlined
def seat_of(lane):
    """The seat of a lane."""
    return lane >> _SHIFT


@inlined
def place_of(lane):
    """Which of the lanes on its seat a lane is."""
    return lane & (WIDTH - 1)


@inlined
def measure_of(lane, row):
    """Where a measure of a lane stands among those of all."""
    return (seat_of(lane) * MEASURES + row) * WIDTH + place_of(lane)
