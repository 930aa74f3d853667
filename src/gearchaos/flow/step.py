"""One affine step of the chunk on a seat, and which of its lanes it may be wrong for.

Whatever stands beyond the last lane of a chunk is carried along for nothing.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import WAVES, place_of, seat_of
from gearchaos.flow.simd import WIDTH, bits, least, load, peek, poke, select, splat, store, vabs, vfma

_TURN = 6.283185307179586

_PLACES = np.array([[i for i in range(WIDTH) if mask >> i & 1] + [0] * (WIDTH - mask.bit_count())
                    for mask in range(1 << WIDTH)], dtype=np.int8)
"""The places of the lanes in a mask, by its bits."""

_COUNTS = np.array([mask.bit_count() for mask in range(1 << WIDTH)], dtype=np.int8)


@inlined
def listed(mask, seat, lane, count):
    """Add the lanes of a seat that are in a mask to the ``count`` listed ones; returns how many there are then.

    Whole chunks are written, so that the list must have room for one more.
    """
    for i in range(WIDTH):
        poke(lane, count + i, seat * WIDTH + _PLACES[mask, i])
    return count + _COUNTS[mask]


@inlined
def _load_matrices(dims, kept, matrices, vectors, first):
    """Copy the step matrices of one lane to every `WIDTH`-th of the vectors' floats from ``first`` on."""
    d = len(dims)
    if kept == 1:  # the usual forcing: the compiler knows how many there are, and writes no loop
        for i in range(d * d + 3 * d):
            poke(vectors, first + i * WIDTH, matrices[i])
    else:
        for i in range(len(matrices)):
            poke(vectors, first + i * WIDTH, matrices[i])


@inlined
def update(dims, points, lanes, seats, lane, count, tick):
    """Have the listed lanes use the step matrices of their contact states."""
    for m in range(count):
        l = peek(lane, m)
        seat, sigma = seat_of(l), peek(lanes.sigma, l)
        own = peek(seats.slot, seat) * len(lanes.number) + l
        if peek(lanes.of, own) != sigma:
            poke(lanes.of, own, sigma)
            piece = peek(points.nodes.piece, peek(lanes.node, l) + peek(seats.ahead, seat) + tick)
            first = (peek(seats.at, seat) + len(dims)) * WIDTH + place_of(l)
            matrices = points.table[peek(lanes.row, l) + piece, int(sigma) + 1]
            _load_matrices(dims, points.kept, matrices, lanes.vectors, first)


@kernel
def load_bounds(dims, values, omega, length, vectors, first):
    """Write the bounds of one lane that tell a harmless step, times h² / 8, to every `WIDTH`-th of the vectors' floats
    from ``first`` on, in the order in which `suspects` reads them.

    ``values`` are its point's parameters, ω in column ``omega``; ``length`` is the step's share of the period.
    """
    h = _TURN * length / values[omega]
    for i in range(2):
        vectors[first + i * WIDTH] = h * h * 0.125 * values[omega + 1 + i]
    for i in range(2, len(dims)):
        vectors[first + i * WIDTH] = h * h * 0.125 * values[omega + 3 + i]


@inlined
def _affine_one_wave(dims, cos, sin, vectors, at, before, after):
    """after = E before + g for the usual forcing, one harmonic."""
    d = len(dims)
    cos, sin = splat(cos), splat(sin)
    for i in range(d):
        total = vfma(load(vectors, at + d * d + d + i), cos, load(vectors, at + d * d + i))
        total = vfma(load(vectors, at + d * d + 2 * d + i), sin, total)
        for j in range(d):
            total = vfma(load(vectors, at + i * d + j), load(vectors, before + j), total)
        store(vectors, after + i, total)


@inlined
def affine(dims, kept, values, node, vectors, at, before, after):
    """after = E before + g, lane by lane, with the waves of a node.

    E and g begin at ``at`` in the vectors, the states at ``before`` and ``after``.
    """
    if kept == 1:
        _affine_one_wave(dims, values[node, WAVES], values[node, WAVES + 1], vectors, at, before, after)
        return
    d = len(dims)
    for i in range(d):
        total = load(vectors, at + d * d + i)
        for j in range(kept):
            cos = at + d * d + d + j * d + i
            total = vfma(load(vectors, cos), splat(values[node, WAVES + 2 * j]), total)
            total = vfma(load(vectors, cos + kept * d), splat(values[node, WAVES + 2 * j + 1]), total)
        for j in range(d):
            total = vfma(load(vectors, at + i * d + j), load(vectors, before + j), total)
        store(vectors, after + i, total)


@inlined
def matvec(dims, vectors, at, tangents, before, after):
    """after = E before for one tangent vector of each lane."""
    d = len(dims)
    for i in range(d):
        total = load(vectors, at + i * d) * load(tangents, before)
        for j in range(1, d):
            total = vfma(load(vectors, at + i * d + j), load(tangents, before + j), total)
        store(tangents, after + i, total)


@inlined
def suspects(dims, sigma, seat, vectors, at, before, after):
    """The lanes, as bits, whose contact state changed in the step, or may have changed and changed back.

    On a step of length h, z stays within h² max|z''| / 8 of its chord and z' within h² max|z'''| / 8 of its own; a
    lane with both gaps wider than the first, or a speed beyond the second and of one sign, crossed nothing unseen.
    The bounds begin at ``at``.
    """
    zero, one, slack = splat(0.0), splat(1.0), splat(0.0)
    for i in range(2, len(dims)):
        slack = vfma(load(vectors, at + i), vabs(load(vectors, before + i)), slack)
    z0, z1 = load(vectors, before), load(vectors, after)
    v0, v1 = load(vectors, before + 1), load(vectors, after + 1)
    state = load(sigma, seat)
    free = state == zero
    gap0 = select(free, one - vabs(z0), vfma(state, z0, splat(-1.0)))
    gap1 = select(free, one - vabs(z1), vfma(state, z1, splat(-1.0)))
    near = least(gap0, gap1) < load(vectors, at) + slack
    slow = least(vabs(v0), vabs(v1)) < load(vectors, at + 1) + slack
    turning = v0 * v1 <= zero
    return bits((gap1 < zero) | (near & (turning | slow)))


@inlined
def collect(flags, seats, lane):
    """List the live lanes that are flagged, bit by bit; returns how many."""
    count = 0
    for seat in range(seats.state[0]):
        live = (1 << peek(seats.live, seat)) - 1
        count = listed(peek(flags, seat) & live, seat, lane, count)
    return count
