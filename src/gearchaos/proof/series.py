"""Taylor series of the flow in one cell of the mesh period, with bounds of their remainders.

The flow of a cell is a matrix function of u in [0, 1], the share of the cell that has passed. It acts on (w, 1), so
that the last column is the effect of the forcing. Coefficient m, the last one, is a ball that contains the rest of the
series too: for all u in [0, 1] the polynomial contains the flow, and its first two derivatives contain those of the
flow.
"""

from __future__ import annotations

import math
from functools import cache

from flint import arb, arb_mat, arb_poly

from gearchaos.proof.balls import interval, magnitude, norm

_MOST_TERMS = 600
_MOST_BITS = 1000
# Remainders are floats; they are not made smaller than this, so that they are normal numbers with correct rounding:
_LEAST_REMAINDER = 2.0**-_MOST_BITS


Harmonics = list[tuple[arb, arb, arb]]


class Flow:
    """The flow of one cell in one contact state, from the coefficients (m + 1, d + 1) of its d ``rows``.

    ``end`` (d + 1, d + 1) is the flow over the whole cell. ``bounds`` (4, d + 1) give, applied to (w, 1) at the start:
    z at the start, z at the end, and balls that contain dz/du and d²z/du² throughout the cell.
    """

    def __init__(self, rows: list[arb_mat]) -> None:
        self.rows, self.dimension, self.terms = rows, len(rows), rows[0].nrows()
        self.end = self._assembled(arb_mat(1, self.terms, [1] * self.terms))
        self.bounds = _range_weights(self.terms) * rows[0]

    def at(self, u: arb) -> arb_mat:
        """The flow (d + 1, d + 1) to the share u of the cell."""
        powers = [arb(1)]
        for _ in range(self.terms - 1):
            powers.append(powers[-1] * u)
        return self._assembled(arb_mat(1, self.terms, powers))

    def _assembled(self, weights: arb_mat) -> arb_mat:
        """The matrix of the flow from the weights (1, m + 1) of the coefficients."""
        entries = [entry for row in self.rows for entry in (weights * row).entries()]
        return arb_mat(self.dimension + 1, self.dimension + 1, [*entries, *(0,) * self.dimension, 1])

    def polynomial(self, state: arb_mat) -> arb_poly:
        """z as a polynomial of u for a state (d + 1, 1) at the start of the cell."""
        return arb_poly((self.rows[0] * state).entries())


@cache
def _range_weights(terms: int) -> arb_mat:
    """Weights (4, terms) of the coefficients in `Flow.bounds`."""
    upto1 = interval(0, 1)
    first = [arb(0) if i == 0 else arb(1) if i == 1 else i * upto1 for i in range(terms)]
    second = [arb(0) if i < 2 else arb(2) if i == 2 else i * (i - 1) * upto1 for i in range(terms)]
    return arb_mat([[arb(int(i == 0)) for i in range(terms)], [arb(1)] * terms, first, second])


def constant_series(matrix: arb_mat, dimension: int, bits: int) -> list[arb_mat]:
    """The d first rows of exp(M u) as power series for M (D, D), with remainders below 2^-bits: each (m + 1, D).

    With ν the norm of M, coefficient i is at most a_i = ν^i/i!, and Σ_{i>m} i (i - 1) a_i / (m (m - 1)) is at most a_m
    ν/(m - 1) / (1 - ν/m). So are the sums for the function and its first derivative.
    """
    size, nu, size_of_term = matrix.nrows(), norm(matrix), 1.0
    rest = math.inf
    term = arb_mat(dimension, size, [int(i == j) for i in range(dimension) for j in range(size)])
    coefficients = [term]
    for m in range(1, _MOST_TERMS):
        term = term * matrix / m
        coefficients.append(term)
        size_of_term *= nu / m
        if m > nu + 2:
            rest = size_of_term * nu / (m - 1) / (1 - nu / m) * (1 + 1e-12)
            if rest < 2.0 ** -min(bits, _MOST_BITS):
                break
    return _by_rows(coefficients, max(rest, _LEAST_REMAINDER))


def _by_rows(coefficients: list[arb_mat], rest: float) -> list[arb_mat]:
    """The coefficients of a matrix series by rows, with the remainder added to the last one."""
    rows, columns = coefficients[0].nrows(), coefficients[0].ncols()
    entries = [c.entries() for c in coefficients]
    entries[-1] = [value + arb(0, rest) for value in entries[-1]]
    return [arb_mat(len(entries), columns, [v for e in entries for v in e[i * columns:(i + 1) * columns]])
            for i in range(rows)]


def with_forcing(rows: list[arb_mat], dimension: int, inputs: list[arb]) -> list[arb_mat]:
    """Series (m + 1, d + 1) on (w, 1) from series (m + 1, D) on w and further unknowns with given initial values."""
    contraction = arb_mat(dimension + len(inputs), dimension + 1)
    for i in range(dimension):
        contraction[i, i] = 1
    for i, value in enumerate(inputs, start=dimension):
        contraction[i, dimension] = value
    return [row * contraction for row in rows]


def fourier_series(matrix: arb_mat, spring: arb_mat, chi: Harmonics, forcing: tuple[list[arb], Harmonics], contact: int,
                   angles: list[arb], bits: int) -> list[arb_mat]:
    """The flow in contact on a flank under a Fourier stiffness, as d power series (m + 1, d + 1).

    ``matrix`` and ``spring`` are A (d, d) and b (d, 1) times the length of the cell. A harmonic is (angle per cell,
    cosine coefficient, sine coefficient): ``chi`` are those of χ - 1 from the start of the cell on, ``forcing`` has the
    constant forcing (d), and its harmonics in the second row from τ = 0 on. ``angles`` are the cosine and sine of each
    of these at the start of the cell. The remainder is made smaller than 2^-bits.
    """
    constant, harmonics = forcing
    d = matrix.nrows()
    turned = [(angle, c * cosine + s * sine, s * cosine - c * sine)
              for (angle, c, s), cosine, sine in zip(harmonics, angles[::2], angles[1::2], strict=True)]
    terms, rest = _cauchy(matrix, spring, chi, constant, turned, bits)
    stiffness, push = _harmonic_terms(chi, terms), _harmonic_terms(turned, terms)
    stiffness[0] += 1
    state = arb_mat(d, d + 1, [int(i == j) for i in range(d) for j in range(d + 1)])
    coefficients, distance = [state], []
    for i in range(terms):
        row = [state[0, j] for j in range(d + 1)]
        row[d] -= contact if i == 0 else 0
        distance += row
        product = arb_mat(1, i + 1, stiffness[i::-1]) * arb_mat(i + 1, d + 1, distance)
        state = matrix * state - spring * product
        state[1, d] += push[i]
        for k in range(d) if i == 0 else ():
            state[k, d] += constant[k]
        state = state / (i + 1)
        coefficients.append(state)
    return _by_rows(coefficients, rest)


def _harmonic_terms(harmonics: Harmonics, count: int) -> list[arb]:
    """Taylor coefficients 0 to ``count`` of Σ (c cos ϑu + s sin ϑu)."""
    out = [arb(0)] * (count + 1)
    for angle, cosine, sine in harmonics:
        power, pair = arb(1), (cosine, sine)
        for i in range(count + 1):
            out[i] += power * pair[0]
            power, pair = power * angle / (i + 1), (pair[1], -pair[0])
    return out


def _cauchy(matrix: arb_mat, spring: arb_mat, chi: Harmonics, constant: list[arb], forcing: Harmonics,
            bits: int) -> tuple[int, float]:
    """The last power m, and a bound of the remainder, by Cauchy's estimate on a disc |u| <= ρ.

    On the disc |cos(ϑu + a)| <= cosh(ϑρ), so that by Gronwall's inequality the flow on (w, 1) is at most
    B = exp(ρ N) there, N a bound of the norm of the equations; coefficient i is at most B ρ^-i. With q = (m + 2)/(m ρ)
    the sum Σ_{i>m} i (i - 1) B ρ^-i / (m (m - 1)) is at most (m + 1)/(m - 1) B ρ^-(m+1) / (1 - q).
    """
    row_a, row_b = norm(matrix), max(map(magnitude, spring.entries()))
    steady = max(map(magnitude, constant))
    best = (_MOST_TERMS, math.inf)
    for rho in (2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0):
        growth = 1.0 + _amplitude(chi, rho)
        exponent = rho * (row_a + 2 * row_b * growth + steady + _amplitude(forcing, rho)) * (1 + 1e-12)
        terms = max(8, math.ceil((bits * math.log(2) + exponent) / math.log(rho)) + 2)
        if terms < best[0]:
            logarithm = exponent - (terms + 1) * math.log(rho)
            ratio = (terms + 2) / (terms * rho)
            first = max(math.exp(logarithm), _LEAST_REMAINDER)
            best = terms, first * (terms + 1) / (terms - 1) / (1 - ratio) * (1 + 1e-9)
    return best


def _amplitude(harmonics: Harmonics, rho: float) -> float:
    """An upper bound of a sum of harmonics on the disc |u| <= ρ."""
    terms = ((magnitude(c) + magnitude(s)) * math.cosh(magnitude(angle) * rho) for angle, c, s in harmonics)
    return sum(terms) * (1 + 1e-12)
