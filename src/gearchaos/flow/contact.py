"""Where a piece of motion leaves its contact state: the first root of the gap, never a later one."""

from __future__ import annotations

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import ORDER, rows
from gearchaos.flow.simd import any_lane, load, select, splat, store, vabs, vfma, vsqrt

_ARRIVED = 1e-15
_GRAZING_SPEED = 1e-8
_PROBE = 1e-3
_LIMIT = 400
_NEVER = 2.0
LOST = 2.0
"""The contact state of a lane whose exit was not decided within the limit of strides."""


@kernel
def _safe_stride(gap, slope, bend):
    """The least distance at which a gap with this slope can vanish if its second derivative is at least ``bend``.

    A step of this length never jumps over a root, and near a simple root it converges quadratically. Where the
    parabola below the gap has no root, the gap has none either.
    """
    zero = splat(0.0)
    gap = select(gap < zero, zero, gap)
    square = vfma(slope, slope, splat(-2.0) * bend * gap)
    root = vsqrt(select(square < zero, zero, square))
    closing = slope < zero
    step = select(closing, gap + gap, slope + root) / select(closing, root - slope, zero - bend)
    rootless = (closing & (square < zero)) | ((zero <= slope) & (zero <= bend))
    return select(rootless, splat(_NEVER), step)


@kernel
def _stride(z, slope, bend, spread, sigma):
    """Safe stride to the nearest boundary, and the contact state beyond it.

    ``bend`` is d²z/ds² here, and ``spread`` bounds how much it changes on the rest of the piece.
    """
    one, zero = splat(1.0), splat(0.0)
    free = sigma == zero
    side = select(free, splat(-1.0), sigma)
    up = _safe_stride(vfma(side, z, select(free, one, splat(-1.0))), side * slope, side * bend - spread)
    down = _safe_stride(one + z, slope, bend - spread)
    falling = free & (down < up)
    return select(falling, down, up), select(falling, splat(-1.0), select(free, one, zero))


@kernel
def _height(ws, coef, d, s):
    """z and its first two derivatives with respect to s at share s of the piece."""
    z = load(ws, coef + ORDER * d)
    slope = bend = splat(0.0)
    for k in range(ORDER - 1, -1, -1):
        bend = vfma(bend, s, slope)
        slope = vfma(slope, s, z)
        z = vfma(z, s, load(ws, coef + k * d))
    return z, slope, bend + bend


@kernel
def _third(ws, coef, d):
    """An upper bound of |d³z/ds³| on the piece."""
    total = splat(0.0)
    for k in range(3, ORDER + 1):
        total = vfma(splat(k * (k - 1.0) * (k - 2.0)), vabs(load(ws, coef + k * d)), total)
    return total


@kernel
def _leaving(ws, coef, d, s, slope, sigma, beyond):
    """Whether a lane that stands on its boundary goes through it.

    A touch at vanishing speed is decided by where the gap goes next, so that a start on a boundary and a grazing
    contact are neither missed nor counted twice.
    """
    fast = vabs(slope) > splat(_GRAZING_SPEED)
    ahead, _, _ = _height(ws, coef, d, s + splat(_PROBE))
    gap = select(sigma == splat(0.0), splat(1.0) - beyond * ahead, sigma * ahead - splat(1.0))
    return fast | (gap < splat(0.0))


@kernel
def find_exits(dims, ws):
    """The share of the piece done when each lane leaves its contact state, 1 if it stays, and the state beyond."""
    d = len(dims)
    at = rows(d)
    sigma, third = load(ws, at.sigma), _third(ws, at.coef, d)
    s, out, to = splat(0.0), splat(_NEVER), sigma
    for _ in range(_LIMIT):
        going = s <= splat(1.0)
        if not any_lane(going):
            break
        z, slope, bend = _height(ws, at.coef, d, s)
        step, beyond = _stride(z, slope, bend, third * (splat(1.0) - s), sigma)
        arrived = going & (step <= splat(_ARRIVED))
        if any_lane(arrived):
            leaving = arrived & _leaving(ws, at.coef, d, s, slope, sigma, beyond)
            out, to = select(leaving, s, out), select(leaving, beyond, to)
            step = select(arrived, splat(_PROBE), step)
            step = select(leaving, splat(_NEVER), step)
        s = select(going, s + step, s)
    to = select(s <= splat(1.0), splat(LOST), to)
    store(ws, at.share, select(out > splat(1.0), splat(1.0), out))
    store(ws, at.beyond, to)
