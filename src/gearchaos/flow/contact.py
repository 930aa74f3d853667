"""Where a piece of motion leaves its contact state: the first root of the gap, never a later one."""

from __future__ import annotations

from math import sqrt

from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER

NEVER = 2.0
"""The share returned when the contact state lasts to the end of the piece."""

_ARRIVED = 1e-15
_GRAZING_SPEED = 1e-8
_PROBE = 1e-3
_LIMIT = 400


@kernel
def height(coef, l, s):
    """z and dz/ds at share s of the piece of lane l."""
    z = coef[ORDER, 0, l]
    slope = 0.0
    for k in range(ORDER - 1, -1, -1):
        slope = fma(slope, s, z)
        z = fma(z, s, coef[k, 0, l])
    return z, slope


@kernel
def curvature_bound(coef, l):
    """An upper bound of |d²z/ds²| on the piece."""
    total = 0.0
    for k in range(2, ORDER + 1):
        total += k * (k - 1) * abs(coef[k, 0, l])
    return total


@kernel
def _safe_stride(gap, slope, bound):
    """The least distance at which a gap with this slope can vanish if its second derivative is at most ``bound``.

    A step of this length never jumps over a root, and near a simple root it converges quadratically.
    """
    gap = max(gap, 0.0)
    root = sqrt(fma(slope, slope, 2.0 * bound * gap))
    if slope < 0.0:
        return 2.0 * gap / (root - slope)
    return (slope + root) / max(bound, 1e-300)


@kernel
def _stride(z, slope, sigma, bound):
    """Safe stride towards the nearest boundary, and the contact state beyond it."""
    if sigma != 0.0:
        return _safe_stride(sigma * z - 1.0, sigma * slope, bound), 0.0
    up = _safe_stride(1.0 - z, -slope, bound)
    down = _safe_stride(1.0 + z, slope, bound)
    return (up, 1.0) if up < down else (down, -1.0)


@kernel
def _gap(z, sigma, beyond):
    return sigma * z - 1.0 if sigma != 0.0 else 1.0 - beyond * z


@kernel
def first_exit(coef, l, sigma):
    """The share at which lane l leaves contact state ``sigma`` and the state it enters; `NEVER` if it stays.

    A touch at vanishing speed is decided by where the gap goes next, so that a start on a boundary and a grazing
    contact are never missed and never counted twice.
    """
    bound = curvature_bound(coef, l)
    s = 0.0
    for _ in range(_LIMIT):
        z, slope = height(coef, l, s)
        step, beyond = _stride(z, slope, sigma, bound)
        if s + step > 1.0:
            return NEVER, sigma
        if step > _ARRIVED:
            s += step
        elif abs(slope) > _GRAZING_SPEED:
            return s, beyond
        else:
            ahead, _ = height(coef, l, s + _PROBE)
            if _gap(ahead, sigma, beyond) < 0.0:
                return s, beyond
            s += _PROBE
    return NEVER, sigma
