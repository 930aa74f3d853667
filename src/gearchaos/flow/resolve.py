"""The steps in which contact may change: piece by piece, from switch to switch, by Taylor polynomials."""

from __future__ import annotations

from gearchaos.flow.contact import LOST, find_exits
from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import BLOCK, CHATTER, MAX_SWITCHES, WIDTH, parameters, rows
from gearchaos.flow.measure import measure_piece, output_series, read_measures, write_measures
from gearchaos.flow.simd import any_lane, load, select, splat, store
from gearchaos.flow.taylor import drive, expand, finish, turn_waves

_TURN = 6.283185307179586


@kernel
def fill(dims, phys, h, k, nodes, step, points, ws):
    """All that the lanes of the chunk need, at their points, to run the whole step, but start and contact state."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    level = par.levels + nodes.level[step]
    for l in range(WIDTH):
        values = phys[points[l]]
        for i in range(d, d * d):
            ws[i * WIDTH + l] = values[i]
        for i in range(1, d):
            ws[(at.minus_b + i) * WIDTH + l] = -values[at.minus_b + i]
            ws[(at.f0 + i) * WIDTH + l] = values[at.f0 + i]
        ws[at.level * WIDTH + l] = values[level]
        ws[at.omega * WIDTH + l] = values[par.omega]
        row = at.phase + 2 * max(h, k)
        for j in range(h):
            ws[row * WIDTH + l] = values[par.f_cos + j]
            ws[(row + 1) * WIDTH + l] = values[par.f_sin + j]
            row += 2
        for j in range(k):
            ws[row * WIDTH + l] = values[par.chi_cos + j]
            ws[(row + 1) * WIDTH + l] = values[par.chi_sin + j]
            row += 2
    _fill_phases(dims, max(h, k), nodes, step, points, ws)
    store(ws, at.h, splat(_TURN) * load(ws, at.h) / load(ws, at.omega))


@kernel
def _fill_phases(dims, harmonics, nodes, step, points, ws):
    """Length of the step as a share of the period, and cos and sin of jωτ at its start."""
    at = rows(len(dims))
    if nodes.length.shape[1] == 1:
        store(ws, at.h, splat(nodes.length[step, 0]))
        for j in range(harmonics):
            for part in range(2):
                store(ws, at.phase + 2 * j + part, splat(nodes.wave[step, part, j, 0]))
        return
    for l in range(WIDTH):
        ws[at.h * WIDTH + l] = nodes.length[step, points[l]]
        for j in range(harmonics):
            for part in range(2):
                ws[(at.phase + 2 * j + part) * WIDTH + l] = nodes.wave[step, part, j, points[l]]


@kernel
def _read(dims, vectors, lane, count, ws):
    """Copy the vectors (d, B) of the chunk's lanes into the start rows; idle lanes follow lane 0."""
    start = rows(len(dims)).start
    for l in range(WIDTH):
        for i in range(len(dims)):
            ws[(start + i) * WIDTH + l] = vectors[i, lane[l if l < count else 0]]


@kernel
def _write(dims, vectors, lane, count, ws, first):
    """Copy d rows from ``first`` on to the vectors (d, B) of the chunk's lanes."""
    for l in range(count):
        for i in range(len(dims)):
            vectors[i, lane[l]] = ws[(first + i) * WIDTH + l]


@kernel
def _carry_tangents(dims, before, after, lane, count, ws, varying):
    """Move the tangent vectors over the piece; f is continuous, so nothing happens to them at a switch."""
    for c in range(before.shape[0]):
        _read(dims, before[c], lane, count, ws)
        expand(dims, ws, False, varying)
        finish(dims, ws)
        _write(dims, after[c], lane, count, ws, rows(len(dims)).end)


@kernel
def _switch(dims, h, k, ws):
    """Put switching lanes on the boundary in their new state, with the rest of the step before them.

    The others have no time left and stay where they are. Returns whether any lane switches.
    """
    at, zero = rows(len(dims)), splat(0.0)
    sigma, beyond = load(ws, at.sigma), load(ws, at.beyond)
    switching = ((sigma < beyond) | (beyond < sigma)) & (beyond < splat(LOST))
    turn_waves(dims, h, k, ws)
    length = load(ws, at.h) * (splat(1.0) - load(ws, at.share))
    store(ws, at.h, select(switching, length, zero))
    store(ws, at.sigma, select(switching, beyond, sigma))
    boundary = select(sigma == zero, beyond, sigma)
    store(ws, at.start, select(switching, boundary, load(ws, at.start)))
    return any_lane(switching)


@inlined
def _mark_lost(dims, lanes, lane, count, ws):
    beyond = rows(len(dims)).beyond
    for l in range(count):
        if ws[beyond * WIDTH + l] == LOST:
            lanes.status[lane[l]] = CHATTER


@inlined
def _run_piece(dims, phys, h, k, lanes, lane, count, work, now, first, measuring):
    """One piece of the chunk, from the start rows to the next switch or the end of the step and back there."""
    ws, at = work.ws, rows(len(dims))
    drive(dims, h, k, ws)
    expand(dims, ws, True, k > 0)
    find_exits(dims, ws)
    if measuring:
        output_series(dims, phys, h, k, work.points, ws)
        measure_piece(dims, ws, work.found)
    finish(dims, ws)
    if lanes.v.shape[1] > 0:
        _write(dims, lanes.w[1 - now], lane, count, ws, at.end)
        _carry_tangents(dims, lanes.v[now if first else 1 - now], lanes.v[1 - now], lane, count, ws, k > 0)
        _read(dims, lanes.w[1 - now], lane, count, ws)
    else:
        for i in range(len(dims)):
            store(ws, at.start + i, load(ws, at.end + i))


@inlined
def _begin(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, measuring):
    """Fill the workspace with all that the lanes of one chunk need to run the step."""
    ws, at = work.ws, rows(len(dims))
    for l in range(WIDTH):
        mine = lane[l if l < count else 0]
        work.points[l] = lanes.point[mine]
        ws[at.sigma * WIDTH + l] = lanes.sigma[mine]
        if measuring:
            read_measures(work.found, lanes.measures, mine, l)
    fill(dims, phys, h, k, nodes, step, work.points, ws)
    _read(dims, lanes.w[now], lane, count, ws)


@inlined
def _resolve_chunk(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, measuring):
    """Advance the lanes of one chunk over one step."""
    ws, at = work.ws, rows(len(dims))
    _begin(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, measuring)
    switching, pieces = True, 0
    while switching and pieces < MAX_SWITCHES:
        _run_piece(dims, phys, h, k, lanes, lane, count, work, now, pieces == 0, measuring)
        _mark_lost(dims, lanes, lane, count, ws)
        switching = _switch(dims, h, k, ws)
        pieces += 1
    _write(dims, lanes.w[1 - now], lane, count, ws, at.start)
    for l in range(count):
        lanes.sigma[lane[l]] = ws[at.sigma * WIDTH + l]
        if switching and ws[at.h * WIDTH + l] > 0.0:
            lanes.status[lane[l]] = CHATTER
        if measuring:
            write_measures(work.found, lanes.measures, lane[l], l)


@inlined
def _measure_chunk(dims, phys, h, k, nodes, step, lanes, lane, count, work, now):
    """Add one step, in which contact does not change, to the measures of the lanes of one chunk."""
    ws, at = work.ws, rows(len(dims))
    _begin(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, True)
    drive(dims, h, k, ws)
    expand(dims, ws, True, k > 0)
    store(ws, at.share, splat(1.0))
    store(ws, at.beyond, load(ws, at.sigma))
    output_series(dims, phys, h, k, work.points, ws)
    measure_piece(dims, ws, work.found)
    for l in range(count):
        write_measures(work.found, lanes.measures, lane[l], l)


@inlined
def _chunk(work, first, total):
    """Copy the next listed lanes, a chunk at most, to where the chunk's lanes stand; returns how many."""
    count = min(WIDTH, total - first)
    for l in range(count):
        work.lane[BLOCK + l] = work.lane[first + l]
    return count


@inlined
def measure(dims, phys, h, k, nodes, step, lanes, work, total, now):
    """Add a step to the measures of the first ``total`` listed lanes, in which contact does not change."""
    for first in range(0, total, WIDTH):
        count = _chunk(work, first, total)
        _measure_chunk(dims, phys, h, k, nodes, step, lanes, work.lane[BLOCK:], count, work, now)


@inlined
def resolve(dims, phys, h, k, nodes, step, lanes, work, total, now, measuring):
    """Advance the first ``total`` listed lanes over one step exactly, whatever contact does in it."""
    for first in range(0, total, WIDTH):
        count = _chunk(work, first, total)
        _resolve_chunk(dims, phys, h, k, nodes, step, lanes, work.lane[BLOCK:], count, work, now, measuring)
