"""The measures of `measure.py`, computed from the Taylor polynomials of segments of a motion, exact to rounding."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.vector.arrays import damps_in_contact, measure_index, releases, rows, rows_per_slot
from gearchaos.flow.kernels.vector.constants import ORDER, WIDTH
from gearchaos.flow.kernels.vector.measure import Measure
from gearchaos.flow.kernels.vector.simd import (
    any_true,
    broadcast,
    larger,
    load,
    load_scalar,
    select,
    smaller,
    store,
    store_scalar,
    vabs,
    vfma,
)
from gearchaos.flow.kernels.vector.taylor import (
    add_sinusoid,
    excitation_series,
    fill_level,
    fill_point,
    fill_step,
    horner,
    horner3,
    in_contact,
    restore_point_rows,
    save_point_rows,
    spring_extension,
    state_series,
    stiffness_variation,
)

_COUNT = len(Measure)
_GAUSS = 6  # nodes of the Gauss–Legendre rule on a segment
_LEGENDRE = np.polynomial.legendre.leggauss(_GAUSS)
_NODES = tuple(float(x) for x in (_LEGENDRE[0] + 1) / 2)
_WEIGHTS = tuple(float(x) for x in _LEGENDRE[1] / 2)

_MARGIN = 0.05
"""The extreme of the samples of a segment is refined if it is this close to the extreme so far, relative to their
range."""


@subroutine
def output_series(dims, harmonics, ws):
    """Polynomials of the velocity x1' and of the mesh force 2ζz' + χ f(z), from those of the coordinates."""
    d = len(dims)
    at, row, sigma = rows(dims), harmonics.rows, load(ws, rows(dims).sigma)
    damping, first, constant = load(ws, row.damping), load(ws, row.velocity), load(ws, row.velocity0)
    if damps_in_contact(dims):
        damping = damping * in_contact(dims, sigma)
    for m in range(ORDER + 1):
        velocity = first * load(ws, at.state + m * d)
        for i in range(1, d):
            velocity = vfma(load(ws, row.velocity + i), load(ws, at.state + m * d + i), velocity)
        store(ws, at.velocity + m, velocity + constant if m == 0 else velocity)
        spring = load(ws, at.stiffness) * spring_extension(ws, at, d, m, sigma)
        if harmonics.stiffness > 0:
            spring = spring + stiffness_variation(ws, at, d, m, sigma)
        store(ws, at.force + m, vfma(damping, load(ws, at.state + m * d + 1), spring))
    for j in range(harmonics.forcing):
        cos, sin = load(ws, row.velocity_cos + j), load(ws, row.velocity_sin + j)
        angle = load(ws, at.duration) * load(ws, at.omega) * broadcast(j + 1.0)
        add_sinusoid(ws, at.velocity, cos, sin, row.cos_sin + 2 * j, angle, False)


@subroutine
def _refined(ws, first, stride, s, end):
    """The extreme value near s, a vector, by two Newton steps on the derivative, limited to 0 <= s <= ``end``."""
    zero = broadcast(0.0)
    for _ in range(2):
        slope, second = zero, zero
        for k in range(ORDER, 0, -1):
            second = vfma(second, s, slope)
            slope = vfma(slope, s, broadcast(float(k)) * load(ws, first + k * stride))
        s = s - select(second == zero, zero, slope / select(second == zero, broadcast(1.0), second))
        s = select(s < zero, zero, select(s > end, end, s))
    return horner(ws, first, stride, s)


@subroutine
def _chord_deviation_bound(ws, first, stride):
    """Upper bound of the distance of a polynomial from its chord on any part of the segment.

    Term c_k s^k deviates from its chord by at most |c_k| max(u − u^k), u in [0, 1], which is 1/4, 0.385 and 0.473 for
    k = 2, 3 and 4, and less than 1 for all k. The factors of the first three are raised by a tenth, which covers the
    terms beyond degree 6.
    """
    total = broadcast(0.0)
    for k in range(6, 1, -1):
        factor = 0.275 if k == 2 else (0.43 if k == 3 else (0.52 if k == 4 else 1.0))
        total = vfma(broadcast(factor), vabs(load(ws, first + k * stride)), total)
    return total


@subroutine
def _update_extremes(ws, first, stride, end, moving, measures, row):
    """Raise the maximum in ``row`` of the measures, and lower the minimum in the next row, to those of a polynomial.

    On most segments the bound of its distance from the chord shows that the extremes so far are not exceeded. On the
    others samples find the extremes to a few per cent of the range; those close to the extremes so far are refined.
    Only the ``moving`` lanes (a mask), those with time left on the segment, are changed, so that the extremes of a lane
    do not depend on the other lanes.
    """
    begin, last, deviation = load(ws, first), horner(ws, first, stride, end), _chord_deviation_bound(ws, first, stride)
    top, bottom = load(measures, row), load(measures, row + 1)
    rising = moving & (top < larger(begin, last) + deviation)
    falling = moving & (smaller(begin, last) - deviation < bottom)
    if not any_true(rising | falling):
        return
    high = low = begin
    s_high = s_low = broadcast(0.0)
    samples = (end * broadcast(0.25), end * broadcast(0.5), end * broadcast(0.75), end)
    values = (*horner3(ws, first, stride, samples[0], samples[1], samples[2]), last)
    for g in range(4):
        above, below = values[g] > high, values[g] < low
        high, s_high = select(above, values[g], high), select(above, samples[g], s_high)
        low, s_low = select(below, values[g], low), select(below, samples[g], s_low)
    margin = broadcast(_MARGIN) * (high - low)
    rising, falling = rising & (high + margin > top), falling & (low - margin < bottom)
    if any_true(rising):
        peak = _refined(ws, first, stride, s_high, end)
        peak = select(peak > high, peak, high)
        store(measures, row, select(rising & (peak > top), peak, top))
    if any_true(falling):
        trough = _refined(ws, first, stride, s_low, end)
        trough = select(trough < low, trough, low)
        store(measures, row + 1, select(falling & (trough < bottom), trough, bottom))


@subroutine
def _add(measures, row, value):
    """Add a vector to a row of the measures."""
    store(measures, row, load(measures, row) + value)


@subroutine
def _add_integrals(dims, ws, duration, end, measures, first):
    """Add the integrals of z and z² about the reference, z'², x1' and x1'² over the segment, by Gauss–Legendre."""
    d = len(dims)
    at, reference = rows(dims), load(measures, first + Measure.Z_REFERENCE)
    z = zz = ss = v = vv = broadcast(0.0)
    for g in range(0, _GAUSS, 3):
        nodes = (end * broadcast(_NODES[g]), end * broadcast(_NODES[g + 1]), end * broadcast(_NODES[g + 2]))
        a = horner3(ws, at.state, d, nodes[0], nodes[1], nodes[2])
        b = horner3(ws, at.state + 1, d, nodes[0], nodes[1], nodes[2])
        c = horner3(ws, at.velocity, 1, nodes[0], nodes[1], nodes[2])
        for i in range(3):
            weight = duration * broadcast(_WEIGHTS[g + i])
            x = a[i] - reference
            z, zz, ss = vfma(weight, x, z), vfma(weight, x * x, zz), vfma(weight, b[i] * b[i], ss)
            v, vv = vfma(weight, c[i], v), vfma(weight, c[i] * c[i], vv)
    _add(measures, first + Measure.Z, z)
    _add(measures, first + Measure.Z_SQUARE, zz)
    _add(measures, first + Measure.Z_DOT_SQUARE, ss)
    _add(measures, first + Measure.VELOCITY, v)
    _add(measures, first + Measure.VELOCITY_SQUARE, vv)


@subroutine
def add_forces(dims, ws, measures, first):
    """Add the integrals of the mesh force, of its square, and of the force in the direction of the flank in contact,
    over the segment, by Gauss–Legendre."""
    at = rows(dims)
    end, f, ff = load(ws, at.end_fraction), broadcast(0.0), broadcast(0.0)
    duration = load(ws, at.duration) * end
    for g in range(0, _GAUSS, 3):
        nodes = (end * broadcast(_NODES[g]), end * broadcast(_NODES[g + 1]), end * broadcast(_NODES[g + 2]))
        force = horner3(ws, at.force, 1, nodes[0], nodes[1], nodes[2])
        for i in range(3):
            weight = duration * broadcast(_WEIGHTS[g + i])
            f, ff = vfma(weight, force[i], f), vfma(weight, force[i] * force[i], ff)
    _add(measures, first + Measure.FORCE, f)
    _add(measures, first + Measure.FORCE_SQUARE, ff)
    _add(measures, first + Measure.CONTACT_FORCE, load(ws, at.sigma) * f)


@subroutine
def measure_segment(dims, ws, measures, first):
    """Add a segment, up to its contact switch, to the measures in rows ``first`` to ``first + len(Measure) - 1``, but
    for those of `add_forces`."""
    d = len(dims)
    at = rows(dims)
    end, sigma = load(ws, at.end_fraction), load(ws, at.sigma)
    duration, zero = load(ws, at.duration) * end, broadcast(0.0)
    moving = zero < duration
    beyond = load(ws, at.next_sigma)
    if releases(dims):
        beyond, sigma = beyond * in_contact(dims, beyond), sigma * in_contact(dims, sigma)
    _add(measures, first + Measure.FRONT_TIME, select(sigma > zero, duration, zero))
    _add(measures, first + Measure.BACK_TIME, select(sigma < zero, duration, zero))
    _add(measures, first + Measure.SWITCHES, select(beyond == sigma, zero, broadcast(1.0)))
    _add_integrals(dims, ws, duration, end, measures, first)
    _update_extremes(ws, at.state, d, end, moving, measures, first + Measure.Z_MAX)
    _update_extremes(ws, at.state + 1, d, end, moving, measures, first + Measure.Z_DOT_MAX)
    _update_extremes(ws, at.force, 1, end, moving, measures, first + Measure.FORCE_MAX)


@subroutine
def gather_measures(measures, source, lane, position):
    """Copy the measures of a lane from ``source``, `Lanes.measures`, to a position of the pack's ``measures``."""
    for row in range(_COUNT):
        store_scalar(measures, row * WIDTH + position, load_scalar(source, measure_index(lane, row)))


@subroutine
def scatter_measures(measures, target, lane, position):
    """Copy the measures at a position of the pack back to those of a lane in ``target``, `Lanes.measures`."""
    for row in range(_COUNT):
        store_scalar(target, measure_index(lane, row), load_scalar(measures, row * WIDTH + position))


@inlined
def prepare_measures(dims, points, lanes, slot, work):
    """Save for a slot the workspace rows that depend on the points of its new lanes."""
    for l in range(WIDTH):
        work.points[l] = lanes.point[slot * WIDTH + l]
    fill_point(dims, points.parameters, points.harmonics, work.points, True, work.rows)
    save_point_rows(dims, points.harmonics, work.rows, lanes.point_rows, slot)


@inlined
def _measure_slot(dims, points, slots, lanes, slot, work, tick):
    """Add the step to the measures of those lanes of a slot that are not suspects."""
    ws, at, d = work.rows, rows(dims), len(dims)
    active, first = load_scalar(slots.active, slot), slot * WIDTH
    measured = ~load_scalar(work.suspects, slot) & ((1 << active) - 1)
    restore_point_rows(dims, points.harmonics, lanes.point_rows, slot, ws)
    for l in range(WIDTH):
        lane = first + (l if l < active else 0)
        work.points[l] = load_scalar(lanes.point, lane)
        work.steps[l] = load_scalar(lanes.first_step, lane) + load_scalar(slots.step_minus_tick, slot) + tick
        store_scalar(ws, at.end_fraction * WIDTH + l, float(measured >> l & 1))
    fill_level(dims, points.parameters, points.harmonics, points.steps.values, work.points, work.steps, ws)
    fill_step(dims, points.harmonics, points.steps.values, work.steps, ws)
    for i in range(d):
        store(ws, at.start + i, load(lanes.vectors, slot * rows_per_slot(lanes) + (tick & 1) * d + i))
    sigma = load(lanes.sigma, slot)
    store(ws, at.sigma, sigma)
    store(ws, at.next_sigma, sigma)
    excitation_series(dims, points.harmonics, ws)
    state_series(dims, ws, True, points.harmonics.stiffness > 0)
    output_series(dims, points.harmonics, ws)
    measure_segment(dims, ws, lanes.measures, slot * _COUNT)


@inlined
def measure_step(dims, points, slots, lanes, work, tick):
    """Add a step to the measures of all lanes except the suspects, which are measured when they are resolved."""
    for slot in range(slots.counters[0]):
        _measure_slot(dims, points, slots, lanes, slot, work, tick)
