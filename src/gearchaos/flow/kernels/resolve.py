"""Steps in which contact may change: from switch to switch, by Taylor polynomials."""

from __future__ import annotations

from gearchaos.flow.kernels.arrays import position_of, rows_per_slot, slot_of
from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.constants import CHATTER, MAX_SWITCHES, WIDTH
from gearchaos.flow.kernels.contact import SEARCH_FAILED, find_exits
from gearchaos.flow.kernels.measures import gather_measures, measure_segment, output_series, scatter_measures
from gearchaos.flow.kernels.offsets import rows
from gearchaos.flow.kernels.simd import any_true, broadcast, load, load_scalar, select, store, store_scalar
from gearchaos.flow.kernels.taylor import advance_phases, end_state, excitation_series, state_series
from gearchaos.flow.kernels.workspace import fill_level, fill_point, fill_step


@inlined
def _gather(dims, vectors, length, first, listed, count, ws):
    """Copy d vectors of the listed lanes to the start rows: vectors ``first`` to ``first + d - 1`` of the ``length``
    vectors of each slot.

    Positions without a lane receive a copy of the first lane.
    """
    start = rows(dims).start * WIDTH
    for l in range(WIDTH):
        lane = load_scalar(listed, l if l < count else 0)
        index = (slot_of(lane) * length + first) * WIDTH + position_of(lane)
        for i in range(len(dims)):
            store_scalar(ws, start + i * WIDTH + l, load_scalar(vectors, index + i * WIDTH))


@inlined
def _scatter(dims, vectors, length, first, listed, count, ws, row):
    """Copy d rows of the workspace, from ``row`` on, to vectors ``first`` to ``first + d - 1`` of the ``length``
    vectors of each listed lane's slot."""
    for l in range(count):
        lane = load_scalar(listed, l)
        index = (slot_of(lane) * length + first) * WIDTH + position_of(lane)
        for i in range(len(dims)):
            store_scalar(vectors, index + i * WIDTH, load_scalar(ws, (row + i) * WIDTH + l))


@subroutine
def _advance_tangents(dims, tangents, before, after, listed, count, ws, varying):
    """Advance the tangent vectors of the listed lanes over the segment, from parity ``before`` to parity ``after``.

    The right-hand side is continuous, so that they do not change at a contact switch. ``tangents`` is `Lanes.tangents`.
    """
    d, vectors = len(dims), tangents.shape[2]
    for c in range(vectors):
        _gather(dims, tangents, 2 * vectors * d, (before * vectors + c) * d, listed, count, ws)
        state_series(dims, ws, False, varying)
        end_state(dims, ws)
        _scatter(dims, tangents, 2 * vectors * d, (after * vectors + c) * d, listed, count, ws, rows(dims).end)


@subroutine
def switch_contact(dims, harmonics, ws):
    """Put switching lanes on the boundary in their new contact state, with the rest of the step as their next
    segment.

    The other lanes get a segment of duration 0 and do not move. Returns whether any lane switches.
    """
    at, zero = rows(dims), broadcast(0.0)
    sigma, beyond = load(ws, at.sigma), load(ws, at.next_sigma)
    switching = ((sigma < beyond) | (beyond < sigma)) & (beyond < broadcast(SEARCH_FAILED))
    advance_phases(dims, harmonics, ws)
    rest = load(ws, at.duration) * (broadcast(1.0) - load(ws, at.end_fraction))
    store(ws, at.duration, select(switching, rest, zero))
    store(ws, at.sigma, select(switching, beyond, sigma))
    boundary = select(sigma == zero, beyond, sigma)
    store(ws, at.start, select(switching, boundary, load(ws, at.start)))
    return any_true(switching)


@inlined
def _mark_failed_searches(dims, lanes, listed, count, ws):
    """Give lanes whose exit was not found the status `CHATTER`."""
    row = rows(dims).next_sigma
    for l in range(count):
        if ws[row * WIDTH + l] == SEARCH_FAILED:
            lanes.status[listed[l]] = CHATTER


@inlined
def _run_segment(dims, points, lanes, listed, count, work, parity, first, measuring):
    """Advance the pack from the start rows to the next switch or the end of the step, and write the states to the start
    rows.

    ``parity`` is that of the tick; ``first`` says that this is the first segment of the step.
    """
    ws, at, harmonics = work.rows, rows(dims), points.harmonics
    excitation_series(dims, harmonics, ws)
    state_series(dims, ws, True, harmonics.stiffness > 0)
    find_exits(dims, ws)
    if measuring:
        output_series(dims, harmonics, ws)
        measure_segment(dims, ws, work.measures, 0)
    end_state(dims, ws)
    if lanes.tangents.shape[2] > 0:
        after, length = 1 - parity, rows_per_slot(lanes)
        before = parity if first else after
        _scatter(dims, lanes.vectors, length, after * len(dims), listed, count, ws, at.end)
        _advance_tangents(dims, lanes.tangents, before, after, listed, count, ws, harmonics.stiffness > 0)
        _gather(dims, lanes.vectors, length, after * len(dims), listed, count, ws)
    else:
        for i in range(len(dims)):
            store(ws, at.start + i, load(ws, at.end + i))


@inlined
def _begin_step(dims, points, slots, lanes, listed, count, work, tick, measuring):
    """Fill the workspace with the states and parameters of the listed lanes at the start of the step."""
    ws, at, parity = work.rows, rows(dims), tick & 1
    for l in range(WIDTH):
        lane = load_scalar(listed, l if l < count else 0)
        work.points[l] = load_scalar(lanes.point, lane)
        work.steps[l] = load_scalar(lanes.first_step, lane) + load_scalar(slots.step_minus_tick, slot_of(lane)) + tick
        ws[at.sigma * WIDTH + l] = load_scalar(lanes.sigma, lane)
        if measuring:
            gather_measures(work.measures, lanes.measures, lane, l)
    fill_point(dims, points.parameters, points.harmonics, work.points, measuring, ws)
    fill_level(dims, points.parameters, points.harmonics, points.steps.values, work.points, work.steps, ws)
    fill_step(dims, points.harmonics, points.steps.values, work.steps, ws)
    _gather(dims, lanes.vectors, rows_per_slot(lanes), parity * len(dims), listed, count, ws)


@inlined
def _resolve_pack(dims, points, slots, lanes, listed, count, work, tick, measuring):
    """Advance up to `WIDTH` listed lanes over one step."""
    ws, at, parity = work.rows, rows(dims), tick & 1
    _begin_step(dims, points, slots, lanes, listed, count, work, tick, measuring)
    switching, segments = True, 0
    while switching and segments < MAX_SWITCHES:
        _run_segment(dims, points, lanes, listed, count, work, parity, segments == 0, measuring)
        _mark_failed_searches(dims, lanes, listed, count, ws)
        switching = switch_contact(dims, points.harmonics, ws)
        segments += 1
    length = rows_per_slot(lanes)
    _scatter(dims, lanes.vectors, length, (1 - parity) * len(dims), listed, count, ws, at.start)
    for l in range(count):
        lanes.sigma[listed[l]] = ws[at.sigma * WIDTH + l]
        if switching and ws[at.duration * WIDTH + l] > 0.0:
            lanes.status[listed[l]] = CHATTER
        if measuring:
            scatter_measures(work.measures, lanes.measures, listed[l], l)


@inlined
def resolve(dims, points, slots, lanes, work, total, tick, measuring):
    """Advance the first ``total`` lanes of ``work.listed`` over one step, with all contact switches in it."""
    for first in range(0, total, WIDTH):
        count, listed = min(WIDTH, total - first), work.listed[first : first + WIDTH]
        _resolve_pack(dims, points, slots, lanes, listed, count, work, tick, measuring)
