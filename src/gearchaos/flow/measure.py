"""What engineers read off a motion, integrated on the Taylor polynomials of its pieces: exact to rounding."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import layout as to
from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import MEASURES, ORDER, WIDTH, measure_of, output_row, rows, seat_rows
from gearchaos.flow.simd import any_lane, least, load, most, peek, poke, select, splat, store, vabs, vfma
from gearchaos.flow.taylor import add_wave, drive, expand, horner, horner3, stretch, variation
from gearchaos.flow.workspace import bring, fill_point, fill_step, keep

_GAUSS = 6
_LEGENDRE = np.polynomial.legendre.leggauss(_GAUSS)
_NODES = tuple(float(x) for x in (_LEGENDRE[0] + 1) / 2)
_WEIGHTS = tuple(float(x) for x in _LEGENDRE[1] / 2)
_NEARLY = 0.05


@kernel
def output_series(dims, h, k, ws):
    """Taylor coefficients of the velocity x1' and of the mesh force 2ζz' + χ f(z), from those of the state."""
    d = len(dims)
    at, factor = rows(d), output_row(d, h, k)
    series, force, sigma = at.series, at.series + ORDER + 1, load(ws, at.sigma)
    damping, first, velocity0 = load(ws, factor), load(ws, factor + 1), load(ws, factor + 1 + d)
    for m in range(ORDER + 1):
        velocity = first * load(ws, at.coef + m * d)
        for i in range(1, d):
            velocity = vfma(load(ws, factor + 1 + i), load(ws, at.coef + m * d + i), velocity)
        store(ws, series + m, velocity + velocity0 if m == 0 else velocity)
        spring = load(ws, at.chi) * stretch(ws, at, d, m, sigma)
        if k > 0:
            spring = spring + variation(ws, at, d, m, sigma)
        store(ws, force + m, vfma(damping, load(ws, at.coef + m * d + 1), spring))
    for j in range(h):
        cos, sin = load(ws, factor + d + 2 + j), load(ws, factor + d + 2 + h + j)
        angle = load(ws, at.h) * load(ws, at.omega) * splat(j + 1.0)
        add_wave(ws, series, cos, sin, at.phase + 2 * j, angle, False)


@kernel
def _refined(ws, first, stride, s, end):
    """The extreme value near share s: two Newton steps on the derivative, kept inside the piece."""
    zero = splat(0.0)
    for _ in range(2):
        slope, bend = zero, zero
        for k in range(ORDER, 0, -1):
            bend = vfma(bend, s, slope)
            slope = vfma(slope, s, splat(float(k)) * load(ws, first + k * stride))
        s = s - select(bend == zero, zero, slope / select(bend == zero, splat(1.0), bend))
        s = select(s < zero, zero, select(s > end, end, s))
    return horner(ws, first, stride, s)


@kernel
def _sagitta(ws, first, stride):
    """How far a series can be from its chord on any part of the piece: u - u^k is at most 1/4, 0.385 and 0.473 for k =
    2, 3 and 4, and less than 1; what is beyond degree 6 is less than the tenth that is added."""
    total = splat(0.0)
    for k in range(6, 1, -1):
        share = 0.275 if k == 2 else (0.43 if k == 3 else (0.52 if k == 4 else 1.0))
        total = vfma(splat(share), vabs(load(ws, first + k * stride)), total)
    return total


@kernel
def _extremes(ws, first, stride, end, moving, found, row):
    """Raise and lower the extremes of one series in ``row`` and the next to those on the piece.

    Most pieces lie so far inside that their chord tells. On the others samples find the extremes to a few per cent of
    what the series varies; only where that comes near a record are they refined, and only in the ``moving`` lanes: no
    lane's extremes depend on its neighbours'.
    """
    begin, last, swing = load(ws, first), horner(ws, first, stride, end), _sagitta(ws, first, stride)
    top, bottom = load(found, row), load(found, row + 1)
    rising, falling = moving & (top < most(begin, last) + swing), moving & (least(begin, last) - swing < bottom)
    if not any_lane(rising | falling):
        return
    high = low = begin
    s_high = s_low = splat(0.0)
    places = (end * splat(0.25), end * splat(0.5), end * splat(0.75), end)
    values = (*horner3(ws, first, stride, places[0], places[1], places[2]), last)
    for g in range(4):
        above, below = values[g] > high, values[g] < low
        high, s_high = select(above, values[g], high), select(above, places[g], s_high)
        low, s_low = select(below, values[g], low), select(below, places[g], s_low)
    margin = splat(_NEARLY) * (high - low)
    rising, falling = rising & (high + margin > top), falling & (low - margin < bottom)
    if any_lane(rising):
        peak = _refined(ws, first, stride, s_high, end)
        peak = select(peak > high, peak, high)
        store(found, row, select(rising & (peak > top), peak, top))
    if any_lane(falling):
        trough = _refined(ws, first, stride, s_low, end)
        trough = select(trough < low, trough, low)
        store(found, row + 1, select(falling & (trough < bottom), trough, bottom))


@kernel
def _add(found, row, value):
    store(found, row, load(found, row) + value)


@kernel
def _integrals(dims, ws, duration, end, found, first):
    """Add the integrals of z, z², z'², x1' and x1'² over the piece, by Gauss' rule."""
    d = len(dims)
    at = rows(d)
    z = zz = ss = v = vv = splat(0.0)
    for g in range(0, _GAUSS, 3):
        places = (end * splat(_NODES[g]), end * splat(_NODES[g + 1]), end * splat(_NODES[g + 2]))
        a = horner3(ws, at.coef, d, places[0], places[1], places[2])
        b = horner3(ws, at.coef + 1, d, places[0], places[1], places[2])
        c = horner3(ws, at.series, 1, places[0], places[1], places[2])
        for i in range(3):
            weight = duration * splat(_WEIGHTS[g + i])
            z, zz, ss = vfma(weight, a[i], z), vfma(weight, a[i] * a[i], zz), vfma(weight, b[i] * b[i], ss)
            v, vv = vfma(weight, c[i], v), vfma(weight, c[i] * c[i], vv)
    _add(found, first + to.Z, z)
    _add(found, first + to.Z_SQUARE, zz)
    _add(found, first + to.Z_DOT_SQUARE, ss)
    _add(found, first + to.VELOCITY, v)
    _add(found, first + to.VELOCITY_SQUARE, vv)


@kernel
def measure_piece(dims, ws, found, first):
    """Add the piece to the measures found so far, `MEASURES` vectors from ``first`` on."""
    d = len(dims)
    at = rows(d)
    end, sigma = load(ws, at.share), load(ws, at.sigma)
    duration, zero = load(ws, at.h) * end, splat(0.0)
    moving = zero < duration
    _add(found, first + to.FRONT_TIME, select(sigma > zero, duration, zero))
    _add(found, first + to.BACK_TIME, select(sigma < zero, duration, zero))
    _add(found, first + to.SWITCHES, select(load(ws, at.beyond) == sigma, zero, splat(1.0)))
    _integrals(dims, ws, duration, end, found, first)
    _extremes(ws, at.coef, d, end, moving, found, first + to.Z_MAX)
    _extremes(ws, at.coef + 1, d, end, moving, found, first + to.Z_DOT_MAX)
    _extremes(ws, at.series + ORDER + 1, 1, end, moving, found, first + to.FORCE_MAX)


@kernel
def read_measures(found, out, lane, l):
    """Copy the measures of ``lane`` so far to lane l of the chunk."""
    for row in range(MEASURES):
        poke(found, row * WIDTH + l, peek(out, measure_of(lane, row)))


@kernel
def write_measures(found, out, lane, l):
    """Copy the measures of lane l of the chunk back to ``lane``."""
    for row in range(MEASURES):
        poke(out, measure_of(lane, row), peek(found, row * WIDTH + l))


@inlined
def study(dims, points, lanes, seat, work):
    """Keep what measuring needs of the lanes that have taken a seat."""
    for l in range(WIDTH):
        work.points[l] = lanes.point[seat * WIDTH + l]
    fill_point(dims, points.phys, points.h, points.k, work.points, True, work.ws)
    keep(dims, points.h, points.k, work.ws, lanes.kept, seat)


@inlined
def _measure_seat(dims, points, seats, lanes, seat, work, tick):
    """Add the step to the measures of those lanes of a seat in which it changes no contact."""
    ws, at, d = work.ws, rows(len(dims)), len(dims)
    live, first = peek(seats.live, seat), seat * WIDTH
    steady = ~peek(work.flags, seat) & ((1 << live) - 1)
    bring(dims, points.h, points.k, lanes.kept, seat, ws)
    for l in range(WIDTH):
        mine = first + (l if l < live else 0)
        work.nodes[l] = peek(lanes.node, mine) + peek(seats.ahead, seat) + tick
        poke(ws, at.share * WIDTH + l, float(steady >> l & 1))
    fill_step(dims, points.h, points.k, points.nodes.values, work.nodes, ws)
    for i in range(d):
        store(ws, at.start + i, load(lanes.vectors, seat * seat_rows(lanes) + (tick & 1) * d + i))
    sigma = load(lanes.sigma, seat)
    store(ws, at.sigma, sigma)
    store(ws, at.beyond, sigma)
    drive(dims, points.h, points.k, ws)
    expand(dims, ws, True, points.k > 0)
    output_series(dims, points.h, points.k, ws)
    measure_piece(dims, ws, lanes.measures, seat * MEASURES)


@inlined
def measure(dims, points, seats, lanes, work, tick):
    """Add a step to the measures of all lanes but the suspects, which `resolve` sees to."""
    for seat in range(seats.state[0]):
        _measure_seat(dims, points, seats, lanes, seat, work, tick)


def empty(lanes: int) -> np.ndarray:
    """Measures (MEASURES, lanes) of nothing yet."""
    out = np.zeros((to.MEASURES, lanes))
    out[[to.Z_MAX, to.Z_DOT_MAX, to.FORCE_MAX]] = -np.inf
    out[[to.Z_MIN, to.Z_DOT_MIN, to.FORCE_MIN]] = np.inf
    return out
