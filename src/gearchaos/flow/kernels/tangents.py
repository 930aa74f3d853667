"""Orthonormalisation of tangent vectors, whose growth gives the Lyapunov exponents (Benettin et al. 1980)."""

from __future__ import annotations

from math import log

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.simd import broadcast, load, select, store, vfma, vsqrt


@inlined
def _normalise(dims, tangents, row, lengths):
    """Divide the tangent vector in rows ``row`` to ``row + d - 1`` by its length, unless that is 0; the length of each
    lane is written to ``lengths`` (WIDTH,)."""
    square, zero = broadcast(0.0), broadcast(0.0)
    for i in range(len(dims)):
        square = vfma(load(tangents, row + i), load(tangents, row + i), square)
    length = vsqrt(square)
    store(lengths, 0, length)
    for i in range(len(dims)):
        vector = load(tangents, row + i)
        store(tangents, row + i, select(zero < length, vector / length, vector))


@subroutine
def orthonormalise(dims, tangents, first, lengths, growth, trajectories):
    """Gram–Schmidt on the K tangent vectors of a slot, coordinate i of vector c in row ``first + c * d + i``.

    The logarithms of their lengths are added to ``growth`` (K, L), in the columns of the pack's ``trajectories``
    (active,). ``lengths`` (at least WIDTH,) is overwritten.
    """
    d = len(dims)
    for c in range(len(growth)):
        row = first + c * d
        for e in range(c):
            other, dot = first + e * d, broadcast(0.0)
            for i in range(d):
                dot = vfma(load(tangents, row + i), load(tangents, other + i), dot)
            dot = broadcast(-1.0) * dot
            for i in range(d):
                store(tangents, row + i, vfma(dot, load(tangents, other + i), load(tangents, row + i)))
        _normalise(dims, tangents, row, lengths)
        for l in range(len(trajectories)):
            if lengths[l] > 0.0:
                growth[c, trajectories[l]] += log(lengths[l])
