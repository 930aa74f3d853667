"""Where the motion of a run jumps, and the event that ends the branch on which it was before."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.branch import follow_branch, follow_doubled
from gearchaos.continuation.events import FLIP, Event
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.orbit import find_cycle
from gearchaos.errors import InputError
from gearchaos.flow import Measure, of_meshes
from gearchaos.studies.runup.runup_results import RunResults

# of a run; fewest mesh cycles, and fewest and most periods, on either side of a jump
_PARTS, _WIDTHS = 800, (24, 4, 400)
_JUMP = 1.25  # smallest ratio of the ranges of the force beyond which they change suddenly
_LEAST = 1e-12  # range of the force that counts as none
_SLOW = 0.05  # largest relative change of speed and torque beside a jump: that of a resonance is slower
_BEYOND = 0.05  # share of the periods on either side that may lie beyond those on the other side
_EARLIER = (4, 8, 16, 32, 64)  # widths before a jump where the motion is taken for one on the branch that ends
_SAME = 0.05  # largest distance of that motion from the branch, relative to the larger of 1 and its largest coordinate
_DOUBLINGS = 4  # of a period, that are followed in turn
_LATER = 1000  # periods for which that motion is followed where it is not periodic
_REACH = 0.02  # how far beyond the jump a branch is followed, relative to the speed

NOT_PERIODIC, GOES_ON = "not periodic", "goes on"
"""Why a jump has no event: the motion before it is not periodic, or its branch stays stable."""


class ChangePoint(NamedTuple):
    """A sudden change of the range of the mesh force in a run: there the motion jumps."""

    period: int
    width: int  # periods on either side by which it was found
    speed: float  # rpm
    before: float  # largest dynamic factors
    after: float
    clear: bool  # whether the range is steady on both sides
    earliest: int = 0  # period since which the motion may have been the same: the motion after the last jump


def find_jumps(results: RunResults, cycles: int, changing: Sequence[np.ndarray]) -> list[ChangePoint]:
    """Where the range of the mesh force of the periods, each of so many mesh cycles, changes suddenly.

    That of two periods is taken, alike along a motion of doubled period. On one side it must be steady, so that a
    chaotic motion has no jumps but its beginning and end. ``changing`` are the speed, and the torque if it changes, at
    the groups of periods (G,).
    """
    from scipy.ndimage import maximum_filter1d, percentile_filter  # here, since they take a tenth of a second to load

    run, groups, extent, factor = results.run, results.groups, results.kept["extent"], results.kept["factor"]
    size = int(groups[1])
    width = int(np.clip(run.periods // _PARTS, max(_WIDTHS[0] // cycles, _WIDTHS[1]), _WIDTHS[2]))
    width = max(width // size, _WIDTHS[1])
    known = int(np.count_nonzero(np.isfinite(extent)))
    if known < 4 * width:
        return []
    level = np.log(np.maximum(maximum_filter1d(extent[:known], 2), _LEAST))
    low, middle, high = (percentile_filter(level, share, width) for share in (100 * _BEYOND, 50, 100 * (1 - _BEYOND)))
    before, after = slice(0, -2 * width), slice(2 * width, None)
    steady = np.minimum((high - low)[before], (high - low)[after]) < math.log(_JUMP)
    for each in changing:
        earlier, later = each[:known][before], each[:known][after]
        steady &= np.abs(later - earlier) < _SLOW * np.minimum(np.abs(later), np.abs(earlier))
    change = np.where(steady, np.abs(middle[after] - middle[before]), 0.0)
    out = []
    while change.max() > math.log(_JUMP):
        middle_of = int(np.argmax(change)) + width
        near = slice(middle_of - width // 2, middle_of + width // 2)  # between the two windows
        k = near.start + int(np.argmax(np.abs(np.diff(level[near]))))
        sides = (slice(max(0, near.start - width), near.start), slice(middle_of + width, middle_of + 2 * width))
        was, becomes = (float(np.fmax.reduce(factor[side])) for side in sides)  # when the transient is over
        spread = high - low
        settled = spread[middle_of + width : middle_of + 2 * width + 1].min()  # when the transient is over
        clear = max(spread[middle_of - width], settled) < math.log(_JUMP)
        out.append(ChangePoint(int(groups[k]), width * size, float(changing[0][k]), was, becomes, bool(clear)))
        change[max(0, middle_of - 3 * width) : middle_of + width] = 0.0
    out.sort()
    return out[:1] + [each._replace(earliest=last.period + 2 * last.width) for last, each in pairwise(out)]


def find_event(
    jump: ChangePoint, mesh: int, before: Callable[[int], tuple[Any, np.ndarray, tuple[str, ...]]]
) -> tuple[str, float]:
    """The kind and the speed of the event that ends the branch of the motion before a jump; where there is none, why
    and NaN.

    ``before`` gives for a period the model at its speed and torque, the state (d,) at its start, and the names of that.
    A run passes the end of a branch before it jumps. So the motion is taken ever earlier until it is on a branch, but
    not before the last jump; soon after that, once, a width before the jump. The search ends at a motion
    without a period that stays as large as it was, by the force of the ``mesh`` with this number.
    """
    why, periods = NOT_PERIODIC, [jump.period - jump.width * widths for widths in _EARLIER]
    known = [period for period in periods if period >= jump.earliest]
    for period in known or [max(jump.earliest, jump.period - jump.width)]:
        model, w, names = before(period)
        family = ParameterFamily(model, ("speed",), names)
        start = as_initial_values(family, family.start[None], w[None, None])
        try:
            family, cycle = find_cycle(
                model.with_values({name: float(x[0, 0]) for name, x in start.items()}), ("speed",), None, None,
                names=names)
        except InputError:  # no periodic motion; does it go on at constant speed with about this dynamic factor?
            flow = family.exact_flow(family.start[None])
            later = flow.advance(flow.advance(w[:, None].copy(), _LATER).w, _LATER, measured=True)
            ends = of_meshes(later.measures)[mesh, [Measure.FORCE_MAX, Measure.FORCE_MIN], 0]
            factor = np.abs(ends).max() / abs(flow.system.static_force[0, mesh])
            if 1 / _JUMP < factor / jump.before < _JUMP:
                break
            continue
        if np.abs(cycle.points - w).max(axis=1).min() > _SAME * max(1.0, float(np.abs(w).max())):
            continue  # another one, reached beyond the end of the branch
        own, rising = float(family.start[0]), jump.speed > float(family.start[0])
        beyond = jump.speed * (1 + _REACH if rising else 1 - _REACH)
        bounds = min(own, beyond), max(own, beyond)
        event = follow_branch(family, cycle, bounds, Settings()).ends_of_stability()[0 if rising else 1]
        if event is not None:
            event = _after_doublings(family, event, bounds)
            return event.kind, float(event.point.u[-1])
        why = GOES_ON
    return why, math.nan


def _after_doublings(family: ParameterFamily, event: Event, bounds: tuple[float, float]) -> Event:
    """The event that ends the stable branch of doubled period which begins at a flip, and of those in turn; the event
    itself where none begins there."""
    for _ in range(_DOUBLINGS):
        if event.kind != FLIP:
            break
        try:
            doubled = follow_doubled(family, event, bounds, Settings())
        except Stopped:
            break
        following = doubled.ends_of_stability()[0]
        if following is None or doubled.unstable[doubled.start]:
            break
        event = following
    return event


def response_peaks(factor: np.ndarray) -> list[int]:
    """The indices of the peaks of the dynamic factors (V,) over the speed, of a run in one direction: it falls by a
    quarter or more on both sides before it rises higher."""
    from scipy.signal import find_peaks  # here, since it takes a third of a second to load

    level = np.log(factor)
    return find_peaks(np.where(np.isfinite(level), level, -np.inf), prominence=math.log(_JUMP))[0].tolist()
