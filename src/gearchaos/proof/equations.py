"""The flow of the equations of motion in balls.

For the equations see `parameters`. Time t is counted in mesh periods from the section.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb, arb_mat, ctx

from gearchaos.model import STIFFNESS_FORMS
from gearchaos.proof.balls import ball, interval, magnitude, norm, precision
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.parameters import Numbers, exact_parts
from gearchaos.proof.series import Flow, constant_series, fourier_series, with_forcing

_BITS_PER_CELL = 1.1  # logarithm to base 2 of the largest growth of errors in a cell
_LONGEST_CELL = 0.75  # largest norm of the equations times the length of a cell, by which the number of cells is chosen
_MOST_CELLS = 2000  # most cells of a mesh period


@dataclass(frozen=True)
class Cell:
    """A part of the mesh period without a jump of the stiffness; times are in mesh periods from the section on."""

    start: Fraction
    length: Fraction
    level: Fraction | None  # χ, if it is constant
    begin: arb = field(init=False)  # balls that contain start, end and length
    end: arb = field(init=False)
    span: arb = field(init=False)

    def __post_init__(self) -> None:
        for name, value in (("begin", self.start), ("end", self.start + self.length), ("span", self.length)):
            object.__setattr__(self, name, ball(value))


class MeshEquations:
    """The equations of a mesh, with the flow of each cell of the mesh period computed when it is first needed.

    All numbers have the precision that was set when the equations were made (`balls.precision`); use them with it.

    ``parameters`` are those of a certificate, see `parameters.exact_parameters`. ``phase`` is the time of the section
    in mesh periods after τ = 0, in [0, 1). ``bits`` is the precision that results should have, at most the one that is
    set. ``duration`` is the mesh period T = 2π/ω, ``stiffness`` the interval from 0 to an upper bound of χ.
    """

    def __init__(self, parameters: Mapping[str, Any], phase: Fraction = Fraction(0), bits: int = 128) -> None:
        self.bits, self.phase, self.parameters = bits, phase, parameters
        known = Numbers(parameters)
        terms = known.terms(ball)
        self.names, self._rows, self.dimension = terms.names, terms.rows, len(terms.names)
        self.duration = terms.duration
        self.matrix = arb_mat(terms.matrix)  # T A, (d, d)
        self.spring = arb_mat([[value] for value in terms.spring])  # T b, (d, 1)
        self.norms = norm(self.matrix), norm(self.spring)
        self._constant, self.harmonics, self._forcing = terms.constant, terms.harmonics, terms.forcing
        stiffness = known.parameters["stiffness"]
        families = [q.name for q in STIFFNESS_FORMS[stiffness["form"]].families]
        # (j, c_j, α_j) of a Fourier stiffness; (start in mesh periods from τ = 0, χ) of the levels of any other
        self._chi = known.series(*(stiffness[name] for name in families)) if families else []
        parts = exact_parts(stiffness)
        ends = [*(start for start, _ in parts[1:]), Fraction(1)]
        levels = [part for part, end in zip(parts, ends, strict=False) if part[0] < end]
        top = max((level for _, level in levels), default=Fraction(1)) + sum(abs(a) for _, a, _ in self._chi)
        self.stiffness = interval(0, ball(top))
        size = max(sum(abs(v) for n, v in row.items() if n in self.names) + abs(row["force"]) * top
                   for row in self._rows.values())
        highest = max([*self.harmonics, *(j for j, _, _ in self._chi), 1])
        self.cells = _cells(levels, phase, max(float(self.duration) * float(size), 2 * math.pi * highest))
        self._tables: dict[Any, Any] = {}
        self._flows: dict[tuple[int, int], Flow] = {}

    def flow(self, cell: int, contact: int) -> Flow:
        """The flow from the start of a cell on while the contact state ``contact`` (0, 1, -1) lasts."""
        key = cell, contact
        if key not in self._flows:
            make = self._fourier_flow if contact and self.cells[cell].level is None else self._constant_flow
            self._flows[key] = make(self.cells[cell], contact)
        return self._flows[key]

    def _constant_flow(self, cell: Cell, contact: int) -> Flow:
        """The flow of a cell from the Taylor series of its level, which is computed once for cells alike."""
        key = cell.length, bool(contact), cell.level if contact else None
        if key not in self._tables:
            push = [self.spring[i, 0] * ball(cell.level or Fraction(0)) for i in range(self.dimension)]
            matrix = autonomous_matrix(self.matrix, self._constant, push if contact else None, self.harmonics,
                                       self._forcing)
            self._tables[key] = constant_series(matrix * cell.span, self.dimension, ctx.prec)
        inputs = [*self.cosines_and_sines(ball(cell.start + self.phase)), arb(1), arb(contact)]
        return Flow(with_forcing(self._tables[key], self.dimension, inputs))

    def _fourier_flow(self, cell: Cell, contact: int) -> Flow:
        """The flow of a cell in contact under a Fourier stiffness."""
        length, start, chi = cell.span, ball(cell.start + self.phase), []
        for j, amplitude, angle in self._chi:
            shift, size = 2 * arb.pi() * j * start - ball(angle), ball(amplitude)
            chi.append((2 * arb.pi() * j * length, size * shift.cos(), -size * shift.sin()))
        terms = [(2 * arb.pi() * j * length, c * length, s * length)
                 for j, (c, s) in zip(self.harmonics, self._forcing, strict=True)]
        return Flow(fourier_series(
            self.matrix * length, self.spring * length, chi, ([value * length for value in self._constant], terms),
            contact, self.cosines_and_sines(start), ctx.prec))

    def cosines_and_sines(self, time: arb) -> list[arb]:
        """cos 2πjt and sin 2πjt of the harmonics at a time from τ = 0 on."""
        pairs = ((2 * j * time).sin_cos_pi() for j in self.harmonics)
        return [value for sine, cosine in pairs for value in (cosine, sine)]

    def forcing_over(self, low: arb, high: arb) -> list[arb]:
        """T f(τ) as balls (d) that contain its values from time ``low`` to ``high`` after the section."""
        return self.forcing_of(self._constant, self._forcing, low, high)

    def forcing_of(self, constant: list[arb], forcing: Iterable[tuple[arb, arb]], low: arb, high: arb) -> list[arb]:
        """As `forcing_over`, with other constants and other cosine and sine coefficients of the harmonics."""
        out, waves = list(constant), self.cosines_and_sines(interval(low, high) + ball(self.phase))
        for (cosine, sine), c, s in zip(forcing, waves[::2], waves[1::2], strict=True):
            out[1] += cosine * c + sine * s
        return out

    def forcing_change(self, tolerances: Mapping[int, Fraction]) -> float:
        """Upper bound of the change of T f(τ), all of it in z'', if no ε_j changes by more than its tolerance."""
        damping, change = abs(ball(self._rows["z_dot"]["eps_dot"])), arb(0)
        for j, size in tolerances.items():
            rate = 2 * arb.pi() * j / self.duration
            change += self.duration * rate * (rate + damping) * ball(size)
        return magnitude(change)


def autonomous_matrix(matrix: arb_mat, constant: list[arb], push: list[arb] | None, harmonics: list[int],
                      forcing: Iterable[tuple[arb, arb]], turning: bool = True) -> arb_mat:
    """The matrix of the equations of w, cos 2πjt, sin 2πjt, 1 and the flank σ.

    With cosine and sine of the harmonics as further unknowns the equations are autonomous. ``matrix`` (d, d) is without
    the force of the teeth, ``push`` is b χ in contact, and ``forcing`` has the coefficients of cosine and sine in the
    row of z'. ``turning`` is False for a derivative by a parameter: cosine and sine depend on none.
    """
    d, h = matrix.nrows(), len(harmonics)
    out = arb_mat(d + 2 * h + 2, d + 2 * h + 2)
    for i, row in enumerate(matrix.tolist()):
        for j, value in enumerate(row):
            out[i, j] = value
        out[i, d + 2 * h] = constant[i]
        if push is not None:
            out[i, 0] -= push[i]
            out[i, d + 2 * h + 1] = push[i]
    for n, (order, (cosine, sine)) in enumerate(zip(harmonics, forcing, strict=True)):
        at, turn = d + 2 * n, 2 * arb.pi() * order
        out[1, at], out[1, at + 1] = cosine, sine
        if turning:
            out[at, at + 1], out[at + 1, at] = -turn, turn
    return out


def equations_at(parameters: Mapping[str, Any], phase: Fraction, bits: int) -> tuple[MeshEquations, int]:
    """Equations for results of a precision, and the precision in bits at which they are to be used.

    Rounding errors grow with the norm of each cell, by a little more than a bit.
    """
    with precision(bits):
        working = bits + math.ceil(_BITS_PER_CELL * len(MeshEquations(parameters, phase, bits).cells))
    with precision(working):
        return MeshEquations(parameters, phase, bits), working


def _cells(levels: list[tuple[Fraction, Fraction]], phase: Fraction, rate: float) -> list[Cell]:
    """The cells of a mesh period that begins at a phase: each level in equal parts.

    Raises `UndecidedError` where there would be too many.
    """
    starts = sorted(((start - phase) % 1, level) for start, level in levels)
    pieces: list[tuple[Fraction, Fraction | None]] = [*starts]
    if not starts or starts[0][0] > 0:
        pieces.insert(0, (Fraction(0), starts[-1][1] if starts else None))
    if not rate / _LONGEST_CELL + len(pieces) < _MOST_CELLS:
        raise UndecidedError("too many steps", _MOST_CELLS - rate / _LONGEST_CELL - len(pieces))
    cells = []
    for (start, level), end in zip(pieces, [*(s for s, _ in pieces[1:]), Fraction(1)], strict=True):
        count = max(1, math.ceil(float(end - start) * rate / _LONGEST_CELL))
        step = (end - start) / count
        cells += [Cell(start + i * step, step, level) for i in range(count)]
    return cells
