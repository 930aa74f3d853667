"""Which stroboscopic sections of a motion come close to its last one."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import inlined, kernel

_STRIP = 64
"""Lanes looked at together: what is noted of them stays in the first-level cache."""


def near_returns(sections: np.ndarray, longest: int, near: float, before: float, count: int) -> np.ndarray:
    """The shortest numbers of periods (count, L), up to ``longest``, after which each motion comes back; 0 for none.

    The last of the sections (S, d, L), S > 2 ``longest``, is then within ``near`` of the one so many periods before,
    and that one within ``before`` of the one as many again before: the largest difference of a coordinate, in units of
    the larger of 1 and its spread over the sections.
    """
    found = np.zeros((count, sections.shape[2]), dtype=np.int64)
    if longest < 1:
        return found
    _search(sections, longest, near, before, np.empty((sections.shape[1] + 1, _STRIP)), np.empty(_STRIP, bool), found)
    return found


@kernel
def _search(sections, longest, near, before, scale, close, found):
    lanes = sections.shape[2]
    for first in range(0, lanes, _STRIP):
        strip = min(_STRIP, lanes - first)
        _spread(sections, first, strip, scale)
        for n in range(1, longest + 1):
            _compare(sections, first, strip, n, near, scale, close)
            for l in range(strip):
                if close[l] and _again(sections, first, l, n, before, scale):
                    _note(found, first + l, n)


@inlined
def _spread(sections, first, strip, scale):
    """The larger of 1 and the spread of each coordinate over the sections, into scale (d + 1, _STRIP); its last row
    is a scratch."""
    d = sections.shape[1]
    for i in range(d):
        for l in range(strip):
            scale[i, l] = scale[d, l] = sections[0, i, first + l]
        for n in range(1, sections.shape[0]):
            for l in range(strip):
                scale[i, l] = max(scale[i, l], sections[n, i, first + l])
                scale[d, l] = min(scale[d, l], sections[n, i, first + l])
        for l in range(strip):
            scale[i, l] = max(scale[i, l] - scale[d, l], 1.0)


@inlined
def _compare(sections, first, strip, n, near, scale, close):
    """Which lanes of the strip were within ``near`` of their last section n periods before."""
    end = sections.shape[0] - 1
    for l in range(strip):
        close[l] = True
    for i in range(sections.shape[1]):
        for l in range(strip):
            gap = abs(sections[end - n, i, first + l] - sections[end, i, first + l]) / scale[i, l]
            close[l] &= gap < near


@inlined
def _again(sections, first, l, n, before, scale):
    """Whether a lane of the strip was within ``before`` of where it was n periods ago yet another n periods ago."""
    end, again = sections.shape[0] - 1, True
    for i in range(sections.shape[1]):
        gap = abs(sections[end - n, i, first + l] - sections[end - 2 * n, i, first + l]) / scale[i, l]
        again &= gap < before
    return again


@inlined
def _note(found, lane, n):
    """Put n where the lane has room for another number."""
    for i in range(len(found)):
        if found[i, lane] == 0:
            found[i, lane] = n
            return
