"""A block of lanes through many mesh periods: the loop that everything else serves."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import LENGTH, parameters, place_of, seat_rows
from gearchaos.flow.measure import measure, study
from gearchaos.flow.resolve import resolve
from gearchaos.flow.seats import end_period, give_up, state_of, take
from gearchaos.flow.simd import WIDTH, bits, load, peek, poke
from gearchaos.flow.step import affine, collect, listed, load_bounds, matvec, suspects, update
from gearchaos.flow.tangent import orthonormalise

_NOBODY = np.nan
"""The contact state of matrices that are nobody's: unequal to any."""

_NEVER = 1 << 62


@inlined
def _sample(target, lanes, seat, live, now):
    """The states and contact states of a seat, into target (d + 1, L)."""
    d = len(target) - 1
    for l in range(seat * WIDTH, seat * WIDTH + live):
        first, number = state_of(lanes, d, l, now), lanes.number[l]
        for i in range(d):
            target[i, number] = lanes.vectors[first + i * WIDTH]
        target[d, number] = lanes.sigma[l]


@inlined
def _begin_piece(dims, points, lanes, seats, seat, step, fresh, lane, tick):
    """Have matrices at hand for the piece that begins with this step, and bounds; both anew if ``fresh``."""
    first, live, slot = seat * WIDTH, seats.live[seat], seats.slot[seat]
    if fresh:
        for l in range(first, first + live):
            lanes.of[slot, l] = _NOBODY
            length, values = points.nodes.values[lanes.node[l] + step, LENGTH], points.phys[lanes.point[l]]
            at = seats.at[seat] * WIDTH + place_of(l)
            load_bounds(dims, values, parameters(len(dims), points.h, points.k).omega, length, lanes.vectors, at)
    right = bits(load(lanes.of, slot * len(seats.live) + seat) == load(lanes.sigma, seat))
    count = listed(~right & ((1 << live) - 1), seat, lane, 0)
    update(dims, points, lanes, seats, lane, count, tick)


@inlined
def _arrive(dims, points, call, lanes, seats, seat, step, lane, tick):
    """Do what is to be done before this step of a seat, and note before which step there is something to do again."""
    first, period, d, nodes = seat * WIDTH, seats.period[seat], len(dims), points.nodes
    node, slots, sampling = lanes.node[first] + step, len(lanes.of), len(call.samples) > 0
    if sampling and nodes.sample[node] >= 0:
        _sample(call.samples[period, nodes.sample[node]], lanes, seat, seats.live[seat], tick & 1)
    seats.ahead[seat], seats.node[seat] = step - tick, node - tick
    if step == 0 or nodes.piece[node - 1] != nodes.piece[node]:
        slot = nodes.piece[node] if slots > 1 else np.int64(0)
        seats.slot[seat], seats.at[seat] = slot, seat * seat_rows(lanes) + 2 * d + slot * (d + points.table.shape[2])
        _begin_piece(dims, points, lanes, seats, seat, step, slots == 1 or period == 0, lane, tick)
    pause = step + 1 if sampling else nodes.until[node]
    if len(call.growth) > 0:
        stride = points.courses.stride[lanes.point[first]]
        pause = min(pause, (step // stride + 1) * stride)
    seats.pause[seat], seats.due[seat] = pause, tick + pause - step


@inlined
def _attend(dims, points, call, lanes, seats, seat, work, tick):
    """Do what is to be done between two steps of a seat, and have the next chunk take it once it is free."""
    step = seats.pause[seat]
    if seats.live[seat] > 0:
        point = lanes.point[seat * WIDTH]
        last = step == points.courses.steps[point]
        if len(call.growth) > 0 and (last or step % points.courses.stride[point] == 0):
            number = lanes.number[seat * WIDTH : seat * WIDTH + seats.live[seat]]
            growth = call.growth[seats.period[seat]]
            first = (2 * seat + (tick & 1)) * len(growth) * len(dims)
            orthonormalise(dims, lanes.tangents, first, work.found, growth, number)
        if last:
            step = np.int64(0)
            end_period(call, lanes, seats, seat, tick & 1)
    if seats.live[seat] == 0 and seats.state[1] < len(call.who):
        take(call, points.courses, lanes, seats, seat, tick & 1)
        if len(call.measures) > 0:
            study(dims, points, lanes, seat, work)
    if seats.live[seat] > 0:
        _arrive(dims, points, call, lanes, seats, seat, step, work.lane, tick)


@inlined
def _attend_all(dims, points, call, lanes, seats, work, tick):
    """Attend to the seats that are due; returns the next tick at which one is."""
    seat, due = 0, _NEVER
    while seat < seats.state[0]:
        if seats.due[seat] == tick:
            _attend(dims, points, call, lanes, seats, seat, work, tick)
        if seats.live[seat] == 0:
            give_up(lanes, seats, seat)
        else:
            due = min(due, seats.due[seat])
            seat += 1
    return due


@inlined
def _affine_steps(dims, points, lanes, seats, flags, tick):
    """The affine step of all lanes, and flags (S,), a bit each, for those that it may be wrong for."""
    d, even, vectors = len(dims), 1 - (tick & 1), lanes.tangents.shape[2]
    length, first, then = seat_rows(lanes), d - d * even, d * even
    for seat in range(seats.state[0]):
        before, after, at = seat * length + first, seat * length + then, peek(seats.at, seat)
        node = peek(seats.node, seat) + tick
        affine(dims, points.kept, points.nodes.values, node, lanes.vectors, at + d, before, after)
        for c in range(vectors):
            own = 2 * seat * vectors + c
            before, after = (own + (1 - even) * vectors) * d, (own + even * vectors) * d
            matvec(dims, lanes.vectors, at + d, lanes.tangents, before, after)
    for seat in range(seats.state[0]):
        before, after = seat * length + first, seat * length + then
        found = suspects(dims, lanes.sigma, seat, lanes.vectors, peek(seats.at, seat), before, after)
        poke(flags, seat, found)


@inlined
def _one_step(dims, points, lanes, seats, work, tick, measuring):
    """One step of all lanes: affine for most, resolved for the suspects."""
    _affine_steps(dims, points, lanes, seats, work.flags, tick)
    if measuring:
        measure(dims, points, seats, lanes, work, tick)
    count = collect(work.flags, seats, work.lane)
    if count > 0:
        resolve(dims, points, seats, lanes, work, count, tick, measuring)
        update(dims, points, lanes, seats, work.lane, count, tick)


@kernel
def advance_block(dims, points, call, lanes, seats, work, measuring, most):
    """Advance the lanes of a call by their periods, though no seat by more than ``most`` steps; returns whether there
    is more to do.

    The chunks of the call take seats one after the other, and leave them when their
    last lane has had its periods.
    """
    due = seats.state[2]
    for tick in range(due, due + most):
        seats.state[2] = tick
        if tick == due:
            due = _attend_all(dims, points, call, lanes, seats, work, tick)
            if seats.state[0] == 0:
                return False
        _one_step(dims, points, lanes, seats, work, tick, measuring)
    seats.state[2] += 1
    return True
