"""Systems with several one-sided contacts: the arrays of their points, and the steps of a point.

The coordinates w of a point with M contacts in K meshes obey

    w' = A w + f(τ) − Σ_m push_m (Σ_e side_e κ_e(τ) g_e + D_m rate_m·w [some e closed]),

the inner sum over the *closed* contacts e of mesh m, those with a positive gap function g_e = side_e row_m·w − o_e(τ).
The stiffness κ_e is constant, and the offset o_e a polynomial of degree 2, on each *piece* of the period. κ_e = 0 says
that contact e is absent. A *contact set* is an integer whose bit e is set where contact e is closed. Between changes of
the set the motion is linear, so that the step matrices of a set serve until it changes; they are made when the set is
first met (`add_set`).
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.arrays import PAGE, aligned, row_offsets
from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.constants import ORDER, TWO_PI, WIDTH
from gearchaos.flow.kernels.measure import Measure

OFFSETS = 3  # coefficients of an offset
BUCKETS = 512  # of the table in which the matrices of a step and a contact set are found
_LEAST_PIECE = 1e-14  # shortest piece of a period, as a fraction of it, that gets steps


class ContactPoints(NamedTuple):
    """P parameter points with d coordinates, H harmonics, M contacts in K meshes and N pieces of the period."""

    omega: np.ndarray  # (P,)
    A: np.ndarray  # (P, d, d)
    f0: np.ndarray  # (P, d)
    orders: np.ndarray  # (H,) int, of the harmonics
    f_cos: np.ndarray  # (P, H, d)
    f_sin: np.ndarray
    integral: np.ndarray  # (d,) int, the coordinate of which one is the integral; -1 where it is of none
    row: np.ndarray  # (K, d) displacement of a mesh from the coordinates
    unit: np.ndarray  # (K, d) row over its square: coordinates at which the displacement is 1
    rate: np.ndarray  # (K, d) its derivative
    push: np.ndarray  # (P, K, d)
    damping: np.ndarray  # (P, K) damping coefficient of the mesh force
    in_contact: np.ndarray  # (K,) int, 1 where the damping acts in contact alone, 0 where it is a part of A
    mesh: np.ndarray  # (M,) int, mesh of a contact
    side: np.ndarray  # (M,) 1.0 on the front flank, -1.0 on the back flank
    edges: np.ndarray  # (P, N + 1) where pieces begin and end, fractions of the period
    stiffness: np.ndarray  # (P, N, M)
    offset: np.ndarray  # (P, N, M, OFFSETS) coefficients in the time since the piece began, in periods
    counts: np.ndarray  # (P, N) int, steps on each piece
    sample: np.ndarray  # (N,) int, index of the sample at the start of a piece, or -1
    orthonormalise_every: np.ndarray  # (P,) int, steps between two orthonormalisations
    velocity: np.ndarray  # (P, d) the measured velocity: velocity·w + velocity0 + its harmonics
    velocity0: np.ndarray  # (P,)
    velocity_cos: np.ndarray  # (P, H)
    velocity_sin: np.ndarray


class StepTables(NamedTuple):
    """The steps of points and the matrices of contact sets met so far, in S places with Q steps and E entries each."""

    point: np.ndarray  # (S,) int, the point whose steps are in a place; -1 for none
    steps: np.ndarray  # (S,) int
    duration: np.ndarray  # (S, Q) in units of τ
    phase: np.ndarray  # (S, Q) start as a fraction of the period
    piece: np.ndarray  # (S, Q) int, the piece that begins with the step; -1 where none does
    present: np.ndarray  # (S, Q) int, the contacts that can close, one bit each
    stiffness: np.ndarray  # (S, Q, M)
    offset: np.ndarray  # (S, Q, M, OFFSETS) coefficients in s, from 0 to 1 on the step
    force: np.ndarray  # (S, Q, ORDER + 1, d)
    entries: np.ndarray  # (S,) int, number in use
    step: np.ndarray  # (S, E) int, step and contact set of an entry
    closed: np.ndarray  # (S, E) int
    follows: np.ndarray  # (S, E) int, the entry of the next step with the same set; -1 where none is known
    chain: np.ndarray  # (S, E) int, the next entry of the same bucket; -1 for none
    bucket: np.ndarray  # (S, BUCKETS) int, its first entry
    matrix: np.ndarray  # (S, E, d + 1, d) w after the step: column j of E in row j, the constant in the last one
    deviation: np.ndarray  # (S, E, M + K (1 + d)) see `add_set`


class ContactWork(NamedTuple):
    """Memory for one trajectory that is being advanced."""

    w: np.ndarray  # (d,)
    after: np.ndarray  # (d,)
    tangents: np.ndarray  # (T, d)
    linear: np.ndarray  # (d, d) linear part of the motion on a segment
    force: np.ndarray  # (ORDER + 1, d) its forcing
    offset: np.ndarray  # (M, OFFSETS) offsets on it
    series: np.ndarray  # (d + 2, ORDER + 1, d) polynomials: of the state or the d + 1 columns; the last of a tangent
    displacement: np.ndarray  # (K, ORDER + 1) polynomials of the displacements of the meshes
    gaps: np.ndarray  # (groups * (ORDER + 1) * WIDTH,) polynomials of the gaps, `WIDTH` contacts in a group
    exits: np.ndarray  # (groups * WIDTH,) first root of each
    rows: np.ndarray  # (K, rows * WIDTH) segments to be measured, one in each position: see `arrays.Rows`
    measures: np.ndarray  # (K, len(Measure) * WIDTH) those of the segments that were in each position
    progress: np.ndarray  # (4,) int: number of the trajectory, completed periods, whether it is loaded, segments kept


def new_tables(places: int, steps: int, entries: int, d: int, m: int, k: int) -> StepTables:
    """Empty tables with these numbers of places, steps, entries, coordinates, contacts and meshes."""
    def whole(*shape: int) -> np.ndarray:
        return np.full((places, *shape), -1, np.int64)

    def real(*shape: int) -> np.ndarray:
        return np.zeros((places, *shape))

    return StepTables(
        whole(), whole(), real(steps), real(steps), whole(steps), whole(steps), real(steps, m), real(steps, m, OFFSETS),
        real(steps, ORDER + 1, d), whole(), whole(entries), whole(entries), whole(entries), whole(entries),
        whole(BUCKETS), real(entries, d + 1, d), real(entries, m + k * (1 + d)))


def new_contact_work(d: int, m: int, k: int, vectors: int) -> ContactWork:
    """Memory for d coordinates, m contacts, k meshes and this number of tangent vectors."""
    groups = -(-m // WIDTH)
    return ContactWork(
        np.zeros(d), np.zeros(d), np.zeros((vectors, d)), np.zeros((d, d)), np.zeros((ORDER + 1, d)),
        np.zeros((m, OFFSETS)), np.zeros((d + 2, ORDER + 1, d)),
        np.zeros((k, ORDER + 1)), aligned(groups * (ORDER + 1) * WIDTH),
        aligned(groups * WIDTH), aligned(k, row_offsets(2, "always").total * WIDTH, to=PAGE),
        aligned(k, len(Measure) * WIDTH), np.zeros(4, np.int64))


@subroutine
def add_harmonics(dims, points, p, phase, duration, force):
    """Add the polynomials of the harmonic forcing on a step to ``force`` (ORDER + 1, d)."""
    for h in range(len(points.orders)):
        angle, turn = TWO_PI * phase * points.orders[h], points.orders[h] * points.omega[p] * duration
        for i in range(len(dims)):
            a, b = points.f_cos[p, h, i], points.f_sin[p, h, i]
            if a == 0.0 and b == 0.0:
                continue
            value, slope = a * cos(angle) + b * sin(angle), b * cos(angle) - a * sin(angle)
            for k in range(ORDER + 1):
                force[k, i] += value
                value, slope = slope * (turn / (k + 1)), -value * (turn / (k + 1))


@subroutine
def fill_steps(dims, points, p, tables, place):
    """Write the steps of point p to a place of the tables, without matrices."""
    tables.point[place], tables.entries[place] = p, 0
    tables.bucket[place, :] = -1
    step = 0
    for n in range(len(points.sample)):
        length, count = points.edges[p, n + 1] - points.edges[p, n], points.counts[p, n]
        if length <= _LEAST_PIECE:
            continue
        share = length / count
        for i in range(count):
            tables.piece[place, step] = n if i == 0 else -1
            tables.phase[place, step] = points.edges[p, n] + i * share
            tables.duration[place, step] = TWO_PI / points.omega[p] * share
            present = 0
            for e in range(len(points.mesh)):
                tables.stiffness[place, step, e] = points.stiffness[p, n, e]
                present |= (1 << e) if points.stiffness[p, n, e] != 0.0 else 0
                o, begin = points.offset[p, n, e], i * share
                tables.offset[place, step, e, 0] = o[0] + begin * (o[1] + begin * o[2])
                tables.offset[place, step, e, 1] = (o[1] + 2.0 * begin * o[2]) * share
                tables.offset[place, step, e, 2] = o[2] * share * share
            tables.present[place, step] = present
            force = tables.force[place, step]
            force[:] = 0.0
            for j in range(len(dims)):
                force[0, j] = points.f0[p, j]
            add_harmonics(dims, points, p, tables.phase[place, step], tables.duration[place, step], force)
            step += 1
    tables.steps[place] = step


@inlined
def mesh_closed(points, closed, m):
    """Whether a contact of mesh m is closed."""
    found = False
    for e in range(len(points.mesh)):
        found |= points.mesh[e] == m and closed >> e & 1 == 1
    return found


@subroutine
def set_equations(dims, points, p, stiffness, closed, offset, force, work):
    """Write the linear part (d, d) and the forcing (ORDER + 1, d) of the motion with a contact set to the workspace.

    ``stiffness`` (M,), ``offset`` (M, OFFSETS) and ``force`` (ORDER + 1, d) are those on the segment.
    """
    d, linear = len(dims), work.linear
    for i in range(d):
        for j in range(d):
            linear[i, j] = points.A[p, i, j]
    for k in range(ORDER + 1):
        for i in range(d):
            work.force[k, i] = force[k, i]
    for e in range(len(points.mesh)):
        if closed >> e & 1:
            m, side = points.mesh[e], points.side[e]
            for i in range(d):
                push = points.push[p, m, i] * stiffness[e]
                for j in range(d):
                    linear[i, j] -= push * points.row[m, j]
                for k in range(OFFSETS):
                    work.force[k, i] += side * push * offset[e, k]
    for m in range(len(points.row)):
        if points.in_contact[m] and mesh_closed(points, closed, m):
            for i in range(d):
                for j in range(d):
                    linear[i, j] -= points.push[p, m, i] * points.damping[p, m] * points.rate[m, j]


@subroutine
def linear_series(dims, integral, duration, linear, force, forced, series):
    """Taylor polynomials (ORDER + 1, d) in s of w' = linear w + force, from ``series[0]`` on, without forcing unless
    ``forced``; ``integral`` (d,) is that of `ContactPoints`."""
    d = len(dims)
    for k in range(ORDER):
        scale = duration / (k + 1)
        for i in range(d):
            total = 0.0
            if integral[i] >= 0:
                total = series[k, integral[i]]
            else:
                total = force[k, i] if forced else 0.0
                for j in range(d):
                    total += linear[i, j] * series[k, j]
            series[k + 1, i] = total * scale


@subroutine
def value_at(series, i, s):
    """The polynomial of coordinate i at s."""
    total = series[ORDER, i]
    for k in range(ORDER - 1, -1, -1):
        total = total * s + series[k, i]
    return total


@inlined
def _chord_deviation(dims, row, series, start, forced, opposite):
    """Upper bound of the distance from its chord, on a step, of row·w of a motion from the state ``start``.

    ``series`` are the polynomials of the d + 1 columns, the last of which counts if ``forced``; ``opposite`` is
    subtracted from coefficient 2.
    """
    d, total = len(dims), 0.0
    for k in range(2, ORDER + 1):
        value = -opposite if k == 2 else 0.0
        for i in range(d):
            motion = series[d, k, i] if forced else 0.0
            for j in range(d):
                motion += start[j] * series[j, k, i]
            value += row[i] * motion
        total += k * (k - 1) / 8.0 * abs(value)
    return total


@subroutine
def add_set(dims, points, p, tables, place, step, closed, work):
    """Make the step matrices of a contact set, and return their entry.

    ``deviation`` has how far a gap can be from its chord, in parts that add up: for each contact, in a motion that
    begins on its boundary in the direction ``unit`` of its mesh; for each mesh, in motions without forcing that begin
    with a displacement of 1 in that direction, and with a coordinate of 1.
    """
    d, contacts, meshes = len(dims), len(points.mesh), len(points.row)
    if tables.entries[place] == tables.step.shape[1]:
        tables.entries[place] = 0
        tables.bucket[place, :] = -1
    entry = tables.entries[place]
    tables.entries[place] = entry + 1
    tables.step[place, entry], tables.closed[place, entry], tables.follows[place, entry] = step, closed, -1
    number = (closed * 31 + step) % BUCKETS
    tables.chain[place, entry], tables.bucket[place, number] = tables.bucket[place, number], entry
    set_equations(dims, points, p, tables.stiffness[place, step], closed, tables.offset[place, step],
                  tables.force[place, step], work)
    for j in range(d + 1):
        series = work.series[j]
        for i in range(d):
            series[0, i] = 1.0 if i == j else 0.0
        linear_series(dims, points.integral, tables.duration[place, step], work.linear, work.force, j == d, series)
        for i in range(d):
            tables.matrix[place, entry, j, i] = value_at(series, i, 1.0)
    start, deviation, series = work.after, tables.deviation[place, entry], work.series
    for e in range(contacts):
        offset, side, m = tables.offset[place, step, e], points.side[e], points.mesh[e]
        for i in range(d):
            start[i] = side * offset[0] * points.unit[m, i]
        deviation[e] = _chord_deviation(dims, points.row[m], series, start, True, side * offset[2])
    for m in range(meshes):
        first = contacts + m * (1 + d)
        deviation[first] = _chord_deviation(dims, points.row[m], series, points.unit[m], False, 0.0)
        for j in range(d):
            for i in range(d):
                start[i] = 1.0 if i == j else 0.0
            deviation[first + 1 + j] = _chord_deviation(dims, points.row[m], series, start, False, 0.0)
    return entry


@inlined
def find_set(dims, points, p, tables, place, step, closed, work):
    """The entry of a step and a contact set, made if it is not there."""
    entry = tables.bucket[place, (closed * 31 + step) % BUCKETS]
    while entry >= 0:
        if tables.step[place, entry] == step and tables.closed[place, entry] == closed:
            return entry
        entry = tables.chain[place, entry]
    return add_set(dims, points, p, tables, place, step, closed, work)
