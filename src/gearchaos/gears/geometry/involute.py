"""The involute function and its inverse."""

from __future__ import annotations

import math


def involute(angle: float) -> float:
    """inv α = tan α − α, ISO 21771:2007 Eq. (18); angles in rad."""
    return math.tan(angle) - angle


def inverse_involute(value: float) -> float:
    """The angle α in [0, π/2) with inv α = ``value``, rad, to rounding; ``value`` must not be negative.

    The involute function is convex. Newton's method therefore descends monotonically from any upper bound; it ends when
    rounding stops the descent. The bounds are inv α ≥ α³/3 and tan α ≤ ``value`` + π/2.
    """
    if value == 0:
        return 0.0
    angle = min(math.cbrt(3 * value), math.atan(value + math.pi / 2))
    while (lower := angle - (involute(angle) - value) / math.tan(angle) ** 2) < angle:
        angle = lower
    return angle
