"""Who sits where: chunks of a call come to the seats of a block, and leave with what became of them."""

from __future__ import annotations

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import DIVERGED, DIVERGED_AT, OK, measure_of, place_of, seat_of, seat_rows
from gearchaos.flow.simd import WIDTH, bits, load, splat, store, vabs


@inlined
def state_of(lanes, d, l, now):
    """Where the state of lane l begins among the vectors' floats; its coordinates stand `WIDTH` apart."""
    return (seat_of(l) * seat_rows(lanes) + now * d) * WIDTH + place_of(l)


@inlined
def _seat_lane(call, courses, lanes, number, l, now):
    """Put a trajectory of the call at lane l; its contact state follows from z alone."""
    point, z = call.points[number], call.w[0, number]
    lanes.number[l], lanes.point[l], lanes.status[l] = number, point, OK
    lanes.node[l], lanes.row[l] = courses.node[point], courses.row[point]
    lanes.sigma[l] = 1.0 if z > 1.0 else (-1.0 if z < -1.0 else 0.0)
    first = state_of(lanes, len(call.w), l, now)
    for i in range(len(call.w)):
        lanes.vectors[first + i * WIDTH] = call.w[i, number]
        for c in range(len(call.v)):
            lanes.tangents[seat_of(l), now, c, i, place_of(l)] = call.v[c, i, number]
    for i in range(len(call.measures)):
        lanes.measures[measure_of(l, i)] = call.measures[i, number]


@inlined
def take(call, courses, lanes, seats, seat, now):
    """Have the next chunk take a seat."""
    chunk, live = seats.state[1], 0
    for i in range(WIDTH):
        if call.who[chunk, i] >= 0:
            _seat_lane(call, courses, lanes, call.who[chunk, i], seat * WIDTH + i, now)
            live += 1
    seats.live[seat], seats.period[seat], seats.state[1] = live, 0, chunk + 1


@inlined
def _leave(call, lanes, l, now):
    """Keep what became of lane l."""
    number, first = lanes.number[l], state_of(lanes, len(call.w), l, now)
    call.status[number] = lanes.status[l]
    for i in range(len(call.w)):
        call.w[i, number] = lanes.vectors[first + i * WIDTH]
        for c in range(len(call.v)):
            call.v[c, i, number] = lanes.tangents[seat_of(l), now, c, i, place_of(l)]
    for i in range(len(call.measures)):
        call.measures[i, number] = lanes.measures[measure_of(l, i)]


@inlined
def _keep(call, lanes, l, now, section):
    """Keep the state of lane l as one of its sections."""
    first = state_of(lanes, len(call.w), l, now)
    for i in range(len(call.w)):
        call.sections[section, i, lanes.number[l]] = lanes.vectors[first + i * WIDTH]


@kernel
def _mark_diverged(vectors, at, status, first, live):
    """Note which of the ``live`` lanes from ``first`` on have diverged; their states begin at vector ``at``."""
    most = splat(DIVERGED_AT)
    inside = bits((vabs(load(vectors, at)) < most) & (vabs(load(vectors, at + 1)) < most))
    if inside == (1 << WIDTH) - 1:
        return
    for l in range(live):
        if not inside >> l & 1 and status[first + l] == OK:
            status[first + l] = DIVERGED


@inlined
def end_period(call, lanes, seats, seat, now):
    """Keep what is asked for of the lanes of a seat, and let those go that have had their periods."""
    period, live = seats.period[seat] + 1, seats.live[seat]
    first, wanted = seat * WIDTH, len(call.sections)
    at = state_of(lanes, len(call.w), first, now) // WIDTH
    _mark_diverged(lanes.vectors, at, lanes.status, first, live)
    if call.ends[lanes.number[first + live - 1]] - period < max(1, wanted):  # the first to go
        for l in range(first, first + seats.live[seat]):
            left = call.ends[lanes.number[l]] - period
            if left < wanted:
                _keep(call, lanes, l, now, wanted - 1 - left)
            if left == 0:
                _leave(call, lanes, l, now)
                live -= 1
    seats.live[seat], seats.period[seat] = live, period


@inlined
def _move(vectors, seats, to, of):
    """Copy the vectors of one seat to another."""
    count = vectors.size // (seats * WIDTH)
    for i in range(count):
        store(vectors, to * count + i, load(vectors, of * count + i))


@inlined
def give_up(lanes, seats, seat):
    """Have the chunk on the last seat that is taken move to this one, which no other wants."""
    last = seats.state[0] - 1
    seats.state[0] = last
    _move(lanes.vectors, len(seats.live), seat, last)
    _move(lanes.tangents, len(seats.live), seat, last)
    _move(lanes.measures, len(seats.live), seat, last)
    _move(lanes.kept, len(seats.live), seat, last)
    seats.live[seat], seats.period[seat] = seats.live[last], seats.period[last]
    seats.ahead[seat], seats.pause[seat], seats.due[seat] = seats.ahead[last], seats.pause[last], seats.due[last]
    seats.node[seat], seats.slot[seat] = seats.node[last], seats.slot[last]
    seats.at[seat] = seats.at[last] - (last - seat) * seat_rows(lanes)
    for i in range(WIDTH):
        _move_lane(lanes, seat * WIDTH + i, last * WIDTH + i)


@inlined
def _move_lane(lanes, to, of):
    lanes.sigma[to], lanes.status[to] = lanes.sigma[of], lanes.status[of]
    lanes.number[to], lanes.point[to] = lanes.number[of], lanes.point[of]
    lanes.node[to], lanes.row[to] = lanes.node[of], lanes.row[of]
    for i in range(len(lanes.of)):
        lanes.of[i, to] = lanes.of[i, of]
