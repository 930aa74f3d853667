"""The steps in which contact may change: piece by piece, from switch to switch, by Taylor polynomials."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.contact import NEVER, first_exit
from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import BLOCK, CHATTER, MAX_SWITCHES, SWITCHES, Piece, piece_workspace
from gearchaos.flow.measure import accumulate, output_series
from gearchaos.flow.taylor import advance_waves, evaluate, expand, stiffness, waves


class Lanes(NamedTuple):
    """The trajectories of one block, lanes last: before and after a step."""

    point: np.ndarray  # (B,) parameter point of each lane
    sigma: np.ndarray  # (B,) contact state
    w: np.ndarray  # (2, d, B) state before and after the step, by parity
    v: np.ndarray  # (2, K, d, B) tangent vectors
    status: np.ndarray  # (B,) int64
    measures: np.ndarray  # (MEASURES, B), or (MEASURES, 0) when nothing is measured


class Resolver(NamedTuple):
    """Scratch space of `resolve`."""

    piece: Piece
    lane: np.ndarray  # (B,) lanes still under way
    count: np.ndarray  # (1,) how many
    points: np.ndarray  # (B,) their parameter points
    rest: np.ndarray  # (B,) share of the step left, by lane
    share: np.ndarray  # (B,) share of the piece done
    beyond: np.ndarray  # (B,) contact state after it
    cos: np.ndarray  # (harmonics, B) by lane
    sin: np.ndarray
    out: np.ndarray  # (d, B)
    series: np.ndarray  # (4, ORDER + 1)


def resolver_workspace(d: int, h: int, k: int) -> Resolver:
    """Empty scratch space for d coordinates, h forcing and k stiffness harmonics."""
    piece = piece_workspace(d, h, k)
    row = np.zeros
    return Resolver(
        piece, row(BLOCK, np.int64), row(1, np.int64), row(BLOCK, np.int64), row(BLOCK), row(BLOCK), row(BLOCK),
        row((max(h, k), BLOCK)), row((max(h, k), BLOCK)), row((d, BLOCK)), row((4, piece.coef.shape[0])),
    )


@kernel
def gather(phys, p, points, n):
    """Copy the parameters of the points (n,) side by side into the workspace."""
    for l in range(n):
        q = points[l]
        for i in range(phys.A.shape[0]):
            p.A[i, l] = phys.A[i, q]
        for i in range(phys.b.shape[0]):
            p.b[i, l] = phys.b[i, q]
            p.f0[i, l] = phys.f0[i, q]
        for i in range(phys.f_cos.shape[0]):
            p.f_cos[i, l] = phys.f_cos[i, q]
            p.f_sin[i, l] = phys.f_sin[i, q]
        for i in range(phys.chi_cos.shape[0]):
            p.chi_cos[i, l] = phys.chi_cos[i, q]
            p.chi_sin[i, l] = phys.chi_sin[i, q]


@kernel
def _begin(r, lanes, nodes, step, now, harmonics):
    """Copy the state at the start of the step to where the pieces work on it."""
    shared = nodes.length.shape[1] == 1
    for m in range(r.count[0]):
        l = r.lane[m]
        q = 0 if shared else lanes.point[l]
        r.rest[l] = 1.0
        for j in range(harmonics):
            r.cos[j, l] = nodes.cos[step, j, q]
            r.sin[j, l] = nodes.sin[step, j, q]
        for i in range(lanes.w.shape[1]):
            lanes.w[1 - now, i, l] = lanes.w[now, i, l]
            for c in range(lanes.v.shape[1]):
                lanes.v[1 - now, c, i, l] = lanes.v[now, c, i, l]


@kernel
def _load(phys, nodes, step, lanes, r, new, harmonics):
    """Fill the workspace for the lanes under way: parameters, phases, contact state and length of the piece."""
    p = r.piece
    shared = nodes.length.shape[1] == 1
    n = r.count[0]
    for m in range(n):
        r.points[m] = lanes.point[r.lane[m]]
    gather(phys, p, r.points, n)
    for m in range(n):
        l = r.lane[m]
        q = lanes.point[l]
        turn = nodes.length[step, 0 if shared else q] * r.rest[l]
        p.angle[m] = 2 * np.pi * turn
        p.h[m] = p.angle[m] / phys.omega[q]
        p.sigma[m] = lanes.sigma[l]
        p.level[m] = phys.levels[nodes.level[step], q] if p.sigma[m] != 0.0 else 0.0
        for i in range(lanes.w.shape[1]):
            p.start[i, m] = lanes.w[new, i, l]
        for j in range(harmonics):
            p.cos[0, j, m] = r.cos[j, l]
            p.sin[0, j, m] = r.sin[j, l]


@kernel
def _measure(dims, phys, lanes, r):
    p = r.piece
    for m in range(r.count[0]):
        output_series(dims, phys, p, r.points, r.series, m)
        share = r.share[m]
        accumulate(r.series, p.sigma[m], p.h[m] * share, share, lanes.measures, r.lane[m])
        if r.beyond[m] != p.sigma[m]:
            lanes.measures[SWITCHES, r.lane[m]] += 1


@kernel
def _find_exits(r):
    p = r.piece
    for m in range(r.count[0]):
        share, r.beyond[m] = first_exit(p.coef, m, p.sigma[m])
        r.share[m] = 1.0 if share == NEVER else share


@kernel
def _carry_tangents(dims, lanes, r, new):
    """Move the tangent vectors over the piece; f is continuous, so nothing happens to them at a switch."""
    p = r.piece
    n = r.count[0]
    for c in range(lanes.v.shape[1]):
        for i in range(len(dims)):
            for m in range(n):
                p.start[i, m] = lanes.v[new, c, i, r.lane[m]]
        expand(dims, p, 0.0, n)
        evaluate(dims, p, r.share, r.out, n)
        for i in range(len(dims)):
            for m in range(n):
                lanes.v[new, c, i, r.lane[m]] = r.out[i, m]


@kernel
def _switch(lanes, r, new, harmonics):
    """Put switching lanes on the boundary in their new state and keep them; let the others go."""
    p = r.piece
    kept = 0
    for m in range(r.count[0]):
        l = r.lane[m]
        if r.beyond[m] != p.sigma[m]:
            boundary = p.sigma[m] if p.sigma[m] != 0.0 else r.beyond[m]
            lanes.w[new, 0, l] = boundary
            lanes.sigma[l] = r.beyond[m]
            r.rest[l] *= 1.0 - r.share[m]
            for j in range(harmonics):
                r.cos[j, l] = p.cos[0, j, m]
                r.sin[j, l] = p.sin[0, j, m]
            r.lane[kept] = l
            kept += 1
    r.count[0] = kept


@kernel
def resolve(dims, phys, nodes, step, lanes, r, now, measuring):
    """Advance the lanes listed in ``r`` over one step exactly, whatever contact does in it."""
    harmonics = nodes.cos.shape[1]
    new = 1 - now
    p = r.piece
    _begin(r, lanes, nodes, step, now, harmonics)
    for _ in range(MAX_SWITCHES):
        if r.count[0] == 0:
            return
        n = r.count[0]
        _load(phys, nodes, step, lanes, r, new, harmonics)
        waves(p, harmonics, n)
        stiffness(p, n)
        expand(dims, p, 1.0, n)
        _find_exits(r)
        if measuring:
            _measure(dims, phys, lanes, r)
        evaluate(dims, p, r.share, r.out, n)
        for i in range(len(dims)):
            for m in range(n):
                lanes.w[new, i, r.lane[m]] = r.out[i, m]
        _carry_tangents(dims, lanes, r, new)
        advance_waves(p, r.share, harmonics, n)
        _switch(lanes, r, new, harmonics)
    for m in range(r.count[0]):
        lanes.status[r.lane[m]] = CHATTER
