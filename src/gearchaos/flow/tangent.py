"""Tangent vectors kept apart from each other, so that their growth tells the Lyapunov exponents."""

from __future__ import annotations

from math import log

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.simd import load, select, splat, store, vfma, vsqrt


@inlined
def _normalise(dims, tangents, own, lengths):
    """Shorten one tangent vector of each lane to length 1, unless it vanishes, and note how long it was."""
    square, zero = splat(0.0), splat(0.0)
    for i in range(len(dims)):
        square = vfma(load(tangents, own + i), load(tangents, own + i), square)
    length = vsqrt(square)
    store(lengths, 0, length)
    for i in range(len(dims)):
        vector = load(tangents, own + i)
        store(tangents, own + i, select(zero < length, vector / length, vector))


@kernel
def orthonormalise(dims, tangents, first, lengths, growth, number):
    """Gram-Schmidt on the K tangent vectors of a seat, which begin at ``first``, WIDTH lanes side by side.

    The logarithms of their lengths are added to growth (K, L), in the column that ``number`` says for each lane.
    ``lengths`` (WIDTH,) is room to work.
    """
    d = len(dims)
    for c in range(len(growth)):
        own = first + c * d
        for e in range(c):
            other, dot = first + e * d, splat(0.0)
            for i in range(d):
                dot = vfma(load(tangents, own + i), load(tangents, other + i), dot)
            for i in range(d):
                store(tangents, own + i, vfma(splat(-1.0) * dot, load(tangents, other + i), load(tangents, own + i)))
        _normalise(dims, tangents, own, lengths)
        for l in range(len(number)):
            if lengths[l] > 0.0:
                growth[c, number[l]] += log(lengths[l])
