"""Where a segment of motion leaves its contact state: the first root of the gap, never a later one.

Method and proof are in docs/method.md, "Resolving a step". All arguments are vectors, except ``ws`` and numbers of
rows. Derivatives are with respect to the share s of the segment.
"""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import subroutine
from gearchaos.flow.kernels.constants import ORDER
from gearchaos.flow.kernels.offsets import rows
from gearchaos.flow.kernels.simd import any_true, broadcast, load, select, smaller, store, vabs, vfma, vsqrt

_EXACT = 1e-15
"""Error of an exit, as a share of the segment, at which the search ends."""

_GRAZING_SPEED = 1e-8
"""An arrival at the boundary with a smaller |dz/ds| counts as a touch, not as a crossing."""

_PROBE = 1e-3
"""How far beyond a touch the sign of the gap decides whether it was a crossing, as a share of the segment."""

_SMALLEST_WINDOW = 1e-9
_MAX_STRIDES = 400
_NEVER = 2.0
"""A share that no motion reaches, since a segment ends at 1."""

LOST = 2.0
"""Contact state of a lane whose exit was not found within the limit of strides."""


@subroutine
def _safe_stride(gap, slope, second):
    """The smallest distance at which a gap with this derivative can vanish if its second derivative is at least
    ``second``.

    A stride of this length never jumps over a root, and near a simple root strides converge quadratically. Where the
    parabola below the gap has no root, the gap has none either.
    """
    zero = broadcast(0.0)
    gap = select(gap < zero, zero, gap)
    square = vfma(slope, slope, broadcast(-2.0) * second * gap)
    root = vsqrt(select(square < zero, zero, square))
    closing = slope < zero
    stride = select(closing, gap + gap, slope + root) / select(closing, root - slope, zero - second)
    rootless = (closing & (square < zero)) | ((zero <= slope) & (zero <= second))
    return select(rootless, broadcast(_NEVER), stride)


@subroutine
def _signs(sigma):
    """Derivatives with respect to z of the distances from the upper and from the lower boundary.

    A lane in contact has one boundary, which takes the part of both.
    """
    free = sigma == broadcast(0.0)
    return select(free, broadcast(-1.0), sigma), select(free, broadcast(1.0), sigma)


@subroutine
def _gaps(z, sigma):
    """Distances of z, within its contact state, from the upper and from the lower boundary."""
    one = broadcast(1.0)
    free = sigma == broadcast(0.0)
    contact = vfma(sigma, z, broadcast(-1.0))
    return select(free, one - z, contact), select(free, one + z, contact)


@subroutine
def _may_close(gap, slope, second, ahead):
    """Whether the parabola below a gap, made concave, reaches zero within the distance ``ahead``."""
    zero = broadcast(0.0)
    second = select(zero < second, zero, second)
    return (gap <= zero) | (vfma(ahead, vfma(broadcast(0.5) * second, ahead, slope), gap) <= zero)


@subroutine
def _stride(above, below, slope, second, change, ahead, sigma):
    """Safe stride to the nearest boundary, and the contact state beyond it.

    ``above`` and ``below`` are the gaps, ``slope`` and ``second`` the derivatives of z; ``change`` bounds how much the
    second one varies within the distance ``ahead``. Seldom are both boundaries within reach, so that one square root
    mostly suffices.
    """
    one, free = broadcast(1.0), sigma == broadcast(0.0)
    up, down = _signs(sigma)
    high = _may_close(above, up * slope, up * second - change, ahead)
    side = select(high, up, down)
    stride = _safe_stride(select(high, above, below), side * slope, side * second - change)
    beyond = select(free, select(high, one, broadcast(-1.0)), broadcast(0.0))
    both = free & high & _may_close(below, down * slope, down * second - change, ahead)
    if any_true(both):
        falling = _safe_stride(below, down * slope, down * second - change)
        lower = both & (falling < stride)
        stride, beyond = select(lower, falling, stride), select(lower, broadcast(-1.0), beyond)
    return stride, beyond


@subroutine
def _displacement(ws, first, d, s):
    """z(s) − z(0) and the first two derivatives of z, from the polynomials that begin at row ``first``.

    The difference is formed without z(0), because a lane that starts on a boundary may move from it by less than the
    rounding of z.
    """
    rate, slope, second = load(ws, first + ORDER * d), broadcast(0.0), broadcast(0.0)
    for k in range(ORDER - 1, 0, -1):
        second = vfma(second, s, slope)
        slope = vfma(slope, s, rate)
        rate = vfma(rate, s, load(ws, first + k * d))
    second = vfma(second, s, slope)
    slope = vfma(slope, s, rate)
    return rate * s, slope, second + second


@subroutine
def _third_derivative_bound(ws, first, d):
    """An upper bound of |d³z/ds³| on the segment, from the polynomials that begin at row ``first``."""
    total = broadcast(0.0)
    for k in range(3, ORDER + 1):
        total = vfma(broadcast(k * (k - 1.0) * (k - 2.0)), vabs(load(ws, first + k * d)), total)
    return total


@subroutine
def _crosses(ws, first, d, s, above, below, sigma, beyond):
    """Whether a lane that touches its boundary at vanishing speed crosses it: whether the gap is negative at s."""
    moved, _, _ = _displacement(ws, first, d, s)
    up, down = _signs(sigma)
    return select(beyond < broadcast(0.0), vfma(down, moved, below), vfma(up, moved, above)) < broadcast(0.0)


@subroutine
def _next_window(error, speed, stride, ahead):
    """Upper bound of the distance from the end of this stride to the boundary crossing.

    It is four times the error bound of the stride over the speed, which holds where the motion does not slow down
    much; infinite if the stride was cut short by the present window. The smaller the window, the sharper are the
    bounds within it.
    """
    far = broadcast(_NEVER)
    window = broadcast(4.0) * error / speed
    smallest = broadcast(_SMALLEST_WINDOW)
    window = select(window < far, select(window < smallest, smallest, window), far)
    return select(stride <= ahead, window, far)


@subroutine
def find_exits(dims, ws):
    """Find where each lane leaves its contact state: writes the share of the segment, 1 if it stays, to row ``share``,
    and the contact state after it to row ``next_sigma`` (`LOST` if the search does not end).

    A start on a boundary and a grazing contact are neither missed nor counted twice: a touch at vanishing speed is
    decided by the gap a little later. From there the windows of the strides grow with the distance; with a bound for
    the whole rest of the segment strides would shrink like its square where the gap opens like its cube.
    """
    d = len(dims)
    at = rows(dims)
    sigma, third = load(ws, at.sigma), _third_derivative_bound(ws, at.state, d)
    above, below = _gaps(load(ws, at.state), sigma)
    up, down = _signs(sigma)
    exit_at, to, touch, probe = broadcast(_NEVER), sigma, broadcast(-_NEVER), broadcast(_PROBE)
    s = select(broadcast(0.0) < load(ws, at.duration), broadcast(0.0), broadcast(_NEVER))  # lanes at the end wait
    searching, reach = s <= broadcast(1.0), broadcast(_NEVER)
    moved, slope, second = broadcast(0.0), load(ws, at.state + d), broadcast(2.0) * load(ws, at.state + 2 * d)
    for _ in range(_MAX_STRIDES):
        over, under = vfma(up, moved, above), vfma(down, moved, below)
        window = smaller(reach, select(touch < broadcast(0.0), broadcast(_NEVER), broadcast(0.5) * (s - touch)))
        ahead = smaller(window, broadcast(1.0) - s)
        change = third * ahead
        stride, beyond = _stride(over, under, slope, second, change, ahead, sigma)
        speed = vabs(slope)
        error = change * stride * stride
        exact = error <= broadcast(_EXACT) * speed
        leaving = searching & (broadcast(_GRAZING_SPEED) < speed) & exact & (stride <= ahead)
        near = (stride < broadcast(_PROBE)) & (smaller(over, under) <= broadcast(_EXACT))
        touching = searching & (speed <= broadcast(_GRAZING_SPEED)) & ((stride <= broadcast(_EXACT)) | near)
        root = s + stride
        reach = _next_window(error, speed, stride, ahead)
        stride = smaller(stride, window)
        if any_true(touching):
            through = touching & _crosses(ws, at.state, d, s + probe, above, below, sigma, beyond)
            leaving, root = leaving | through, select(through, s, root)
            stride = select(touching, probe, stride)
            touch, probe = select(touching, s, touch), select(touching, probe + probe, probe)
        exit_at, to = select(leaving, root, exit_at), select(leaving, beyond, to)
        stride = select(leaving, broadcast(_NEVER), stride)
        s = select(searching, s + stride, s)
        searching = s <= broadcast(1.0)
        if not any_true(searching):
            break
        moved, slope, second = _displacement(ws, at.state, d, s)
    to = select(s <= broadcast(1.0), broadcast(LOST), to)
    store(ws, at.share, select(exit_at > broadcast(1.0), broadcast(1.0), exit_at))
    store(ws, at.next_sigma, to)
