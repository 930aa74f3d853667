"""Contact switches and extrema of z of trajectories, recorded segment by segment; see `sensitivity`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import subroutine
from gearchaos.flow.kernels.one_spring.contact import SEARCH_FAILED
from gearchaos.flow.kernels.vector.arrays import rows
from gearchaos.flow.kernels.vector.constants import CHATTER, ORDER, WIDTH

_BISECTIONS = 100


class Segment(NamedTuple):
    """Where the segments of the lanes of a pack lie in the period, and the extrema of z on them."""

    start: np.ndarray  # (WIDTH,) start of the segment as a fraction of the period
    length: np.ndarray  # (WIDTH,) its length, likewise
    at: np.ndarray  # (2, WIDTH) extrema, as fractions of the segment
    found: np.ndarray  # (WIDTH,) their number
    first: np.ndarray  # (WIDTH,) index of the first in `SensitivityCall.extrema`


def new_segment() -> Segment:
    """An empty `Segment`."""
    return Segment(np.zeros(WIDTH), np.zeros(WIDTH), np.zeros((2, WIDTH)), *np.zeros((2, WIDTH), np.int64))


@subroutine
def _value(ws, first, stride, l, s):
    """The polynomial whose coefficient k is row ``first + k * stride``, for lane l at s."""
    total = 0.0
    for k in range(ORDER, -1, -1):
        total = total * s + ws[(first + k * stride) * WIDTH + l]
    return total


@subroutine
def _derivative(ws, first, stride, l, s):
    """The derivative of that polynomial."""
    total = 0.0
    for k in range(ORDER, 0, -1):
        total = total * s + k * ws[(first + k * stride) * WIDTH + l]
    return total


@subroutine
def _root(ws, first, stride, l, a, b, derivative):
    """A root between a and b of the polynomial, or of its derivative, for lane l, by bisection."""
    rising = True
    for n in range(_BISECTIONS):
        middle = a if n == 0 else 0.5 * (a + b)
        if n > 0 and middle in (a, b):
            break
        value = _derivative(ws, first, stride, l, middle) if derivative else _value(ws, first, stride, l, middle)
        if n == 0:
            rising = value <= 0.0
        elif (value <= 0.0) == rising:
            a = middle
        else:
            b = middle
    return 0.5 * (a + b)


@subroutine
def _find_extrema(ws, first, stride, l, end, segment):
    """Find the extrema of z on the segment of lane l up to ``end``: the roots of z', whose polynomial begins at row
    ``first``. At most two are found: z'' changes sign at most once on a step of 0.45 rad, except in cases of no
    practical interest."""
    segment.found[l] = 0
    before, after = ws[first * WIDTH + l], _value(ws, first, stride, l, end)
    if (before > 0.0) != (after > 0.0):
        segment.at[0, l] = _root(ws, first, stride, l, 0.0, end, False)
        segment.found[l] = 1
        return
    rate, last = _derivative(ws, first, stride, l, 0.0), _derivative(ws, first, stride, l, end)
    if (rate > 0.0) == (last > 0.0) or (rate > 0.0) == (before > 0.0):
        return
    turn = _root(ws, first, stride, l, 0.0, end, True)
    if (_value(ws, first, stride, l, turn) > 0.0) != (before > 0.0):
        segment.at[0, l] = _root(ws, first, stride, l, 0.0, turn, False)
        segment.at[1, l] = _root(ws, first, stride, l, turn, end, False)
        segment.found[l] = 2


@subroutine
def record_switches(ws, at, call, lanes, count, segment):
    """Record the contact switches at the ends of the segments, with z' from the start rows."""
    for l in range(count):
        lane, sigma, beyond = lanes[l], ws[at.sigma * WIDTH + l], ws[at.next_sigma * WIDTH + l]
        if beyond == SEARCH_FAILED:
            call.status[lane] = CHATTER
        elif (abs(sigma) > 0.75) != (abs(beyond) > 0.75) and call.switch_count[lane] < call.switches.shape[1]:
            record = call.switches[lane, call.switch_count[lane]]
            record[0] = segment.start[l] + segment.length[l] * ws[at.end_fraction * WIDTH + l]
            record[1] = 1.0 if sigma + beyond > 0.0 else -1.0
            record[2] = 1.0 if abs(beyond) > 0.75 else 0.0
            record[3] = ws[(at.start + 1) * WIDTH + l]
            call.switch_count[lane] += 1


@subroutine
def record_extrema(dims, ws, row, call, lanes, count, segment):
    """Find and record the extrema of z on the segments, without their derivatives."""
    d, at = len(dims), rows(dims)
    for l in range(count):
        segment.found[l] = 0
        if ws[at.duration * WIDTH + l] > 0.0:
            _find_extrema(ws, row.motion + 1, d, l, ws[at.end_fraction * WIDTH + l], segment)
        lane = lanes[l]
        segment.first[l] = call.extremum_count[lane]
        segment.found[l] = min(segment.found[l], call.extrema.shape[1] - segment.first[l])
        for n in range(segment.found[l]):
            record = call.extrema[lane, segment.first[l] + n]
            record[0] = segment.start[l] + segment.length[l] * segment.at[n, l]
            record[1] = _value(ws, row.motion, d, l, segment.at[n, l])
            record[2] = 1.0 if _value(ws, row.motion + 1, d, l, 0.0) > 0.0 else -1.0
            record[2] = -record[2] if n == 1 else record[2]
        call.extremum_count[lane] += segment.found[l]


@subroutine
def extremum_derivatives(dims, ws, call, lanes, count, segment, column):
    """Record the derivative of z at the extrema of the segments, from the polynomial of a tangent vector."""
    for l in range(count):
        for n in range(segment.found[l]):
            value = _value(ws, rows(dims).state, len(dims), l, segment.at[n, l])
            call.extrema[lanes[l], segment.first[l] + n, 3 + column] = value
