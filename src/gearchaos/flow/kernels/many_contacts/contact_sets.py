"""Systems with several one-sided contacts: the steps of a point, and the motions with the contact sets met so far.

Between changes of the contact set the motion is linear: its polynomials on a step are linear in the state at the start
of the step, and serve until the set changes. They are made when the set is first met.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.many_contacts.contact_arrays import MOST_UNROLLED, OFFSETS
from gearchaos.flow.kernels.vector.arrays import releases
from gearchaos.flow.kernels.vector.constants import ORDER, TWO_PI, WIDTH
from gearchaos.flow.kernels.vector.simd import broadcast, load, store, vfma

_CONTINUOUS = 1e-12  # an offset that differs by less from one piece to the next, in units of displacement, goes on
_LEAST_PIECE = 1e-14  # shortest piece of a period, as a fraction of it, that gets steps


@subroutine
def _add_harmonics(points, angle, turn, cos_amplitudes, sin_amplitudes, series):
    """Add the polynomials of harmonics (H,) on a step to ``series`` (ORDER + 1,): it begins at ``angle`` of the first
    order and turns by ``turn``."""
    for h in range(len(points.orders)):
        a, b = cos_amplitudes[h], sin_amplitudes[h]
        if a == 0.0 and b == 0.0:
            continue
        c, s = cos(angle * points.orders[h]), sin(angle * points.orders[h])
        value, slope = a * c + b * s, b * c - a * s
        for k in range(ORDER + 1):
            series[k] += value
            value, slope = slope * (turn * points.orders[h] / (k + 1)), -value * (turn * points.orders[h] / (k + 1))


@subroutine
def _fill_rows(dims, points, p, tables, place, step, span, work):
    """Write the steps of point p to a place of the tables, from row ``step`` on, or the leaps of so many steps; returns
    the row after them."""
    first, series, leaps, first_release = 0, work.shifted, 0, len(points.mesh) - len(points.releasing)
    for n in range(len(points.sample)):
        length, count = points.edges[p, n + 1] - points.edges[p, n], points.counts[p, n]
        if length <= _LEAST_PIECE:
            continue
        share = span * (length / count)
        for i in range(count // span):
            if span > 1:
                flight = first + i * span
                tables.leap[place, flight] = step
                tables.pause[place, flight] = 1 if tables.pause[place, flight] == 1 else 2
            tables.piece[place, step] = n if span == 1 else len(points.sample) + n
            tables.sample[place, step] = points.sample[n] if i == 0 else -1
            tables.phase[place, step] = points.edges[p, n] + i * share
            tables.duration[place, step] = TWO_PI / points.omega[p] * share
            present = anew = 0
            tables.offset[place, step] = 0.0
            for e in range(len(points.mesh)):
                tables.stiffness[place, step, e] = points.stiffness[p, n, e]
                present |= (1 << e) if points.stiffness[p, n, e] != 0.0 else 0
                o, begin = points.offset[p, n, e], i * share
                offset = tables.offset[place, step]
                offset[0, e] = o[0] + begin * (o[1] + begin * o[2])
                offset[1, e] = (o[1] + 2.0 * begin * o[2]) * share
                offset[2, e] = o[2] * share * share
                earlier = tables.offset[place, max(step - 1, 0)]
                if step == 0 or not abs(offset[0, e] - earlier[0, e] - earlier[1, e] - earlier[2, e]) < _CONTINUOUS:
                    anew |= 1 << e
                if releases(dims) and e >= first_release:  # the row of its force changes with its stiffness
                    earlier_stiffness = tables.stiffness[place, max(step - 1, 0), e]
                    anew |= (1 << e) if points.stiffness[p, n, e] != earlier_stiffness else 0
            before = tables.present[place, step - 1] if step > 0 else 0
            anew = present & (anew | ~before)
            tables.present[place, step], tables.anew[place, step] = present, anew
            tables.pause[place, step] = anew != 0 or present != before or tables.sample[place, step] >= 0
            if len(dims) > MOST_UNROLLED and points.leap[p, n] > 0 and i % points.leap[p, n] == 0:
                tables.leap[place, step], tables.leap_closed[place, leaps] = leaps, 0
                for e in range(len(points.mesh)):
                    gap = points.side[e] * dot(dims, points.row[points.mesh[e]], points.rest[p]) - offset[0, e]
                    if present >> e & 1 and gap > 0.0:
                        tables.leap_closed[place, leaps] |= 1 << e
                leaps += 1
            angle, turn = TWO_PI * tables.phase[place, step], points.omega[p] * tables.duration[place, step]
            force, velocity = tables.force[place, step], tables.velocity[place, step]
            for j in range(len(dims)):
                series[:] = 0.0
                series[0] = points.f0[p, j]
                _add_harmonics(points, angle, turn, points.f_cos[p, :, j], points.f_sin[p, :, j], series)
                for k in range(ORDER + 1):
                    force[k, j] = series[k]
            velocity[:] = 0.0
            velocity[0] = points.velocity0[p]
            _add_harmonics(points, angle, turn, points.velocity_cos[p], points.velocity_sin[p], velocity)
            step += 1
        first += count
    return step


@inlined
def forget_sets(tables, place):
    tables.entries[place] = tables.parts[place] = 0
    tables.first[place, :] = tables.part_first[place, :] = -1
    tables.leap_made[place, :] = tables.leap_part[place, :] = -1


@subroutine
def fill_steps(dims, points, p, tables, place, work):
    """Write the steps of point p and its leaps to a place of the tables, without what depends on contact sets."""
    tables.point[place] = p
    forget_sets(tables, place)
    tables.leap[place, :] = -1
    tables.steps[place] = _fill_rows(dims, points, p, tables, place, 0, 1, work)
    if points.span[p] > 1:
        _fill_rows(dims, points, p, tables, place, tables.steps[place], points.span[p], work)


@inlined
def pushing(dims, points, closed):
    """The contacts of a contact set that push: of those that release, where the force does not pull."""
    if not releases(dims):
        return closed
    count = len(points.mesh) - len(points.releasing)
    found = closed & (1 << count) - 1
    for u in range(len(points.releasing)):
        if not closed >> (count + u) & 1:
            found &= ~(1 << points.releasing[u])
    return found


@inlined
def mesh_closed(points, closed, m):
    """Whether one of the ``closed`` contacts is of mesh m."""
    found = False
    for e in range(len(points.mesh)):
        found |= points.mesh[e] == m and closed >> e & 1 == 1
    return found


@subroutine
def _set_equations(dims, points, p, tables, place, step, closed, linear):
    """Write the linear part of the motion on a step with a contact set, column j in row j
    of ``linear`` (d, V WIDTH)."""
    d, closed = len(dims), pushing(dims, points, closed)
    for i in range(d):
        for j in range(d):
            linear[j, i] = points.A[p, i, j]
    for e in range(len(points.mesh)):
        if closed >> e & 1:
            m = points.mesh[e]
            for i in range(d):
                push = points.push[p, m, i] * tables.stiffness[place, step, e]
                for j in range(d):
                    linear[j, i] -= push * points.row[m, j]
    for m in range(len(points.in_contact)):
        if points.in_contact[m] and mesh_closed(points, closed, m):
            for i in range(d):
                for j in range(d):
                    linear[j, i] -= points.push[p, m, i] * points.damping[p, m] * points.rate[m, j]


@subroutine
def _set_force(dims, points, p, tables, place, step, closed, force):
    """Write the forcing (V, ORDER + 1, WIDTH) of the motion on a step with a contact set."""
    closed = pushing(dims, points, closed)
    for k in range(ORDER + 1):
        for i in range(len(dims)):
            force[i // WIDTH, k, i % WIDTH] = tables.force[place, step, k, i]
    for e in range(len(points.mesh)):
        if closed >> e & 1:
            m, side = points.mesh[e], points.side[e]
            for i in range(len(dims)):
                push = points.push[p, m, i] * tables.stiffness[place, step, e]
                for k in range(OFFSETS):
                    force[i // WIDTH, k, i % WIDTH] += side * push * tables.offset[place, step, k, e]


@inlined
def _fill_series(dims, duration, linear, force, series):
    """Taylor polynomials in s of w' = linear w + force from ``series`` at 0, in V vectors of ORDER + 1 coefficients."""
    for k in range(ORDER):
        scale = broadcast(duration / (k + 1))
        for v in range(len(series)):
            total = load(force, v * (ORDER + 1) + k)
            for n in range(len(dims)):
                total = vfma(load(linear, n * len(series) + v), broadcast(series[n // WIDTH, k, n % WIDTH]), total)
            store(series, v * (ORDER + 1) + k + 1, total * scale)


@inlined
def bend_bound(dims, outputs, constant, state, factor, terms):
    """How far a displacement is from its chord on a step at most, in the motion from ``factor`` times a state (d,), by
    its polynomials (d, TERMS) from unit vectors and that from 0; ``terms`` (TERMS,) is memory."""
    low, high, bend = load(constant, 0), load(constant, 1), 0.0
    for j in range(len(dims)):
        at = broadcast(factor * state[j])
        low, high = vfma(at, load(outputs, 2 * j), low), vfma(at, load(outputs, 2 * j + 1), high)
    store(terms, 0, low)
    store(terms, 1, high)
    for k in range(2, ORDER + 1):
        bend += k * (k - 1) / 8.0 * abs(terms[k])
    return bend


@inlined
def dot(dims, row, w):
    """row·w."""
    total = 0.0
    for i in range(len(dims)):
        total += row[i] * w[i]
    return total


@inlined
def rate_share(points, p, tables, place, step, r):
    """D/κ on a step, by which the rate is added in a row behind those of the meshes."""
    stiffness = tables.stiffness[place, step, len(points.mesh) - len(points.row) + r]
    return points.damping[p, r] / stiffness if stiffness != 0.0 else 0.0


@inlined
def displacement(dims, points, p, tables, place, step, r, w):
    """Row r times w on a step."""
    found = dot(dims, points.row[r], w)
    if releases(dims) and r >= len(points.in_contact):
        found += rate_share(points, p, tables, place, step, r) * dot(dims, points.rate[r], w)
    return found


@inlined
def _coefficient(dims, row, series, k):
    """Coefficient k of row·w, from the polynomials of w."""
    total = 0.0
    for i in range(len(dims)):
        total += row[i] * series[i // WIDTH, k, i % WIDTH]
    return total


@inlined
def _output(dims, points, p, tables, place, step, r, series, k):
    """The same of row r on a step."""
    found = _coefficient(dims, points.row[r], series, k)
    if releases(dims) and r >= len(points.in_contact):
        found += rate_share(points, p, tables, place, step, r) * _coefficient(dims, points.rate[r], series, k)
    return found


@subroutine
def _add_part(dims, points, p, tables, place, step, closed, work):
    """Make the linear part of the motion with a contact set, for all steps of the piece of this one; returns it."""
    d, part = len(dims), tables.parts[place]
    tables.parts[place] = part + 1
    piece, series = tables.piece[place, step], work.series
    tables.part_closed[place, part] = closed
    tables.part_chain[place, part], tables.part_first[place, piece] = tables.part_first[place, piece], part
    linear = tables.equations[place, part]
    linear[:] = tables.matrix[place, part] = tables.columns[place, part] = tables.outputs[place, part] = 0.0
    _set_equations(dims, points, p, tables, place, step, closed, linear)
    work.force[:] = 0.0
    series[:] = 0.0
    for j in range(d):
        for i in range(d):
            series[i // WIDTH, 0, i % WIDTH] = 1.0 if i == j else 0.0
        _fill_series(dims, tables.duration[place, step], linear, work.force, series)
        for k in range(ORDER + 1):
            for i in range(d):
                tables.columns[place, part, (j * d + i) // WIDTH, k, (j * d + i) % WIDTH] = series[
                    i // WIDTH, k, i % WIDTH]
            for m in range(len(points.row)):
                tables.outputs[place, part, m, j, k] = _output(dims, points, p, tables, place, step, m, series, k)
            tables.outputs[place, part, len(points.row), j, k] = _coefficient(dims, points.velocity[p], series, k)
    values_at(tables.columns[place, part], 1.0, work.values)
    for j in range(d):
        for i in range(d):
            tables.matrix[place, part, j, i] = work.values[j * d + i]
        for m in range(len(points.row)):
            bend = 0.0
            for k in range(2, ORDER + 1):
                bend += k * (k - 1) / 8.0 * abs(tables.outputs[place, part, m, j, k])
            tables.bends[place, part, m, j] = bend
    return part


@subroutine
def _make_clear(dims, points, tables, place, step, closed, entry, terms):
    """Write ``clear`` of a contact set, see `add_set`; ``terms`` (TERMS,) is memory."""
    for m in range(len(points.row)):
        low, high, reference = -np.inf, np.inf, 0.0
        for e in range(len(points.mesh)):
            if points.mesh[e] != m or not tables.present[place, step] >> e & 1:
                continue
            o, side = tables.offset[place, step], points.side[e]
            end, bend = o[0, e] + o[1, e] + o[2, e], 0.25 * abs(o[2, e])
            if closed >> e & 1:
                reference = side * o[0, e]
            if (side > 0.0) == (closed >> e & 1 == 1):
                low = max(low, side * o[0, e] + bend, side * end + bend)
            else:
                high = min(high, side * o[0, e] - bend, side * end - bend)
        clear = tables.clear[place, entry, m]
        clear[0], clear[1], clear[2] = low, high, reference
        clear[3] = bend_bound(dims, tables.outputs[place, tables.linear[place, entry], m],
                         tables.shift_outputs[place, entry, m], points.unit[m], reference, terms)


@inlined
def after_step(dims, tables, place, entry, w, after):
    """Write the state after a step with a contact set, from ``w``, to ``after``."""
    apply_affine(dims, tables.matrix[place, tables.linear[place, entry]], tables.shift[place, entry], w, after)


@inlined
def apply_affine(dims, matrix, shift, w, after):
    vectors = len(shift) // WIDTH
    for v in range(vectors):
        total = load(shift, v)
        for j in range(len(dims)):
            total = vfma(broadcast(w[j]), load(matrix, j * vectors + v), total)
        store(after, v, total)


@inlined
def values_at(columns, s, values):
    """The columns (G, ORDER + 1, WIDTH) at s, and at −s in the second half of ``values`` (2 G WIDTH,).

    Number j d + i of each half is that of column j for coordinate i.
    """
    at, square = broadcast(s), broadcast(s * s)
    for group in range(len(columns)):
        first = group * (ORDER + 1)
        even, odd = load(columns, first + ORDER), load(columns, first + ORDER - 1)
        for k in range(ORDER - 2, 0, -2):
            even = vfma(even, square, load(columns, first + k))
            odd = vfma(odd, square, load(columns, first + k - 1))
        even = vfma(even, square, load(columns, first))
        store(values, group, vfma(at, odd, even))
        store(values, len(columns) + group, vfma(broadcast(-s), odd, even))


@inlined
def _find(first, chain, sets, closed):
    """The place of a contact set among those of a step or of a piece, in a chain; −1 if it is not there."""
    found = first
    while found >= 0 and sets[found] != closed:
        found = chain[found]
    return found


@subroutine
def add_set(dims, points, p, tables, place, step, closed, work):
    """Make the motion on a step with a contact set, and return its entry.

    ``clear`` says of each mesh between which displacements its contacts surely stay as they are: the lower and the
    upper limit, and how far the displacement can be from its chord on the step. The last is the bound for the motion
    that begins on a reference displacement, the third number, at rest: the fourth; ``bends`` are, for each coordinate,
    that for a difference of 1 from there.
    """
    part = _find(tables.part_first[place, tables.piece[place, step]], tables.part_chain[place],
                 tables.part_closed[place], closed)
    full = part < 0 and tables.parts[place] == tables.part_closed.shape[1]
    if full or tables.entries[place] == tables.step.shape[1]:
        forget_sets(tables, place)
        part = -1
    entry = tables.entries[place]
    tables.entries[place] = entry + 1
    tables.step[place, entry], tables.closed[place, entry], tables.follows[place, entry] = step, closed, -1
    tables.chain[place, entry], tables.first[place, step] = tables.first[place, step], entry
    if part < 0:
        part = _add_part(dims, points, p, tables, place, step, closed, work)
    tables.linear[place, entry] = part
    _set_force(dims, points, p, tables, place, step, closed, work.force)
    series, outputs = tables.shifts[place, entry], tables.shift_outputs[place, entry]
    series[:] = outputs[:] = tables.shift[place, entry] = 0.0
    _fill_series(dims, tables.duration[place, step], tables.equations[place, part], work.force, series)
    for k in range(ORDER + 1):
        for m in range(len(points.row)):
            outputs[m, k] = _output(dims, points, p, tables, place, step, m, series, k)
        velocity = _coefficient(dims, points.velocity[p], series, k)
        outputs[len(points.row), k] = velocity + tables.velocity[place, step, k]
    _make_clear(dims, points, tables, place, step, closed, entry, work.shifted)
    values_at(tables.shifts[place, entry], 1.0, work.shifts)
    for i in range(len(dims)):
        tables.shift[place, entry, i] = work.shifts[i]
    return entry


@inlined
def find_set(dims, points, p, tables, place, step, closed, work):
    """The entry of a step and a contact set, made if it is not there."""
    entry = _find(tables.first[place, step], tables.chain[place], tables.closed[place], closed)
    return entry if entry >= 0 else add_set(dims, points, p, tables, place, step, closed, work)
