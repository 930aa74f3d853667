"""Motion with several one-sided contacts: step by step, and where contact may change from switch to switch.

A step is affine as long as the contact set stays. It is *resolved* where a gap may vanish: the first root of all gaps
ends a segment, the contacts with that root switch together, and the rest of the step follows.
"""

from __future__ import annotations

from math import cos, log, sin, sqrt

import numpy as np

from gearchaos.flow.kernels.arrays import rows
from gearchaos.flow.kernels.compilation import inlined, main_kernel, subroutine
from gearchaos.flow.kernels.constants import (
    CHATTER,
    DIVERGED,
    DIVERGED_AT,
    MAX_SWITCHES,
    OK,
    ORDER,
    TWO_PI,
    WIDTH,
)
from gearchaos.flow.kernels.contact import NO_ROOT, first_roots
from gearchaos.flow.kernels.contact_sets import (
    OFFSETS,
    add_harmonics,
    fill_steps,
    find_set,
    linear_series,
    mesh_closed,
    set_equations,
    value_at,
)
from gearchaos.flow.kernels.measure import FIRST, Measure
from gearchaos.flow.kernels.measures import add_forces, measure_segment

_FEW_HARMONICS = 3  # up to which they are evaluated anew, instead of their polynomials shifted
_FIRST = np.array([FIRST[measure.combined] for measure in Measure])
"""With what each measure begins, which tells how parts combine: 0 are added, −∞ and ∞ give way to any other value."""


@inlined
def _dot(dims, row, w):
    """row·w."""
    total = 0.0
    for i in range(len(dims)):
        total += row[i] * w[i]
    return total


@inlined
def _closed_contacts(dims, points, tables, place, step, w):
    """The contact set of a state at the start of a step."""
    closed = 0
    for e in range(len(points.mesh)):
        if tables.present[place, step] >> e & 1:
            gap = points.side[e] * _dot(dims, points.row[points.mesh[e]], w) - tables.offset[place, step, e, 0]
            closed |= (1 << e) if gap > 0.0 else 0
    return closed


@inlined
def _may_switch(dims, points, tables, place, entry, step, closed, before, after):
    """Whether a contact may switch in a step: whether a gap is smaller at its beginning or end than it may differ from
    its chord."""
    d, contacts, deviation = len(dims), len(points.mesh), tables.deviation[place, entry]
    present, offset = tables.present[place, step], tables.offset[place, step]
    for m in range(len(points.row)):
        start, end = _dot(dims, points.row[m], before), _dot(dims, points.row[m], after)
        first = contacts + m * (1 + d)
        others = 0.0
        for i in range(d):
            others += deviation[first + 1 + i] * abs(before[i] - start * points.unit[m, i])
        for e in range(contacts):
            if points.mesh[e] == m and present >> e & 1:
                inside = 1.0 if closed >> e & 1 else -1.0
                gap = inside * (points.side[e] * start - offset[e, 0])
                later = inside * (points.side[e] * end - (offset[e, 0] + offset[e, 1] + offset[e, 2]))
                if not min(gap, later) > deviation[e] + deviation[first] * abs(gap) + others:
                    return True
    return False


@subroutine
def _shift_forcing(dims, source, start, rest, shifted):
    """The polynomial (ORDER + 1, d) of a forcing about ``start``, over the ``rest`` of the step, by repeated
    division."""
    for i in range(len(dims)):
        for k in range(ORDER + 1):
            shifted[k, i] = source[k, i]
        if source[1, i] != 0.0 or source[2, i] != 0.0:
            for n in range(ORDER):
                for k in range(ORDER - 1, n - 1, -1):
                    shifted[k, i] += start * shifted[k + 1, i]
            scale = 1.0
            for k in range(1, ORDER + 1):
                scale *= rest
                shifted[k, i] *= scale


@subroutine
def _segment_equations(dims, points, p, tables, place, step, start, rest, closed, work):
    """The equations on the rest of a step, from its fraction ``start`` on, with a contact set, in the workspace."""
    d, source = len(dims), tables.force[place, step]
    for e in range(len(points.mesh)):
        o = tables.offset[place, step, e]
        work.offset[e, 0] = o[0] + start * (o[1] + start * o[2])
        work.offset[e, 1], work.offset[e, 2] = (o[1] + 2.0 * start * o[2]) * rest, o[2] * rest * rest
    if start == 0.0:
        set_equations(dims, points, p, tables.stiffness[place, step], closed, work.offset, source, work)
        return
    shifted = work.series[d]  # the polynomial of the forcing about ``start``
    if len(points.orders) <= _FEW_HARMONICS:
        shifted[:] = 0.0
        for i in range(d):
            shifted[0, i] = points.f0[p, i]
        share = tables.duration[place, step] * points.omega[p] / TWO_PI
        add_harmonics(dims, points, p, tables.phase[place, step] + start * share,
                      tables.duration[place, step] * rest, shifted)
    else:
        _shift_forcing(dims, source, start, rest, shifted)
    set_equations(dims, points, p, tables.stiffness[place, step], closed, work.offset, shifted, work)


@subroutine
def _displacements(dims, points, series, displacement):
    """Polynomials (K, ORDER + 1) of the displacements of the meshes, from those of the coordinates."""
    for m in range(len(points.row)):
        for k in range(ORDER + 1):
            displacement[m, k] = _dot(dims, points.row[m], series[k])


@subroutine
def _gap_series(points, present, closed, switched, work):
    """Polynomials of the gaps within a contact set, positive inside; those of absent contacts are 1.

    The gaps of the contacts in ``switched``, which have just switched, begin with 0.
    """
    groups = len(work.exits) // WIDTH
    for e in range(groups * WIDTH):
        first = (e // WIDTH) * (ORDER + 1) * WIDTH + e % WIDTH
        there = e < len(points.mesh) and present >> e & 1
        if not there:
            for k in range(ORDER + 1):
                work.gaps[first + k * WIDTH] = 1.0 if k == 0 else 0.0
            continue
        inside, displacement = 1.0 if closed >> e & 1 else -1.0, work.displacement[points.mesh[e]]
        for k in range(ORDER + 1):
            work.gaps[first + k * WIDTH] = inside * points.side[e] * displacement[k]
        for k in range(OFFSETS):
            work.gaps[first + k * WIDTH] -= inside * work.offset[e, k]
        if switched >> e & 1:
            work.gaps[first] = 0.0


@inlined
def _first_exit(work):
    """The first root of all gaps, more than 1 if there is none, negative if the search failed; and the set of contacts
    that have it."""
    exit_at, switching = NO_ROOT, 0
    for group in range(len(work.exits) // WIDTH):
        first_roots(work.gaps, group * (ORDER + 1), work.exits, group)
    for e in range(len(work.exits)):
        exit_at = min(exit_at, work.exits[e])
    for e in range(len(work.exits)):
        switching |= (1 << e) if work.exits[e] == exit_at else 0
    return exit_at, switching


@subroutine
def _measure_kept(work):
    """Add the segments that are kept to the measures."""
    at = rows((0, 0))
    for m in range(len(work.rows)):
        ws = work.rows[m]
        for l in range(work.progress[3], WIDTH):  # positions without a segment
            ws[at.duration * WIDTH + l] = ws[at.end_fraction * WIDTH + l] = 0.0
            ws[at.next_sigma * WIDTH + l] = ws[at.sigma * WIDTH + l]
        measure_segment((0, 0), ws, work.measures[m], 0)
        add_forces((0, 0), ws, work.measures[m], 0)
    work.progress[3] = 0


@subroutine
def _keep_segment(dims, points, p, tables, place, step, start, duration, end, closed, after, series, work):
    """Keep a segment to be measured: displacement, velocity and force of each mesh. `WIDTH` segments are measured
    together.

    The segment begins at the fraction ``start`` of the step; ``closed`` and ``after`` are the contact sets on it and
    after it, ``series`` the polynomials of the coordinates.
    """
    at, l = rows((0, 0)), work.progress[3]
    _displacements(dims, points, series, work.displacement)
    for m in range(len(points.row)):
        ws, now, then, spring = work.rows[m], 0.0, 0.0, 0.0
        force0 = force1 = force2 = 0.0
        for e in range(len(points.mesh)):
            if points.mesh[e] == m:
                then = points.side[e] if after >> e & 1 else then
                if closed >> e & 1:
                    now, stiffness = points.side[e], tables.stiffness[place, step, e]
                    spring += stiffness
                    force0 -= stiffness * points.side[e] * work.offset[e, 0]
                    force1 -= stiffness * points.side[e] * work.offset[e, 1]
                    force2 -= stiffness * points.side[e] * work.offset[e, 2]
        ws[at.sigma * WIDTH + l], ws[at.next_sigma * WIDTH + l] = now, then
        ws[at.duration * WIDTH + l], ws[at.end_fraction * WIDTH + l] = duration, end
        damping = points.damping[p, m] if now != 0.0 or not points.in_contact[m] else 0.0
        for k in range(ORDER + 1):
            rate = _dot(dims, points.rate[m], series[k])
            ws[(at.state + 2 * k) * WIDTH + l] = work.displacement[m, k]
            ws[(at.state + 2 * k + 1) * WIDTH + l] = rate
            ws[(at.force + k) * WIDTH + l] = damping * rate + spring * work.displacement[m, k]
            ws[(at.velocity + k) * WIDTH + l] = _dot(dims, points.velocity[p], series[k])
        ws[at.force * WIDTH + l] += force0
        ws[(at.force + 1) * WIDTH + l] += force1
        ws[(at.force + 2) * WIDTH + l] += force2
        ws[at.velocity * WIDTH + l] += points.velocity0[p]
        angle = TWO_PI * tables.phase[place, step] + points.omega[p] * start * tables.duration[place, step]
        for h in range(len(points.orders)):
            order, a, b = points.orders[h], points.velocity_cos[p, h], points.velocity_sin[p, h]
            if a == 0.0 and b == 0.0:
                continue
            value = a * cos(order * angle) + b * sin(order * angle)
            slope = b * cos(order * angle) - a * sin(order * angle)
            for k in range(ORDER + 1):
                ws[(at.velocity + k) * WIDTH + l] += value
                turn = order * points.omega[p] * duration / (k + 1)
                value, slope = slope * turn, -value * turn
    work.progress[3] += 1
    if work.progress[3] == WIDTH:
        _measure_kept(work)


@subroutine
def _saltate(dims, points, p, closed, after, switching, duration, end, work):
    """Change tangent vectors where the damping of a mesh begins or ends with a contact switch, at the fraction ``end``
    of a segment and in the state ``work.after``.

    Its force D s' jumps, and the instant of the switch changes by −side row·v/g', so that v jumps by
    ∓ push D (s'/g') side row·v.
    """
    d = len(dims)
    for m in range(len(points.row)):
        change = (1.0 if mesh_closed(points, after, m) else 0.0) - (1.0 if mesh_closed(points, closed, m) else 0.0)
        if not points.in_contact[m] or change == 0.0:
            continue
        for e in range(len(points.mesh)):
            if points.mesh[e] == m and switching >> e & 1:
                rate = _dot(dims, points.rate[m], work.after)
                moved = (work.offset[e, 1] + 2.0 * end * work.offset[e, 2]) / duration
                ratio = 1.0 if moved == 0.0 else points.side[e] * rate / (points.side[e] * rate - moved)
                for c in range(len(work.tangents)):
                    jump = change * points.damping[p, m] * ratio * _dot(dims, points.row[m], work.tangents[c])
                    for i in range(d):
                        work.tangents[c, i] -= points.push[p, m, i] * jump
                break


@subroutine
def _resolve(dims, points, p, tables, place, step, closed, measuring, work):
    """Advance ``work.w`` and the tangent vectors over a step from switch to switch; returns the contact set at its end
    and the status."""
    d, start, rest, switched = len(dims), 0.0, 1.0, 0
    series = work.series[d + 1]
    for _ in range(MAX_SWITCHES):
        duration = tables.duration[place, step] * rest
        _segment_equations(dims, points, p, tables, place, step, start, rest, closed, work)
        motion = work.series[0]
        for i in range(d):
            motion[0, i] = work.w[i]
        linear_series(dims, points.integral, duration, work.linear, work.force, True, motion)
        _displacements(dims, points, motion, work.displacement)
        _gap_series(points, tables.present[place, step], closed, switched, work)
        end, switching = _first_exit(work)
        if end < 0.0:
            return closed, CHATTER
        over, end = end > 1.0, min(end, 1.0)
        after = closed if over else closed ^ switching
        if measuring:
            _keep_segment(dims, points, p, tables, place, step, start, duration, end, closed, after, motion, work)
        for i in range(d):
            work.after[i] = value_at(motion, i, end)
        for c in range(len(work.tangents)):
            for i in range(d):
                series[0, i] = work.tangents[c, i]
            linear_series(dims, points.integral, duration, work.linear, work.force, False, series)
            for i in range(d):
                work.tangents[c, i] = value_at(series, i, end)
        if not over and len(work.tangents) > 0:
            _saltate(dims, points, p, closed, after, switching, duration, end, work)
        for i in range(d):
            work.w[i] = work.after[i]
        closed, switched = after, switching
        start, rest = start + end * rest, rest * (1.0 - end)
        if over or not rest > 0.0:
            return closed, OK
    return closed, CHATTER


@inlined
def _advance_affine(dims, matrix, work):
    """Advance ``work.w``, whose state after the step is in ``work.after``, and the tangent vectors by a step matrix."""
    moved = work.linear[0]
    for c in range(len(work.tangents)):
        for i in range(len(dims)):
            total = 0.0
            for j in range(len(dims)):
                total += matrix[j, i] * work.tangents[c, j]
            moved[i] = total
        for i in range(len(dims)):
            work.tangents[c, i] = moved[i]
    for i in range(len(dims)):
        work.w[i] = work.after[i]


@subroutine
def _orthonormalise(dims, tangents, growth, lane):
    """Gram–Schmidt on tangent vectors (T, d); the logarithms of their lengths are added to column ``lane`` of
    ``growth`` (T, L)."""
    for c in range(len(tangents)):
        for e in range(c):
            dot = _dot(dims, tangents[c], tangents[e])
            for i in range(len(dims)):
                tangents[c, i] -= dot * tangents[e, i]
        length = sqrt(_dot(dims, tangents[c], tangents[c]))
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
    for e in range(len(points.mesh)):
        if points.mesh[e] == 0 and closed >> e & 1:
            target[len(dims), lane] = points.side[e]


@inlined
def _run_period(dims, points, call, tables, place, lane, period, measuring, work):
    """Advance a trajectory by a period; returns the status."""
    p, entry, closed, d = tables.point[place], -1, 0, len(dims)
    every = points.orthonormalise_every[p]
    for step in range(tables.steps[place]):
        piece = tables.piece[place, step]
        if piece >= 0:
            closed, entry = _closed_contacts(dims, points, tables, place, step, work.w), -1
            if len(call.samples) > 0 and points.sample[piece] >= 0:
                _sample(dims, points, call.samples[period, points.sample[piece]], lane, closed, work.w)
        following = -1 if entry < 0 else tables.follows[place, entry]
        if following < 0:
            following = find_set(dims, points, p, tables, place, step, closed, work)
            if entry >= 0 and tables.step[place, entry] == step - 1 and tables.closed[place, entry] == closed:
                tables.follows[place, entry] = following
        entry = following
        matrix = tables.matrix[place, entry]
        for i in range(d):
            total = matrix[d, i]
            for j in range(d):
                total += matrix[j, i] * work.w[j]
            work.after[i] = total
        if _may_switch(dims, points, tables, place, entry, step, closed, work.w, work.after):
            before = closed
            closed, status = _resolve(dims, points, p, tables, place, step, closed, measuring, work)
            if status != OK:
                return status
            if closed != before:
                entry = -1
        else:
            if measuring:
                _segment_equations(dims, points, p, tables, place, step, 0.0, 1.0, closed, work)
                motion, duration = work.series[0], tables.duration[place, step]
                for i in range(d):
                    motion[0, i] = work.w[i]
                linear_series(dims, points.integral, duration, work.linear, work.force, True, motion)
                _keep_segment(dims, points, p, tables, place, step, 0.0, duration, 1.0, closed, closed, motion, work)
            _advance_affine(dims, matrix, work)
        if len(call.growth) > 0 and (step + 1 == tables.steps[place] or (step + 1) % every == 0):
            _orthonormalise(dims, work.tangents, call.growth[period], lane)
    return OK


@inlined
def _load_lane(dims, call, lane, work):
    """Copy a trajectory of the call to the workspace."""
    for i in range(len(dims)):
        work.w[i] = call.w[i, lane]
        for c in range(len(work.tangents)):
            work.tangents[c, i] = call.tangent[c, i, lane]
    count = len(_FIRST)
    for every in range(len(call.measures)):
        m, row = every // count, every % count
        for l in range(WIDTH):
            known = l == 0 or row == Measure.Z_REFERENCE
            work.measures[m, row * WIDTH + l] = call.measures[every, lane] if known else _FIRST[row]


@inlined
def _store_lane(dims, call, lane, work):
    """Copy the results in the workspace to the arrays of the call."""
    for i in range(len(dims)):
        call.w[i, lane] = work.w[i]
        for c in range(len(work.tangents)):
            call.tangent[c, i, lane] = work.tangents[c, i]
    if len(call.measures) > 0 and work.progress[3] > 0:
        _measure_kept(work)
    count = len(_FIRST)
    for every in range(len(call.measures)):
        m, row = every // count, every % count
        found = work.measures[m, row * WIDTH]
        for l in range(1, WIDTH):
            other = work.measures[m, row * WIDTH + l]
            found = found + other if _FIRST[row] == 0.0 else (
                max(found, other) if _FIRST[row] < 0.0 else min(found, other))
        call.measures[every, lane] = found


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
            fill_steps(dims, points, p, tables, place)
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
