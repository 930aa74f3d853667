"""One affine step for a block of lanes, a chunk at a time, and which of them it may be wrong for.

Rows of a block are a whole number of chunks long; whatever stands beyond the last lane is carried along for nothing.
"""

from __future__ import annotations

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.simd import WIDTH, any_lane, least, load, select, splat, store, vabs, vfma

_TURN = 6.283185307179586


@kernel
def chunks(n):
    """How many chunks hold n lanes."""
    return (n + WIDTH - 1) // WIDTH


@kernel
def stale(loaded, sigma, lane, n):
    """List the lanes whose active matrices are not those of their contact state; returns how many."""
    count = 0
    for l in range(n):
        lane[count] = l
        count += 1 if loaded[l] != sigma[l] else 0
    return count


@kernel
def load_matrices(table, piece, point, sigma, active, loaded, lane, count):
    """Copy the step matrices of the contact states of the listed lanes into the active rows (rows, B)."""
    for m in range(count):
        l = lane[m]
        matrices = table[point[l], piece, int(sigma[l]) + 1]
        for i in range(len(matrices)):
            active[i, l] = matrices[i]
        loaded[l] = sigma[l]


@kernel
def load_bounds(dims, phys, nodes, step, point, bounds, n):
    """The bounds (d, B) that tell a harmless step: rows as `suspects` reads them, times h² / 8."""
    d = len(dims)
    omega = d * d + 2 * d + 2
    for l in range(n):
        q = point[l]
        h = _TURN * nodes.length[step, q if nodes.length.shape[1] > 1 else 0] / phys[q, omega]
        bounds[0, l] = h * h * 0.125 * phys[q, omega + 1]
        bounds[1, l] = h * h * 0.125 * phys[q, omega + 2]
        for i in range(2, d):
            bounds[i, l] = h * h * 0.125 * phys[q, omega + 3 + i]


@inlined
def matvec(dims, active, before, after, n):
    """after = E before, lane by lane; (d, B)."""
    d, row = len(dims), before.shape[1] // WIDTH
    for c in range(chunks(n)):
        for i in range(d):
            total = load(active, i * d * row + c) * load(before, c)
            for j in range(1, d):
                total = vfma(load(active, (i * d + j) * row + c), load(before, j * row + c), total)
            store(after, i * row + c, total)


@inlined
def _affine_one_wave(dims, cos, sin, active, before, after, n):
    """after = E before + g for the usual forcing, one harmonic."""
    d, row = len(dims), before.shape[1] // WIDTH
    cos, sin = splat(cos), splat(sin)
    for c in range(chunks(n)):
        for i in range(d):
            total = vfma(load(active, (d * d + d + i) * row + c), cos, load(active, (d * d + i) * row + c))
            total = vfma(load(active, (d * d + 2 * d + i) * row + c), sin, total)
            for j in range(d):
                total = vfma(load(active, (i * d + j) * row + c), load(before, j * row + c), total)
            store(after, i * row + c, total)


@inlined
def affine(dims, kept, wave, active, before, after, n):
    """after = E before + g, lane by lane; (d, B). ``wave`` (2, harmonics, Q) holds cos and sin of jωτ here."""
    if kept == 1:
        _affine_one_wave(dims, wave[0, 0, 0], wave[1, 0, 0], active, before, after, n)
        return
    d, row = len(dims), before.shape[1] // WIDTH
    for c in range(chunks(n)):
        for i in range(d):
            total = load(active, (d * d + i) * row + c)
            for j in range(kept):
                cos = d * d + d + j * d + i
                total = vfma(load(active, cos * row + c), splat(wave[0, j, 0]), total)
                total = vfma(load(active, (cos + kept * d) * row + c), splat(wave[1, j, 0]), total)
            for j in range(d):
                total = vfma(load(active, (i * d + j) * row + c), load(before, j * row + c), total)
            store(after, i * row + c, total)


@inlined
def suspects(dims, bounds, sigma, before, after, flags, n):
    """Flag each lane whose contact state changed in the step, or may have changed and changed back.

    On a step of length h, z stays within h² max|z''| / 8 of its chord and z' within h² max|z'''| / 8 of its own; a
    lane with both gaps wider than the first, or a speed beyond the second and of one sign, crossed nothing unseen.
    """
    row, zero, one = before.shape[1] // WIDTH, splat(0.0), splat(1.0)
    for c in range(chunks(n)):
        slack = zero
        for i in range(2, len(dims)):
            slack = vfma(load(bounds, i * row + c), vabs(load(before, i * row + c)), slack)
        z0, z1, v0, v1 = load(before, c), load(after, c), load(before, row + c), load(after, row + c)
        state = load(sigma, c)
        free = state == zero
        gap0 = select(free, one - vabs(z0), vfma(state, z0, splat(-1.0)))
        gap1 = select(free, one - vabs(z1), vfma(state, z1, splat(-1.0)))
        near = least(gap0, gap1) < load(bounds, c) + slack
        slow = least(vabs(v0), vabs(v1)) < load(bounds, row + c) + slack
        turning = v0 * v1 <= zero
        store(flags, c, select((gap1 < zero) | (near & (turning | slow)), one, zero))


@inlined
def collect(flags, flag, lane, n):
    """List the lanes with this flag; returns how many."""
    count = 0
    for c in range(chunks(n)):
        if any_lane(load(flags, c) == splat(flag)):
            for l in range(c * WIDTH, min((c + 1) * WIDTH, n)):
                lane[count] = l
                count += 1 if flags[l] == flag else 0
    return count
