"""Bounds on a piece of the mesh period for all models of a box of parameters, relative to the model at its centre.

In a piece of length h, in mesh periods, one contact state σ lasts for all motions. Let R(w, t; p) be the right side of
w' = R, and M(p) its derivative by w. Relative to the motion w0 at the centre p0, a motion at p(u) has the difference

    δ(h) = Φ δ(0) + γ u,  Φ the flow of M(p),  γ_j the derivative by u_j of the motion at p(u) from w0(0).

At the centre both are computed precisely. Their changes over the box are bounded, entry by entry, by

    |Φ(p) - Φ(p0)| <= h E |ΔM| E,  E = exp(h |M|),
    |γ_j(p) - γ_j(p0)| <= h E (|ΔM| sup|γ_j| + sup|R_j(y, t; p) - R_j(w0, t; p0)|),  R_j = dR/du_j.

All matrices of bounds are floats; each has a factor for its rounding errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import ball, interval, magnitude, norm
from gearchaos.proof.equations import Cell, autonomous_matrix
from gearchaos.proof.families.coefficients import BoxTerms, Dual, ParameterBox, balls_of, sizes
from gearchaos.proof.parameters import exact_parts

UP = 1 + 1e-9
"""Factor above all rounding errors of the floats."""


@dataclass(frozen=True)
class Slack:
    """Bounds on a piece, where w is a motion at p and ŵ that at p0 from the same state."""

    flow: np.ndarray  # (d, d), |Φ(p) - Φ(p0)| at any time of the piece
    drift: np.ndarray  # (d, m), |γ(p) - γ(p0)| at the end
    moved: np.ndarray  # (d,), |w - ŵ| at any time of the piece
    moved_rate: np.ndarray  # (d,), |w' - ŵ'|
    moved_curvature: float  # |z″ - ẑ″|


class _Direction(NamedTuple):
    """Bounds of derivatives by one u_j, or of how much they change over the box; ``wave``: of the harmonic forcing."""

    matrix: np.ndarray
    spring: np.ndarray
    constant: np.ndarray
    wave: float


class BoxBounds:
    """Bounds of the coefficients over a box with its half-widths times a scale.

    It is `tube.Coefficients` of all models of the box.
    """

    def __init__(self, unit: ParameterBox, scale: Fraction) -> None:
        self.unit, self.equations, self.count, self.scale = unit, unit.equations, unit.count, ball(scale)
        self.box, self.centre = unit.coefficients(scale), unit.coefficients(scale, at_centre=True)
        self.slopes = [self._direction(j, None) for j in range(self.count)]
        self.changes = [self._direction(j, self.centre) for j in range(self.count)]
        self.top = max([magnitude(v.value) for v in self.box.levels],
                       default=magnitude(self.equations.stiffness))
        d, forcing = self.equations.dimension, sizes(self.box.constant)
        forcing[1] += sum(sizes(self.box.forcing).ravel().tolist())
        self.sizes = sizes(self.box.matrix), sizes(self.box.spring), forcing
        self.matrix = arb_mat(d, d, balls_of(self.box.matrix))
        self.spring = arb_mat(d, 1, balls_of(self.box.spring))
        self.norms, self.stiffness = (norm(self.matrix), norm(self.spring)), interval(0, arb(self.top))

    def _direction(self, j: int, less: BoxTerms | None) -> _Direction:
        """The bounds of derivatives by u_j, of their differences from those of other coefficients if wanted."""
        matrix, spring, constant, waves = (
            sizes(getattr(self.box, name), j, getattr(less, name) if less else None)
            for name in ("matrix", "spring", "constant", "forcing"))
        return _Direction(matrix, spring, constant, sum(waves.ravel().tolist()))

    def forcing_over(self, low: arb, high: arb) -> list[arb]:
        """T f(τ) from time ``low`` to ``high`` for all models of the box, as balls (d)."""
        waves = [(cosine.value, sine.value) for cosine, sine in self.box.forcing]
        return self.equations.forcing_of(balls_of(self.box.constant), waves, low, high)

    def part(self, cell: Cell) -> int | None:
        """The number of the part of the stiffness in which a cell lies; None if no box can vary its levels."""
        if not self.box.levels:
            return None
        share = (cell.start + self.equations.phase) % 1
        return sum(start <= share for start, _ in exact_parts(self.equations.parameters["stiffness"])) - 1

    def _level(self, cell: Cell, contact: int) -> tuple[float, list[float], list[float]]:
        """Bounds in a cell of χ, of its derivatives by u_j, and of their changes over the box; 0 in free flight."""
        part = self.part(cell)
        if part is None or not contact:
            return self.top if contact else 0.0, [0.0] * self.count, [0.0] * self.count
        over, at = self.box.levels[part], self.centre.levels[part]
        return (magnitude(over.value), [magnitude(x) for x in over.slopes],
                [magnitude(x - y) for x, y in zip(over.slopes, at.slopes, strict=True)])

    def slack(self, cell: Cell, contact: int, length: float, start: np.ndarray) -> Slack:
        """The bounds on a piece.

        Parameters
        ----------
        cell : Cell
            In which it lies.
        contact : int
        length : float
            An upper bound of h.
        start : (d,)
            Upper bounds of \\|w\\| at the start of the piece, of all motions.
        """
        chi, chi_slopes, chi_changes = self._level(cell, contact)
        matrix, spring, steady = self.sizes
        push = np.zeros_like(matrix)
        push[:, 0] = spring * chi
        size = matrix + push
        exponential = _exponential(length * size * UP)
        forcing = steady + spring * chi * abs(contact)
        states = exponential @ (start + length * forcing) * UP
        reach = states[0] + abs(contact) if contact else 0.0
        wave = np.eye(1, len(size), 1)[0]
        chi_spread, spring_spread = float(sum(chi_slopes)), np.sum([by.spring for by in self.slopes], axis=0)
        change, slopes, rates, rate_changes = np.zeros_like(size), [], [], []
        for j, (by, moved_by) in enumerate(zip(self.slopes, self.changes, strict=True)):
            pushed = by.spring * chi + spring * chi_slopes[j]
            slope = by.matrix.copy()
            slope[:, 0] += pushed
            slopes.append(slope)
            change += slope
            rates.append(by.matrix @ states + by.constant + wave * by.wave + pushed * reach)
            bend = (moved_by.spring * chi + by.spring * chi_spread
                    + spring * chi_changes[j] + spring_spread * chi_slopes[j])
            rate_changes.append(moved_by.matrix @ states + moved_by.constant + wave * moved_by.wave + bend * reach)
        total = sum(rates)
        moved = length * exponential @ total
        drift = [length * exponential @ (change @ (length * exponential @ rate) + rate_change + slope @ moved)
                 for rate, rate_change, slope in zip(rates, rate_changes, slopes, strict=True)]
        moved_rate = size @ moved + total
        acceleration = size @ states + forcing
        curvature = float(size[0] @ moved_rate + change[0] @ (acceleration + moved_rate))
        return Slack(length * exponential @ change @ exponential * UP, np.array(drift).T * UP, moved * UP,
                     moved_rate * UP, curvature * UP)

    def drift_at_centre(self, cell: Cell, contact: int, first: arb, last: arb, state: arb_mat) -> arb_mat:
        """γ (d, m) at p0 on a piece from share ``first`` to ``last`` of a cell, for w0 = ``state`` (d, 1) there."""
        d, whole = self.equations.dimension, bool(first.is_zero() and last == 1)
        key = cell.length, contact, self.part(cell), cell.level
        blocks = self.unit.blocks.get(key) if whole else None
        if blocks is None:
            length = ball(cell.length) * (last - first)
            base = self._extended(cell, contact, None) * length
            blocks = [_derivative_block(base, self._extended(cell, contact, j) * length, d) for j in range(self.count)]
        if whole:
            self.unit.blocks[key] = blocks
        time = ball(cell.start + self.equations.phase) + first * ball(cell.length)
        inputs = [*self.equations.cosines_and_sines(time), arb(1), arb(contact)]
        start = arb_mat(d + len(inputs), 1, [*state.entries(), *inputs])
        columns = [(block * start).entries() for block in blocks]
        return arb_mat(d, self.count, [columns[j][i] for i in range(d) for j in range(self.count)]) * self.scale

    def _extended(self, cell: Cell, contact: int, j: int | None) -> arb_mat:
        """The matrix of the autonomous equations of w, the harmonics, 1 and σ at p0, or its derivative by u_j."""
        def of(number: Dual) -> arb:
            return number.value if j is None else number.slopes[j]

        centre, d, part = self.unit.centre, self.equations.dimension, self.part(cell)
        push = [of(spring) * ball(cell.level or 0) if part is None else of(spring * centre.levels[part])
                for spring in centre.spring]
        forcing = [(of(cosine), of(sine)) for cosine, sine in centre.forcing]
        return autonomous_matrix(arb_mat(d, d, balls_of(centre.matrix, j)), balls_of(centre.constant, j),
                                 push if contact else None, self.equations.harmonics, forcing, turning=j is None)


def _derivative_block(matrix: arb_mat, slope: arb_mat, rows: int) -> arb_mat:
    """The first rows of the derivative of exp M by a parameter: a block of exp [[M, M_j], [0, M]]."""
    size = matrix.nrows()
    both = arb_mat(2 * size, 2 * size)
    for a in range(size):
        for b in range(size):
            both[a, b] = both[size + a, size + b] = matrix[a, b]
            both[a, size + b] = slope[a, b]
    both = both.exp()
    return arb_mat(rows, size, [both[a, size + b] for a in range(rows) for b in range(size)])


def _exponential(matrix: np.ndarray) -> np.ndarray:
    """An upper bound of the exponential of a matrix of numbers that are not negative."""
    size = float(matrix.sum(axis=1).max())
    terms = max(20, math.ceil(4 * size))
    total = term = np.eye(len(matrix))
    for k in range(1, terms):
        term = term @ matrix / k
        total = total + term
    rest = 2 * math.exp(terms * math.log(size + 1e-30) - math.lgamma(terms + 1))
    return (total + rest) * UP
