"""One affine step for a block of lanes, and which of them it may be wrong for."""

from __future__ import annotations

from gearchaos.flow.jit import fma, kernel


@kernel
def load_lane(dims, steps, phys, piece, h, active, lanes, l):
    """Copy the step matrices of lane l's contact state into the active rows.

    Rows: E, constant, cosine and sine response as in `Steps`, then the bounds that tell a harmless step.
    """
    d = len(dims)
    q = lanes.point[l]
    sigma = lanes.sigma[l]
    contact = 0 if sigma == 0.0 else 1
    rows = d * d + d + 2 * steps.harmonics * d
    for i in range(rows):
        active[i, l] = steps.table[piece, contact, i, q]
    for i in range(d):
        active[d * d + i, l] = fma(sigma, steps.table[piece, contact, rows + i, q], active[d * d + i, l])
    eighth = h * h * 0.125
    for i in range(2):
        active[rows + i, l] = eighth * phys.bound0[i, q]
    for i in range(2, d):
        active[rows + i, l] = eighth * phys.bound[i, q]


@kernel
def load(dims, steps, phys, nodes, step, active, lanes, n):
    """Copy the step matrices of all lanes, at the start of a stretch of equal steps."""
    turn = 6.283185307179586
    shared = nodes.length.shape[1] == 1
    for l in range(n):
        q = lanes.point[l]
        h = turn * nodes.length[step, 0 if shared else q] / phys.omega[q]
        load_lane(dims, steps, phys, nodes.piece[step], h, active, lanes, l)


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
def affine(dims, steps, nodes, step, active, before, after, n):
    """after = E before + g, lane by lane; (d, n)."""
    d = len(dims)
    matvec(dims, active, before, after, n)
    for i in range(d):
        for l in range(n):
            after[i, l] += active[d * d + i, l]
        for j in range(steps.harmonics):
            c = nodes.cos[step, j, 0]
            s = nodes.sin[step, j, 0]
            row = d * d + d + j * d + i
            for l in range(n):
                total = fma(active[row, l], c, after[i, l])
                after[i, l] = fma(active[row + steps.harmonics * d, l], s, total)


@kernel
def suspects(dims, steps, active, sigma, before, after, flags, n):
    """Flag each lane whose contact state changed in the step, or may have changed and changed back.

    On a step of length h, z stays within h² max|z''| / 8 of its chord and z' within h² max|z'''| / 8 of its own; a
    lane with both gaps wider than the first, or a speed beyond the second and of one sign, crossed nothing unseen.
    """
    d = len(dims)
    rows = d * d + d + 2 * steps.harmonics * d
    for l in range(n):
        slack = 0.0
        for i in range(2, d):
            slack = fma(active[rows + i, l], abs(before[i, l]), slack)
        z0, z1 = before[0, l], after[0, l]
        v0, v1 = before[1, l], after[1, l]
        touching = sigma[l] != 0.0
        gap0 = fma(sigma[l], z0, -1.0) if touching else 1.0 - abs(z0)
        gap1 = fma(sigma[l], z1, -1.0) if touching else 1.0 - abs(z1)
        near = min(gap0, gap1) < active[rows, l] + slack
        slow = min(abs(v0), abs(v1)) < active[rows + 1, l] + slack
        turning = v0 * v1 <= 0.0
        flags[l] = 1.0 if (gap1 < 0.0) | (near & (turning | slow)) else 0.0


@kernel
def collect(flags, lane, n):
    """List the flagged lanes; returns how many."""
    count = 0
    for l in range(n):
        lane[count] = l
        count += 1 if flags[l] != 0.0 else 0
    return count
