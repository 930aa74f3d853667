"""The arrays of systems with several one-sided contacts: points, steps and contact sets, work.

The coordinates w of a point with M contacts in K meshes obey

    w' = A w + f(τ) − Σ_m push_m (Σ_e side_e κ_e(τ) g_e + D_m rate_m·w [some e closed]),

the inner sum over the *closed* contacts e of mesh m, those with a positive gap function g_e = side_e row_m·w − o_e(τ).
The stiffness κ_e is constant, and the offset o_e a polynomial of degree 2, on each *piece* of the period. κ_e = 0 says
that contact e is absent. A *contact set* is an integer whose bit e is set where contact e is closed.

A contact that *releases* pushes only where its force κ_e (g_e + r side_e rate_m·w), r = D_m/κ_e, is positive too. This
is one more gap function, with the row row_m + r rate_m: that of one more contact, without a force of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.vector.arrays import PAGE, aligned, row_offsets
from gearchaos.flow.kernels.vector.constants import ORDER, WIDTH
from gearchaos.flow.kernels.vector.measure import Measure

OFFSETS = 3  # coefficients of an offset
TERMS = 2 * WIDTH  # places of a polynomial of degree `ORDER`
CLEAR = 4  # numbers of a mesh that `contact_sets.add_set` writes
MOST_UNROLLED = 8
"""Most coordinates for which kernels are compiled by themselves, 1.2 to 1.7 times faster: it took minutes for 24."""
LEAP = 2 * WIDTH
"""Most steps that are taken as one in contact, above `MOST_UNROLLED` coordinates, where steps take longer."""


class ContactPoints(NamedTuple):
    """P parameter points with d coordinates, H harmonics, M contacts in K meshes and N pieces of the period.

    U contacts release. For each of them there is one more row and one more contact, so that there are R = K + U rows
    and C = M + U contacts."""

    omega: np.ndarray  # (P,)
    A: np.ndarray  # (P, d, d)
    f0: np.ndarray  # (P, d)
    orders: np.ndarray  # (H,) int, of the harmonics
    f_cos: np.ndarray  # (P, H, d)
    f_sin: np.ndarray
    row: np.ndarray  # (R, d) displacement of a mesh from the coordinates
    unit: np.ndarray  # (R, d) row over its square: coordinates at which the displacement is 1; 0 behind the meshes
    rate: np.ndarray  # (R, d) its derivative
    push: np.ndarray  # (P, K, d)
    damping: np.ndarray  # (P, R) damping coefficient of the mesh force
    in_contact: np.ndarray  # (K,) int, 1 where the damping acts in contact alone, 0 where it is a part of A
    releasing: np.ndarray  # (U,) int, the contacts that release
    mesh: np.ndarray  # (C,) int, row of a contact: its mesh
    side: np.ndarray  # (C,) 1.0 on the front flank, -1.0 on the back flank
    sides: np.ndarray  # (V WIDTH,) the same, in V vectors
    edges: np.ndarray  # (P, N + 1) where pieces begin and end, fractions of the period
    stiffness: np.ndarray  # (P, N, C)
    offset: np.ndarray  # (P, N, C, OFFSETS) coefficients in the time since the piece began, in periods
    counts: np.ndarray  # (P, N) int, steps on each piece
    leap: np.ndarray  # (P, N) int, those of each of its leaps in contact, at most `LEAP`; 0 for no leaps
    sample: np.ndarray  # (N,) int, index of the sample at the start of a piece, or -1
    orthonormalise_every: np.ndarray  # (P,) int, steps between two orthonormalisations
    span: np.ndarray  # (P,) int, steps of free flight that are taken as one, a *leap*; 1 for no leaps
    rest: np.ndarray  # (P, d) in equilibrium with the mean stiffness: leaps in contact are taken near it
    velocity: np.ndarray  # (P, d) the measured velocity: velocity·w + velocity0 + its harmonics
    velocity0: np.ndarray  # (P,)
    velocity_cos: np.ndarray  # (P, H)
    velocity_sin: np.ndarray


class StepTables(NamedTuple):
    """The steps of points and the motions with the contact sets met so far, in S places with Q steps, E entries and F
    linear parts each.

    Behind the steps of a period stand its leaps of free flight, described as steps are. An entry is a step with a
    contact set; the linear part of its motion serves all steps of a piece. A leap in contact, of G in a period, is one
    with the contact set that rest has there.
    """

    point: np.ndarray  # (S,) int, the point whose steps are in a place; -1 for none
    steps: np.ndarray  # (S,) int
    piece: np.ndarray  # (S, Q) int, that of the period; those of leaps have other numbers
    duration: np.ndarray  # (S, Q) in units of τ
    phase: np.ndarray  # (S, Q) start as a fraction of the period
    sample: np.ndarray  # (S, Q) int, index of the sample at the start of the step, or -1
    present: np.ndarray  # (S, Q) int, the contacts that can close, one bit each
    anew: np.ndarray  # (S, Q) int, those that begin with the step, or whose offset jumps there
    pause: np.ndarray  # (S, Q) int, 1 where other contacts are present than before, some begin, or a sample is taken;
    #                    2 at other steps with which a leap begins
    leap: np.ndarray  # (S, Q) int, the leap that begins with a step, its row in free flight; -1 for none
    stiffness: np.ndarray  # (S, Q, C)
    offset: np.ndarray  # (S, Q, OFFSETS, V WIDTH) coefficients in s, from 0 to 1 on the step; C contacts in V vectors
    force: np.ndarray  # (S, Q, ORDER + 1, d)
    velocity: np.ndarray  # (S, Q, ORDER + 1) what of the measured velocity does not depend on the state
    entries: np.ndarray  # (S,) int, number in use
    step: np.ndarray  # (S, E) int, step and contact set of an entry
    closed: np.ndarray  # (S, E) int
    follows: np.ndarray  # (S, E) int, the entry of the next step with the same set; -1 where none is known
    first: np.ndarray  # (S, Q) int, the last entry made of a step; -1 for none
    chain: np.ndarray  # (S, E) int, the one made before; -1 for none
    linear: np.ndarray  # (S, E) int, the linear part
    shift: np.ndarray  # (S, E, V WIDTH) w after the step from 0; d coordinates in V vectors
    shifts: np.ndarray  # (S, E, G1, ORDER + 1, WIDTH) its polynomials on the step, see `contact_sets.values_at`
    shift_outputs: np.ndarray  # (S, E, R + 1, TERMS) those of the displacements and of the measured velocity
    clear: np.ndarray  # (S, E, R, CLEAR) see `contact_sets.add_set`
    parts: np.ndarray  # (S,) int, number of linear parts in use
    part_closed: np.ndarray  # (S, F) int, contact set of a linear part
    part_first: np.ndarray  # (S, 2 N) int, the last linear part made of a piece; -1 for none
    part_chain: np.ndarray  # (S, F) int, the one made before; -1 for none
    equations: np.ndarray  # (S, F, d, V WIDTH) A of w' = A w + ... with the closed contacts: column j in row j
    matrix: np.ndarray  # (S, F, d, V WIDTH) w after the step: column j in row j
    columns: np.ndarray  # (S, F, G, ORDER + 1, WIDTH) its polynomials on the step
    outputs: np.ndarray  # (S, F, R + 1, d, TERMS)
    bends: np.ndarray  # (S, F, R, d) bounds beside ``clear``
    leap_made: np.ndarray  # (S, F) int, 1 where there are the next three
    leap_matrix: np.ndarray  # (S, F, d, V WIDTH) ``matrix`` of a leap
    leap_rows: np.ndarray  # (S, F, K, d, LEAP) displacements after each of its steps, then 0
    leap_bends: np.ndarray  # (S, F, K, d) bounds beside ``leap_clear``
    leap_closed: np.ndarray  # (S, G) int, contact set
    leap_part: np.ndarray  # (S, G) int, linear part; -1 where the leap has not been made
    leap_shift: np.ndarray  # (S, G, V WIDTH)
    leap_first: np.ndarray  # (S, G, K, 2) lower and upper limit of the displacements at its start
    leap_clear: np.ndarray  # (S, G, K, 3, LEAP) after each step: displacements from 0, lower and upper limits, then ∞


class ContactWork(NamedTuple):
    """Memory for one trajectory that is being advanced."""

    w: np.ndarray  # (d,)
    after: np.ndarray  # (V WIDTH,), of d coordinates
    last: np.ndarray  # (V WIDTH,) the state at the end of a step
    tangents: np.ndarray  # (T, d)
    force: np.ndarray  # (V, ORDER + 1, WIDTH) forcing of the motion on a segment
    series: np.ndarray  # (V, ORDER + 1, WIDTH) polynomials of one
    power: np.ndarray  # (d, d) of the matrix of a step
    states: np.ndarray  # (2, d) of motions from rest and from 0
    values: np.ndarray  # (2 * G * WIDTH,) the columns at a point of the step, see `contact_sets.values_at`
    shifts: np.ndarray  # (2 * G1 * WIDTH,) the motion from 0 there
    outputs: np.ndarray  # (R + 1, TERMS) polynomials of the displacements of the meshes and of the measured velocity
    shifted: np.ndarray  # (TERMS,) a polynomial on the rest of a step
    gaps: np.ndarray  # (groups * (ORDER + 1) * WIDTH,) polynomials of the gaps, `WIDTH` contacts in a group
    exits: np.ndarray  # (groups * WIDTH,) first root of each
    rows: np.ndarray  # (K, rows * WIDTH) segments to be measured, one in each position: see `arrays.Rows`
    measures: np.ndarray  # (K, len(Measure) * WIDTH) those of the segments that were in each position
    progress: np.ndarray  # (4,) int: number of the trajectory, completed periods, whether it is loaded, segments kept


def new_tables(
    places: int, steps: int, entries: int, parts: int, leaps: int, pieces: int, d: int, m: int, k: int
) -> StepTables:
    """Empty tables with these numbers of places, steps, entries, linear parts, leaps in contact, pieces, coordinates,
    contacts and rows. Their memory is not touched before it serves; behind what does in a vector, 0 is written
    then, since what stands there by chance may be slow to compute with."""
    leaping, vector = parts if leaps else 0, vectors_of(d) * WIDTH

    def whole(*shape: int) -> np.ndarray:
        return np.empty((places, *shape), np.int64)

    def real(*shape: int) -> np.ndarray:
        return np.empty((places, *shape))

    def vectors(*shape: int) -> np.ndarray:
        return aligned(places, *shape, allocate=np.empty)

    return StepTables(
        np.full(places, -1), whole(), whole(steps), real(steps), real(steps), whole(steps), whole(steps), whole(steps),
        whole(steps), whole(steps), real(steps, m), vectors(steps, OFFSETS, vectors_of(m) * WIDTH),
        real(steps, ORDER + 1, d), real(steps, ORDER + 1),
        whole(), whole(entries), whole(entries), whole(entries), whole(steps), whole(entries), whole(entries),
        vectors(entries, vector), vectors(entries, vectors_of(d), ORDER + 1, WIDTH),
        vectors(entries, k + 1, TERMS), real(entries, k, CLEAR),
        whole(), whole(parts), whole(2 * pieces), whole(parts), vectors(parts, d, vector),
        vectors(parts, d, vector), vectors(parts, vectors_of(d * d), ORDER + 1, WIDTH),
        vectors(parts, k + 1, d, TERMS), real(parts, k, d),
        whole(leaping), vectors(leaping, d, vector), vectors(leaping, k, d, LEAP), real(leaping, k, d),
        whole(leaps), whole(leaps), vectors(leaps, vector), real(leaps, k, 2),
        vectors(leaps, k, 3, LEAP))


def vectors_of(count: int) -> int:
    """Vectors that so many numbers take."""
    return -(-count // WIDTH)


def new_contact_work(points: ContactPoints, vectors: int) -> ContactWork:
    """Memory for the motions of these points, with this number of tangent vectors."""
    (r, d), m, k = points.row.shape, len(points.mesh), len(points.in_contact)
    groups, vector = vectors_of(m), vectors_of(d) * WIDTH
    return ContactWork(
        np.zeros(d), aligned(vector), aligned(vector), np.zeros((vectors, d)),
        aligned(vectors_of(d), ORDER + 1, WIDTH), aligned(vectors_of(d), ORDER + 1, WIDTH),
        np.zeros((d, d)), np.zeros((2, d)), aligned(2 * vectors_of(d * d) * WIDTH), aligned(2 * vector),
        aligned(r + 1, TERMS), aligned(TERMS), aligned(groups * (ORDER + 1) * WIDTH), aligned(groups * WIDTH),
        aligned(k, row_offsets(2, "always").total * WIDTH, to=PAGE), aligned(k, len(Measure) * WIDTH),
        np.zeros(4, np.int64))
