"""The assignment of packs to slots: packs of a call enter free slots, and leave them when they have completed their
periods."""

from __future__ import annotations

from gearchaos.flow.kernels.arrays import measure_index, position_of, rows_per_slot, slot_of, state_index
from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.constants import DIVERGED, DIVERGED_AT, OK, WIDTH
from gearchaos.flow.kernels.simd import bits, broadcast, load, store, vabs


@inlined
def _load_lane(call, grids, lanes, trajectory, lane, parity):
    """Copy a trajectory of the call into a lane; its contact state follows from z alone."""
    point, z = call.points[trajectory], call.w[0, trajectory]
    lanes.trajectory[lane], lanes.point[lane], lanes.status[lane] = trajectory, point, OK
    lanes.first_step[lane], lanes.first_entry[lane] = grids.first_step[point], grids.first_entry[point]
    lanes.sigma[lane] = 1.0 if z > 1.0 else (-1.0 if z < -1.0 else 0.0)
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
    """Give the status `DIVERGED` to those of the lanes ``first`` to ``first + active - 1`` that have diverged.

    Their states begin at vector ``state``; ``status`` is `Lanes.status`.
    """
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
    slots.step_minus_tick[slot], slots.stop[slot], slots.due[slot] = (
        slots.step_minus_tick[last], slots.stop[last], slots.due[last]
    )
    slots.row_minus_tick[slot], slots.matrix_buffer[slot] = slots.row_minus_tick[last], slots.matrix_buffer[last]
    slots.matrices[slot] = slots.matrices[last] - (last - slot) * rows_per_slot(lanes)
    for i in range(WIDTH):
        _copy_lane(lanes, slot * WIDTH + i, last * WIDTH + i)
