"""Arrays aligned to cache lines or to pages of memory."""

from __future__ import annotations

from math import prod

import numpy as np

CACHE_LINE, PAGE = 64, 4096
"""Bytes in a line of the cache, which is also the size of a vector; bytes in a page of memory."""


def aligned(*shape: int, to: int = CACHE_LINE) -> np.ndarray:
    """An array of zeros (float64) of this shape, whose address is a multiple of ``to`` bytes.

    With a multiple of `CACHE_LINE` no vector lies in two lines of the cache.
    """
    size, step = prod(shape), to // 8
    padded = np.zeros(size + step)
    skip = -(padded.ctypes.data // 8) % step
    return padded[skip : skip + size].reshape(shape)
