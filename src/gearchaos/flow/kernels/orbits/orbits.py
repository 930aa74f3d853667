"""Periodic orbits of a batch of trajectories: candidates for the period from near returns, and Newton's method for
w = P(w) with P the map over one period.

Each Newton iteration needs one call of the flow: the caller advances states and unit tangent vectors by the period of
the orbit, and hands the result to `newton_iteration`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, kernel, subroutine
from gearchaos.flow.kernels.vector.constants import OK

BLOCK = 64  # lanes compared together, so that their scales stay in the first-level cache


@kernel
def search_returns(sections, longest, tolerance, previous_tolerance, scale, close, found):
    """Fill ``found`` (count, L), see `near_returns`.

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


RESIDUAL = 1e-10
"""An orbit has converged when P changes no coordinate by more than this."""

_EXACT = 1e-13  # residual below which no further iteration is made
_MAX_STALLS = 2  # number of iterations that do not halve the residual after which the search ends

_SQUARINGS = 16


class NewtonSearch(NamedTuple):
    """State of the search for the periodic orbits of L trajectories. An iteration evaluates P, the map over one period.

    Attributes
    ----------
    guess : (d, L)
        Initial guess.
    at : (d, L)
        Point at which P is evaluated next.
    w : (d, L)
        Point with the smallest residual so far.
    residual : (L,)
        Largest change of a coordinate, |P(w) − w|; infinite before the first iteration.
    monodromy : (L, d, d)
        Derivative of P at ``w``, set on convergence.
    stalls : (L,) of int
        Number of iterations that did not halve the residual.
    scratch : (2, d, d + 1)
        Working memory.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import start_newton_search
    >>> start_newton_search(np.zeros((2, 3))).residual
    array([inf, inf, inf])
    """

    guess: np.ndarray  # (d, L) initial guess
    at: np.ndarray  # (d, L) point at which P is evaluated next
    w: np.ndarray  # (d, L) point with the smallest residual so far
    residual: np.ndarray  # (L,) largest |P(w) - w| of a coordinate; infinite before the first iteration
    monodromy: np.ndarray  # (L, d, d) derivative of P at w, set on convergence
    stalls: np.ndarray  # (L,) number of iterations that did not halve the residual
    scratch: np.ndarray  # (2, d, d + 1)


@kernel
def newton_iteration(search, active, end, tangent, status, max_distance, max_multiplier):
    """Update the search of some trajectories after one evaluation of P, and set the point of the next one.

    Parameters
    ----------
    search : NewtonSearch
        Updated in place.
    active : (B,)
        Indices of the trajectories; on return those that need another iteration are at the front.
    end : (d, B)
        P at ``search.at[:, active]``.
    tangent : (d, d, B)
        Monodromy matrices there, column c in ``tangent[c]``.
    status : (B,)
        Status of the flow.
    max_distance : float
        End the search of a trajectory that differs from its guess by this or more in some coordinate.
    max_multiplier : float
        End the search of a trajectory with a multiplier of this modulus or more.

    Returns
    -------
    int
        Number of trajectories that need another iteration. The others have converged, have failed `_MAX_STALLS` times
        to halve the residual, or were ended by the two limits.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.flow import newton_iteration, start_newton_search
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> search, active = start_newton_search(problem.w), np.arange(1)
    >>> for _ in range(20):
    ...     run = problem.flow.advance(search.at, 1, tangent=np.eye(2)[:, :, None])
    ...     if newton_iteration(search, active, run.w, run.tangent, run.status, 10.0, 100.0) == 0:
    ...         break
    >>> bool(search.residual[0] < 1e-10)
    True
    """
    count = 0
    for i in range(len(active)):
        lane = active[i]
        if (_record(search, lane, end, tangent, status, i)
                and _step(search, lane, tangent, i, max_distance, max_multiplier)):
            active[count] = lane
            count += 1
    return count


@inlined
def _record(search, lane, end, tangent, status, i):
    """Record the point if its residual is the smallest so far; returns whether to go on."""
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
    return not over and search.stalls[lane] < _MAX_STALLS


@inlined
def _step(search, lane, tangent, i, max_distance, max_multiplier):
    """Newton's step δ from (I − M) δ = P(w) − w; returns whether P is to be evaluated at its end."""
    d = len(search.at)
    system, powers = search.scratch
    for j in range(d):
        for c in range(d):
            powers[j, c] = tangent[c, j, i]
            system[j, c] = (1.0 if c == j else 0.0) - tangent[c, j, i]
    if solve(system) == 0:
        return False
    for j in range(d):
        if not abs(search.at[j, lane] + system[j, d] - search.guess[j, lane]) < max_distance:
            return False
    if _expands(powers, system, max_multiplier):
        return False
    for j in range(d):
        search.at[j, lane] += system[j, d]
    return True


@subroutine
def solve(system):
    """Solve A x = b, ``system`` (d, d + 1) being [A, b]; x replaces b. Returns the sign of the determinant of A, 0 if
    it is singular."""
    d, sign = len(system), 1
    for k in range(d):
        pivot = k
        for j in range(k + 1, d):
            if abs(system[j, k]) > abs(system[pivot, k]):
                pivot = j
        if not abs(system[pivot, k]) > 0.0:
            return 0
        sign *= (1 if pivot == k else -1) * (1 if system[pivot, k] > 0.0 else -1)
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
    return sign


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
def _expands(matrix, scratch, max_multiplier):
    """Whether a matrix has an eigenvalue of modulus ``max_multiplier`` or more, to a tenth of a per cent.

    By Gelfand's formula, from the norm of a high power. The matrix is the first d columns of ``matrix`` (d, d + 1).
    These are overwritten, and those of ``scratch`` (d, d + 1).
    """
    d, logarithm = len(matrix), 0.0
    if _norm(matrix, d) < max_multiplier:
        return False
    for _ in range(_SQUARINGS):
        size = _norm(matrix, d)
        if not size > 0.0:
            return False
        logarithm = 2 * (logarithm + np.log(size))
        for j in range(d):
            for c in range(d):
                scratch[j, c] = matrix[j, c] / size
        for j in range(d):
            for c in range(d):
                matrix[j, c] = 0.0
                for m in range(d):
                    matrix[j, c] += scratch[j, m] * scratch[m, c]
    size = _norm(matrix, d)
    return size > 0.0 and (logarithm + np.log(size)) / 2**_SQUARINGS >= np.log(max_multiplier)


def near_returns(
    sections: np.ndarray, longest: int, tolerance: float, previous_tolerance: float, count: int
) -> np.ndarray:
    """The smallest numbers of periods n after which each motion returned close to its state, twice in succession.

    The distance of two sections is the largest difference of a coordinate, divided by its range over all sections or by
    1, whichever is larger.

    Parameters
    ----------
    sections : (S, d, L)
        States of L motions after S successive mesh periods, S > 2 ``longest``.
    longest : int
        Largest n considered.
    tolerance : float
        Largest distance between the last section and the one n periods before it.
    previous_tolerance : float
        Largest distance between the sections n and 2 n periods before the last one.
    count : int
        Largest number of values n reported for each motion.

    Returns
    -------
    (count, L)
        The values n in ascending order, padded with zeros.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import near_returns
    >>> sections = np.tile([[0.0], [1.0], [2.0]], (4, 2))[:, :, None]  # three points again and again
    >>> near_returns(sections, 5, 1e-6, 1e-6, 1).tolist()
    [[3]]
    """
    found = np.zeros((count, sections.shape[2]), dtype=np.int64)
    if longest < 1:
        return found
    scale, close = np.empty((sections.shape[1] + 1, BLOCK)), np.empty(BLOCK, bool)
    search_returns(sections, longest, tolerance, previous_tolerance, scale, close, found)
    return found


def start_newton_search(w: np.ndarray) -> NewtonSearch:
    """Begin a search for periodic orbits, to be continued with `newton_iteration`.

    Parameters
    ----------
    w : (d, L)
        Guesses of a point on each orbit.

    Returns
    -------
    NewtonSearch

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import start_newton_search
    >>> start_newton_search(np.zeros((2, 3))).monodromy.shape
    (3, 2, 2)
    """
    d, count = w.shape
    return NewtonSearch(w.copy(), w.copy(), w.copy(), np.full(count, np.inf), np.zeros((count, d, d)),
                        np.zeros(count, np.int64), np.zeros((2, d, d + 1)))
