"""The affine step: its tables, from Taylor polynomials; the step of the pack in a slot; and the test for lanes in which
contact may have changed.

Positions without an active lane are computed too, and their results ignored.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, kernel, subroutine
from gearchaos.flow.kernels.vector.arrays import COS_SIN, damps_in_contact, position_of, releases, rows, slot_of
from gearchaos.flow.kernels.vector.constants import ORDER, TWO_PI, WIDTH
from gearchaos.flow.kernels.vector.simd import (
    bits,
    broadcast,
    load,
    load_scalar,
    select,
    smaller,
    store,
    store_affine,
    store_bytes,
    store_scalar,
    vabs,
    vfma,
)
from gearchaos.flow.kernels.vector.taylor import (
    add_sinusoid,
    end_state,
    excitation_series,
    fill_level,
    fill_point,
    fill_step,
    set_amplitudes,
    state_series,
)

_POSITIONS = np.array([sum(i << 8 * n for n, i in enumerate(i for i in range(WIDTH) if mask >> i & 1))
                       for mask in range(1 << WIDTH)])
"""Positions of the set bits of each mask (256,), one in each byte, the first in the lowest."""

_COUNTS = np.array([mask.bit_count() for mask in range(1 << WIDTH)], dtype=np.int8)
"""Number of set bits of each mask (256,)."""


@inlined
def append_lanes(mask, slot, listed, count):
    """Append the lanes of a slot whose bits are set to the ``count`` listed ones; returns the new count. It always
    writes `WIDTH` numbers, so ``listed`` must have room for them."""
    store_bytes(listed, count, _POSITIONS[mask], slot * WIDTH)
    return count + _COUNTS[mask]


@inlined
def _load_matrices(dims, tabulated, matrices, vectors, first):
    """Copy the step matrices of one lane (rows,) to every `WIDTH`-th float of the vectors from index ``first`` on."""
    d = len(dims)
    if tabulated == 1:  # one harmonic, the usual forcing: a constant number of rows, so that the loop is unrolled
        for i in range(d * d + 3 * d):
            store_scalar(vectors, first + i * WIDTH, matrices[i])
    else:
        for i in range(len(matrices)):
            store_scalar(vectors, first + i * WIDTH, matrices[i])


@inlined
def update_matrices(dims, points, lanes, slots, listed, count, tick):
    """Load step matrices for those of the listed lanes whose contact state has changed since theirs were loaded."""
    for m in range(count):
        lane = load_scalar(listed, m)
        slot, sigma = slot_of(lane), load_scalar(lanes.sigma, lane)
        index = load_scalar(slots.matrix_buffer, slot) * len(lanes.trajectory) + lane
        if load_scalar(lanes.matrix_sigma, index) != sigma:
            store_scalar(lanes.matrix_sigma, index, sigma)
            step = load_scalar(lanes.first_step, lane) + load_scalar(slots.step_minus_tick, slot) + tick
            entry = load_scalar(points.steps.entry, step)
            first = (load_scalar(slots.matrices, slot) + len(dims)) * WIDTH + position_of(lane)
            matrices = points.table[load_scalar(lanes.first_entry, lane) + entry, int(sigma) + 1]
            _load_matrices(dims, points.tabulated, matrices, lanes.vectors, first)


@subroutine
def load_bounds(dims, values, columns, length, vectors, first):
    """Write the bounds of one lane that `find_suspects` uses to every `WIDTH`-th float of the vectors from index
    ``first`` on: those of |z''| and |z'''| and the factors of |w_i|, i >= 2 (see `system.bounds`), all times h² / 8.

    ``values`` (total,) are the parameters of the lane's point, ``columns`` their `ParameterColumns`, ``length`` the
    length of the step as a fraction of the period.
    """
    h = TWO_PI * length / values[columns.omega]
    for i in range(2):
        vectors[first + i * WIDTH] = h * h * 0.125 * values[columns.bound0 + i]
    for i in range(2, len(dims)):
        vectors[first + i * WIDTH] = h * h * 0.125 * values[columns.bound + i]


@inlined
def affine_step(dims, tabulated, values, step, vectors, matrices, before, after):
    """after = E before + g for all lanes of a slot, in the order of the step tables.

    E and g begin at vector ``matrices``, the states at vectors ``before`` and ``after``. cos jωτ and sin jωτ are in row
    ``step`` of ``values``, `Steps.values`; ``tabulated`` is `Points.tabulated`.
    """
    if tabulated == 1:
        cos, sin = values[step, COS_SIN], values[step, COS_SIN + 1]
        store_affine(dims, vectors, matrices, before, after, broadcast(cos), broadcast(sin))
        return
    d = len(dims)
    for i in range(d):
        total = load(vectors, matrices + d * d + i)
        for j in range(tabulated):
            cos = matrices + d * d + d + j * d + i
            total = vfma(load(vectors, cos), broadcast(values[step, COS_SIN + 2 * j]), total)
            total = vfma(load(vectors, cos + tabulated * d), broadcast(values[step, COS_SIN + 2 * j + 1]), total)
        for j in range(d):
            total = vfma(load(vectors, matrices + i * d + j), load(vectors, before + j), total)
        store(vectors, after + i, total)


@inlined
def find_suspects(dims, sigma, slot, vectors, bounds, before, after):
    """The lanes of a slot, one bit each, whose contact state changed in the step or may have changed and changed back.

    On a step of duration h, z differs from its chord by at most h² max|z''| / 8, and z' from its chord by at most h²
    max|z'''| / 8. A lane stayed in its contact state if its gap, the distance to the nearest boundary, is larger than
    the first bound at both ends of the step, or if z' has the same sign and is larger than the second bound at both
    ends. The second test needs a continuous z'', so that it is left out where the damping acts in contact alone. Where
    contact ends with the force, all lanes beyond the boundary are suspects.
    ``bounds`` is the first vector that `load_bounds` wrote, ``sigma`` is `Lanes.sigma`.
    """
    zero, one, slack = broadcast(0.0), broadcast(1.0), broadcast(0.0)
    for i in range(2, len(dims)):
        slack = vfma(load(vectors, bounds + i), vabs(load(vectors, before + i)), slack)
    z0, z1 = load(vectors, before), load(vectors, after)
    v0, v1 = load(vectors, before + 1), load(vectors, after + 1)
    state = load(sigma, slot)
    free = state == zero
    gap0 = select(free, one - vabs(z0), vfma(state, z0, broadcast(-1.0)))
    gap1 = select(free, one - vabs(z1), vfma(state, z1, broadcast(-1.0)))
    near = smaller(gap0, gap1) < load(vectors, bounds) + slack
    if releases(dims):
        return bits((gap1 < zero) | near | (zero < vabs(state)))
    if damps_in_contact(dims):
        return bits((gap1 < zero) | near)
    slow = smaller(vabs(v0), vabs(v1)) < load(vectors, bounds + 1) + slack
    turning = v0 * v1 <= zero
    return bits((gap1 < zero) | (near & (turning | slow)))


@inlined
def list_suspects(suspects, slots, listed):
    """List the active lanes whose bits are set in ``suspects`` (SLOTS,); returns how many there are."""
    count = 0
    for slot in range(slots.counters[0]):
        active = (1 << load_scalar(slots.active, slot)) - 1
        count = append_lanes(load_scalar(suspects, slot) & active, slot, listed, count)
    return count


@subroutine
def _clear(ws, first, count):
    """Set ``count`` rows to zero."""
    for i in range(first * WIDTH, (first + count) * WIDTH):
        ws[i] = 0.0


@subroutine
def _respond(dims, ws, forced, varying, table, points, entry, state, first, stride):
    """Advance the pack from the start rows over the step; write coordinate i at its end to ``table[point, entry, state,
    first + i * stride]``. ``points`` (WIDTH,) are the indices of the lanes' points."""
    end = rows(dims).end
    state_series(dims, ws, forced, varying)
    end_state(dims, ws)
    for l in range(WIDTH):
        for i in range(len(dims)):
            table[points[l], entry, state, first + i * stride] = ws[(end + i) * WIDTH + l]


@subroutine
def _tabulate_step(dims, parameters, harmonics, values, entry, state, tabulated, work, table):
    """Compute all rows of one entry in one contact state, for the pack of points ``work.points`` at ``work.steps``."""
    d, varying = len(dims), harmonics.stiffness > 0
    at, ws = rows(dims), work.rows
    fill_point(dims, parameters, harmonics, work.points, False, ws)
    fill_level(dims, parameters, harmonics, values, work.points, work.steps, ws)
    fill_step(dims, harmonics, values, work.steps, ws)
    for l in range(WIDTH):
        ws[at.sigma * WIDTH + l] = state - 1.0
        ws[at.end_fraction * WIDTH + l] = 1.0
    excitation_series(dims, harmonics, ws)
    _clear(ws, at.start, d)
    if tabulated > 0:
        _clear(ws, at.forcing, ORDER + 1)
    _respond(dims, ws, True, varying, table, work.points, entry, state, d * d, 1)
    for j in range(d):
        _clear(ws, at.start, d)
        for l in range(WIDTH):
            ws[(at.start + j) * WIDTH + l] = 1.0
        _respond(dims, ws, False, varying, table, work.points, entry, state, j, d)
    if tabulated > 0:
        _tabulate_responses(dims, parameters, harmonics, entry, state, work, table)


@subroutine
def _tabulate_responses(dims, parameters, harmonics, entry, state, work, table):
    """Compute the responses, from rest, to the forcing harmonics as factors of cos jωτ and sin jωτ at the start of the
    step: to the forcing at phase 0, and to the forcing a quarter period later."""
    d = len(dims)
    at, ws, column, cos_sin = rows(dims), work.rows, harmonics.columns, harmonics.rows.cos_sin
    _clear(ws, at.start, d)
    _clear(ws, at.constant, d)
    _clear(ws, at.sigma, 1)
    for j in range(harmonics.forcing):
        angle = load(ws, at.duration) * load(ws, at.omega) * broadcast(j + 1.0)
        for l in range(WIDTH):
            ws[cos_sin * WIDTH + l] = 1.0
            ws[(cos_sin + 1) * WIDTH + l] = 0.0
        for quarter in range(2):
            cos, sin = column.f_cos + j, column.f_sin + j
            if quarter == 0:
                set_amplitudes(parameters, work.points, cos, sin, 1.0, ws, at.amplitudes)
            else:
                set_amplitudes(parameters, work.points, sin, cos, -1.0, ws, at.amplitudes)
            add_sinusoid(ws, at.forcing, load(ws, at.amplitudes), load(ws, at.amplitudes + 1), cos_sin, angle, True)
            first = d * d + d + (quarter * harmonics.forcing + j) * d
            _respond(dims, ws, True, False, table, work.points, entry, state, first, 1)


@kernel
def tabulate_steps(dims, parameters, harmonics, values, first, first_of_entry, tabulated, work, table):
    """Compute the step tables (P, entries, 3, rows) of the points of one grid, see `step_tables.tabulate`, `WIDTH`
    points at a time.

    ``first`` (P,) is the index of each point's first step in the `Steps.values` of the grid, ``first_of_entry``
    (entries,) the one within the grid of the first step with each entry; ``tabulated`` is `Points.tabulated`.
    """
    for base in range(0, table.shape[0], WIDTH):
        for l in range(WIDTH):
            work.points[l] = min(base + l, table.shape[0] - 1)
        for entry in range(table.shape[1]):
            for l in range(WIDTH):
                work.steps[l] = first[work.points[l]] + first_of_entry[entry]
            for state in range(3):
                _tabulate_step(dims, parameters, harmonics, values, entry, state, tabulated, work, table)
