"""The measures of motions with several contacts: of each mesh, from the segments between switches, `WIDTH` together."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.many_contacts.contact_sets import pushing
from gearchaos.flow.kernels.one_spring.measures import add_forces, measure_segment
from gearchaos.flow.kernels.vector.arrays import rows
from gearchaos.flow.kernels.vector.constants import ORDER, WIDTH
from gearchaos.flow.kernels.vector.measure import FIRST, Measure
from gearchaos.flow.kernels.vector.simd import broadcast, load, select, store, vfma

_FIRST = np.array([FIRST[measure.combined] for measure in Measure])
"""With what each measure begins, which tells how parts combine: 0 are added, −∞ and ∞ give way to any other value."""


@subroutine
def shift_series(polynomial, begin, shifted):
    """The polynomial on the rest of a step, from ``begin`` on, by repeated division."""
    for k in range(ORDER + 1):
        shifted[k] = polynomial[k]
    if begin == 0.0:
        return
    for n in range(ORDER):
        for k in range(ORDER - 1, n - 1, -1):
            shifted[k] += begin * shifted[k + 1]
    scale = 1.0
    for k in range(1, ORDER + 1):
        scale *= 1.0 - begin
        shifted[k] *= scale


@inlined
def load_measures(call, lane, work):
    """Copy the measures of a trajectory of the call to the workspace."""
    count = len(_FIRST)
    for every in range(len(call.measures)):
        m, row = every // count, every % count
        for l in range(WIDTH):
            known = l == 0 or row == Measure.Z_REFERENCE
            work.measures[m, row * WIDTH + l] = call.measures[every, lane] if known else _FIRST[row]


@inlined
def store_measures(call, lane, work):
    """Copy the measures in the workspace to those of a trajectory of the call."""
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


@subroutine
def _add_rates_and_forces(ws):
    """Polynomials of the velocities and of the mesh forces of the segments kept, from those of the displacements, and
    from the stiffness, the damping and the offsets in the force, which rows ``stiffness``, ``level`` and ``force``
    have."""
    at, zero = rows((0, 0)), broadcast(0.0)
    spring, damping, duration = load(ws, at.stiffness), load(ws, at.level), load(ws, at.duration)
    per_time = select(zero < duration, broadcast(1.0) / duration, zero)
    for k in range(ORDER + 1):
        rate = zero
        if k < ORDER:
            rate = broadcast(k + 1.0) * load(ws, at.state + 2 * k + 2) * per_time
        store(ws, at.state + 2 * k + 1, rate)
        force = vfma(spring, load(ws, at.state + 2 * k), damping * rate)
        store(ws, at.force + k, force + load(ws, at.force + k) if k < 3 else force)


@subroutine
def _measure_kept(work):
    """Add the segments that are kept to the measures."""
    at = rows((0, 0))
    for m in range(len(work.rows)):
        ws = work.rows[m]
        for l in range(work.progress[3], WIDTH):  # positions without a segment
            ws[at.duration * WIDTH + l] = ws[at.end_fraction * WIDTH + l] = 0.0
            ws[at.next_sigma * WIDTH + l] = ws[at.sigma * WIDTH + l]
        _add_rates_and_forces(ws)
        measure_segment((0, 0), ws, work.measures[m], 0)
        add_forces((0, 0), ws, work.measures[m], 0)
    work.progress[3] = 0


@inlined
def keep_segment(dims, points, p, tables, place, step, begin, end, closed, after, work):
    """Keep the segment from ``begin`` to ``end`` of a step to be measured: displacement and force of each mesh, and the
    measured velocity. `WIDTH` segments are measured together.

    ``closed`` and ``after`` are the contact sets on it and after it; ``work.outputs`` the polynomials on the step.
    """
    at, l, rest = rows((0, 0)), work.progress[3], 1.0 - begin
    closed, after = pushing(dims, points, closed), pushing(dims, points, after)
    shifted, offset = work.shifted, tables.offset[place, step]
    for m in range(len(points.in_contact)):
        ws, now, then, spring = work.rows[m], 0.0, 0.0, 0.0
        force0 = force1 = force2 = 0.0
        for e in range(len(points.mesh)):
            if points.mesh[e] == m:
                side = points.side[e]
                then = side if after >> e & 1 else then
                if closed >> e & 1:
                    now, push = side, side * tables.stiffness[place, step, e]
                    spring += tables.stiffness[place, step, e]
                    force0 -= push * (offset[0, e] + begin * (offset[1, e] + begin * offset[2, e]))
                    force1 -= push * (offset[1, e] + 2.0 * begin * offset[2, e]) * rest
                    force2 -= push * offset[2, e] * rest * rest
        ws[at.sigma * WIDTH + l], ws[at.next_sigma * WIDTH + l] = now, then
        ws[at.duration * WIDTH + l] = tables.duration[place, step] * rest
        ws[at.end_fraction * WIDTH + l] = (end - begin) / rest
        ws[at.stiffness * WIDTH + l] = spring
        ws[at.level * WIDTH + l] = points.damping[p, m] if now != 0.0 or not points.in_contact[m] else 0.0
        ws[at.force * WIDTH + l] = force0
        ws[(at.force + 1) * WIDTH + l], ws[(at.force + 2) * WIDTH + l] = force1, force2
        shift_series(work.outputs[m], begin, shifted)
        for k in range(ORDER + 1):
            ws[(at.state + 2 * k) * WIDTH + l] = shifted[k]
        shift_series(work.outputs[len(points.row)], begin, shifted)
        for k in range(ORDER + 1):
            ws[(at.velocity + k) * WIDTH + l] = shifted[k]
    work.progress[3] += 1
    if work.progress[3] == WIDTH:
        _measure_kept(work)
