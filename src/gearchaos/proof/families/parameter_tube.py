"""One mesh period of all motions from a box of states, for all models of a box of parameters.

The motions start at c + C u + ξ with |ξ_i| <= r and |u_j| <= 1, where u sets the parameters p(u). Their difference from
the motion at the centre (state c, parameters p0) is A ξ + B u. On a piece i of the mesh period A becomes Φ A and B
becomes Φ B + γ, with Φ and γ known up to bounds ΔΦ_i and Δγ_i. By the telescoping sum the errors of A and B after piece
N are at most

    Σ_i |Φ_N ... Φ_(i+1)| ΔΦ_i (|A_i| + ΔA_i)  and  Σ_i |Φ_N ... Φ_(i+1)| (ΔΦ_i (|B_i| + ΔB_i) + Δγ_i),

with the products of the precise matrices at the centre. So bounds are not multiplied by bounds from piece to piece, and
errors do not grow faster than the motions do.

Where motions of the box graze a contact boundary, some touch it twice and others not at all. The windows of the two
switches are then taken as one, before and after which all motions are in the same contact state. Within it a motion may
switch any number of times, since κ is anything from 0 to χ.

On a piece of length h, in mesh periods, one contact state σ lasts for all motions. Let R(w, t; p) be the right side of
w' = R, and M(p) its derivative by w. Relative to the motion w0 at the centre p0, a motion at p(u) has the difference

    δ(h) = Φ δ(0) + γ u,  Φ the flow of M(p),  γ_j the derivative by u_j of the motion at p(u) from w0(0).

At the centre both are computed precisely. Their changes over the box are bounded, entry by entry, by

    |Φ(p) - Φ(p0)| <= h E |ΔM| E,  E = exp(h |M|),
    |γ_j(p) - γ_j(p0)| <= h E (|ΔM| sup|γ_j| + sup|R_j(y, t; p) - R_j(w0, t; p0)|),  R_j = dR/du_j.

All matrices of bounds are floats; each has a factor for its rounding errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import ball, block, interval, magnitude, norm, unit
from gearchaos.proof.crossing import Displacement, clearance
from gearchaos.proof.equations import Cell, autonomous_matrix
from gearchaos.proof.families.coefficients import BoxTerms, Dual, ParameterBox, balls_of, sizes
from gearchaos.proof.parameters import exact_parts
from gearchaos.proof.tube import Trajectory, Tube, Window, largest_rate, slopes_through, speed_at

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
        """The bounds on a piece of a cell in one contact state.

        ``length`` is an upper bound of h, ``start`` (d,) are upper bounds of \\|w\\| at its start, of all motions.
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


_WIDENING = 2
"""Width of a window relative to the spread of the switches to first order."""


class ParameterTube(Tube):
    """The motions over one mesh period from the section on.

    ``centre`` is the motion from c at the centre of the box of parameters, ``drift`` (d, m) is C, ``radius`` r.
    ``shifts`` (S, m) are about the derivatives by u of the times of the switches, for the starts c + C u: they set the
    widths of the windows. With ``grazing``, overlapping windows of two switches on one flank are taken as one. Raises
    `UndecidedError` with the reason and margin of what could not be proved.

    Attributes
    ----------
    slopes : arb_mat
        A, (d, d): contains S with P(x; p) - P(y; p) = S (x - y) for all states of the box and all p.
    by_parameters : arb_mat
        B, (d, m).
    switches : int
        Number of windows: where none is that of a graze, the number of contact switches of every motion.
    """

    def __init__(
        self, bounds: BoxBounds, centre: Trajectory, drift: np.ndarray, radius: float, shifts: np.ndarray,
        grazing: bool = False,
    ) -> None:
        super().__init__(bounds.equations, centre)
        self.coefficients = self.bounds = bounds
        d, self.count = self.dimension, bounds.count
        self.start = arb_mat(d, 1, [arb(0, radius)] * d)
        self.every_u = arb_mat(self.count, 1, [arb(0, 1)] * self.count)
        self.factor, self.drift = unit(d), arb_mat(d, self.count, drift.ravel().tolist())
        self.factor_error, self.drift_error = np.zeros((d, d)), np.zeros((d, self.count))
        self.products: list[arb_mat] = []
        self.weights: list[np.ndarray] = []
        windows = []
        for number, (switch, shift) in enumerate(zip(centre.switches, shifts, strict=True)):
            speed, row = speed_at(switch), block(switch.slopes, 1, range(d))
            spread = magnitude((row * self.start)[0, 0]) / speed + float(np.abs(shift).sum())
            windows.append(self._window(number, _WIDENING * spread + 2.0 ** (24 - self.equations.bits), 12))
        windows = united(windows) if grazing else windows
        self.follow(windows)
        self.slopes, self.by_parameters = self._enclosed()
        self.switches = len(windows)

    def _enclosed(self) -> tuple[arb_mat, arb_mat]:
        """A and B with their errors."""
        return _widened(self.factor, self.factor_error), _widened(self.drift, self.drift_error)

    def _difference(self) -> arb_mat:
        """Contains the difference from the motion at the centre of all motions, (d, 1)."""
        slopes, by_parameters = self._enclosed()
        return slopes * self.start + by_parameters * self.every_u

    def _piece(self, part: int, index: int, first: arb, last: arb) -> None:
        cell, d, contact = self.equations.cells[index], self.dimension, self.centre.contacts[part]
        flow, frozen = self.equations.flow(index, contact), self.centre.starts[part, index]
        forward, onward = flow.at(first), flow.at(last)
        entry, leaving, before = forward * frozen, onward * frozen, self._difference()
        length, whole = magnitude(cell.span * (last - first)), magnitude(cell.span)
        state = block(entry, d, range(1))
        slack = self.bounds.slack(cell, contact, length, _magnitudes(state)[:, 0] + _magnitudes(before)[:, 0])
        inverse = block(forward, d, range(d)).inv()
        gamma = self.bounds.drift_at_centre(cell, contact, first, last, state)
        pulled = block(frozen, d, range(1)) + inverse * before
        path = Displacement(flow.polynomial(arb_mat(d + 1, 1, [*pulled.entries(), 1])), tuple(arb(0, v * UP) for v in (
            slack.moved[0], slack.moved_rate[0] * whole, slack.moved_curvature * whole**2)))
        self._advance(block(onward, d, range(d)) * inverse, slack.flow, gamma, slack.drift)
        self.leaving = block(leaving, d, range(1)) + self._difference()
        # proves too that z is on its side of the boundaries at both ends, i.e. before and after a window
        clearance(path, contact, first, last, entry[0, 0] + before[0, 0], self.leaving[0, 0])

    def _advance(self, flow: arb_mat, flow_error: np.ndarray, gamma: arb_mat, gamma_error: np.ndarray) -> None:
        """Apply the flow of a piece, and bound the errors after it by the telescoping sum."""
        flow_error = flow_error + _magnitudes(flow - flow.mid())
        gamma_error = gamma_error + _magnitudes(gamma - gamma.mid())
        flow, gamma, d = flow.mid(), gamma.mid(), self.dimension
        both = np.hstack([_magnitudes(self.factor) + self.factor_error, _magnitudes(self.drift) + self.drift_error])
        weight = flow_error @ both
        weight[:, d:] += gamma_error
        self.products = [flow * product for product in self.products] + [unit(d)]
        self.weights.append(weight * UP)
        self.factor, self.drift = flow * self.factor, flow * self.drift + gamma
        error = sum(_magnitudes(p) @ w for p, w in zip(self.products, self.weights, strict=True)) * UP
        self.factor_error, self.drift_error = error[:, :d], error[:, d:]

    def _through(self, window: Window) -> None:
        """Follow the motions through a window.

        γ of a window is the integral of dR/du_j along the motion at the centre, followed by the flow. This differs
        from the unit matrix by at most e^(ηN) - 1.
        """
        duration, d, box = window.high - window.low, self.dimension, self.bounds.box
        states = self._states_in(window, self.leaving)
        growth = (duration * largest_rate(self.bounds)).expm1()
        force, columns = interval(0, states[0, 0] - window.flank), []
        for j in range(self.count):
            rates = (arb_mat(d, d, balls_of(box.matrix, j)) * states).entries()
            wave = arb(0, self.bounds.slopes[j].wave)
            bend = max((magnitude(level.slopes[j]) for level in box.levels), default=0.0)
            for i in range(d):
                push = box.spring[i].slopes[j] * self.bounds.stiffness + box.spring[i].value * arb(0, bend)
                rates[i] += box.constant[i].slopes[j] + (wave if i == 1 else 0) - push * force
            error = arb(0, magnitude(growth) * max(map(magnitude, rates)))
            columns.append([duration * (rate + error) for rate in rates])
        gamma = arb_mat(d, self.count, [columns[j][i] for i in range(d) for j in range(self.count)])
        flow = slopes_through(self.bounds, duration)
        self._advance(flow, np.zeros((d, d)), gamma, np.zeros((d, self.count)))


def united(windows: list[Window]) -> list[Window]:
    """The windows, those of two switches on one flank that overlap as one."""
    out = list[Window]()
    for window in windows:
        before = out[-1] if out else window
        if (before.first == before.last == window.first - 1 and before.flank == window.flank
                and not before.high < window.low):
            out[-1] = replace(before, low=before.low.min(window.low), high=before.high.max(window.high),
                              last=window.last)
        else:
            out.append(window)
    return out


def _magnitudes(matrix: arb_mat) -> np.ndarray:
    """Upper bounds of the absolute values of the entries of a matrix."""
    return np.array([[magnitude(v) for v in row] for row in matrix.tolist()])


def _widened(matrix: arb_mat, error: np.ndarray) -> arb_mat:
    """A matrix with errors added to its radii."""
    rows = zip(matrix.tolist(), error.tolist(), strict=True)
    return arb_mat([[v + arb(0, e) for v, e in zip(row, errors, strict=True)] for row, errors in rows])
