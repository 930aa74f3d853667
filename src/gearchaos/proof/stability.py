"""The number of multipliers inside and outside the unit circle, by Stein inequalities around the cycle.

If symmetric matrices Q_k satisfy Q_k - S_kᵀ Q_(k+1) S_k > 0 for the derivatives S_k of P at the n points, Q_n = Q_0,
then Q_0 - Mᵀ Q_0 M > 0 for their product M. So no multiplier lies on the unit circle, and Q_0 has as many positive
eigenvalues as there are multipliers inside, as many negative ones as there are outside (Ostrowski and Schneider).

The Q_k are sought in floats. What is found is proved in balls: positive pivots, and the signs of a congruent matrix.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import least, magnitude, texts
from gearchaos.proof.candidate import float_midpoint
from gearchaos.proof.certificate import UndecidedError

_ROUNDS = 240  # most rounds of the cycle in which the invariant subspaces are sought
_SAME_SUBSPACE = 1e-14  # change of a projector in a round at which an invariant subspace counts as found
_LARGE = 1e10  # largest entry of a product of derivatives whose eigenvalues near 1 are still accurate


@dataclass(frozen=True)
class Stability:
    """A proof of the numbers of multipliers inside and outside the unit circle."""

    inside: int
    outside: int
    matrices: np.ndarray  # Q_k, (n, d, d), exactly these floats
    margin: float  # a lower bound of the least pivot of Q_k - S_kᵀ Q_(k+1) S_k over the largest entry of all Q_k

    def document(self) -> dict[str, Any]:
        """Of a certificate."""
        matrices = [texts([[Fraction(v) for v in row] for row in q]) for q in self.matrices.tolist()]
        return {"inside": self.inside, "outside": self.outside, "Q": matrices}


def stability(slopes: list[arb_mat], midpoints: list[arb_mat]) -> Stability:
    """The multipliers of an orbit from n slopes (d, d) of P that contain its derivatives.

    The matrices Q_k are computed from ``midpoints``, approximate derivatives (d, d). Raises `UndecidedError` with the
    reason "neutral" if the inequalities are not proved.
    """
    matrices = _stein_matrices(list(map(float_midpoint, midpoints)))
    if matrices is None or not np.isfinite(matrices).all() or not (largest := float(np.abs(matrices).max())) > 0:
        raise UndecidedError("neutral", 0.0)
    balls = [arb_mat(len(q), len(q), q.ravel().tolist()) for q in matrices]
    margin = math.inf
    for k, slope in enumerate(slopes):
        difference = balls[k] - slope.transpose() * balls[(k + 1) % len(balls)] * slope
        margin = min(margin, _least_pivot(difference) / largest * (1 - 1e-15))
    if not margin > 0:
        raise UndecidedError("neutral", margin)
    inside = _positive_eigenvalues(balls[0], matrices[0])
    return Stability(inside, len(matrices[0]) - inside, matrices, margin)


def _least_pivot(matrix: arb_mat) -> float:
    """A lower bound of the least pivot of L D Lᵀ; at the first that is not positive, a bound of that one."""
    rows, size, smallest = matrix.tolist(), matrix.nrows(), math.inf
    for k in range(size):
        smallest = min(smallest, least(rows[k][k]))
        if not rows[k][k] > 0:
            return min(smallest, 0.0)
        for i in range(k + 1, size):
            factor = rows[i][k] / rows[k][k]
            for j in range(k + 1, i + 1):
                rows[i][j] = rows[i][j] - factor * rows[j][k]
    return smallest


def _positive_eigenvalues(matrix: arb_mat, values: np.ndarray) -> int:
    """The number of positive eigenvalues of a regular symmetric matrix.

    It is that of the congruent matrix Vᵀ Q V, V being the eigenvectors in floats, whose diagonal is proved to dominate.
    Then V is regular too. Raises `UndecidedError` if the diagonal does not dominate.
    """
    v, positive = arb_mat(np.linalg.eigh(values)[1].tolist()), 0
    for i, row in enumerate((v.transpose() * matrix * v).tolist()):
        gap = abs(row[i]) - sum((abs(x) for j, x in enumerate(row) if j != i), arb(0))
        if not gap > 0:
            raise UndecidedError("neutral", -magnitude(gap))
        positive += bool(row[i] > 0)
    return positive


def _stein_matrices(derivatives: list[np.ndarray]) -> np.ndarray | None:
    """Matrices Q_k (n, d, d) that should satisfy the inequalities, None where there is no splitting.

    In bases of the unstable and stable subspaces at the n points the derivatives are block diagonal, and each block has
    an equation of its own, with 1 on the right side: forwards for the unstable block, backwards for the stable one.
    """
    bases, outside = _splitting(derivatives)
    n, d = len(derivatives), len(derivatives[0])
    try:
        inverses = [np.linalg.inv(basis) for basis in bases]
        local = [inverses[(k + 1) % n] @ a @ bases[k] for k, a in enumerate(derivatives)]
        stable = _sums([a[outside:, outside:] for a in reversed(local)], d - outside)
        unstable = _sums([np.linalg.inv(a[:outside, :outside]) for a in local], outside, before=True)
    except np.linalg.LinAlgError:
        return None
    stable = [stable[-k % n] for k in range(n)]
    out = np.zeros((n, d, d))
    for k in range(n):
        out[k, :outside, :outside], out[k, outside:, outside:] = -unstable[k], stable[k]
        out[k] = inverses[k].T @ out[k] @ inverses[k]
    return (out + out.transpose(0, 2, 1)) / 2


def _sums(factors: list[np.ndarray], size: int, *, before: bool = False) -> list[np.ndarray]:
    """Periodic solutions of q_(k+1) = b_kᵀ q_k b_k + 1, or of b_kᵀ (q_k + 1) b_k with ``before``.

    Raises `LinAlgError` if there is none.
    """
    if size == 0:
        return [np.zeros((0, 0))] * len(factors)
    one = np.eye(size)

    def step(q: np.ndarray, b: np.ndarray, add: np.ndarray) -> np.ndarray:
        return b.T @ (q + add) @ b if before else b.T @ q @ b + add

    particular, power = np.zeros((size, size)), one
    for b in factors:
        particular, power = step(particular, b, one), power @ b
    system, out = np.eye(size * size) - np.kron(power.T, power.T), []
    q = np.linalg.solve(system, particular.ravel()).reshape(size, size)
    for b in factors:
        out.append(q)
        q = step(q, b, one)
    return out


def _splitting(derivatives: list[np.ndarray]) -> tuple[list[np.ndarray], int]:
    """Bases (d, d) at the n points, columns of the unstable subspace first, and the dimension of the unstable subspace.

    Both subspaces are found by orthogonal iteration around the cycle: forwards for the unstable one, and backwards with
    the transposed derivatives for the complement of the stable one.
    """
    n, d = len(derivatives), len(derivatives[0])
    product = np.eye(d)
    for derivative in derivatives:
        product = derivative @ product
    if np.abs(product).max() < _LARGE:
        outside = int((np.abs(np.linalg.eigvals(product)) > 1).sum())
    else:  # the product has lost multipliers near 1 to rounding
        outside = int((_orthogonal_iteration(derivatives)[1] > 0).sum())
    if outside in (0, d):  # so far about: the inequalities prove it, or fail
        return [np.eye(d)] * n, outside
    forward, _ = _orthogonal_iteration(derivatives, outside)
    complement, _ = _orthogonal_iteration([a.T for a in reversed(derivatives)], outside)
    return [np.hstack([forward[k][:, :outside], complement[-k % n][:, outside:]]) for k in range(n)], outside


def _orthogonal_iteration(factors: list[np.ndarray], size: int | None = None) -> tuple[list[np.ndarray], np.ndarray]:
    """Orthogonal matrices (d, d) before each factor, with nested dominant subspaces, and their logarithms of growth.

    It ends when the subspace of the first ``size`` columns has converged, and without ``size`` when the growth has.
    """
    d = len(factors[0])
    q = np.linalg.qr(np.random.default_rng(0).normal(size=(d, d)))[0]
    total, growth, projector = np.zeros(d), np.zeros(d), np.zeros((d, d))
    for _ in range(_ROUNDS):
        previous, frames, growth = growth, [], np.zeros(d)
        for a in factors:
            frames.append(q)
            q, r = np.linalg.qr(a @ q)
            growth += np.log(np.maximum(np.abs(np.diag(r)), 1e-300))
        total += growth
        before, projector = projector, q[:, :size] @ q[:, :size].T
        change = growth - previous if size is None else projector - before
        if np.abs(change).max() < (1e-12 * len(factors) if size is None else _SAME_SUBSPACE):
            return frames, growth
    return frames, total / _ROUNDS
