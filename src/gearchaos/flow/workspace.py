"""What the lanes of a chunk need to run a step by Taylor polynomials: written to the workspace from their points and
nodes, or kept for a seat, whose lanes need the same again in the next step."""

from __future__ import annotations

from gearchaos.flow import layout as to
from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import WIDTH, kept_rows, output_row, parameters, rows
from gearchaos.flow.simd import load, peek, poke, splat, store

_TURN = 6.283185307179586


@inlined
def _columns(phys, own, column, count, ws, row, l):
    """Copy so many parameters of a point, from its ``own`` first one on, to as many rows."""
    for i in range(count):
        poke(ws, (row + i) * WIDTH + l, peek(phys, own + column + i))


@kernel
def fill_point(dims, phys, h, k, points, measuring, ws):
    """All that depends on the lanes' points alone; what only the measures need if ``measuring``."""
    d = len(dims)
    at, par, output = rows(d), parameters(d, h, k), output_row(d, h, k)
    factors = at.phase + 2 * max(h, k)
    for l in range(WIDTH):
        own = points[l] * par.total
        _columns(phys, own, par.A + d, d * d - d, ws, d, l)
        for i in range(1, d):
            poke(ws, (at.minus_b + i) * WIDTH + l, -peek(phys, own + par.b + i))
        _columns(phys, own, par.f0, d, ws, at.f0, l)
        _columns(phys, own, par.levels, 3, ws, at.levels, l)  # and ω
        for j in range(h):
            _columns(phys, own, par.f_cos + j, 1, ws, factors + 2 * j, l)
            _columns(phys, own, par.f_sin + j, 1, ws, factors + 2 * j + 1, l)
        for j in range(k):
            _columns(phys, own, par.chi_cos + j, 1, ws, factors + 2 * (h + j), l)
            _columns(phys, own, par.chi_sin + j, 1, ws, factors + 2 * (h + j) + 1, l)
        if measuring:
            _columns(phys, own, par.damping, d + 2, ws, output, l)
            _columns(phys, own, par.velocity_cos, 2 * h, ws, output + d + 2, l)


@kernel
def fill_step(dims, h, k, nodes, node, ws):
    """What depends on the step, too, of points that are filled."""
    at, width = rows(len(dims)), nodes.shape[1]
    for l in range(WIDTH):
        here = node[l] * width
        level = at.levels + int(peek(nodes, here + to.LEVEL))
        poke(ws, at.level * WIDTH + l, peek(ws, level * WIDTH + l))
        poke(ws, at.h * WIDTH + l, peek(nodes, here + to.LENGTH))
        _columns(nodes, here, to.WAVES, 2 * max(h, k), ws, at.phase, l)
    store(ws, at.h, splat(_TURN) * load(ws, at.h) / load(ws, at.omega))


@inlined
def keep(dims, h, k, ws, kept, seat):
    """Keep for a seat what of the workspace depends on its lanes' points alone."""
    at, tail = rows(len(dims)), output_row(len(dims), h, k) - 2 * (h + k)
    count = kept_rows(len(dims), h, k)
    for i in range(count):
        row = i if i < at.coef else tail + i - at.coef
        store(kept, seat * count + i, load(ws, row))


@inlined
def bring(dims, h, k, kept, seat, ws):
    """Write to the workspace what was kept for a seat."""
    at, tail = rows(len(dims)), output_row(len(dims), h, k) - 2 * (h + k)
    count = kept_rows(len(dims), h, k)
    for i in range(at.coef):
        store(ws, i, load(kept, seat * count + i))
    for i in range(count - at.coef):
        store(ws, tail + i, load(kept, seat * count + at.coef + i))
