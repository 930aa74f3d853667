"""Newton's method for an orbit of n mesh periods, or for one at an event, along parameters in which the equations are
polynomials: the corrector of a continuation in one call.

The M unknowns are the n points (n d), then the Q parameters. The N = M − 1 equations are the defects P(x(k)) − x(k + 1)
and, at an event, one more: that z touches a boundary at an extremum, or that the matrix of the linear equations of the
orbit, with the critical multiplier in its last rows, is singular. With b and c the singular vectors at a neighbouring
orbit, this matrix A is singular where s = 0 in

    [A b; cᵀ 0] [v; s] = [0; 1],   [Aᵀ c; bᵀ 0] [w; s] = [0; 1],

and ds = −wᵀ dA v. Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria, SIAM 2000.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import kernel, subroutine
from gearchaos.flow.kernels.orbits.orbits import solve
from gearchaos.flow.kernels.orbits.sensitivity import advance_lanes
from gearchaos.flow.kernels.vector.constants import OK

NO_EVENT, MULTIPLIER, EXTREMUM = range(3)
"""Kinds of the further equation."""

FAILED, SOLVED, NO_SOLUTION, OTHER_STEPS = range(4)
"""How a correction ends: the equations are not known or not defined at some place, Newton's method converges or does
not, or the period has to be divided into other steps."""


class Limits(NamedTuple):
    """When Newton's method ends.

    Attributes
    ----------
    tolerance : float
        Largest equation at which they are solved.
    accepted : float
        The same where rounding errors let it come no further.
    growth : float
        By this factor over the smallest one so far it diverges.
    alternates : float
        It goes to and fro if the largest equation differs by less than this fraction from that two iterations before.
    iterations : int
        Most of them.

    Examples
    --------
    >>> from gearchaos.flow import Limits
    >>> Limits(1e-12, 1e-10, growth=1e3, alternates=0.1, iterations=8).accepted
    1e-10
    """

    tolerance: float
    accepted: float
    growth: float
    alternates: float
    iterations: int


class Polynomials(NamedTuple):
    """The equations at Q parameters in a box: sums of products of 1, T_1(x) − T_1(−1), T_2(x) − T_2(−1), …, K in each
    direction, with x from −1 to 1 across the box.

    The C columns are the parameters of a system, the starts of the parts of its period, and its least number of steps.

    Attributes
    ----------
    low : (Q,)
        Corner nearest to −∞.
    width : (Q,)
    origin : (C,)
        Values at that corner.
    coefficients : (K^Q, C)
        Of the differences from there; the last direction varies fastest.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import Polynomials
    >>> Polynomials(np.zeros(1), np.ones(1), np.zeros(30), np.zeros((16, 30))).coefficients.shape
    (16, 30)
    """

    low: np.ndarray  # (Q,)
    width: np.ndarray  # (Q,)
    origin: np.ndarray  # (C,)
    coefficients: np.ndarray  # (K^Q, C)


class Correction(NamedTuple):
    """What Newton's method works with."""

    u: np.ndarray  # (M,) the guess is overwritten by the solution
    guess: np.ndarray  # (M,) likewise the guess
    rows: np.ndarray  # (2, M) u − guess is at a right angle to the first; the second is that of the tangent
    jacobian: np.ndarray  # (M, M + 1) derivatives of the equations, the first of ``rows``; the negative equations
    matrix: np.ndarray  # (M, M + 1) scratch; in its last column the tangent is left
    bordered: np.ndarray  # (n d + 1, n d + 2) scratch
    vectors: np.ndarray  # (2, n d) v and w: those of a neighbouring orbit are overwritten
    basis: np.ndarray  # (Q, 2, K) scratch
    found: np.ndarray  # (1 + Q, C) scratch
    lanes: np.ndarray  # (2 n,) 0, 1, …
    steps: np.ndarray  # (3,) in a period; limits of the least numbers of steps with which that is so
    event: np.ndarray  # (3,) kind; critical multiplier and step of differences, or boundary and instant
    result: np.ndarray  # (3,) largest |equation|; sign of the determinant with the tangent; index of the extremum


@subroutine
def interpolate(polynomials, values, basis, found):
    """Write the equations at values (Q,), and their derivatives by each of them, to ``found`` (1 + Q, C)."""
    count, q = basis.shape[2], len(values)
    for i in range(q):
        x = 2.0 * (values[i] - polynomials.low[i]) / polynomials.width[i] - 1.0
        basis[i, 0, 0], basis[i, 1, 0], basis[i, 0, 1], basis[i, 1, 1] = 1.0, 0.0, x, 1.0
        for k in range(2, count):
            basis[i, 1, k] = 2.0 * basis[i, 0, k - 1] + 2.0 * x * basis[i, 1, k - 1] - basis[i, 1, k - 2]
            basis[i, 0, k] = 2.0 * x * basis[i, 0, k - 1] - basis[i, 0, k - 2]
        for k in range(1, count):
            basis[i, 0, k] += 1.0 if k % 2 else -1.0
    columns = len(polynomials.origin)
    for c in range(columns):
        for i in range(1 + q):
            found[i, c] = 0.0
    for k in range(len(polynomials.coefficients)):
        for i in range(1 + q):
            factor, rest = 1.0, k
            for j in range(q - 1, -1, -1):
                factor *= basis[j, 1 if j + 1 == i else 0, rest % count]
                rest //= count
            for c in range(columns):
                found[i, c] += factor * polynomials.coefficients[k, c]
    for c in range(columns):
        found[0, c] += polynomials.origin[c]
        for i in range(q):
            found[1 + i, c] *= 2.0 / polynomials.width[i]


@kernel
def evaluate_polynomials(polynomials, values, basis, found):
    """See `interpolate`."""
    interpolate(polynomials, values, basis, found)


@subroutine
def _equations_at(own, polynomials, call):
    """Write the equations at the parameters among the unknowns to the call; whether that can be."""
    q = len(polynomials.low)
    values = own.u[len(own.u) - q :]
    for i in range(q):
        if not 0.0 < values[i] - polynomials.low[i] < polynomials.width[i]:
            return FAILED
    interpolate(polynomials, values, own.basis, own.found)
    for c in range(call.parameters.shape[1]):
        call.parameters[0, c] = own.found[0, c]
        for i in range(q):
            call.derivatives[0, i, c] = own.found[1 + i, c]
    least = own.found[0, own.found.shape[1] - 1]
    return SOLVED if own.steps[1] < least and least <= own.steps[2] else OTHER_STEPS


@subroutine
def _advance_points(dims, harmonics, row, own, call, direction, step, work, segment):
    """Advance the points, moved by ``step`` times a direction (n d,), and, for other than 0, as many moved against it;
    whether all could be."""
    d, n = len(dims), own.vectors.shape[1] // len(dims)
    count = n if step == 0.0 else 2 * n
    for l in range(count):
        k, h = (l, step) if l < n else (l - n, -step)
        for i in range(d):
            call.w[l, i] = own.u[k * d + i] + h * direction[k * d + i]
        # the contact state, as in `system.contact_states` where contact does not end with its force
        call.sigma[l] = (1.0 if call.w[l, 0] > 1.0 else 0.0) - (1.0 if call.w[l, 0] < -1.0 else 0.0)
        call.switch_count[l] = call.extremum_count[l] = 0
        call.status[l] = OK
    advance_lanes(dims, harmonics, row, call, int(own.steps[0]), own.lanes[:count], work, segment)
    failed = 0
    for l in range(count):
        failed += call.status[l] != OK
    return failed == 0


@subroutine
def _fill_defects(dims, own, call):
    """Write the defects of the orbit and their derivatives."""
    d, q = len(dims), call.derivatives.shape[1]
    n, m = own.vectors.shape[1] // d, len(own.u)
    for k in range(n):
        after = (k + 1) % n * d
        for i in range(d):
            equation = own.jacobian[k * d + i]
            for j in range(m):
                equation[j] = 0.0
            for j in range(d):
                equation[k * d + j] = call.tangent[k, j, i]
            equation[after + i] -= 1.0
            for j in range(q):
                equation[n * d + j] = call.sensitivity[k, j, i]
            equation[m] = own.u[after + i] - call.w[k, i]


@subroutine
def _solve_bordered(dims, own, transposed):
    """Solve the bordered equations for v, or with the transposed matrix for w; the vector and s are left in the last
    column of ``bordered``. Whether they are not singular."""
    d, size, system = len(dims), own.vectors.shape[1], own.bordered
    right, below = own.vectors[0 if transposed else 1], own.vectors[1 if transposed else 0]
    for i in range(size):
        for j in range(size):
            system[i, j] = own.jacobian[j, i] if transposed else own.jacobian[i, j]
        system[i, size], system[size, i], system[i, size + 1] = right[i], below[i], 0.0
    for i in range(d):  # the image of the last point is the first one times the multiplier
        last = size - d + i
        if transposed:
            system[i, last] -= own.event[1] - 1.0
        else:
            system[last, i] -= own.event[1] - 1.0
    system[size, size], system[size, size + 1] = 0.0, 1.0
    return solve(system) != 0


@subroutine
def _store_vector(own, which):
    """Keep a vector left in ``bordered``, of length 1; returns 1 by its length."""
    size, total = own.vectors.shape[1], 0.0
    for i in range(size):
        total += own.bordered[i, size + 1] ** 2
    scale = 1.0 / np.sqrt(total)
    for i in range(size):
        own.vectors[which, i] = scale * own.bordered[i, size + 1]
    return scale


@subroutine
def _fill_multiplier(dims, harmonics, row, own, call, probe, work, segment):
    """Write the equation of a critical multiplier, and its derivatives by differences in the direction v; whether it
    could be evaluated."""
    d, size, q, m = len(dims), own.vectors.shape[1], call.derivatives.shape[1], len(own.u)
    if not _solve_bordered(dims, own, True):
        return False
    for i in range(size):  # w: v has the borders of the orbit before, too
        own.matrix[0, i] = own.bordered[i, size + 1]
    if not _solve_bordered(dims, own, False):
        return False
    s = own.bordered[size, size + 1] * _store_vector(own, 0)
    for i in range(size):
        own.bordered[i, size + 1] = own.matrix[0, i]
    s *= _store_vector(own, 1)
    if not _advance_points(dims, harmonics, row, own, probe, own.vectors[0], own.event[2], work, segment):
        return False
    n, scale, equation = size // d, 0.5 / own.event[2], own.jacobian[size]
    for j in range(m):
        equation[j] = 0.0
    for k in range(n):
        for i in range(d):
            factor = scale * own.vectors[1, k * d + i]
            for j in range(d):
                equation[k * d + j] += factor * (probe.tangent[k, j, i] - probe.tangent[n + k, j, i])
            for j in range(q):
                equation[size + j] += factor * (probe.sensitivity[k, j, i] - probe.sensitivity[n + k, j, i])
    equation[m] = s  # w* A v is −s
    return True


@subroutine
def _fill_extremum(dims, own, call):
    """Write the equation of the extremum nearest to an instant and a boundary; whether there is one."""
    d, size, q, m = len(dims), own.vectors.shape[1], call.derivatives.shape[1], len(own.u)
    n, number, least, equation = size // d, -1, np.inf, own.jacobian[size]
    boundary, instant = own.event[1], own.event[2]
    for k in range(n):
        for i in range(call.extremum_count[k]):
            number += 1
            record = call.extrema[k, i]
            lag = (k + record[0] - instant + 0.5 * n) % n - 0.5 * n
            distance = abs(lag) + abs(record[1] - boundary)
            if distance < least:
                least = distance
                own.result[2] = number
                for j in range(m):
                    equation[j] = 0.0
                for j in range(d):
                    equation[k * d + j] = record[3 + j]
                for j in range(q):
                    equation[size + j] = record[3 + d + j]
                equation[m] = boundary - record[1]
    return least < np.inf


@subroutine
def _evaluate(dims, harmonics, row, own, call, probe, work, segment):
    """Write all equations and derivatives at ``u`` to ``jacobian``; returns the largest one, NaN where they cannot be
    evaluated."""
    m, kind, largest = len(own.u), int(own.event[0]), 0.0
    if not _advance_points(dims, harmonics, row, own, call, own.u, 0.0, work, segment):
        return np.nan
    _fill_defects(dims, own, call)
    if kind == MULTIPLIER and not _fill_multiplier(dims, harmonics, row, own, call, probe, work, segment):
        return np.nan
    if kind == EXTREMUM and not _fill_extremum(dims, own, call):
        return np.nan
    for i in range(m - 1):
        size = abs(own.jacobian[i, m])
        if not size < np.inf:
            return np.nan
        largest = max(largest, size)
    distance = 0.0
    for j in range(m):
        own.jacobian[m - 1, j] = own.rows[0, j]
        distance += own.rows[0, j] * (own.u[j] - own.guess[j])
    own.jacobian[m - 1, m] = -distance
    return largest


@subroutine
def _solve_for(own, tangent):
    """Newton's step, or the tangent, in the last column of ``matrix``; returns the sign of the determinant."""
    m = len(own.u)
    for i in range(m):
        for j in range(m + 1):
            own.matrix[i, j] = own.jacobian[i, j]
    if tangent:
        for i in range(m):
            own.matrix[i, m], own.matrix[m - 1, i] = (1.0 if i == m - 1 else 0.0), own.rows[1, i]
    return solve(own.matrix)


@kernel
def correct_orbit(dims, harmonics, row, own, polynomials, call, probe, limits, work, segment):
    """The solution of the equations nearest to the guess in the plane through it at a right angle to the first of
    ``rows``, by Newton's method; returns how it ended.

    ``own`` (a `Correction`) holds guess and solution, ``call`` (a `SensitivityCall` of n trajectories and one point of
    the parameters) the period from each point of the orbit. ``probe`` is another one, of 2 n trajectories with the same
    parameters, for the differences. ``limits`` are `Limits`.
    """
    best, before, last = np.inf, np.inf, np.inf
    for _ in range(limits.iterations):
        known = _equations_at(own, polynomials, call)
        if known != SOLVED:
            return known
        residual = _evaluate(dims, harmonics, row, own, call, probe, work, segment)
        if np.isnan(residual):
            return FAILED
        stalled = not residual < best
        best = min(best, residual)
        if residual <= limits.tolerance or (stalled and residual <= limits.accepted):
            own.result[0], own.result[1] = residual, _solve_for(own, True)
            return SOLVED if own.result[1] != 0.0 else FAILED
        if stalled and best <= limits.accepted:
            return FAILED
        diverges, alternates = residual > limits.growth * best, abs(residual - before) < limits.alternates * residual
        if diverges or alternates or _solve_for(own, False) == 0:
            return NO_SOLUTION
        before, last = last, residual
        for j in range(len(own.u)):
            own.u[j] += own.matrix[j, len(own.u)]
    return NO_SOLUTION
