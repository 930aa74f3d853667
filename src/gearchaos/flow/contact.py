"""Where a piece of motion leaves its contact state: the first root of the gap, never a later one."""

from __future__ import annotations

from math import sqrt

from gearchaos.flow.jit import fma, kernel
from gearchaos.flow.layout import ORDER, WIDTH, rows

NEVER = 2.0
"""The share at which a lane leaves that keeps its contact state to the end of the piece."""

_ARRIVED = 1e-15
_GRAZING_SPEED = 1e-8
_PROBE = 1e-3
_APPROACHES = 8
_LIMIT = 400


@kernel
def _safe_stride(gap, slope, bound):
    """The least distance at which a gap with this slope can vanish if its second derivative is at most ``bound``.

    A step of this length never jumps over a root, and near a simple root it converges quadratically.
    """
    gap = max(gap, 0.0)
    root = sqrt(fma(slope, slope, 2.0 * bound * gap))
    top = 2.0 * gap if slope < 0.0 else slope + root
    return top / (root - slope if slope < 0.0 else bound)


@kernel
def _stride(z, slope, sigma, bound):
    """Safe stride to the nearest boundary, and the contact state beyond it."""
    free = sigma == 0.0
    towards = -1.0 if free else sigma
    up = _safe_stride(fma(towards, z, 1.0 if free else -1.0), towards * slope, bound)
    down = _safe_stride(1.0 + z, slope, bound)
    falling = free & (down < up)
    return (down if falling else up), (-1.0 if falling else (1.0 if free else 0.0))


@kernel
def _height(dims, ws, l, s):
    """z and dz/ds of one lane at share s of the piece."""
    d = len(dims)
    coef = rows(d).coef
    z = ws[(coef + ORDER * d) * WIDTH + l]
    slope = 0.0
    for k in range(ORDER - 1, -1, -1):
        slope = fma(slope, s, z)
        z = fma(z, s, ws[(coef + k * d) * WIDTH + l])
    return z, slope


@kernel
def _bound_curvature(dims, ws):
    """An upper bound of |d²z/ds²| on the piece, lane by lane."""
    d = len(dims)
    at = rows(d)
    for l in range(WIDTH):
        total = 1e-300
        for k in range(2, ORDER + 1):
            total = fma(k * (k - 1.0), abs(ws[(at.coef + k * d) * WIDTH + l]), total)
        ws[at.curvature * WIDTH + l] = total


@kernel
def _approach(dims, ws):
    """Take safe strides with all lanes at once, until each stands before its exit or past the end."""
    at = rows(len(dims))
    for l in range(WIDTH):
        ws[at.share * WIDTH + l] = 0.0
    for _ in range(_APPROACHES):
        moving = 0.0
        for l in range(WIDTH):
            s = ws[at.share * WIDTH + l]
            z, slope = _height(dims, ws, l, s)
            step, _ = _stride(z, slope, ws[at.sigma * WIDTH + l], ws[at.curvature * WIDTH + l])
            going = (s <= 1.0) & (step > _ARRIVED)
            moving += 1.0 if going else 0.0
            ws[at.share * WIDTH + l] = (NEVER if s + step > 1.0 else s + step) if going else s
        if moving == 0.0:
            return


@kernel
def _decide(dims, ws, l):
    """From a point before the exit of one lane: the share at which it leaves, and the contact state it enters.

    A touch at vanishing speed is decided by where the gap goes next, so that a start on a boundary and a grazing
    contact are neither missed nor counted twice.
    """
    at = rows(len(dims))
    s, sigma = ws[at.share * WIDTH + l], ws[at.sigma * WIDTH + l]
    for _ in range(_LIMIT):
        if s > 1.0:
            return NEVER, sigma
        z, slope = _height(dims, ws, l, s)
        step, beyond = _stride(z, slope, sigma, ws[at.curvature * WIDTH + l])
        if step > _ARRIVED:
            s += step
        elif abs(slope) > _GRAZING_SPEED:
            return s, beyond
        else:
            ahead, _ = _height(dims, ws, l, s + _PROBE)
            gap = 1.0 - beyond * ahead if sigma == 0.0 else sigma * ahead - 1.0
            if gap < 0.0:
                return s, beyond
            s += _PROBE
    return NEVER, sigma


@kernel
def find_exits(dims, ws, count):
    """The share done and the contact state beyond it, for the first ``count`` lanes of the chunk."""
    at = rows(len(dims))
    _bound_curvature(dims, ws)
    _approach(dims, ws)
    for l in range(count):
        share, beyond = _decide(dims, ws, l)
        ws[at.share * WIDTH + l] = 1.0 if share == NEVER else share
        ws[at.beyond * WIDTH + l] = beyond
