"""Orbits that meet another orbit at a fold or a flip, found by Newton's method in balls along the critical direction.

Near such an event the equations of the orbit are nearly singular: in floats Newton's method ends far from the orbit.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from flint import arb_mat

from gearchaos.proof.candidate import Candidate, cyclic_jacobian, float_midpoint, moved
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations

_AMPLITUDES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
"""Distances along the critical direction from which orbits are sought."""

_MOST_STEPS = 60
_CONVERGED = 1e-20
_FAR = 0.3
"""A correction above this means that no orbit is near."""

GUARD_BITS = 32
"""Points are rounded to multiples of 2^(GUARD_BITS - bits)."""

_DISTINCT = 1e-13
"""Orbits count as different if their points differ by more than this."""


def converged(equations: MeshEquations, points: list[list[Fraction]]) -> Candidate | None:
    """The orbit to which Newton's method leads from points, if it converges to rounding errors; else None."""
    try:
        candidate = Candidate.at(equations, points)
        for _ in range(_MOST_STEPS):
            if candidate.error <= _CONVERGED:
                return candidate
            if not candidate.error < _FAR:
                return None
            candidate = Candidate.at(equations, moved(equations, candidate.points, candidate.correction, GUARD_BITS))
    except UndecidedError:
        pass
    return None


def critical_directions(derivatives: list[arb_mat]) -> tuple[np.ndarray, np.ndarray]:
    """The right and left singular vectors (n, d) of the least singular value of the cyclic system."""
    left, _, right = np.linalg.svd(cyclic_jacobian(list(map(float_midpoint, derivatives))))
    shape = len(derivatives), derivatives[0].nrows()
    return right[-1].reshape(shape), left[:, -1].reshape(shape)


def neighbours(equations: MeshEquations, points: list[list[Fraction]]) -> Iterator[Candidate]:
    """Different orbits near points next to which the cyclic system is nearly singular, each once."""
    try:
        direction, _ = critical_directions([t.derivative for t in Candidate.at(equations, points).trajectories])
    except UndecidedError:
        return
    found: list[Candidate] = []
    for amplitude in _AMPLITUDES:
        for side in (1, -1):
            start = moved(equations, points, side * amplitude / np.abs(direction).max() * direction, GUARD_BITS)
            candidate = converged(equations, start)
            if candidate is not None and all(distance(candidate.points, f.points) > _DISTINCT for f in found):
                found.append(candidate)
                yield candidate


def distance(first: list[list[Fraction]], second: list[list[Fraction]]) -> float:
    """The largest difference of a coordinate of two lists of points."""
    return float(max(abs(a - b) for p, q in zip(first, second, strict=True) for a, b in zip(p, q, strict=True)))


def as_floats(points: list[list[Fraction]]) -> np.ndarray:
    """Points (n, d) rounded to floats."""
    return np.array([[float(value) for value in point] for point in points])
