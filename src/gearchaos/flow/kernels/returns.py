"""Near returns of stroboscopic sections, for many lanes."""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import inlined, kernel

BLOCK = 64
"""Lanes compared together, so that their scales stay in the first-level cache."""


@kernel
def search_returns(sections, longest, tolerance, previous_tolerance, scale, close, found):
    """Fill ``found`` (count, L), see `flow.returns.near_returns`.

    ``sections`` is (S, d, L); ``scale`` (d + 1, BLOCK) and ``close`` (BLOCK,), booleans, are overwritten.
    """
    lanes = sections.shape[2]
    for first in range(0, lanes, BLOCK):
        count = min(BLOCK, lanes - first)
        _spread(sections, first, count, scale)
        for n in range(1, longest + 1):
            _compare(sections, first, count, n, tolerance, scale, close)
            for l in range(count):
                if close[l] and _returned_before(sections, first, l, n, previous_tolerance, scale):
                    _append(found, first + l, n)


@inlined
def _spread(sections, first, count, scale):
    """Write the range of each coordinate over all sections, or 1 if that is larger, to ``scale``; its last row is
    scratch."""
    d = sections.shape[1]
    for i in range(d):
        for l in range(count):
            scale[i, l] = scale[d, l] = sections[0, i, first + l]
        for n in range(1, sections.shape[0]):
            for l in range(count):
                scale[i, l] = max(scale[i, l], sections[n, i, first + l])
                scale[d, l] = min(scale[d, l], sections[n, i, first + l])
        for l in range(count):
            scale[i, l] = max(scale[i, l] - scale[d, l], 1.0)


@inlined
def _compare(sections, first, count, n, tolerance, scale, close):
    """Which lanes of the block were, n periods before their last section, within ``tolerance`` of it."""
    end = sections.shape[0] - 1
    for l in range(count):
        close[l] = True
    for i in range(sections.shape[1]):
        for l in range(count):
            gap = abs(sections[end - n, i, first + l] - sections[end, i, first + l]) / scale[i, l]
            close[l] &= gap < tolerance


@inlined
def _returned_before(sections, first, l, n, previous_tolerance, scale):
    """Whether the sections n and 2 n periods before the last one, of lane l of the block, are within
    ``previous_tolerance``."""
    end, close = sections.shape[0] - 1, True
    for i in range(sections.shape[1]):
        gap = abs(sections[end - n, i, first + l] - sections[end - 2 * n, i, first + l]) / scale[i, l]
        close &= gap < previous_tolerance
    return close


@inlined
def _append(found, lane, n):
    """Write n to the first element of a lane's column that is still 0."""
    for i in range(len(found)):
        if found[i, lane] == 0:
            found[i, lane] = n
            return
