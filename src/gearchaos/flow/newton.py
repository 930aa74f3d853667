"""Newton for periodic orbits of many trajectories: what a round of each tells, and where it is to be tried next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.jit import inlined, kernel
from gearchaos.flow.layout import OK

RESIDUAL = 1e-10
"""An orbit counts as converged when one round changes no coordinate by more than this."""

_EXACT = 1e-13
_PATIENCE = 2
_SQUARINGS = 16


class Search(NamedTuple):
    """How far L trajectories have come to their orbits."""

    guess: np.ndarray  # (d, L) where they began
    at: np.ndarray  # (d, L) where the next round begins
    w: np.ndarray  # (d, L) the best so far
    residual: np.ndarray  # (L,) its largest change of a coordinate over a round; infinite where there is none
    monodromy: np.ndarray  # (L, d, d) its derivative of the round, once it has converged
    halts: np.ndarray  # (L,) how often the residual has not been halved
    scratch: np.ndarray  # (2, d, d + 1)


def begin(w: np.ndarray) -> Search:
    """A search from guesses (d, L)."""
    d, lanes = w.shape
    return Search(w.copy(), w.copy(), w.copy(), np.full(lanes, np.inf), np.zeros((lanes, d, d)),
                  np.zeros(lanes, np.int64), np.zeros((2, d, d + 1)))


@kernel
def next_round(search, busy, end, tangent, status, reach, expansion):
    """Learn from a round of the ``busy`` (B,): its ends (d, B), monodromy matrices by their columns (d, d, B), status.

    Who goes on moves to the front of ``busy``; returns how many do. One goes on until it converges, halts twice, is
    farther than ``reach`` from its guess in some coordinate, or has a multiplier of ``expansion`` or more.
    """
    count = 0
    for i in range(len(busy)):
        lane = busy[i]
        if _learn(search, lane, end, tangent, status, i) and _improve(search, lane, tangent, i, reach, expansion):
            busy[count] = lane
            count += 1
    return count


@inlined
def _learn(search, lane, end, tangent, status, i):
    """Keep the round if it is the best so far; whether another is worth trying."""
    residual, d = 0.0, len(end)
    for j in range(d):
        change = end[j, i] - search.at[j, lane]
        search.scratch[0, j, d] = change
        residual = max(residual, abs(change)) if np.isfinite(change) else np.inf
    if status[i] != OK or residual == np.inf:
        return False
    best = search.residual[lane]
    if residual > 0.5 * best:
        search.halts[lane] += 1
    if residual < best:
        search.residual[lane] = residual
        for j in range(d):
            search.w[j, lane] = search.at[j, lane]
            if residual <= RESIDUAL:
                for c in range(d):
                    search.monodromy[lane, j, c] = tangent[c, j, i]
    over = residual <= _EXACT or (residual >= best and best <= RESIDUAL)
    return not over and search.halts[lane] < _PATIENCE


@inlined
def _improve(search, lane, tangent, i, reach, expansion):
    """Newton's step: (I - M) δ = P(w) - w; whether it leads to where another round is to be tried."""
    d = len(search.at)
    system, powers = search.scratch
    for j in range(d):
        for c in range(d):
            powers[j, c] = tangent[c, j, i]
            system[j, c] = (1.0 if c == j else 0.0) - tangent[c, j, i]
    if not _solve(system):
        return False
    for j in range(d):
        if not abs(search.at[j, lane] + system[j, d] - search.guess[j, lane]) < reach:
            return False
    if _expands(powers, system, expansion):
        return False
    for j in range(d):
        search.at[j, lane] += system[j, d]
    return True


@kernel
def _solve(system):
    """Solve A x = b, (A, b) being ``system`` (d, d + 1), into its last column; False if A is singular."""
    d = len(system)
    for k in range(d):
        pivot = k
        for j in range(k + 1, d):
            if abs(system[j, k]) > abs(system[pivot, k]):
                pivot = j
        if not abs(system[pivot, k]) > 0.0:
            return False
        for c in range(k, d + 1):
            system[k, c], system[pivot, c] = system[pivot, c], system[k, c]
        for j in range(k + 1, d):
            factor = system[j, k] / system[k, k]
            for c in range(k + 1, d + 1):
                system[j, c] -= factor * system[k, c]
    for k in range(d - 1, -1, -1):
        for c in range(k + 1, d):
            system[k, d] -= system[k, c] * system[c, d]
        system[k, d] /= system[k, k]
    return True


@kernel
def _norm(matrix, d):
    """The largest sum of moduli in a row of a matrix (d, d), if it stands in a wider one."""
    most = 0.0
    for j in range(d):
        total = 0.0
        for c in range(d):
            total += abs(matrix[j, c])
        most = max(most, total)
    return most


@kernel
def _expands(matrix, room, expansion):
    """Whether a matrix has an eigenvalue of that modulus or more, to a tenth of a per cent: Gelfand's formula, the norm
    of a high power. Both arrays (d, d + 1) are overwritten, but for the last column."""
    d, logarithm = len(matrix), 0.0
    if _norm(matrix, d) < expansion:
        return False
    for _ in range(_SQUARINGS):
        size = _norm(matrix, d)
        if not size > 0.0:
            return False
        logarithm = 2 * (logarithm + np.log(size))
        for j in range(d):
            for c in range(d):
                room[j, c] = matrix[j, c] / size
        for j in range(d):
            for c in range(d):
                matrix[j, c] = 0.0
                for m in range(d):
                    matrix[j, c] += room[j, m] * room[m, c]
    size = _norm(matrix, d)
    return size > 0.0 and (logarithm + np.log(size)) / 2**_SQUARINGS >= np.log(expansion)
