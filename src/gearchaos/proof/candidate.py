"""An approximate periodic orbit with exact points: its refinement by Newton's method, and Krawczyk's proof near it.

The unknowns are the n states x_k at the sections, the equations F_k = P(x_k) - x_(k+1) = 0 with x_n = x_0. On the
cubes X_k of radius r about the points c_k the slopes S_k of P give F(x) - F(y) = J (x - y) with J in a set of matrices:
S_k in place (k, k), -1 in place (k, k + 1). With any matrix Y let

    K = c - Y F(c) + (1 - Y J)(X - c).

If K lies in the interior of X, x → x - Y F(x) maps X into K, so by Brouwer it has a fixed point; as |1 - Y J| < 1 in
the maximum norm, Y and J are regular, so the fixed point is a zero of F, and the only one.

Y is a matrix of floats, near the inverse of the midpoint of J. With γ = N u/(1 - N u), u = 2^-53, the rounding errors
of a product of matrices of floats with inner dimension N are at most γ times the product of their absolute values
(Higham, Accuracy and Stability of Numerical Algorithms, section 3.5).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import ball, magnitude, rounded
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.motion import Trajectory, trajectory

UNIT = 2.0**-53  # u, the largest relative rounding error of a float
_LEAST_CONTRACTION = 0.1  # least margin of Krawczyk's operator
_MOST_STEPS = 12  # most steps of Newton's method
_GUARD_BITS = 16  # refined points are multiples of 2^(_GUARD_BITS - bits)
_ROUNDING_BITS = 40  # corrections below 2^(_ROUNDING_BITS - bits) may be rounding errors
_NEAR = 1e-3  # a first correction by Newton's method above this means that the points are not near an orbit
_MOST_STEPS_FAR = 60
_CONVERGED = 1e-20
_FAR = 0.3  # a first correction by `converged` above this means that no orbit is near
COARSE_GUARD_BITS = 32  # as `_GUARD_BITS`, where the equations may be nearly singular

Points = list[list[Fraction]]


@dataclass(frozen=True, eq=False)
class Candidate:
    """Points near an orbit of period n, with the motions from them over one mesh period."""

    equations: MeshEquations
    points: Points  # n points c_k of d coordinates
    trajectories: list[Trajectory]  # the motion from each point

    @classmethod
    def at(cls, equations: MeshEquations, points: Points) -> Candidate:
        """The candidate with these points; raises `UndecidedError` where a motion cannot be followed."""
        return cls(equations, points, [trajectory(equations, column(point)) for point in points])

    @property
    def period(self) -> int:
        return len(self.points)

    @cached_property
    def defects(self) -> list[arb_mat]:
        """P(c_k) - c_(k+1), each (d, 1)."""
        following = [*self.points[1:], self.points[0]]
        return [t.image - column(point) for t, point in zip(self.trajectories, following, strict=True)]

    @cached_property
    def system(self) -> CyclicSystem:
        """The linearised cyclic system; raises `UndecidedError` if it is singular."""
        system = CyclicSystem.at([t.derivative for t in self.trajectories])
        if system is None:
            raise UndecidedError("Krawczyk not contracting", 0.0)
        return system

    @cached_property
    def correction(self) -> np.ndarray:
        """The correction (n, d) of the points by Newton's method."""
        return self.system.newton_step(self.defects)

    @cached_property
    def error(self) -> float:
        """The largest entry of the correction, about the distance from the orbit."""
        return float(np.abs(self.correction).max())

    def separation(self, radius: Any, reach: np.ndarray | None = None) -> float | None:
        """The least distance of the first cube and that of a proper divisor of the period, over the radius.

        With ``reach`` (n, d), of boxes with these half edges. It is None for period 1. Raises `UndecidedError` if two
        may overlap.
        """
        gaps = []
        for k in (k for k in range(1, self.period) if self.period % k == 0):
            apart = [abs(a - b) for a, b in zip(self.points[0], self.points[k], strict=True)]
            gaps.append(max(apart) - 2 * radius if reach is None else max(
                float(v) * (1 - 1e-12) - a - b for v, a, b in zip(apart, reach[0], reach[k], strict=True)))
        if gaps and min(gaps) <= 0:
            raise UndecidedError("period not minimal", float(min(gaps)))
        return float(min(gaps) / radius) if gaps else None

    def box(self, k: int, radius: Fraction) -> arb_mat:
        """The cube about point k, (d, 1)."""
        half = ball(radius)
        return arb_mat(len(self.points[k]), 1, [arb(ball(c), half) for c in self.points[k]])

    def refined(self, tolerance: float) -> Candidate:
        """A candidate with an error of at most ``tolerance``: this one, or one found by Newton's method.

        Raises `UndecidedError` with the reason that Newton's method does not get nearer, and a negative margin.
        """
        candidate, steps = self, 0
        while not candidate.error <= tolerance:
            following = candidate.corrected() if candidate.error < _NEAR and steps < _MOST_STEPS else candidate
            if not following.error < 0.5 * candidate.error:
                at_rounding = candidate.error < 2.0 ** (_ROUNDING_BITS - self.equations.bits)
                near = "bits exhausted" if at_rounding else "Krawczyk not contracting"
                raise UndecidedError(near if candidate.error < _NEAR else "Newton diverged",
                                     1 - candidate.error / tolerance)
            candidate, steps = following, steps + 1
        return candidate

    def corrected(self, guard_bits: int = _GUARD_BITS) -> Candidate:
        """The candidate after one step of Newton's method."""
        return Candidate.at(self.equations, moved(self.equations, self.points, self.correction, guard_bits))


def converged(equations: MeshEquations, points: Points) -> Candidate | None:
    """The orbit to which Newton's method leads from points, if it converges to rounding errors; else None."""
    with suppress(UndecidedError):
        candidate = Candidate.at(equations, points)
        for _ in range(_MOST_STEPS_FAR):
            if candidate.error <= _CONVERGED:
                return candidate
            if not candidate.error < _FAR:
                break
            candidate = candidate.corrected(COARSE_GUARD_BITS)
    return None


def moved(equations: MeshEquations, points: Points, changes: np.ndarray, guard_bits: int) -> Points:
    """Points plus changes (n, d), rounded to multiples of 2^(``guard_bits`` - bits)."""
    return [[rounded(ball(c) + change, equations.bits - guard_bits) for c, change in zip(point, row, strict=True)]
            for point, row in zip(points, changes.tolist(), strict=True)]


def column(point: list[Fraction]) -> arb_mat:
    """A point as a matrix (d, 1)."""
    return arb_mat(len(point), 1, [ball(value) for value in point])


def float_midpoint(matrix: arb_mat) -> np.ndarray:
    """The midpoints of the entries of a matrix, rounded to floats."""
    return np.array([[float(value) for value in row] for row in matrix.mid().tolist()])


def midpoints_and_spread(slopes: list[arb_mat]) -> tuple[list[np.ndarray], np.ndarray]:
    """Midpoints (d, d) of n matrices in floats, and upper bounds (n d,) of the row sums of the distances from them."""
    middle = list(map(float_midpoint, slopes))
    spread = [sum(magnitude(v - m) for v, m in zip(row, near, strict=True)) for matrix, at in zip(
        slopes, middle, strict=True) for row, near in zip(matrix.tolist(), at.tolist(), strict=True)]
    return middle, np.array(spread) * (1 + 1e-14)


def distance_from_unit(inverse: np.ndarray, matrix: np.ndarray) -> tuple[np.ndarray, float]:
    """Upper bounds of the row sums of |1 - Y M| with floats Y and M, once multiplied by the factor.

    The factor is above the rounding errors of what else is added, if that is a product with |Y| too.
    """
    count = len(matrix)
    gamma = (count + 2) * UNIT / (1 - (count + 2) * UNIT)
    rest = np.abs(np.eye(count) - inverse @ matrix).sum(axis=1)
    rounding = gamma * (np.abs(inverse) @ np.abs(matrix).sum(axis=1) + 1)
    return rest + rounding, 1 + 8 * gamma


@dataclass(frozen=True)
class CyclicSystem:
    """The cyclic system at given points, by an approximate inverse of its derivative."""

    inverse: np.ndarray  # Y, (N, N) with N = n d

    @classmethod
    def at(cls, derivatives: list[arb_mat]) -> CyclicSystem | None:
        """The system of the points with derivatives (d, d); None if it is singular to rounding."""
        try:
            inverse = np.linalg.inv(cyclic_jacobian(list(map(float_midpoint, derivatives))))
        except np.linalg.LinAlgError:
            return None
        return cls(inverse) if np.isfinite(inverse).all() else None

    def newton_step(self, defects: list[arb_mat]) -> np.ndarray:
        """The correction (n, d) of the points by Newton's method, from P(c_k) - c_(k+1), each (d, 1)."""
        values = np.array([float(v) for defect in defects for v in defect.mid().entries()])
        return -(self.inverse @ values).reshape(len(defects), -1)

    def contraction(self, slopes: list[arb_mat], defects: list[arb_mat], radius: float) -> float:
        """As `margin`; raises `UndecidedError` if it is not large enough."""
        existence = self.margin(slopes, defects, radius * (1 - 1e-15))
        if not existence > _LEAST_CONTRACTION:
            raise UndecidedError("Krawczyk not contracting", existence)
        return existence

    def margin(self, slopes: list[arb_mat], defects: list[arb_mat], radius: float) -> float:
        """A lower bound of the least 1 - |K - c|/r over all rows; the orbit is proved if it is positive.

        ``slopes`` are those of the cubes, (d, d), ``defects`` P(c_k) - c_(k+1), each (d, 1), and ``radius`` is r.
        """
        middle, spread = midpoints_and_spread(slopes)
        rest, factor = distance_from_unit(self.inverse, cyclic_jacobian(middle))
        defect = np.array([magnitude(v) for d in defects for v in d.entries()])
        largest = float((rest + np.abs(self.inverse) @ (spread + defect / radius)).max()) * factor
        return (1 - largest) * (1 - 2**-50) if largest < 1 else 1 - largest


def cyclic_jacobian(derivatives: list[np.ndarray]) -> np.ndarray:
    """The derivative (n d, n d) of the cyclic system from the derivatives (d, d) of P."""
    n, d = len(derivatives), len(derivatives[0])
    out = np.zeros((n, d, n, d))
    for k, derivative in enumerate(derivatives):
        out[k, :, k] += derivative
        out[k, :, (k + 1) % n] -= np.eye(d)
    return out.reshape(n * d, n * d)
