"""The steps in which contact may change: piece by piece, from switch to switch, by Taylor polynomials."""

from __future__ import annotations

from gearchaos.flow.contact import LOST, find_exits
from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import BLOCK, CHATTER, MAX_SWITCHES, ORDER, WIDTH, parameters, rows
from gearchaos.flow.measure import add_measures, measure_piece, output_series, read_extremes
from gearchaos.flow.taylor import drive, expand, expand_waves, finish, finish_waves

_TURN = 6.283185307179586


@kernel
def fill_piece(dims, phys, h, k, nodes, step, l, q, sigma, rest, ws):
    """Parameters, stiffness level and length of the piece of lane l of the chunk, at point q."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    for i in range(d * d + 2 * d):
        ws[i * WIDTH + l] = -phys[q, i] if at.minus_b <= i < at.f0 else phys[q, i]
    ws[at.sigma * WIDTH + l] = sigma
    ws[at.chi * WIDTH + l] = phys[q, par.levels + nodes.level[step]] if sigma != 0.0 else 0.0
    if k > 0:
        for m in range(1, ORDER + 1):
            ws[(at.chi + m) * WIDTH + l] = 0.0
    length = nodes.length[step, q if nodes.length.shape[1] > 1 else 0]
    ws[at.h * WIDTH + l] = _TURN * length * rest / phys[q, par.omega]


@kernel
def start_waves(nodes, step, l, q, wave):
    """cos jωτ and sin jωτ at the start of the step for lane l of the chunk."""
    place = q if nodes.length.shape[1] > 1 else 0
    for j in range(wave.shape[0]):
        wave[j, 0, l] = nodes.wave[step, 0, j, place]
        wave[j, 1, l] = nodes.wave[step, 1, j, place]


@kernel
def set_out(dims, phys, h, k, points, wave, ws, angle):
    """Series of the waves, the forcing and the stiffness, once the pieces are filled."""
    at, omega = rows(len(dims)), parameters(len(dims), h, k).omega
    for l in range(WIDTH):
        angle[l] = ws[at.h * WIDTH + l] * phys[points[l], omega]
    for j in range(wave.shape[0]):
        expand_waves(wave, j, angle)
    drive(dims, phys, h, k, points, wave, ws)


@kernel
def _read(dims, vectors, lane, count, ws):
    """Copy the vectors (d, B) of the chunk's lanes into the start rows; idle lanes follow lane 0."""
    start = rows(len(dims)).start
    for l in range(WIDTH):
        for i in range(len(dims)):
            ws[(start + i) * WIDTH + l] = vectors[i, lane[l if l < count else 0]]


@kernel
def _write(dims, vectors, lane, count, ws):
    end = rows(len(dims)).end
    for l in range(count):
        for i in range(len(dims)):
            vectors[i, lane[l]] = ws[(end + i) * WIDTH + l]


@kernel
def _carry_tangents(dims, v, lane, count, ws, varying):
    """Move the tangent vectors over the piece; f is continuous, so nothing happens to them at a switch."""
    for c in range(v.shape[0]):
        _read(dims, v[c], lane, count, ws)
        expand(dims, ws, False, varying)
        finish(dims, ws)
        _write(dims, v[c], lane, count, ws)


@kernel
def _switch(dims, lanes, new, lane, count, rest, wave, ws):
    """Put switching lanes on the boundary in their new state and keep them; let the others go."""
    at = rows(len(dims))
    kept = 0
    for l in range(count):
        sigma, beyond = ws[at.sigma * WIDTH + l], ws[at.beyond * WIDTH + l]
        if beyond == LOST:
            lanes.status[lane[l]] = CHATTER
        elif beyond != sigma:
            lanes.w[new, 0, lane[l]] = sigma if sigma != 0.0 else beyond
            lanes.sigma[lane[l]] = beyond
            lane[kept] = lane[l]
            rest[kept] = rest[l] * (1.0 - ws[at.share * WIDTH + l])
            for j in range(wave.shape[0]):
                wave[j, 0, kept] = wave[j, 0, l]
                wave[j, 1, kept] = wave[j, 1, l]
            kept += 1
    return kept


@kernel
def _fill(dims, phys, h, k, nodes, step, lanes, lane, count, rest, points, ws):
    for l in range(WIDTH):
        mine = lane[l if l < count else 0]
        points[l] = lanes.point[mine]
        fill_piece(
            dims, phys, h, k, nodes, step, l, points[l], lanes.sigma[mine], rest[l if l < count else 0], ws
        )


@kernel
def _begin(dims, nodes, step, lanes, now, lane, count, rest, wave):
    """Copy the chunk's states to where the pieces work on them, and the waves at the start of the step."""
    for l in range(count):
        rest[l] = 1.0
        start_waves(nodes, step, l, lanes.point[lane[l]], wave)
        for i in range(len(dims)):
            lanes.w[1 - now, i, lane[l]] = lanes.w[now, i, lane[l]]
            for c in range(lanes.v.shape[1]):
                lanes.v[1 - now, c, i, lane[l]] = lanes.v[now, c, i, lane[l]]


@kernel
def _resolve_chunk(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, measuring):
    """Advance the lanes of one chunk over one step."""
    ws, wave, new = work.ws, work.wave, 1 - now
    _begin(dims, nodes, step, lanes, now, lane, count, work.rest, wave)
    for _ in range(MAX_SWITCHES):
        _fill(dims, phys, h, k, nodes, step, lanes, lane, count, work.rest, work.points, ws)
        set_out(dims, phys, h, k, work.points, wave, ws, work.angle)
        _read(dims, lanes.w[new], lane, count, ws)
        expand(dims, ws, True, k > 0)
        find_exits(dims, ws)
        if measuring:
            output_series(dims, phys, h, k, work.points, wave, ws)
            for l in range(WIDTH):
                read_extremes(work.found, lanes.measures, lane[l if l < count else 0], l)
            measure_piece(dims, ws, work.found)
            for l in range(count):
                add_measures(work.found, lanes.measures, lane[l], l)
        finish(dims, ws)
        _write(dims, lanes.w[new], lane, count, ws)
        _carry_tangents(dims, lanes.v[new], lane, count, ws, k > 0)
        finish_waves(wave, ws, rows(len(dims)).share)
        count = _switch(dims, lanes, new, lane, count, work.rest, wave, ws)
        if count == 0:
            return
    for l in range(count):
        lanes.status[lane[l]] = CHATTER


@kernel
def resolve(dims, phys, h, k, nodes, step, lanes, work, total, now, measuring):
    """Advance the first ``total`` listed lanes over one step exactly, whatever contact does in it."""
    lane = work.lane[BLOCK:]
    for first in range(0, total, WIDTH):
        count = min(WIDTH, total - first)
        for l in range(count):
            lane[l] = work.lane[first + l]
        _resolve_chunk(dims, phys, h, k, nodes, step, lanes, lane, count, work, now, measuring)
