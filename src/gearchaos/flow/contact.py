"""Where a piece of motion leaves its contact state: the first root of the gap, never a later one."""

from __future__ import annotations

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import ORDER, rows
from gearchaos.flow.simd import any_lane, least, load, select, splat, store, vabs, vfma, vsqrt

_ARRIVED = 1e-15
_GRAZING_SPEED = 1e-8
_PROBE = 1e-3
_CLOSE = 1e-9
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
def _signs(sigma):
    """How the distances from the boundary above and from the one below change with z.

    In contact there is one boundary, which both stand for.
    """
    free = sigma == splat(0.0)
    return select(free, splat(-1.0), sigma), select(free, splat(1.0), sigma)


@kernel
def _gaps(z, sigma):
    """Distances of z, inside its contact state, from the boundary above and from the one below."""
    one = splat(1.0)
    free = sigma == splat(0.0)
    touching = vfma(sigma, z, splat(-1.0))
    return select(free, one - z, touching), select(free, one + z, touching)


@kernel
def _reached(gap, slope, bend, ahead):
    """Whether a parabola below the gap, no more than straight, comes down to zero within the share ``ahead``."""
    zero = splat(0.0)
    bend = select(zero < bend, zero, bend)
    return (gap <= zero) | (vfma(ahead, vfma(splat(0.5) * bend, ahead, slope), gap) <= zero)


@kernel
def _stride(above, below, slope, bend, spread, ahead, sigma):
    """Safe stride to the nearest boundary, and the contact state beyond it.

    ``bend`` is d²z/ds² here, and ``spread`` bounds how much it changes within the share ``ahead``. Seldom are both
    boundaries within reach, so mostly one root does.
    """
    one, free = splat(1.0), sigma == splat(0.0)
    up, down = _signs(sigma)
    high = _reached(above, up * slope, up * bend - spread, ahead)
    side = select(high, up, down)
    step = _safe_stride(select(high, above, below), side * slope, side * bend - spread)
    beyond = select(free, select(high, one, splat(-1.0)), splat(0.0))
    both = free & high & _reached(below, down * slope, down * bend - spread, ahead)
    if any_lane(both):
        falling = _safe_stride(below, down * slope, down * bend - spread)
        lower = both & (falling < step)
        step, beyond = select(lower, falling, step), select(lower, splat(-1.0), beyond)
    return step, beyond


@kernel
def _rise(ws, coef, d, s):
    """z(s) - z(0) and the first two derivatives of z with respect to s, at share s of the piece.

    From the start, because a lane that starts on a boundary may move from it by less than z can resolve.
    """
    rate, slope, bend = load(ws, coef + ORDER * d), splat(0.0), splat(0.0)
    for k in range(ORDER - 1, 0, -1):
        bend = vfma(bend, s, slope)
        slope = vfma(slope, s, rate)
        rate = vfma(rate, s, load(ws, coef + k * d))
    bend = vfma(bend, s, slope)
    slope = vfma(slope, s, rate)
    return rate * s, slope, bend + bend


@kernel
def _third(ws, coef, d):
    """An upper bound of |d³z/ds³| on the piece."""
    total = splat(0.0)
    for k in range(3, ORDER + 1):
        total = vfma(splat(k * (k - 1.0) * (k - 2.0)), vabs(load(ws, coef + k * d)), total)
    return total


@kernel
def _leaving(ws, coef, d, s, above, below, sigma, beyond):
    """Whether a lane that touches its boundary at vanishing speed goes through it: whether the gap is negative at s."""
    rise, _, _ = _rise(ws, coef, d, s)
    up, down = _signs(sigma)
    return select(beyond < splat(0.0), vfma(down, rise, below), vfma(up, rise, above)) < splat(0.0)


@kernel
def _window(error, speed, step, inside):
    """Within what distance of the next place the boundary will be, if it was within reach: by the bound for the error
    of the stride, where the motion is not much slower there. Bounds are the sharper the closer the window is.
    """
    far = splat(_NEVER)
    guess = splat(4.0) * error / speed
    guess = select(guess < far, select(guess < splat(_CLOSE), splat(_CLOSE), guess), far)
    return select(step <= inside, guess, far)


@kernel
def find_exits(dims, ws):
    """The share of the piece done when each lane leaves its contact state, 1 if it stays, and the state beyond.

    A start on a boundary and a grazing contact are neither missed nor counted twice: a touch at vanishing speed is
    decided by a probe ahead. From there the windows of the strides grow with the distance; with a bound for the rest
    of the piece they would shrink like its square where the gap opens like its cube.
    """
    d = len(dims)
    at = rows(d)
    sigma, third = load(ws, at.sigma), _third(ws, at.coef, d)
    above, below = _gaps(load(ws, at.coef), sigma)
    up, down = _signs(sigma)
    out, to, touch, probe = splat(_NEVER), sigma, splat(-_NEVER), splat(_PROBE)
    s = select(splat(0.0) < load(ws, at.h), splat(0.0), splat(_NEVER))  # lanes that are done wait
    going, reach = s <= splat(1.0), splat(_NEVER)
    rise, slope, bend = splat(0.0), load(ws, at.coef + d), splat(2.0) * load(ws, at.coef + 2 * d)
    for _ in range(_LIMIT):
        over, under = vfma(up, rise, above), vfma(down, rise, below)
        window = least(reach, select(touch < splat(0.0), splat(_NEVER), splat(0.5) * (s - touch)))
        inside = least(window, splat(1.0) - s)
        spread = third * inside
        step, beyond = _stride(over, under, slope, bend, spread, inside, sigma)
        speed = vabs(slope)
        error = spread * step * step
        sure = error <= splat(_ARRIVED) * speed
        leaving = going & (splat(_GRAZING_SPEED) < speed) & sure & (step <= inside)
        near = (step < splat(_PROBE)) & (least(over, under) <= splat(_ARRIVED))
        touching = going & (speed <= splat(_GRAZING_SPEED)) & ((step <= splat(_ARRIVED)) | near)
        root = s + step
        reach = _window(error, speed, step, inside)
        step = least(step, window)
        if any_lane(touching):
            through = touching & _leaving(ws, at.coef, d, s + probe, above, below, sigma, beyond)
            leaving, root = leaving | through, select(through, s, root)
            step = select(touching, probe, step)
            touch, probe = select(touching, s, touch), select(touching, probe + probe, probe)
        out, to = select(leaving, root, out), select(leaving, beyond, to)
        step = select(leaving, splat(_NEVER), step)
        s = select(going, s + step, s)
        going = s <= splat(1.0)
        if not any_lane(going):
            break
        rise, slope, bend = _rise(ws, at.coef, d, s)
    to = select(s <= splat(1.0), splat(LOST), to)
    store(ws, at.share, select(out > splat(1.0), splat(1.0), out))
    store(ws, at.beyond, to)
