"""A step in which contact may change, for systems with several contacts: from switch to switch.

The motion with a contact set is a polynomial on the whole step, linear in the state at its start. After a switch the
motion is that of the new set from the state at the start of the step, its *origin*, that leads through the state at the
switch. s in [0, 1] is the fraction of the step; the gaps of a contact set are positive inside it.
"""

from __future__ import annotations

from math import sqrt

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.many_contacts.contact_measures import keep_segment, shift_series
from gearchaos.flow.kernels.many_contacts.contact_sets import (
    after_step,
    displacement,
    dot,
    find_set,
    mesh_closed,
    pushing,
    values_at,
)
from gearchaos.flow.kernels.one_spring.contact import NO_ROOT, first_roots
from gearchaos.flow.kernels.vector.arrays import releases
from gearchaos.flow.kernels.vector.constants import CHATTER, MAX_SWITCHES, OK, ORDER, WIDTH
from gearchaos.flow.kernels.vector.simd import bits, broadcast, fma, load, store, vabs, vfma

_SAME_INSTANT = 1e-9  # two switches that are closer, as a fraction of the step, are found by the careful search
_ITERATIONS = 12
_EXACT = 1e-17  # error of a switch, as a fraction of the step, with which the iteration ends


@inlined
def output_series(dims, tables, place, entry, work, measuring):
    """Polynomials of the outputs on a step from its origin ``work.w``, to ``work.outputs``; that of the measured
    velocity only if ``measuring``."""
    d, columns, outputs = len(dims), tables.outputs[place, tables.linear[place, entry]], work.outputs
    for row in range(len(outputs) if measuring else len(outputs) - 1):
        constant = tables.shift_outputs[place, entry]
        low, high = load(constant, 2 * row), load(constant, 2 * row + 1)
        for j in range(d):
            low = vfma(broadcast(work.w[j]), load(columns, 2 * (row * d + j)), low)
            high = vfma(broadcast(work.w[j]), load(columns, 2 * (row * d + j) + 1), high)
        store(outputs, 2 * row, low)
        store(outputs, 2 * row + 1, high)


@subroutine
def _falling_root(displacement, side, o0, o1, o2, gap0, slope0, gap1, slope1, begin):
    """The root after ``begin`` of ±(side·displacement − offset), which falls from gap0 > 0 to gap1 <= 0 on the rest of
    the step, with these slopes at its ends; −1 if not found.

    It begins with the cubic polynomial with these ends, and goes on by Halley's method.
    """
    rest = 1.0 - begin
    a1, end = slope0 * rest, slope1 * rest
    a2, a3 = 3.0 * (gap1 - gap0) - 2.0 * a1 - end, 2.0 * (gap0 - gap1) + a1 + end
    t = 2.0 * gap0 / (sqrt(max(a1 * a1 - 4.0 * gap0 * (a2 + a3), 0.0)) - a1)
    t -= (gap0 + t * (a1 + t * (a2 + t * a3))) / (a1 + t * (2.0 * a2 + 3.0 * t * a3))
    s = begin + rest * t
    for _ in range(_ITERATIONS):
        value, slope, half = displacement[ORDER], 0.0, 0.0  # half the second derivative
        for k in range(ORDER - 1, -1, -1):
            half, slope, value = fma(half, s, slope), fma(slope, s, value), fma(value, s, displacement[k])
        value, slope = side * value - (o0 + s * (o1 + s * o2)), side * slope - (o1 + 2.0 * s * o2)
        half = side * half - o2
        change = value * slope / (slope * slope - value * half)
        s -= change
        if abs(change * change * change) * (slope * slope + half * half) < _EXACT * slope * slope:
            return s
    return -1.0


@inlined
def _doubtful(points, m, offset, closed, begin, z0, z1, half, second):
    """The contacts whose gaps may vanish on the rest of a step, as far as their values at its ends say, (z0 and z1 of
    mesh m), and the bound ``second`` of the second derivatives beside 2 ``half``, that of the displacement."""
    found, rest = 0, 1.0 - begin
    zero, share = broadcast(0.0), broadcast(0.125 * rest * rest)
    vectors = len(points.sides) // WIDTH
    for v in range(vectors):
        o0, o1, o2 = load(offset, v), load(offset, vectors + v), load(offset, 2 * vectors + v)
        side = load(points.sides, v)
        gap0 = side * broadcast(z0) - vfma(broadcast(begin), vfma(broadcast(begin), o2, o1), o0)
        gap1 = side * broadcast(z1) - (o0 + o1 + o2)
        bent = share * (vabs(side * broadcast(half) - o2) * broadcast(2.0) + broadcast(second))
        opens = bits((bent < gap0) & (bent < gap1))
        stays = bits((gap0 < zero - bent) & (gap1 < zero - bent))
        here = closed >> (v * WIDTH)
        found |= (~((here & opens) | (~here & stays)) & (1 << WIDTH) - 1) << (v * WIDTH)
    return found


@inlined
def _slope(series, s):
    """The derivative of a polynomial at s."""
    found = ORDER * series[ORDER]
    for k in range(ORDER - 1, 0, -1):
        found = fma(found, s, k * series[k])
    return found


@inlined
def _next_switch(dims, points, p, tables, place, step, closed, begin, switched, last, work):
    """The first root of all gaps after ``begin``, more than 1 if there is none, and the set of contacts that have it;
    negative where a gap is not seen to rise, to fall or to stay positive on the rest of the step.

    ``switched`` are the contacts that have switched at ``begin``, in the state ``work.after``; ``last`` (d,) is the
    state at the end of the step. Bounds of the derivatives of a gap are those on the whole step.
    """
    rest, exit_at, switching, first = 1.0 - begin, NO_ROOT, 0, 0
    present, offset, duration = tables.present[place, step], tables.offset[place, step], tables.duration[place, step]
    for m in range(len(points.row)):
        z = work.outputs[m]
        z0, v0 = z[0], z[1]
        if begin > 0.0:
            z0, v0 = dot(dims, points.row[m], work.after), duration * dot(dims, points.rate[m], work.after)
        z1, v1 = dot(dims, points.row[m], last), duration * dot(dims, points.rate[m], last)
        if releases(dims) and m >= len(points.in_contact):
            z0 = displacement(dims, points, p, tables, place, step, m, work.after) if begin > 0.0 else z[0]
            z1 = displacement(dims, points, p, tables, place, step, m, last)
            v0, v1 = _slope(z, begin), _slope(z, 1.0)
        second = third = 0.0
        for k in range(ORDER, 2, -2):
            second += k * (k - 1) * abs(z[k]) + (k - 1) * (k - 2) * abs(z[k - 1])
            third += k * (k - 1) * (k - 2) * abs(z[k]) + (k - 1) * (k - 2) * (k - 3) * abs(z[k - 1])
        doubtful = switched | _doubtful(points, m, offset, closed, begin, z0, z1, z[2], second)
        for e in range(len(points.mesh)):
            if not (doubtful & present) >> e & 1 or points.mesh[e] != m:
                continue
            side, o0, o1, o2 = points.side[e], offset[0, e], offset[1, e], offset[2, e]
            inside = 1.0 if closed >> e & 1 else -1.0
            gap0 = inside * (side * z0 - (o0 + begin * (o1 + begin * o2)))
            gap1 = inside * (side * z1 - (o0 + o1 + o2))
            slope0 = inside * (side * v0 - (o1 + 2.0 * begin * o2))
            if switched >> e & 1:  # gap/(s − begin), which is slope0 at first, has a second derivative of third/3
                if not min(slope0 * rest, gap1) > third * rest * rest * rest / 24.0:
                    return -1.0, 0
                continue
            slope1, bend = inside * (side * v1 - (o1 + 2.0 * o2)), 0.125 * third * rest * rest
            if not gap0 > 0.0 or not (min(slope0, slope1) > bend or max(slope0, slope1) < -bend):
                return -1.0, 0
            if gap1 > 0.0:
                continue
            if switching != 0 and (side == points.side[first] and o0 == offset[0, first] and o1 == offset[1, first]
                                   and o2 == offset[2, first] and points.mesh[first] == m):
                switching |= 1 << e
                continue
            root = _falling_root(z, side, o0, o1, o2, gap0, slope0, gap1, slope1, begin)
            if not (begin <= root <= 1.0) or abs(root - exit_at) < _SAME_INSTANT:
                return -1.0, 0
            if root < exit_at:
                exit_at, switching, first = root, 1 << e, e
    return exit_at, switching


@subroutine
def _search_switch(points, present, offset, closed, begin, switched, work):
    """`_next_switch` by the careful search, which misses no touch: by bounds that follow the motion.

    The gaps of contacts that have just switched begin with 0.
    """
    rest, shifted, exit_at, switching = 1.0 - begin, work.shifted, NO_ROOT, 0
    for row in range(len(work.gaps)):
        work.gaps[row] = 1.0 if row // WIDTH % (ORDER + 1) == 0 else 0.0
    for m in range(len(points.row)):
        shift_series(work.outputs[m], begin, shifted)
        for e in range(len(points.mesh)):
            if points.mesh[e] != m or not present >> e & 1:
                continue
            first, inside = (e // WIDTH) * (ORDER + 1) * WIDTH + e % WIDTH, 1.0 if closed >> e & 1 else -1.0
            o0, o1, o2 = offset[0, e], offset[1, e], offset[2, e]
            for k in range(ORDER + 1):
                work.gaps[first + k * WIDTH] = inside * points.side[e] * shifted[k]
            work.gaps[first] -= inside * (o0 + begin * (o1 + begin * o2))
            work.gaps[first + WIDTH] -= inside * (o1 + 2.0 * begin * o2) * rest
            work.gaps[first + 2 * WIDTH] -= inside * o2 * rest * rest
            if switched >> e & 1:
                work.gaps[first] = 0.0
    for group in range(len(work.exits) // WIDTH):
        first_roots(work.gaps, group * (ORDER + 1), work.exits, group)
    for e in range(len(work.exits)):
        exit_at = min(exit_at, work.exits[e])
    for e in range(len(work.exits)):
        switching |= (1 << e) if work.exits[e] == exit_at else 0
    return (begin + rest * exit_at if 0.0 <= exit_at <= 1.0 else exit_at), switching


@subroutine
def _saltate(dims, points, p, closed, after, switching, duration, offset, end, work):
    """Change tangent vectors where the damping of a mesh begins or ends with a contact switch, at the fraction ``end``
    of a step and in the state ``work.after``.

    Its force D s' jumps, and the instant of the switch changes by −side row·v/g', so that v jumps by
    ∓ push D (s'/g') side row·v.
    """
    d = len(dims)
    closed, after = pushing(dims, points, closed), pushing(dims, points, after)
    for m in range(len(points.in_contact)):
        change = (1.0 if mesh_closed(points, after, m) else 0.0) - (1.0 if mesh_closed(points, closed, m) else 0.0)
        if not points.in_contact[m] or change == 0.0:
            continue
        for e in range(len(points.mesh)):
            if points.mesh[e] == m and switching >> e & 1:
                rate = dot(dims, points.rate[m], work.after)
                moved = (offset[1, e] + 2.0 * end * offset[2, e]) / duration
                ratio = 1.0 if moved == 0.0 else points.side[e] * rate / (points.side[e] * rate - moved)
                for c in range(len(work.tangents)):
                    jump = change * points.damping[p, m] * ratio * dot(dims, points.row[m], work.tangents[c])
                    for i in range(d):
                        work.tangents[c, i] -= points.push[p, m, i] * jump
                break


@inlined
def _apply(dims, values, first, vector, constant, result):
    """Write a column matrix, which begins at ``first`` of the ``values``, times a vector to ``result``, beside a
    ``constant`` (d,) if that has elements."""
    d = len(dims)
    for i in range(d):
        total = constant[i] if len(constant) > 0 else 0.0
        for j in range(d):
            total = fma(values[first + j * d + i], vector[j], total)
        result[i] = total


@inlined
def resolve(dims, points, p, tables, place, step, entry, measuring, work):
    """Advance ``work.w`` and the tangent vectors from switch to switch to the origins of a step whose motion no longer
    switches; returns the entry of its contact set and the status.
    """
    d, begin, switched, closed, last, none = len(dims), 0.0, 0, tables.closed[place, entry], work.last, work.shifts[:0]
    present, offset, duration = tables.present[place, step], tables.offset[place, step], tables.duration[place, step]
    for _ in range(MAX_SWITCHES):
        output_series(dims, tables, place, entry, work, measuring)
        after_step(dims, tables, place, entry, work.w, last)
        end, switching = _next_switch(dims, points, p, tables, place, step, closed, begin, switched, last, work)
        if end < 0.0:
            end, switching = _search_switch(points, present, offset, closed, begin, switched, work)
        if end < 0.0:
            return entry, CHATTER
        over, end = end > 1.0, min(end, 1.0)
        after = closed if over else closed ^ switching
        if measuring:
            keep_segment(dims, points, p, tables, place, step, begin, end, closed, after, work)
        if over:
            return entry, OK
        values_at(tables.columns[place, tables.linear[place, entry]], end, work.values)
        values_at(tables.shifts[place, entry], end, work.shifts)
        _apply(dims, work.values, 0, work.w, work.shifts, work.after)
        for c in range(len(work.tangents)):
            _apply(dims, work.values, 0, work.tangents[c], none, work.w)
            for i in range(d):
                work.tangents[c, i] = work.w[i]
        if len(work.tangents) > 0:
            _saltate(dims, points, p, closed, after, switching, duration, offset, end, work)
        closed, begin, switched = after, end, switching
        entry = find_set(dims, points, p, tables, place, step, closed, work)
        values_at(tables.columns[place, tables.linear[place, entry]], end, work.values)
        values_at(tables.shifts[place, entry], end, work.shifts)
        for i in range(d):
            work.last[i] = work.after[i] - work.shifts[i]
        back = len(work.values) // 2  # of the motion from there to the origin: the linear part does not change in time
        _apply(dims, work.values, back, work.last, none, work.w)
        for c in range(len(work.tangents)):
            _apply(dims, work.values, back, work.tangents[c], none, work.last)
            for i in range(d):
                work.tangents[c, i] = work.last[i]
        if end == 1.0:
            return entry, OK
    return entry, CHATTER
