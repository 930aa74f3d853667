"""What engineers read off a motion, integrated on the Taylor polynomials of its pieces: exact to rounding."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import layout as to
from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER, WIDTH, parameters, rows

_GAUSS = 8
_LEGENDRE = np.polynomial.legendre.leggauss(_GAUSS)
_NODES = tuple(float(x) for x in (_LEGENDRE[0] + 1) / 2)
_WEIGHTS = tuple(float(x) for x in _LEGENDRE[1] / 2)
_Z, _SPEED, _VELOCITY, _FORCE = range(4)


@kernel
def output_series(dims, phys, h, k, points, wave, ws):
    """Taylor coefficients of z, z', the velocity x1' and the mesh force 2ζz' + χ f(z)."""
    d = len(dims)
    at, par = rows(d), parameters(d, h, k)
    for l in range(WIDTH):
        q = points[l]
        for m in range(ORDER + 1):
            coef = (at.coef + m * d) * WIDTH + l
            velocity = phys[q, par.velocity0] if m == 0 else 0.0
            for i in range(d):
                velocity = fma(phys[q, par.velocity + i], ws[coef + i * WIDTH], velocity)
            for j in range(h):
                velocity = fma(phys[q, par.velocity_cos + j], wave[j, 0, m * WIDTH + l], velocity)
                velocity = fma(phys[q, par.velocity_sin + j], wave[j, 1, m * WIDTH + l], velocity)
            row = (at.series + m * 4) * WIDTH + l
            ws[row] = ws[coef]
            ws[row + WIDTH] = ws[coef + WIDTH]
            ws[row + 2 * WIDTH] = velocity
            ws[row + 3 * WIDTH] = fma(phys[q, par.damping], ws[coef + WIDTH], ws[(at.spring + m) * WIDTH + l])


@kernel
def _value(ws, series, which, l, s):
    """One of the four series of lane l at share s."""
    total = ws[(series + ORDER * 4 + which) * WIDTH + l]
    for k in range(ORDER - 1, -1, -1):
        total = fma(total, s, ws[(series + k * 4 + which) * WIDTH + l])
    return total


@kernel
def _refined(ws, series, which, l, s, end):
    """The extreme value near share s: two Newton steps on the derivative, kept inside the piece."""
    for _ in range(2):
        first = 0.0
        second = 0.0
        for k in range(ORDER, 0, -1):
            second = fma(second, s, first)
            first = fma(first, s, k * ws[(series + k * 4 + which) * WIDTH + l])
        if second != 0.0:
            s = min(max(s - first / second, 0.0), end)
    return _value(ws, series, which, l, s)


@kernel
def _extremes(ws, series, which, end, out, top, lane, l):
    """Update the greatest and least value of one series, rows ``top`` and ``top + 1`` of the measures.

    Only samples that come near a new extreme are worth refining.
    """
    high, low, s_high, s_low = -np.inf, np.inf, 0.0, 0.0
    for g in range(_GAUSS + 1):
        s = end * g / _GAUSS
        value = _value(ws, series, which, l, s)
        if value > high:
            high, s_high = value, s
        if value < low:
            low, s_low = value, s
    margin = 0.02 * (high - low)
    if high + margin > out[top, lane]:
        out[top, lane] = max(out[top, lane], high, _refined(ws, series, which, l, s_high, end))
    if low - margin < out[top + 1, lane]:
        out[top + 1, lane] = min(out[top + 1, lane], low, _refined(ws, series, which, l, s_low, end))


@kernel
def _integrals(ws, series, duration, end, out, lane, l):
    z = speed = velocity = zz = ss = vv = 0.0
    for g in range(_GAUSS):
        s = _NODES[g] * end
        weight = _WEIGHTS[g] * duration
        a, b, c = _value(ws, series, _Z, l, s), _value(ws, series, _SPEED, l, s), _value(ws, series, _VELOCITY, l, s)
        z = fma(weight, a, z)
        zz = fma(weight, a * a, zz)
        ss = fma(weight, b * b, ss)
        velocity = fma(weight, c, velocity)
        vv = fma(weight, c * c, vv)
    out[to.Z, lane] += z
    out[to.Z_SQUARE, lane] += zz
    out[to.Z_DOT_SQUARE, lane] += ss
    out[to.VELOCITY, lane] += velocity
    out[to.VELOCITY_SQUARE, lane] += vv


@kernel
def accumulate(dims, ws, out, lane, l):
    """Add the piece of lane l of the chunk to the measures of ``lane``."""
    at = rows(len(dims))
    end, sigma = ws[at.share * WIDTH + l], ws[at.sigma * WIDTH + l]
    duration = ws[at.h * WIDTH + l] * end
    if sigma > 0.0:
        out[to.FRONT_TIME, lane] += duration
    if sigma < 0.0:
        out[to.BACK_TIME, lane] += duration
    if ws[at.beyond * WIDTH + l] != sigma:
        out[to.SWITCHES, lane] += 1.0
    _integrals(ws, at.series, duration, end, out, lane, l)
    _extremes(ws, at.series, _Z, end, out, to.Z_MAX, lane, l)
    _extremes(ws, at.series, _SPEED, end, out, to.Z_DOT_MAX, lane, l)
    _extremes(ws, at.series, _FORCE, end, out, to.FORCE_MAX, lane, l)


def empty(lanes: int) -> np.ndarray:
    """Measures (MEASURES, lanes) of nothing yet."""
    out = np.zeros((to.MEASURES, lanes))
    out[[to.Z_MAX, to.Z_DOT_MAX, to.FORCE_MAX]] = -np.inf
    out[[to.Z_MIN, to.Z_DOT_MIN, to.FORCE_MIN]] = np.inf
    return out
