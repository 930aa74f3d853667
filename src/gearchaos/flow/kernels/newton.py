"""One round of Newton's method for the periodic orbits of many trajectories."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, kernel, subroutine
from gearchaos.flow.kernels.constants import OK

RESIDUAL = 1e-10
"""An orbit counts as converged when one round changes no coordinate by more than this."""

_EXACT = 1e-13
"""Residual below which no further round is made."""

_PATIENCE = 2
"""So many rounds may fail to halve the residual."""

_SQUARINGS = 16


class NewtonSearch(NamedTuple):
    """The progress of L trajectories towards their periodic orbits. One *round* is one period of the orbit."""

    guess: np.ndarray  # (d, L) where the search began
    at: np.ndarray  # (d, L) where the next round begins
    w: np.ndarray  # (d, L) the best point so far
    residual: np.ndarray  # (L,) largest change of a coordinate in the round from w; infinite if there was none
    monodromy: np.ndarray  # (L, d, d) derivative of that round, once it has converged
    stalls: np.ndarray  # (L,) rounds that did not halve the residual
    scratch: np.ndarray  # (2, d, d + 1)


@kernel
def next_round(search, busy, end, tangent, status, reach, expansion):
    """Evaluate one round of some trajectories, and set the start of their next one.

    Parameters
    ----------
    search : NewtonSearch
        Is updated.
    busy : (B,)
        Numbers of the trajectories. Those that need another round are moved to the front.
    end : (d, B)
        Where the round that began at ``search.at[:, busy]`` ended.
    tangent : (d, d, B)
        Its monodromy matrices, column c in ``tangent[c]``.
    status : (B,)
        Status of the round.
    reach : float
        Give up a trajectory that is farther than this from its guess in some coordinate.
    expansion : float
        Give up one with a multiplier of this modulus or more.

    Returns
    -------
    int
        How many trajectories need another round. The others have converged, have failed twice to halve the residual,
        or were given up.
    """
    count = 0
    for i in range(len(busy)):
        lane = busy[i]
        if _record(search, lane, end, tangent, status, i) and _step(search, lane, tangent, i, reach, expansion):
            busy[count] = lane
            count += 1
    return count


@inlined
def _record(search, lane, end, tangent, status, i):
    """Record the round if it is the best so far; returns whether another one is worth trying."""
    residual, d = 0.0, len(end)
    for j in range(d):
        change = end[j, i] - search.at[j, lane]
        search.scratch[0, j, d] = change
        residual = max(residual, abs(change)) if np.isfinite(change) else np.inf
    if status[i] != OK or residual == np.inf:
        return False
    best = search.residual[lane]
    if residual > 0.5 * best:
        search.stalls[lane] += 1
    if residual < best:
        search.residual[lane] = residual
        for j in range(d):
            search.w[j, lane] = search.at[j, lane]
            if residual <= RESIDUAL:
                for c in range(d):
                    search.monodromy[lane, j, c] = tangent[c, j, i]
    over = residual <= _EXACT or (residual >= best and best <= RESIDUAL)
    return not over and search.stalls[lane] < _PATIENCE


@inlined
def _step(search, lane, tangent, i, reach, expansion):
    """Newton's step δ from (I − M) δ = P(w) − w; returns whether its end is worth another round."""
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


@subroutine
def _solve(system):
    """Solve A x = b, ``system`` (d, d + 1) being [A, b]; x replaces b. Returns False if A is singular."""
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


@subroutine
def _norm(matrix, d):
    """The largest sum of moduli in a row of the first d rows and columns of a matrix."""
    largest = 0.0
    for j in range(d):
        total = 0.0
        for c in range(d):
            total += abs(matrix[j, c])
        largest = max(largest, total)
    return largest


@subroutine
def _expands(matrix, room, expansion):
    """Whether a matrix has an eigenvalue of modulus ``expansion`` or more, to a tenth of a per cent.

    By Gelfand's formula, from the norm of a high power. Both arrays (d, d + 1) are overwritten, except for the last
    column, which is not part of the matrix.
    """
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
