"""Boxes of parameters: the coefficients of the equations of motion over them, and what they do to motions on a piece.

A box is p = p0 + D u with |u_j| <= 1; D has the half-widths. Every coefficient is a ball that contains its values over
the box, with balls that contain its derivatives by u_1, ..., u_m there (automatic differentiation).

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
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple, cast

import numpy as np
from flint import arb, arb_mat

from gearchaos.errors import InputError
from gearchaos.model import STIFFNESS_FORMS
from gearchaos.proof.balls import ball, block, from_columns, from_text, interval, magnitude, norm, to_text
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import Cell, MeshEquations, autonomous_matrix
from gearchaos.proof.parameters import Numbers, Terms, exact_parts

UP = 1 + 1e-9  # factor above all rounding errors of the floats
LEVELS = tuple(name for kind in STIFFNESS_FORMS.values() for name in kind.level_names)


class Dual:
    """A number that depends on u: a ball of its values over the box, and balls of its derivatives."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: arb, slopes: list[arb]) -> None:
        self.value, self.slopes = value, slopes

    def _pair(self, other: Any) -> Dual:
        constant = other if isinstance(other, arb | Dual) else ball(other)
        return constant if isinstance(constant, Dual) else Dual(constant, [arb(0)] * len(self.slopes))

    def __add__(self, other: Any) -> Dual:
        b = self._pair(other)
        return Dual(self.value + b.value, [x + y for x, y in zip(self.slopes, b.slopes, strict=True)])

    def __neg__(self) -> Dual:
        return Dual(-self.value, [-x for x in self.slopes])

    def __sub__(self, other: Any) -> Dual:
        return self + (-self._pair(other))

    def __rsub__(self, other: Any) -> Dual:
        return self._pair(other) + (-self)

    def __mul__(self, other: Any) -> Dual:
        b = self._pair(other)
        return Dual(self.value * b.value,
                    [x * b.value + self.value * y for x, y in zip(self.slopes, b.slopes, strict=True)])

    def __truediv__(self, other: Any) -> Dual:
        b = self._pair(other)
        quotient = self.value / b.value
        return Dual(quotient, [(x - quotient * y) / b.value for x, y in zip(self.slopes, b.slopes, strict=True)])

    def __rtruediv__(self, other: Any) -> Dual:
        return self._pair(other) / self

    __radd__, __rmul__ = __add__, __mul__

    def __eq__(self, other: object) -> bool:
        """Whether two numbers are the same function of u: computed in the same way from the same parameters."""
        return isinstance(other, Dual) and all(
            x.mid() == y.mid() and x.rad() == y.rad()
            for x, y in zip((self.value, *self.slopes), (other.value, *other.slopes), strict=True))

    def __hash__(self) -> int:
        return id(self)

    def __bool__(self) -> bool:
        return not (self.value.is_zero() and all(x.is_zero() for x in self.slopes))


class VariedNumbers(Numbers):
    """The parameters of a model by name, as functions of u; ``parameters`` are those at the centre of the box.

    ``widths`` has for each parameter that varies its derivatives by u_1, ..., u_m: usually one half-width, else 0. With
    ``at_centre``, values and derivatives are those at the centre alone.
    """

    def __init__(self, parameters: Mapping[str, Any], widths: Mapping[str, list[Fraction]], at_centre: bool) -> None:
        super().__init__(parameters)
        self.widths, self.count, self.at_centre = widths, len(next(iter(widths.values()))), at_centre

    def __getitem__(self, name: str) -> Dual:
        stiffness = self.parameters["stiffness"]
        return self._dual(name, from_text(stiffness[name] if name in stiffness else self.parameters[name]))

    def amplitude(self, j: int, value: Fraction) -> Dual:
        return self._dual(f"eps{j}", value)

    def _dual(self, name: str, centre: Fraction) -> Dual:
        """The parameter ``name`` with this value at the centre of the box."""
        width = self.widths.get(name, [Fraction(0)] * self.count)
        reach = Fraction(0) if self.at_centre else sum(map(abs, width), Fraction(0))
        value = interval(ball(centre - reach), ball(centre + reach)) if reach else ball(centre)
        return Dual(value, [ball(w) for w in width])


@dataclass(frozen=True)
class BoxTerms(Terms):
    """The coefficients over a box, with their derivatives."""

    levels: list[Dual]  # χ in each part of a stiffness whose levels a box can vary; empty for any other


class ParameterBox:
    """The models p0 + D u about that of some equations; ``widths`` has for each u_j the half-widths that it changes.

    Raises `InputError` if an amplitude of the transmission error that varies is 0 at the centre, and `UndecidedError`
    if the motions of the box need other coordinates than those at its centre.
    """

    def __init__(self, equations: MeshEquations, widths: list[dict[str, Fraction]]) -> None:
        self.equations, self.widths, self.count = equations, widths, len(widths)
        self.blocks: dict[Any, list[arb_mat]] = {}  # see `BoxBounds.drift_at_centre`
        self.names = dict.fromkeys(name for together in widths for name in together)
        present = {f"eps{j}" for j in equations.harmonics}  # the equations at the centre leave out the others
        for name in sorted(name for name in self.names.keys() - present if name.startswith("eps")):
            raise InputError(name, "must not be 0 at the centre of the box", 0.0,
                             "Another width or value moves the centre of the interval of an event.")
        if self.coefficients(Fraction(1)).names != equations.names:
            raise UndecidedError("coordinates not the same", 0.0)
        self.centre = self.coefficients(Fraction(1), at_centre=True)

    def coefficients(self, scale: Fraction, *, at_centre: bool = False) -> BoxTerms:
        """The coefficients over the box with its half-widths times ``scale``, or at its centre with these."""
        slopes = {name: [together.get(name, Fraction(0)) * scale for together in self.widths] for name in self.names}
        known = VariedNumbers(self.equations.parameters, slopes, at_centre)
        kind = STIFFNESS_FORMS[known.parameters["stiffness"]["form"]]
        levels = [level for _, level in kind.parts(cast(Any, known))] if kind.level_names else []
        return BoxTerms(**vars(known.terms(lambda value: value)), levels=levels)


class Slack(NamedTuple):
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
    """Bounds of the coefficients over a box with its half-widths times a scale: `tube.Coefficients` of all its models.
    """

    def __init__(self, unit: ParameterBox, scale: Fraction) -> None:
        self.unit, self.equations, self.count, self.scale = unit, unit.equations, unit.count, ball(scale)
        self.box, self.centre = unit.coefficients(scale), unit.coefficients(scale, at_centre=True)
        self.slopes = [self._direction(j, None) for j in range(self.count)]
        self.changes = [self._direction(j, self.centre) for j in range(self.count)]
        self.top = max(map(magnitude, balls_of(self.box.levels)), default=magnitude(self.equations.stiffness))
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
            m, size, blocks = base.tolist(), base.nrows(), []
            for j in range(self.count):  # the derivative of exp M by u_j is a block of exp [[M, M_j], [0, M]]
                slope = (self._extended(cell, contact, j) * length).tolist()
                both = arb_mat([[*a, *b] for a, b in zip(m, slope, strict=True)] + [[arb(0)] * size + a for a in m])
                blocks.append(block(both.exp(), d, range(size, 2 * size)))
        if whole:
            self.unit.blocks[key] = blocks
        time = ball(cell.start + self.equations.phase) + first * ball(cell.length)
        inputs = [*self.equations.cosines_and_sines(time), arb(1), arb(contact)]
        start = arb_mat(d + len(inputs), 1, [*state.entries(), *inputs])
        return from_columns([(rows * start).entries() for rows in blocks]) * self.scale

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


def shifted(parameters: Mapping[str, Any], changes: Mapping[str, Fraction]) -> dict[str, Any]:
    """The parameters of a certificate with some changed; ``epsj`` is an amplitude of the transmission error."""
    out = {**parameters, "eps": list(parameters["eps"]), "stiffness": dict(parameters["stiffness"])}
    for name, change in changes.items():
        key: Any = int(name[3:]) - 1 if name.startswith("eps") else name
        table = out["eps"] if name.startswith("eps") else out["stiffness"] if name in LEVELS else out
        table[key] = to_text(from_text(table[key]) + change)
    return out


def sizes(numbers: list[Any], by: int | None = None, less: list[Any] | None = None) -> np.ndarray:
    """Upper bounds of the values of numbers, or of their derivatives by a u_j, if wanted less those of others."""
    balls = balls_of(numbers, by)
    differences = balls if less is None else [x - y for x, y in zip(balls, balls_of(less, by), strict=True)]
    return np.array(list(map(magnitude, differences))).reshape(np.shape(np.array(numbers, dtype=object)))


def balls_of(numbers: list[Any], by: int | None = None) -> list[arb]:
    """The values of nested lists of `Dual` one after another, or their derivatives by a u_j."""
    return [x.value if by is None else x.slopes[by] for x in np.array(numbers, dtype=object).flat]
