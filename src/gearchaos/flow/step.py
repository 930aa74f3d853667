"""One affine step for a block of lanes, and which of them it may be wrong for."""

from __future__ import annotations

from gearchaos.flow.jit import fma, kernel

_TURN = 6.283185307179586


@kernel
def stale(loaded, sigma, lane, n):
    """List the lanes whose active matrices are not those of their contact state; returns how many."""
    count = 0
    for l in range(n):
        lane[count] = l
        count += 1 if loaded[l] != sigma[l] else 0
    return count


@kernel
def load(table, piece, point, sigma, active, loaded, lane, count):
    """Copy the step matrices of the contact states of the listed lanes into the active rows (rows, B)."""
    for m in range(count):
        l = lane[m]
        matrices = table[point[l], piece, int(sigma[l]) + 1]
        for i in range(len(matrices)):
            active[i, l] = matrices[i]
        loaded[l] = sigma[l]


@kernel
def load_bounds(dims, phys, nodes, step, point, bounds, n):
    """The bounds (d, n) that tell a harmless step: rows as `suspects` reads them, times h² / 8."""
    d = len(dims)
    omega = d * d + 2 * d + 2
    for l in range(n):
        q = point[l]
        h = _TURN * nodes.length[step, q if nodes.length.shape[1] > 1 else 0] / phys[q, omega]
        bounds[0, l] = h * h * 0.125 * phys[q, omega + 1]
        bounds[1, l] = h * h * 0.125 * phys[q, omega + 2]
        for i in range(2, d):
            bounds[i, l] = h * h * 0.125 * phys[q, omega + 3 + i]


@kernel
def matvec(dims, active, before, after, n):
    """after = E before, lane by lane; (d, n)."""
    d = len(dims)
    for i in range(d):
        for l in range(n):
            total = active[i * d, l] * before[0, l]
            for j in range(1, d):
                total = fma(active[i * d + j, l], before[j, l], total)
            after[i, l] = total


@kernel
def _affine_one_wave(dims, cos, sin, active, before, after, n):
    """after = E before + g for the usual forcing, one harmonic."""
    d = len(dims)
    g = d * d
    for i in range(d):
        for l in range(n):
            total = fma(active[g + d + i, l], cos, active[g + i, l])
            total = fma(active[g + 2 * d + i, l], sin, total)
            for j in range(d):
                total = fma(active[i * d + j, l], before[j, l], total)
            after[i, l] = total


@kernel
def affine(dims, kept, wave, active, before, after, n):
    """after = E before + g, lane by lane; (d, n). ``wave`` (2, harmonics, Q) holds cos and sin of jωτ here."""
    d = len(dims)
    if kept == 1:
        _affine_one_wave(dims, wave[0, 0, 0], wave[1, 0, 0], active, before, after, n)
        return
    matvec(dims, active, before, after, n)
    for i in range(d):
        for l in range(n):
            after[i, l] += active[d * d + i, l]
        for j in range(kept):
            row = d * d + d + j * d + i
            for l in range(n):
                total = fma(active[row, l], wave[0, j, 0], after[i, l])
                after[i, l] = fma(active[row + kept * d, l], wave[1, j, 0], total)


@kernel
def suspects(dims, bounds, sigma, before, after, flags, n):
    """Flag each lane whose contact state changed in the step, or may have changed and changed back.

    On a step of length h, z stays within h² max|z''| / 8 of its chord and z' within h² max|z'''| / 8 of its own; a
    lane with both gaps wider than the first, or a speed beyond the second and of one sign, crossed nothing unseen.
    """
    d = len(dims)
    for l in range(n):
        slack = 0.0
        for i in range(2, d):
            slack = fma(bounds[i, l], abs(before[i, l]), slack)
        z0, z1 = before[0, l], after[0, l]
        v0, v1 = before[1, l], after[1, l]
        touching = sigma[l] != 0.0
        gap0 = fma(sigma[l], z0, -1.0) if touching else 1.0 - abs(z0)
        gap1 = fma(sigma[l], z1, -1.0) if touching else 1.0 - abs(z1)
        near = min(gap0, gap1) < bounds[0, l] + slack
        slow = min(abs(v0), abs(v1)) < bounds[1, l] + slack
        turning = v0 * v1 <= 0.0
        flags[l] = 1.0 if (gap1 < 0.0) | (near & (turning | slow)) else 0.0


@kernel
def collect(flags, flag, lane, n):
    """List the lanes with this flag; returns how many."""
    count = 0
    for l in range(n):
        lane[count] = l
        count += 1 if flags[l] == flag else 0
    return count
