"""Motion with several one-sided contacts: step by step, and where contact may change from switch to switch.

A step is affine as long as the contact set stays. It is *resolved* where a gap may vanish: see `contact_switches`. Free
flight far from both flanks, and contact far from its end, take many steps as one, a *leap*.
"""

from __future__ import annotations

from math import log, sqrt

from gearchaos.flow.kernels.compilation import inlined, main_kernel, subroutine
from gearchaos.flow.kernels.many_contacts.contact_arrays import MOST_UNROLLED
from gearchaos.flow.kernels.many_contacts.contact_leaps import leap_in_contact
from gearchaos.flow.kernels.many_contacts.contact_measures import keep_segment, load_measures, store_measures
from gearchaos.flow.kernels.many_contacts.contact_sets import (
    after_step,
    displacement,
    dot,
    fill_steps,
    find_set,
    pushing,
)
from gearchaos.flow.kernels.many_contacts.contact_switches import output_series, resolve
from gearchaos.flow.kernels.vector.arrays import releases
from gearchaos.flow.kernels.vector.constants import DIVERGED, DIVERGED_AT, OK
from gearchaos.flow.kernels.vector.simd import fma


@inlined
def closed_contacts(dims, points, tables, place, step, w, before):
    """The contact set of a state at the start of a step, from that ``before``."""
    anew, p = tables.anew[place, step], tables.point[place]
    closed = before & tables.present[place, step] & ~anew
    if anew != 0:
        for e in range(len(points.mesh)):
            if anew >> e & 1 and tables.present[place, step] >> e & 1:
                at = displacement(dims, points, p, tables, place, step, points.mesh[e], w)
                gap = points.side[e] * at - tables.offset[place, step, 0, e]
                closed |= (1 << e) if gap > 0.0 else 0
    return closed


@inlined
def _within(dims, points, tables, place, entry, r, start, end, before):
    """Whether a displacement surely stays within its limits in a step, from its values at both ends and the state
    before."""
    limits, bends = tables.clear[place, entry, r], tables.bends[place, tables.linear[place, entry], r]
    deviation = limits[3]
    for i in range(len(dims)):
        deviation += bends[i] * abs(before[i] - limits[2] * points.unit[r, i])
    return (min(start, end) - deviation > limits[0]) & (max(start, end) + deviation < limits[1])


@inlined
def _stays(dims, points, tables, place, entry, before, after):
    """Whether surely no contact switches in a step between these states: see `contact_sets.add_set`."""
    stays, meshes = True, len(points.in_contact)
    for m in range(meshes):
        start, end = dot(dims, points.row[m], before), dot(dims, points.row[m], after)
        stays &= _within(dims, points, tables, place, entry, m, start, end, before)
    for r in range(meshes, len(points.row) if releases(dims) else meshes):
        p, step = tables.point[place], tables.step[place, entry]
        start = displacement(dims, points, p, tables, place, step, r, before)
        end = displacement(dims, points, p, tables, place, step, r, after)
        stays &= _within(dims, points, tables, place, entry, r, start, end, before)
    return stays


@inlined
def _skip_steps(points, tables, place, step, entry, w):
    """Advance the state of a system of two coordinates and one mesh over steps in which surely no contact switches;
    returns the step that is next, and the entry of the last one, from that before ``step``."""
    w0, w1, row, unit = w[0], w[1], points.row[0], points.unit[0]
    while step < tables.steps[place] and tables.pause[place, step] == 0:
        following = tables.follows[place, entry]
        if following < 0:
            break
        part, shift, clear = tables.linear[place, following], tables.shift[place, following], tables.clear[
            place, following, 0]
        matrix, bends = tables.matrix[place, part], tables.bends[place, part, 0]
        after0 = fma(matrix[1, 0], w1, fma(matrix[0, 0], w0, shift[0]))
        after1 = fma(matrix[1, 1], w1, fma(matrix[0, 1], w0, shift[1]))
        deviation = clear[3] + (bends[0] * abs(w0 - clear[2] * unit[0]) + bends[1] * abs(w1 - clear[2] * unit[1]))
        start, end = row[0] * w0 + row[1] * w1, row[0] * after0 + row[1] * after1
        if not (min(start, end) - deviation > clear[0] and max(start, end) + deviation < clear[1]):
            break
        w0, w1, entry, step = after0, after1, following, step + 1
    w[0], w[1] = w0, w1
    return step, entry


@inlined
def _measure_whole(dims, points, p, tables, place, step, entry, work):
    """Keep a whole step to be measured, in which no contact switches."""
    output_series(dims, tables, place, entry, work, True)
    closed = tables.closed[place, entry]
    keep_segment(dims, points, p, tables, place, step, 0.0, 1.0, closed, closed, work)


@inlined
def _leap(dims, points, p, tables, place, leap, measuring, work):
    """Find the state after a leap, unless a contact may close in it; returns its entry, or −1."""
    entry = find_set(dims, points, p, tables, place, leap, 0, work)
    after_step(dims, tables, place, entry, work.w, work.after)
    if not _stays(dims, points, tables, place, entry, work.w, work.after):
        return -1
    if measuring:
        _measure_whole(dims, points, p, tables, place, leap, entry, work)
    return entry


@inlined
def advance_tangents(dims, matrix, tangents, moved):
    """Advance tangent vectors (T, d) over a step; ``moved`` (d,) is memory."""
    for c in range(len(tangents)):
        for i in range(len(dims)):
            moved[i] = 0.0
            for j in range(len(dims)):
                moved[i] += matrix[j, i] * tangents[c, j]
        for i in range(len(dims)):
            tangents[c, i] = moved[i]


@subroutine
def _orthonormalise(dims, tangents, growth, lane):
    """Gram–Schmidt on tangent vectors (T, d); the logarithms of their lengths are added to column ``lane`` of
    ``growth`` (T, L)."""
    for c in range(len(tangents)):
        for e in range(c):
            shared = dot(dims, tangents[c], tangents[e])
            for i in range(len(dims)):
                tangents[c, i] -= shared * tangents[e, i]
        length = sqrt(dot(dims, tangents[c], tangents[c]))
        if length > 0.0:
            growth[c, lane] += log(length)
            for i in range(len(dims)):
                tangents[c, i] /= length


@inlined
def _sample(dims, points, target, lane, closed, w):
    """Write the state and the contact state of the first mesh to ``target`` (d + 1, L)."""
    for i in range(len(dims)):
        target[i, lane] = w[i]
    target[len(dims), lane] = 0.0
    closed = pushing(dims, points, closed)
    for e in range(len(points.mesh)):
        if points.mesh[e] == 0 and closed >> e & 1:
            target[len(dims), lane] = points.side[e]


@inlined
def _run_period(dims, points, call, tables, place, lane, period, measuring, work):
    """Advance a trajectory by a period; returns the status."""
    p, entry, closed, d = tables.point[place], -1, 0, len(dims)
    every = points.orthonormalise_every[p]
    skip = len(dims) == 2 and len(points.row) == 1 and not measuring and len(work.tangents) == 0
    step = 0
    while step < tables.steps[place]:
        if skip and entry >= 0:
            step, entry = _skip_steps(points, tables, place, step, entry, work.w)
            if step == tables.steps[place]:
                break
        if tables.pause[place, step] == 1:
            before, closed = closed, closed_contacts(dims, points, tables, place, step, work.w, closed)
            entry = entry if closed == before else -1
            if len(call.samples) > 0 and tables.sample[place, step] >= 0:
                _sample(dims, points, call.samples[period, tables.sample[place, step]], lane, closed, work.w)
        following, taken, leap = -1, 1, tables.leap[place, step]
        if d > MOST_UNROLLED and not measuring and leap >= 0 and closed == tables.leap_closed[place, leap]:
            part = leap_in_contact(dims, points, p, tables, place, step, leap, work)
            taken = points.leap[p, tables.piece[place, step]] if part >= 0 else 1
        elif d == 2 and closed == 0 and leap >= 0:
            following = _leap(dims, points, p, tables, place, leap, measuring, work)
            taken = points.span[p] if following >= 0 else 1
        if taken == 1:
            following = -1 if entry < 0 else tables.follows[place, entry]
            if following < 0:
                following = find_set(dims, points, p, tables, place, step, closed, work)
                if entry >= 0 and tables.step[place, entry] == step - 1 and tables.closed[place, entry] == closed:
                    tables.follows[place, entry] = following
            after_step(dims, tables, place, following, work.w, work.after)
            if _stays(dims, points, tables, place, following, work.w, work.after):
                if measuring:
                    _measure_whole(dims, points, p, tables, place, step, following, work)
            else:
                following, status = resolve(dims, points, p, tables, place, step, following, measuring, work)
                if status != OK:
                    return status
                closed = tables.closed[place, following]
                after_step(dims, tables, place, following, work.w, work.after)
        for i in range(d):
            work.w[i] = work.after[i]
        if following >= 0:
            part = tables.linear[place, following]
        matrices = tables.leap_matrix if following < 0 else tables.matrix
        advance_tangents(dims, matrices[place, part], work.tangents, work.after)
        entry = following if taken == 1 else -1
        step += taken
        if len(call.growth) > 0 and (step == tables.steps[place] or step // every > (step - taken) // every):
            _orthonormalise(dims, work.tangents, call.growth[period], lane)
    return OK


@inlined
def _load_lane(dims, call, lane, work):
    """Copy a trajectory of the call to the workspace."""
    for i in range(len(dims)):
        work.w[i] = call.w[i, lane]
        for c in range(len(work.tangents)):
            work.tangents[c, i] = call.tangent[c, i, lane]
    load_measures(call, lane, work)


@inlined
def _store_lane(dims, call, lane, work):
    """Copy the results in the workspace to the arrays of the call."""
    for i in range(len(dims)):
        call.w[i, lane] = work.w[i]
        for c in range(len(work.tangents)):
            call.tangent[c, i, lane] = work.tangents[c, i]
    store_measures(call, lane, work)


@main_kernel
def advance_contact_sets(dims, points, call, order, tables, work, measuring, most_steps):
    """Advance the trajectories of a call, in the ``order`` (L,) given, by at most about ``most_steps`` steps; returns
    whether any are unfinished.

    ``points``, ``tables`` and ``work`` are `ContactPoints`, `StepTables` and `ContactWork`. The last place of the
    tables serves all points that have none of their own.
    """
    done, d, sections = 0, len(dims), len(call.sections)
    while work.progress[0] < len(order):
        lane = order[work.progress[0]]
        p = call.points[lane]
        place = min(p, len(tables.point) - 1)
        if tables.point[place] != p:
            fill_steps(dims, points, p, tables, place, work)
        if work.progress[2] == 0:
            _load_lane(dims, call, lane, work)
            work.progress[2] = 1
        while work.progress[1] < call.periods[lane]:
            if done > most_steps:
                return True
            status = _run_period(dims, points, call, tables, place, lane, work.progress[1], measuring, work)
            inside = True
            for i in range(min(d, 2)):
                inside &= abs(work.w[i]) < DIVERGED_AT
            call.status[lane] = status if inside else DIVERGED
            work.progress[1] += 1
            done += tables.steps[place]
            left = call.periods[lane] - work.progress[1]
            ended = call.status[lane] != OK
            if ended:  # it stays where it is
                work.progress[1] = call.periods[lane]
            for n in range(sections):
                if left == sections - 1 - n or (ended and left > sections - 1 - n):
                    for i in range(d):
                        call.sections[n, i, lane] = work.w[i]
        _store_lane(dims, call, lane, work)
        work.progress[0] += 1
        work.progress[1] = work.progress[2] = 0
    return False
