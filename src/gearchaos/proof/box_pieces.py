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
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import ball, interval, magnitude
from gearchaos.proof.equations import Cell, MeshEquations
from gearchaos.proof.parameter_box import Coefficients, magnitudes, slope_of, value_of
from gearchaos.proof.parameters import exact_parts

UP = 1 + 1e-9
"""Factor above all rounding errors of the floats."""


@dataclass(frozen=True)
class Slack:
    """Bounds on a piece.

    Attributes
    ----------
    flow : (d, d)
        \\|Φ(p) - Φ(p0)\\|, at any time of the piece.
    drift : (d, m)
        \\|γ(p) - γ(p0)\\| at the end.
    moved : (d,)
        \\|w - ŵ\\|, w a motion at p and ŵ that at p0 from the same state, at any time of the piece.
    moved_rate : (d,)
        \\|w' - ŵ'\\|.
    moved_curvature : float
        \\|z″ - ẑ″\\|.
    """

    flow: np.ndarray
    drift: np.ndarray
    moved: np.ndarray
    moved_rate: np.ndarray
    moved_curvature: float


@dataclass(frozen=True)
class UnitBox:
    """A box at scale 1, with what is computed for it once.

    Attributes
    ----------
    equations : MeshEquations
        At the centre.
    centre : Coefficients
        At the centre, with the half-widths of the box for the derivatives.
    count : int
        Number m of the u_j.
    blocks : dict
        Derivatives of the flows of whole cells by u_j, by length, contact state and level.
    """

    equations: MeshEquations
    centre: Coefficients
    count: int
    blocks: dict[Any, list[arb_mat]] = field(default_factory=dict)


class BoxBounds:
    """Bounds of the coefficients over a box, from which those of pieces are computed.

    Parameters
    ----------
    unit : UnitBox
        The box with its half-widths as given.
    box, centre : Coefficients
        Over the box with its half-widths times ``scale``, and at its centre with these half-widths for the derivatives.
    scale : Fraction
    """

    def __init__(self, unit: UnitBox, box: Coefficients, centre: Coefficients, scale: Fraction) -> None:
        count = unit.count
        self.equations, self.count, self.box, self.centre = unit.equations, count, box, centre
        self.unit, self.blocks, self.scale = unit.centre, unit.blocks, ball(scale)
        self.matrix, self.spring = magnitudes(value_of(box.matrix)), magnitudes(value_of(box.spring))
        self.matrix_slopes = [magnitudes(slope_of(box.matrix, j)) for j in range(count)]
        self.spring_slopes = [magnitudes(slope_of(box.spring, j)) for j in range(count)]
        self.constant_slopes = [magnitudes(slope_of(box.constant, j)) for j in range(count)]
        self.matrix_change = [self._changes("matrix", j) for j in range(count)]
        self.spring_change = [self._changes("spring", j) for j in range(count)]
        self.constant_change = [self._changes("constant", j) for j in range(count)]
        self.wave_slopes = [sum(magnitude(x.slopes[j]) for pair in box.harmonics for x in pair) for j in range(count)]
        self.wave_change = [
            sum(magnitude(x.slopes[j] - y.slopes[j]) for a, b in zip(box.harmonics, centre.harmonics, strict=True)
                for x, y in zip(a, b, strict=True)) for j in range(count)]
        self.top = max([magnitude(v.value) for v in box.levels], default=magnitude(unit.equations.stiffness))

    def _changes(self, name: str, j: int) -> np.ndarray:
        """Bounds of the change over the box of the derivatives by u_j of the coefficients ``name``."""
        over, at = slope_of(getattr(self.box, name), j), slope_of(getattr(self.centre, name), j)
        if name == "matrix":
            return magnitudes([[x - y for x, y in zip(p, q, strict=True)] for p, q in zip(over, at, strict=True)])
        return magnitudes([x - y for x, y in zip(over, at, strict=True)])

    def level(self, cell: Cell) -> tuple[float, list[float], list[float]]:
        """Bounds in a cell of χ, of its derivatives by u_j, and of their changes over the box."""
        part = self.part(cell)
        if part is None:
            return self.top, [0.0] * self.count, [0.0] * self.count
        over, at = self.box.levels[part], self.centre.levels[part]
        return (magnitude(over.value), [magnitude(x) for x in over.slopes],
                [magnitude(x - y) for x, y in zip(over.slopes, at.slopes, strict=True)])

    def part(self, cell: Cell) -> int | None:
        """The number of the part of the stiffness in which a cell lies; None if no box can vary its levels."""
        if not self.box.levels:
            return None
        share = (cell.start + self.equations.phase) % 1
        return sum(start <= share for start, _ in exact_parts(self.equations.parameters["stiffness"])) - 1

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
        chi, chi_slopes, chi_changes = self.level(cell) if contact else (0.0, [0.0] * self.count, [0.0] * self.count)
        push = np.zeros_like(self.matrix)
        push[:, 0] = self.spring * chi
        size = self.matrix + push
        exponential = _exponential(length * size * UP)
        forcing = self._forcing() + self.spring * chi * abs(contact)
        states = exponential @ (start + length * forcing) * UP
        change, rates, rate_changes = np.zeros_like(size), [], []
        reach = states[0] + abs(contact)
        for j in range(self.count):
            spring = self.spring_slopes[j] * chi + self.spring * chi_slopes[j]
            by_j = self.matrix_slopes[j].copy()
            by_j[:, 0] += spring
            change += by_j
            wave = np.eye(1, len(size), 1)[0]
            rates.append(self.matrix_slopes[j] @ states + self.constant_slopes[j] + wave * self.wave_slopes[j]
                         + spring * (reach if contact else 0.0))
            bend = (self.spring_change[j] * chi + self.spring_slopes[j] * self._spread(chi_slopes)
                    + self.spring * chi_changes[j] + self._spring_spread() * chi_slopes[j])
            rate_changes.append(self.matrix_change[j] @ states + self.constant_change[j] + wave * self.wave_change[j]
                                + bend * (reach if contact else 0.0))
        total = sum(rates)
        moved = length * exponential @ total
        drift = [length * exponential @ (change @ (length * exponential @ rates[j]) + rate_changes[j]
                                         + self._slopes_of(j, chi, chi_slopes[j]) @ moved)
                 for j in range(self.count)]
        moved_rate = size @ moved + total
        acceleration = size @ states + forcing
        curvature = float(size[0] @ moved_rate + change[0] @ (acceleration + moved_rate))
        return Slack(length * exponential @ change @ exponential * UP, np.array(drift).T * UP, moved * UP,
                     moved_rate * UP, curvature * UP)

    def _slopes_of(self, j: int, chi: float, chi_slope: float) -> np.ndarray:
        """Bounds of dM/du_j."""
        out = self.matrix_slopes[j].copy()
        out[:, 0] += self.spring_slopes[j] * chi + self.spring * chi_slope
        return out

    def _spread(self, slopes: list[float]) -> float:
        """A bound of the change of χ over the box."""
        return float(sum(slopes))

    def _spring_spread(self) -> np.ndarray:
        """A bound of the change of b over the box."""
        return np.sum(self.spring_slopes, axis=0)

    def _forcing(self) -> np.ndarray:
        """Bounds of the forcing without the force of the mesh."""
        out = magnitudes(value_of(self.box.constant))
        out[1] += sum(magnitude(x.value) for pair in self.box.harmonics for x in pair)
        return out

    def drift_at_centre(self, cell: Cell, contact: int, first: arb, last: arb, state: arb_mat) -> arb_mat:
        """γ (d, m) at p0 on a piece from share ``first`` to ``last`` of a cell, for w0 = ``state`` (d, 1) there.

        The derivative by u_j of the flow of an autonomous system is a block of exp [[M, M_j], [0, M]].
        """
        d, whole = self.equations.dimension, bool(first.is_zero() and last == 1)
        key = cell.length, contact, self.part(cell), cell.level
        blocks = self.blocks.get(key) if whole else None
        if blocks is None:
            blocks = self._derivatives(cell, contact, ball(cell.length) * (last - first))
        if whole:
            self.blocks[key] = blocks
        inputs = self._inputs(cell, first, contact)
        start = arb_mat(d + len(inputs), 1, [*state.entries(), *inputs])
        columns = [(block * start).entries() for block in blocks]
        return arb_mat(d, self.count, [columns[j][i] for i in range(d) for j in range(self.count)]) * self.scale

    def _derivatives(self, cell: Cell, contact: int, length: arb) -> list[arb_mat]:
        """The derivatives by u_j at p0 of the first d rows of the flow of w, the harmonics, 1 and σ, at scale 1."""
        base = self._extended(cell, contact, None) * length
        d, size, out = self.equations.dimension, base.nrows(), []
        for j in range(self.count):
            slope = self._extended(cell, contact, j) * length
            both = arb_mat(2 * size, 2 * size)
            for a in range(size):
                for b in range(size):
                    both[a, b] = both[size + a, size + b] = base[a, b]
                    both[a, size + b] = slope[a, b]
            derivative = both.exp()
            out.append(arb_mat(d, size, [derivative[a, size + b] for a in range(d) for b in range(size)]))
        return out

    def _inputs(self, cell: Cell, share: arb, contact: int) -> list[arb]:
        """Cosine and sine of the harmonics at a time of a cell, 1, and σ."""
        time = ball(cell.start + self.equations.phase) + share * ball(cell.length)
        out: list[arb] = []
        for j in self.equations.harmonics:
            sine, cosine = (2 * j * time).sin_cos_pi()
            out += [cosine, sine]
        return [*out, arb(1), arb(contact)]

    def _extended(self, cell: Cell, contact: int, j: int | None) -> arb_mat:
        """The matrix of the autonomous equations of w, the harmonics, 1 and σ at p0, or its derivative by u_j."""
        def of(number: object) -> arb:
            return number.value if j is None else number.slopes[j]  # type: ignore[attr-defined]

        centre, d, h = self.unit, self.equations.dimension, len(self.equations.harmonics)
        out = arb_mat(d + 2 * h + 2, d + 2 * h + 2)
        part = self.part(cell)
        level = centre.levels[part] if part is not None else None
        for row in range(d):
            for column in range(d):
                out[row, column] = of(centre.matrix[row][column])
            out[row, d + 2 * h] = of(centre.constant[row])
            if contact:
                spring = centre.spring[row]
                push = of(spring * level) if level is not None else of(spring) * ball(cell.level or 0)
                out[row, 0] -= push
                out[row, d + 2 * h + 1] = push
        for n, (order, (cosine, sine)) in enumerate(zip(self.equations.harmonics, centre.harmonics, strict=True)):
            at, turn = d + 2 * n, 2 * arb.pi() * order
            out[1, at], out[1, at + 1] = of(cosine), of(sine)
            if j is None:
                out[at, at + 1], out[at + 1, at] = -turn, turn
        return out


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


def window_balls(bounds: BoxBounds) -> tuple[arb_mat, arb_mat, arb]:
    """T A (d, d), T b (d, 1) and the interval from 0 to the largest χ, over the box."""
    box, d = bounds.box, bounds.equations.dimension
    matrix = arb_mat(d, d, [v for row in value_of(box.matrix) for v in row])
    return matrix, arb_mat(d, 1, value_of(box.spring)), interval(0, arb(bounds.top))
