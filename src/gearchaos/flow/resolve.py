"""The steps in which contact may change: piece by piece, from switch to switch, by Taylor polynomials."""

from __future__ import annotations

from gearchaos.flow.contact import LOST, find_exits
from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import CHATTER, MAX_SWITCHES, WIDTH, place_of, rows, seat_of, seat_rows
from gearchaos.flow.measure import measure_piece, output_series, read_measures, write_measures
from gearchaos.flow.simd import any_lane, load, peek, poke, select, splat, store
from gearchaos.flow.taylor import drive, expand, finish, turn_waves
from gearchaos.flow.workspace import fill_point, fill_step


@inlined
def _read(dims, vectors, length, first, lane, count, ws):
    """Copy d vectors of the chunk's lanes, from ``first`` on of the ``length`` on each seat, into the start rows; idle
    lanes follow lane 0."""
    start = rows(len(dims)).start * WIDTH
    for l in range(WIDTH):
        mine = peek(lane, l if l < count else 0)
        at = (seat_of(mine) * length + first) * WIDTH + place_of(mine)
        for i in range(len(dims)):
            poke(ws, start + i * WIDTH + l, peek(vectors, at + i * WIDTH))


@inlined
def _write(dims, vectors, length, first, lane, count, ws, row):
    """Copy d rows from ``row`` on to d vectors of the chunk's lanes, from ``first`` on of the ``length`` on each
    seat."""
    for l in range(count):
        mine = peek(lane, l)
        at = (seat_of(mine) * length + first) * WIDTH + place_of(mine)
        for i in range(len(dims)):
            poke(vectors, at + i * WIDTH, peek(ws, (row + i) * WIDTH + l))


@kernel
def _carry_tangents(dims, tangents, before, after, lane, count, ws, varying):
    """Move the tangent vectors over the piece; f is continuous, so nothing happens to them at a switch."""
    d, vectors, flat = len(dims), tangents.shape[2], tangents.reshape(-1)
    for c in range(vectors):
        _read(dims, flat, 2 * vectors * d, (before * vectors + c) * d, lane, count, ws)
        expand(dims, ws, False, varying)
        finish(dims, ws)
        _write(dims, flat, 2 * vectors * d, (after * vectors + c) * d, lane, count, ws, rows(d).end)


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
def _run_piece(dims, points, lanes, lane, count, work, now, first, measuring):
    """One piece of the chunk, from the start rows to the next switch or the end of the step and back there."""
    ws, at = work.ws, rows(len(dims))
    drive(dims, points.h, points.k, ws)
    expand(dims, ws, True, points.k > 0)
    find_exits(dims, ws)
    if measuring:
        output_series(dims, points.h, points.k, ws)
        measure_piece(dims, ws, work.found, 0)
    finish(dims, ws)
    if lanes.tangents.shape[2] > 0:
        then, length = 1 - now, seat_rows(lanes)
        _write(dims, lanes.vectors, length, then * len(dims), lane, count, ws, at.end)
        _carry_tangents(dims, lanes.tangents, now if first else then, then, lane, count, ws, points.k > 0)
        _read(dims, lanes.vectors, length, then * len(dims), lane, count, ws)
    else:
        for i in range(len(dims)):
            store(ws, at.start + i, load(ws, at.end + i))


@inlined
def _begin(dims, points, seats, lanes, lane, count, work, tick, measuring):
    """Fill the workspace with all that the lanes of one chunk need to run the step; states go by the clock's parity."""
    ws, at, now = work.ws, rows(len(dims)), tick & 1
    for l in range(WIDTH):
        mine = peek(lane, l if l < count else 0)
        work.points[l] = peek(lanes.point, mine)
        work.nodes[l] = peek(lanes.node, mine) + peek(seats.ahead, seat_of(mine)) + tick
        ws[at.sigma * WIDTH + l] = peek(lanes.sigma, mine)
        if measuring:
            read_measures(work.found, lanes.measures, mine, l)
    fill_point(dims, points.phys, points.h, points.k, work.points, measuring, ws)
    fill_step(dims, points.h, points.k, points.nodes.values, work.nodes, ws)
    length = seat_rows(lanes)
    _read(dims, lanes.vectors, length, now * len(dims), lane, count, ws)


@inlined
def _resolve_chunk(dims, points, seats, lanes, lane, count, work, tick, measuring):
    """Advance the lanes of one chunk over one step."""
    ws, at, now = work.ws, rows(len(dims)), tick & 1
    _begin(dims, points, seats, lanes, lane, count, work, tick, measuring)
    switching, pieces = True, 0
    while switching and pieces < MAX_SWITCHES:
        _run_piece(dims, points, lanes, lane, count, work, now, pieces == 0, measuring)
        _mark_lost(dims, lanes, lane, count, ws)
        switching = _switch(dims, points.h, points.k, ws)
        pieces += 1
    length = seat_rows(lanes)
    _write(dims, lanes.vectors, length, (1 - now) * len(dims), lane, count, ws, at.start)
    for l in range(count):
        lanes.sigma[lane[l]] = ws[at.sigma * WIDTH + l]
        if switching and ws[at.h * WIDTH + l] > 0.0:
            lanes.status[lane[l]] = CHATTER
        if measuring:
            write_measures(work.found, lanes.measures, lane[l], l)


@inlined
def resolve(dims, points, seats, lanes, work, total, tick, measuring):
    """Advance the first ``total`` listed lanes over one step exactly, whatever contact does in it."""
    for first in range(0, total, WIDTH):
        count, lane = min(WIDTH, total - first), work.lane[first : first + WIDTH]
        _resolve_chunk(dims, points, seats, lanes, lane, count, work, tick, measuring)
