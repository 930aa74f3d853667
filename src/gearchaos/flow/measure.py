"""What engineers read off a motion, integrated on the Taylor polynomials of its pieces: exact to rounding."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import layout as to
from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import MEASURES, ORDER, WIDTH, parameters, rows
from gearchaos.flow.simd import any_lane, load, select, splat, store, vfma
from gearchaos.flow.taylor import add_wave, horner, horner3, set_gain, set_gains, stretch, variation

_GAUSS = 6
_LEGENDRE = np.polynomial.legendre.leggauss(_GAUSS)
_NODES = tuple(float(x) for x in (_LEGENDRE[0] + 1) / 2)
_WEIGHTS = tuple(float(x) for x in _LEGENDRE[1] / 2)
_NEARLY = 0.05


@kernel
def output_series(dims, phys, h, k, points, ws):
    """Taylor coefficients of the velocity x1' and of the mesh force 2ζz' + χ f(z), from those of the state."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    velocity, force, sigma = at.series, at.series + ORDER + 1, load(ws, at.sigma)
    set_gain(phys, points, par.velocity, ws, at.gain)
    gain = load(ws, at.gain)
    for m in range(ORDER + 1):
        store(ws, velocity + m, gain * load(ws, at.coef + m * d))
    for i in range(1, d):
        set_gain(phys, points, par.velocity + i, ws, at.gain)
        gain = load(ws, at.gain)
        for m in range(ORDER + 1):
            store(ws, velocity + m, vfma(gain, load(ws, at.coef + m * d + i), load(ws, velocity + m)))
    set_gain(phys, points, par.damping, ws, at.gain)
    damping = load(ws, at.gain)
    for m in range(ORDER + 1):
        spring = load(ws, at.chi) * stretch(ws, at, d, m, sigma)
        if k > 0:
            spring = spring + variation(ws, at, d, m, sigma)
        store(ws, force + m, vfma(damping, load(ws, at.coef + m * d + 1), spring))
    set_gain(phys, points, par.velocity0, ws, at.gain)
    store(ws, velocity, load(ws, velocity) + load(ws, at.gain))
    for j in range(h):
        set_gains(phys, points, par.velocity_cos + j, par.velocity_sin + j, 1.0, ws, at.gain)
        angle = load(ws, at.h) * load(ws, at.omega) * splat(j + 1.0)
        add_wave(ws, velocity, load(ws, at.gain), load(ws, at.gain + 1), at.phase + 2 * j, angle, False)


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
def _extremes(ws, first, stride, end, moving, found, row):
    """Raise and lower the extremes of one series in ``row`` and the next to those on the piece.

    Samples find them to a few per cent of what the series varies; only where that comes near a record is it refined,
    and only in the ``moving`` lanes: no lane's extremes depend on its neighbours'.
    """
    high = low = load(ws, first)
    s_high = s_low = splat(0.0)
    places = (end * splat(0.25), end * splat(0.5), end * splat(0.75), end)
    values = (*horner3(ws, first, stride, places[0], places[1], places[2]), horner(ws, first, stride, end))
    for g in range(4):
        above, below = values[g] > high, values[g] < low
        high, s_high = select(above, values[g], high), select(above, places[g], s_high)
        low, s_low = select(below, values[g], low), select(below, places[g], s_low)
    margin = splat(_NEARLY) * (high - low)
    top, bottom = load(found, row), load(found, row + 1)
    rising, falling = moving & (high + margin > top), moving & (low - margin < bottom)
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
def _integrals(dims, ws, duration, end, found):
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
    _add(found, to.Z, z)
    _add(found, to.Z_SQUARE, zz)
    _add(found, to.Z_DOT_SQUARE, ss)
    _add(found, to.VELOCITY, v)
    _add(found, to.VELOCITY_SQUARE, vv)


@kernel
def measure_piece(dims, ws, found):
    """Add the piece to the measures ``found`` (MEASURES * WIDTH,), which hold the extremes so far."""
    d = len(dims)
    at = rows(d)
    end, sigma = load(ws, at.share), load(ws, at.sigma)
    duration, zero = load(ws, at.h) * end, splat(0.0)
    moving = zero < duration
    _add(found, to.FRONT_TIME, select(sigma > zero, duration, zero))
    _add(found, to.BACK_TIME, select(sigma < zero, duration, zero))
    _add(found, to.SWITCHES, select(load(ws, at.beyond) == sigma, zero, splat(1.0)))
    _integrals(dims, ws, duration, end, found)
    _extremes(ws, at.coef, d, end, moving, found, to.Z_MAX)
    _extremes(ws, at.coef + 1, d, end, moving, found, to.Z_DOT_MAX)
    _extremes(ws, at.series + ORDER + 1, 1, end, moving, found, to.FORCE_MAX)


@kernel
def read_measures(found, out, lane, l):
    """Copy the measures of ``lane`` so far to lane l of the chunk."""
    for row in range(MEASURES):
        found[row * WIDTH + l] = out[row, lane]


@kernel
def write_measures(found, out, lane, l):
    """Copy the measures of lane l of the chunk back to ``lane``."""
    for row in range(MEASURES):
        out[row, lane] = found[row * WIDTH + l]


def empty(lanes: int) -> np.ndarray:
    """Measures (MEASURES, lanes) of nothing yet."""
    out = np.zeros((to.MEASURES, lanes))
    out[[to.Z_MAX, to.Z_DOT_MAX, to.FORCE_MAX]] = -np.inf
    out[[to.Z_MIN, to.Z_DOT_MIN, to.FORCE_MIN]] = np.inf
    return out
