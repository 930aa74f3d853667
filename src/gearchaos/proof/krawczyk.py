"""Existence and uniqueness of a periodic orbit near given points, by Krawczyk's operator on the cyclic system.

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

from dataclasses import dataclass

import numpy as np
from flint import arb_mat

from gearchaos.proof.balls import magnitude

_UNIT = 2.0**-53


def float_midpoint(matrix: arb_mat) -> np.ndarray:
    """The midpoints of the entries of a matrix, rounded to floats."""
    return np.array([[float(value) for value in row] for row in matrix.mid().tolist()])


def row_spread(matrix: arb_mat, midpoint: np.ndarray) -> np.ndarray:
    """Upper bounds of the sums over each row of the distances of the entries of a matrix from floats."""
    rows = zip(matrix.tolist(), midpoint.tolist(), strict=True)
    return np.array([sum(magnitude(v - m) for v, m in zip(row, near, strict=True)) for row, near in rows]) * (1 + 1e-14)


@dataclass(frozen=True)
class CyclicSystem:
    """The derivative of the cyclic system at given points, and an approximate inverse.

    Attributes
    ----------
    inverse : (N, N)
        Y; N = n d.
    """

    inverse: np.ndarray

    @classmethod
    def at(cls, derivatives: list[arb_mat]) -> CyclicSystem | None:
        """The system of the points with derivatives (d, d); None if it is singular to rounding."""
        try:
            inverse = np.linalg.inv(cyclic_jacobian(list(map(float_midpoint, derivatives))))
        except np.linalg.LinAlgError:
            return None
        return cls(inverse) if np.isfinite(inverse).all() else None

    @property
    def norm(self) -> float:
        """The norm of the inverse: how many times larger than the defects the corrections of the points are."""
        return float(np.abs(self.inverse).sum(axis=1).max())

    def newton_step(self, defects: list[arb_mat]) -> np.ndarray:
        """The correction (n, d) of the points by Newton's method, from P(c_k) - c_(k+1), each (d, 1)."""
        values = np.array([float(v) for defect in defects for v in defect.mid().entries()])
        return -(self.inverse @ values).reshape(len(defects), -1)

    def margin(self, slopes: list[arb_mat], defects: list[arb_mat], radius: float) -> float:
        """A lower bound of the least 1 - |K - c|/r over all rows; the orbit is proved if it is positive.

        Parameters
        ----------
        slopes : list of arb_mat
            Slopes (d, d) of the cubes.
        defects : list of arb_mat
            P(c_k) - c_(k+1), each (d, 1).
        radius : float
            r.
        """
        middle = list(map(float_midpoint, slopes))
        jacobian = cyclic_jacobian(middle)
        count = len(jacobian)
        weight = np.abs(self.inverse)
        rest = np.abs(np.eye(count) - self.inverse @ jacobian).sum(axis=1)
        gamma = (count + 2) * _UNIT / (1 - (count + 2) * _UNIT)
        rounding = gamma * (weight @ np.abs(jacobian).sum(axis=1) + 1)
        spread = np.concatenate([row_spread(s, m) for s, m in zip(slopes, middle, strict=True)])
        defect = np.array([magnitude(v) for d in defects for v in d.entries()])
        moved = weight @ (spread + defect / radius)
        largest = float((rest + rounding + moved).max()) * (1 + 8 * gamma)
        return (1 - largest) * (1 - 2**-50) if largest < 1 else 1 - largest


def cyclic_jacobian(derivatives: list[np.ndarray]) -> np.ndarray:
    """The derivative (n d, n d) of the cyclic system from the derivatives (d, d) of P."""
    n, d = len(derivatives), len(derivatives[0])
    out = np.zeros((n, d, n, d))
    for k, derivative in enumerate(derivatives):
        out[k, :, k] += derivative
        out[k, :, (k + 1) % n] -= np.eye(d)
    return out.reshape(n * d, n * d)
