"""What engineers read off a motion, integrated on the Taylor polynomials of its pieces: exact to rounding."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import layout as at
from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER

_GAUSS = 8
_NODES, _WEIGHTS = (np.polynomial.legendre.leggauss(_GAUSS)[0] + 1) / 2, (
    np.polynomial.legendre.leggauss(_GAUSS)[1] / 2
)


@kernel
def output_series(dims, phys, p, points, series, l):
    """Taylor coefficients (4, ORDER + 1) of z, z', of the velocity x1' and of the mesh force 2ζz' + χ f(z), for lane l."""
    d = len(dims)
    q = points[l]
    for k in range(ORDER + 1):
        speed = p.coef[k, 1, l]
        velocity = phys.velocity0[q] if k == 0 else 0.0
        for i in range(d):
            velocity = fma(phys.velocity[i, q], p.coef[k, i, l], velocity)
        for j in range(phys.velocity_cos.shape[0]):
            velocity = fma(phys.velocity_cos[j, q], p.cos[k, j, l], velocity)
            velocity = fma(phys.velocity_sin[j, q], p.sin[k, j, l], velocity)
        series[0, k] = p.coef[k, 0, l]
        series[1, k] = speed
        series[2, k] = velocity
        series[3, k] = fma(phys.damping[q], speed, p.force[k, l])


@kernel
def _value(series, row, s):
    total = series[row, ORDER]
    for k in range(ORDER - 1, -1, -1):
        total = fma(total, s, series[row, k])
    return total


@kernel
def _refined(series, row, s, end):
    """The extreme value near share s: two Newton steps on the derivative, kept inside the piece."""
    for _ in range(2):
        first = 0.0
        second = 0.0
        for k in range(ORDER, 0, -1):
            second = fma(second, s, first)
            first = fma(first, s, k * series[row, k])
        if second != 0.0:
            s = min(max(s - first / second, 0.0), end)
    return _value(series, row, s)


@kernel
def _extremes(series, row, end, out, top, l):
    """Update the greatest and least value of one series, rows ``top`` and ``top + 1`` of the measures."""
    high, low = -np.inf, np.inf
    s_high, s_low = 0.0, 0.0
    for g in range(_GAUSS + 2):
        s = 0.0 if g == _GAUSS else (end if g > _GAUSS else _NODES[g] * end)
        value = _value(series, row, s)
        if value > high:
            high, s_high = value, s
        if value < low:
            low, s_low = value, s
    margin = 0.01 * (high - low)
    if high + margin > out[top, l]:
        out[top, l] = max(out[top, l], high, _refined(series, row, s_high, end))
    if low - margin < out[top + 1, l]:
        out[top + 1, l] = min(out[top + 1, l], low, _refined(series, row, s_low, end))


@kernel
def accumulate(series, sigma, duration, end, out, l):
    """Add one piece (up to share ``end``, ``duration`` in τ) to the measures of lane l."""
    if sigma > 0.0:
        out[at.FRONT_TIME, l] += duration
    if sigma < 0.0:
        out[at.BACK_TIME, l] += duration
    for g in range(_GAUSS):
        s = _NODES[g] * end
        weight = _WEIGHTS[g] * duration
        z = _value(series, 0, s)
        speed = _value(series, 1, s)
        velocity = _value(series, 2, s)
        out[at.Z, l] = fma(weight, z, out[at.Z, l])
        out[at.Z_SQUARE, l] = fma(weight, z * z, out[at.Z_SQUARE, l])
        out[at.Z_DOT_SQUARE, l] = fma(weight, speed * speed, out[at.Z_DOT_SQUARE, l])
        out[at.VELOCITY, l] = fma(weight, velocity, out[at.VELOCITY, l])
        out[at.VELOCITY_SQUARE, l] = fma(weight, velocity * velocity, out[at.VELOCITY_SQUARE, l])
    _extremes(series, 0, end, out, at.Z_MAX, l)
    _extremes(series, 1, end, out, at.Z_DOT_MAX, l)
    _extremes(series, 3, end, out, at.FORCE_MAX, l)


def empty(lanes: int) -> np.ndarray:
    """Measures (MEASURES, lanes) of nothing yet."""
    out = np.zeros((at.MEASURES, lanes))
    out[[at.Z_MAX, at.Z_DOT_MAX, at.FORCE_MAX]] = -np.inf
    out[[at.Z_MIN, at.Z_DOT_MIN, at.FORCE_MIN]] = np.inf
    return out
