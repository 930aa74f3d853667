"""The main loop: advance many lanes by many mesh periods, step by step."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.affine import (
    affine_step,
    append_lanes,
    find_suspects,
    list_suspects,
    load_bounds,
    update_matrices,
)
from gearchaos.flow.kernels.arrays import LENGTH, position_of, rows_per_slot, state_index
from gearchaos.flow.kernels.compilation import inlined, main_kernel
from gearchaos.flow.kernels.constants import WIDTH
from gearchaos.flow.kernels.measures import measure_step, prepare_measures
from gearchaos.flow.kernels.resolve import resolve
from gearchaos.flow.kernels.simd import bits, load, load_scalar, store_linear, store_scalar
from gearchaos.flow.kernels.slots import end_period, load_pack, release_slot
from gearchaos.flow.kernels.tangents import orthonormalise

_NO_STATE = np.nan
"""Contact state of a matrix buffer without matrices; NaN is unequal to every contact state."""

_NO_TICK = 1 << 62
"""Later than any tick."""


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
    slot, due = 0, _NO_TICK
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
