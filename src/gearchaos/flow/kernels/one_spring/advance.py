"""The main loop: advance many lanes by many mesh periods, step by step.

Packs of a call enter free slots, and leave them when they have completed their periods.
"""

from __future__ import annotations

from math import log

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, main_kernel, subroutine
from gearchaos.flow.kernels.one_spring.affine import (
    affine_step,
    append_lanes,
    find_suspects,
    list_suspects,
    load_bounds,
    update_matrices,
)
from gearchaos.flow.kernels.one_spring.contact import resolve
from gearchaos.flow.kernels.one_spring.measures import measure_step, prepare_measures
from gearchaos.flow.kernels.vector.arrays import LENGTH, measure_index, position_of, rows_per_slot, slot_of, state_index
from gearchaos.flow.kernels.vector.constants import DIVERGED, DIVERGED_AT, OK, WIDTH
from gearchaos.flow.kernels.vector.simd import (
    bits,
    broadcast,
    load,
    load_scalar,
    select,
    store,
    store_linear,
    store_scalar,
    vabs,
    vfma,
    vsqrt,
)

_NO_STATE = np.nan  # contact state of a matrix buffer without matrices; NaN is unequal to every contact state
_NO_TICK = 1 << 62  # later than any tick


@inlined
def _sample(target, lanes, slot, active, parity):
    """Write the states and contact states of a slot to ``target`` (d + 1, L)."""
    d = len(target) - 1
    for lane in range(slot * WIDTH, slot * WIDTH + active):
        first, trajectory = state_index(lanes, d, lane, parity), lanes.trajectory[lane]
        for i in range(d):
            target[i, trajectory] = lanes.vectors[first + i * WIDTH]
        target[d, trajectory] = lanes.sigma[lane]


@inlined
def _load_entry(dims, points, lanes, slots, slot, step, fresh, listed, tick):
    """Load the step matrices and bounds for the steps from ``step`` on that have the same entry. If ``fresh`` the
    matrix buffer is filled anew, else only matrices of lanes whose contact state has changed are replaced."""
    first, active, matrix_buffer = slot * WIDTH, slots.active[slot], slots.matrix_buffer[slot]
    if fresh:
        for lane in range(first, first + active):
            lanes.matrix_sigma[matrix_buffer, lane] = _NO_STATE
            length = points.steps.values[lanes.first_step[lane] + step, LENGTH]
            values = points.parameters[lanes.point[lane]]
            first_bound = slots.matrices[slot] * WIDTH + position_of(lane)
            load_bounds(dims, values, points.harmonics.columns, length, lanes.vectors, first_bound)
    valid = bits(load(lanes.matrix_sigma, matrix_buffer * len(slots.active) + slot) == load(lanes.sigma, slot))
    count = append_lanes(~valid & ((1 << active) - 1), slot, listed, 0)
    update_matrices(dims, points, lanes, slots, listed, count, tick)


@inlined
def _prepare_steps(dims, points, call, lanes, slots, slot, step, listed, tick):
    """Prepare a slot for the steps from ``step`` on, and set the step before which its next housekeeping is due."""
    first, period, d, steps = slot * WIDTH, slots.period[slot], len(dims), points.steps
    number, buffers, sampling = lanes.first_step[first] + step, len(lanes.matrix_sigma), len(call.samples) > 0
    if sampling and steps.sample[number] >= 0:
        _sample(call.samples[period, steps.sample[number]], lanes, slot, slots.active[slot], tick & 1)
    slots.step_minus_tick[slot], slots.row_minus_tick[slot] = step - tick, number - tick
    if step == 0 or steps.entry[number - 1] != steps.entry[number]:
        matrix_buffer = steps.entry[number] if buffers > 1 else np.int64(0)
        slots.matrix_buffer[slot] = matrix_buffer
        slots.matrices[slot] = slot * rows_per_slot(lanes) + 2 * d + matrix_buffer * (d + points.table.shape[2])
        _load_entry(dims, points, lanes, slots, slot, step, buffers == 1 or period == 0, listed, tick)
    stop = step + 1 if sampling else steps.entry_end[number]
    if len(call.growth) > 0:
        every = points.grids.orthonormalise_every[lanes.point[first]]
        stop = min(stop, (step // every + 1) * every)
    slots.stop[slot], slots.due[slot] = stop, tick + stop - step


@inlined
def _housekeeping(dims, points, call, lanes, slots, slot, work, tick):
    """Between two steps of a slot: orthonormalise, end the period, load the next pack if this one has ended."""
    step, parity = slots.stop[slot], tick & 1
    if slots.active[slot] > 0:
        point = lanes.point[slot * WIDTH]
        last = step == points.grids.step_count[point]
        if len(call.growth) > 0 and (last or step % points.grids.orthonormalise_every[point] == 0):
            trajectories = lanes.trajectory[slot * WIDTH : slot * WIDTH + slots.active[slot]]
            growth = call.growth[slots.period[slot]]
            first = (2 * slot + parity) * len(growth) * len(dims)
            orthonormalise(dims, lanes.tangents, first, work.measures, growth, trajectories)
        if last:
            step = np.int64(0)
            end_period(call, lanes, slots, slot, parity)
    if slots.active[slot] == 0 and slots.counters[1] < len(call.packs):
        load_pack(call, points.grids, lanes, slots, slot, parity)
        if len(call.measures) > 0:
            prepare_measures(dims, points, lanes, slot, work)
    if slots.active[slot] > 0:
        _prepare_steps(dims, points, call, lanes, slots, slot, step, work.listed, tick)


@inlined
def _due_housekeeping(dims, points, call, lanes, slots, work, tick):
    """Do the housekeeping of the slots for which it is due at this tick; returns the next tick at which it is due."""
    slot, due = np.int64(0), _NO_TICK
    while slot < slots.counters[0]:
        if slots.due[slot] == tick:
            _housekeeping(dims, points, call, lanes, slots, slot, work, tick)
        if slots.active[slot] == 0:
            release_slot(lanes, slots, slot)
        else:
            due = min(due, slots.due[slot])
            slot += 1
    return due


@inlined
def _affine_steps(dims, points, lanes, slots, suspects, tick):
    """Make the affine step of all lanes, and write the suspects of each slot to ``suspects`` (SLOTS,), one bit for each
    lane."""
    d, even, vectors = len(dims), 1 - (tick & 1), lanes.tangents.shape[2]
    length, first, then = rows_per_slot(lanes), d - d * even, d * even
    for slot in range(slots.counters[0]):
        before, after, bounds = slot * length + first, slot * length + then, load_scalar(slots.matrices, slot)
        step = load_scalar(slots.row_minus_tick, slot) + tick
        affine_step(dims, points.tabulated, points.steps.values, step, lanes.vectors, bounds + d, before, after)
        for c in range(vectors):
            tangent = 2 * slot * vectors + c
            before, after = (tangent + (1 - even) * vectors) * d, (tangent + even * vectors) * d
            store_linear(dims, lanes.vectors, bounds + d, lanes.tangents, before, after)
    for slot in range(slots.counters[0]):
        before, after, bounds = slot * length + first, slot * length + then, load_scalar(slots.matrices, slot)
        found = find_suspects(dims, lanes.sigma, slot, lanes.vectors, bounds, before, after)
        store_scalar(suspects, slot, found)


@inlined
def _tick(dims, points, lanes, slots, work, tick, measuring):
    """One step of all lanes: affine, and resolved for the suspects."""
    _affine_steps(dims, points, lanes, slots, work.suspects, tick)
    if measuring:
        measure_step(dims, points, slots, lanes, work, tick)
    count = list_suspects(work.suspects, slots, work.listed)
    if count > 0:
        resolve(dims, points, slots, lanes, work, count, tick, measuring)
        update_matrices(dims, points, lanes, slots, work.listed, count, tick)


@main_kernel
def advance_packs(dims, points, call, lanes, slots, work, measuring, ticks):
    """Advance the packs of a call by their periods, for at most ``ticks`` ticks; returns whether any are unfinished.

    ``points``, ``call``, ``lanes``, ``slots`` and ``work`` are `Points`, `Call`, `Lanes`, `Slots` and `Workspace` of
    `arrays`. Packs enter free slots in order, and leave them when their last lane has completed its periods.
    """
    due = slots.counters[2]
    for tick in range(due, due + ticks):
        slots.counters[2] = tick
        if tick == due:
            due = _due_housekeeping(dims, points, call, lanes, slots, work, tick)
            if slots.counters[0] == 0:
                return False
        _tick(dims, points, lanes, slots, work, tick, measuring)
    slots.counters[2] += 1
    return True


@inlined
def _load_lane(call, grids, lanes, trajectory, lane, parity):
    """Copy a trajectory of the call into a lane."""
    point = call.points[trajectory]
    lanes.trajectory[lane], lanes.point[lane], lanes.status[lane] = trajectory, point, OK
    lanes.first_step[lane], lanes.first_entry[lane] = grids.first_step[point], grids.first_entry[point]
    lanes.sigma[lane] = call.sigma[trajectory]
    first = state_index(lanes, len(call.w), lane, parity)
    for i in range(len(call.w)):
        lanes.vectors[first + i * WIDTH] = call.w[i, trajectory]
        for c in range(len(call.tangent)):
            lanes.tangents[slot_of(lane), parity, c, i, position_of(lane)] = call.tangent[c, i, trajectory]
    for i in range(len(call.measures)):
        lanes.measures[measure_index(lane, i)] = call.measures[i, trajectory]


@inlined
def load_pack(call, grids, lanes, slots, slot, parity):
    """Copy the next pack of the call into a free slot."""
    pack, active = slots.counters[1], 0
    for i in range(WIDTH):
        if call.packs[pack, i] >= 0:
            _load_lane(call, grids, lanes, call.packs[pack, i], slot * WIDTH + i, parity)
            active += 1
    slots.active[slot], slots.period[slot], slots.counters[1] = active, 0, pack + 1


@inlined
def _store_lane(call, lanes, lane, parity):
    """Copy the results of a lane into the arrays of the call."""
    trajectory, first = lanes.trajectory[lane], state_index(lanes, len(call.w), lane, parity)
    call.status[trajectory] = lanes.status[lane]
    for i in range(len(call.w)):
        call.w[i, trajectory] = lanes.vectors[first + i * WIDTH]
        for c in range(len(call.tangent)):
            call.tangent[c, i, trajectory] = lanes.tangents[slot_of(lane), parity, c, i, position_of(lane)]
    for i in range(len(call.measures)):
        call.measures[i, trajectory] = lanes.measures[measure_index(lane, i)]


@inlined
def _store_section(call, lanes, lane, parity, section):
    """Copy the state of a lane into one of its sections."""
    first = state_index(lanes, len(call.w), lane, parity)
    for i in range(len(call.w)):
        call.sections[section, i, lanes.trajectory[lane]] = lanes.vectors[first + i * WIDTH]


@subroutine
def _mark_diverged(vectors, state, status, first, active):
    """Give the status `DIVERGED` to those of ``active`` lanes from ``first`` on, with their states from vector
    ``state`` on, that have diverged; ``status`` is `Lanes.status`."""
    limit = broadcast(DIVERGED_AT)
    inside = bits((vabs(load(vectors, state)) < limit) & (vabs(load(vectors, state + 1)) < limit))
    if inside == (1 << WIDTH) - 1:
        return
    for l in range(active):
        if not inside >> l & 1 and status[first + l] == OK:
            status[first + l] = DIVERGED


@inlined
def end_period(call, lanes, slots, slot, parity):
    """Record the requested sections of the lanes of a slot, and store the results of those that have completed their
    periods."""
    period, active = slots.period[slot] + 1, slots.active[slot]
    first, sections = slot * WIDTH, len(call.sections)
    state = state_index(lanes, len(call.w), first, parity) // WIDTH
    _mark_diverged(lanes.vectors, state, lanes.status, first, active)
    fewest = call.periods[lanes.trajectory[first + active - 1]]  # lanes are sorted, most periods first
    if fewest - period < max(1, sections):
        for lane in range(first, first + slots.active[slot]):
            left = call.periods[lanes.trajectory[lane]] - period
            if left < sections:
                _store_section(call, lanes, lane, parity, sections - 1 - left)
            if left == 0:
                _store_lane(call, lanes, lane, parity)
                active -= 1
    slots.active[slot], slots.period[slot] = active, period


@inlined
def _copy_slot(vectors, slots, to, source):
    """Copy all vectors of slot ``source`` to slot ``to``, in an array of vectors for ``slots`` slots."""
    count = vectors.size // (slots * WIDTH)
    for i in range(count):
        store(vectors, to * count + i, load(vectors, source * count + i))


@inlined
def _copy_lane(lanes, to, source):
    """Copy the scalars of lane ``source`` to lane ``to``."""
    lanes.sigma[to], lanes.status[to] = lanes.sigma[source], lanes.status[source]
    lanes.trajectory[to], lanes.point[to] = lanes.trajectory[source], lanes.point[source]
    lanes.first_step[to], lanes.first_entry[to] = lanes.first_step[source], lanes.first_entry[source]
    for i in range(len(lanes.matrix_sigma)):
        lanes.matrix_sigma[i, to] = lanes.matrix_sigma[i, source]


@inlined
def release_slot(lanes, slots, slot):
    """Remove a slot that has no pack from those in use: the pack in the last used slot is moved into it."""
    last, count = slots.counters[0] - 1, len(slots.active)
    slots.counters[0] = last
    _copy_slot(lanes.vectors, count, slot, last)
    _copy_slot(lanes.tangents, count, slot, last)
    _copy_slot(lanes.measures, count, slot, last)
    _copy_slot(lanes.point_rows, count, slot, last)
    slots.active[slot], slots.period[slot] = slots.active[last], slots.period[last]
    slots.step_minus_tick[slot], slots.stop[slot] = slots.step_minus_tick[last], slots.stop[last]
    slots.due[slot] = slots.due[last]
    slots.row_minus_tick[slot], slots.matrix_buffer[slot] = slots.row_minus_tick[last], slots.matrix_buffer[last]
    slots.matrices[slot] = slots.matrices[last] - (last - slot) * rows_per_slot(lanes)
    for i in range(WIDTH):
        _copy_lane(lanes, slot * WIDTH + i, last * WIDTH + i)


@inlined
def _normalise(dims, tangents, row, lengths):
    """Divide the tangent vector in rows ``row`` to ``row + d - 1`` by its length, unless that is 0; the length of each
    lane is written to ``lengths`` (WIDTH,)."""
    square, zero = broadcast(0.0), broadcast(0.0)
    for i in range(len(dims)):
        square = vfma(load(tangents, row + i), load(tangents, row + i), square)
    length = vsqrt(square)
    store(lengths, 0, length)
    for i in range(len(dims)):
        vector = load(tangents, row + i)
        store(tangents, row + i, select(zero < length, vector / length, vector))


@subroutine
def orthonormalise(dims, tangents, first, lengths, growth, trajectories):
    """Gram–Schmidt on the K tangent vectors of a slot, coordinate i of vector c in row ``first + c * d + i``.

    The logarithms of their lengths are added to ``growth`` (K, L), in the columns of the pack's ``trajectories``
    (active,). ``lengths`` (at least WIDTH,) is overwritten.
    """
    d = len(dims)
    for c in range(len(growth)):
        row = first + c * d
        for e in range(c):
            other, dot = first + e * d, broadcast(0.0)
            for i in range(d):
                dot = vfma(load(tangents, row + i), load(tangents, other + i), dot)
            dot = broadcast(-1.0) * dot
            for i in range(d):
                store(tangents, row + i, vfma(dot, load(tangents, other + i), load(tangents, row + i)))
        _normalise(dims, tangents, row, lengths)
        for l in range(len(trajectories)):
            if lengths[l] > 0.0:
                growth[c, trajectories[l]] += log(lengths[l])
