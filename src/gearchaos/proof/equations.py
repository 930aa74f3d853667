"""The equations of motion (2.12)-(2.18) of ``docs/model.md`` with exact coefficients, and their flow in balls.

In coordinates w that begin with z and z', while the contact state σ lasts (0 free, 1 front flank, -1 back flank),

    w' = A w + f(τ) - b χ(τ) (z - σ) [σ ≠ 0].

The entries of A and b are rational functions of the parameters and are computed as fractions. The coordinates that do
not act on z are left out where the fractions say so. Time t is counted in mesh periods from the section.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from flint import arb, arb_mat, ctx

from gearchaos.model import STIFFNESS_FORMS
from gearchaos.proof.balls import ball, from_text, interval, magnitude, norm, precision
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.parameters import exact_parts
from gearchaos.proof.series import Flow, constant_series, fourier_series, with_forcing

_BITS_PER_CELL = 1.1
"""Logarithm to base 2 of the largest growth of errors in a cell."""

_LONGEST_CELL = 0.75
"""Largest norm of the equations times the length of a cell, by which the number of cells is chosen."""

_MOST_CELLS = 2000
"""Most cells of a mesh period."""

Row = dict[str, Fraction]


@dataclass(frozen=True)
class Cell:
    """A part of the mesh period without a jump of the stiffness.

    Attributes
    ----------
    start, length : Fraction
        In mesh periods, the start from the section on.
    level : Fraction or None
        χ, if it is constant.
    begin, end, span : arb
        Balls that contain start, end and length.
    """

    start: Fraction
    length: Fraction
    level: Fraction | None
    begin: arb = field(init=False)
    end: arb = field(init=False)
    span: arb = field(init=False)

    def __post_init__(self) -> None:
        for name, value in (("begin", self.start), ("end", self.start + self.length), ("span", self.length)):
            object.__setattr__(self, name, ball(value))


class MeshEquations:
    """The equations of a mesh, with the flow of each cell of the mesh period computed when it is first needed.

    All numbers have the precision that was set when the equations were made (`balls.precision`); use them with it.

    Parameters
    ----------
    parameters : mapping
        As in a certificate, see `parameters.exact_parameters`.
    phase : Fraction
        Time of the section, in mesh periods after τ = 0, in [0, 1).
    bits : int
        The precision that results should have, at most the one that is set.

    Attributes
    ----------
    names : tuple of str
        The d coordinates.
    dimension : int
        d.
    duration : arb
        The mesh period T = 2π/ω.
    cells : list of Cell
        The parts of the mesh period in order of time.
    matrix : arb_mat
        T A, (d, d).
    spring : arb_mat
        T b, (d, 1).
    norms : (float, float)
        Upper bounds of the norms of ``matrix`` and ``spring``.
    stiffness : arb
        The interval from 0 to an upper bound of χ.
    """

    def __init__(self, parameters: Mapping[str, Any], phase: Fraction = Fraction(0), bits: int = 128) -> None:
        self.bits, self.phase, self.parameters = bits, phase, parameters
        known = _Numbers(parameters)
        self.names, self._rows = linear_rows(known)
        self.dimension = len(self.names)
        self.duration = 2 * arb.pi() / ball(known["omega"])
        self.matrix = self.duration * arb_mat(
            self.dimension, self.dimension,
            [ball(self._rows[row].get(column, Fraction(0))) for row in self.names for column in self.names])
        self.spring = self.duration * arb_mat(self.dimension, 1, [-ball(self._rows[n]["force"]) for n in self.names])
        self.norms = norm(self.matrix), norm(self.spring)
        self._constant = [ball(self._rows[n]["one"]) * self.duration for n in self.names]
        self.harmonics, self._forcing = _forcing(known, self._rows["z_dot"], self.duration)
        self._chi = _fourier(known)
        levels = _levels(known)
        top = max((level for _, level in levels), default=Fraction(1)) + sum(abs(a) for _, a, _ in self._chi)
        self.stiffness = interval(0, ball(top))
        self.cells = _cells(levels, phase, self._rate(top))
        self._tables: dict[Any, Any] = {}
        self._flows: dict[tuple[int, int], Flow] = {}

    def _rate(self, top: Fraction) -> float:
        """About the largest rate of the flow per mesh period, by which the cells are made short enough."""
        size = max(sum(abs(v) for n, v in row.items() if n in self.names) + abs(row["force"]) * top
                   for row in self._rows.values())
        highest = max([*self.harmonics, *(j for j, _, _ in self._chi), 1])
        return max(float(self.duration) * float(size), 2 * math.pi * highest)

    def flow(self, cell: int, contact: int) -> Flow:
        """The flow from the start of a cell on while the contact state ``contact`` (0, 1, -1) lasts."""
        key = cell, contact
        if key not in self._flows:
            self._flows[key] = self._make_flow(self.cells[cell], contact)
        return self._flows[key]

    def _make_flow(self, cell: Cell, contact: int) -> Flow:
        """The flow of a cell: from the Taylor series of its level, or from that of a Fourier stiffness."""
        angles = self._cosines_and_sines(cell.start + self.phase)
        if contact and cell.level is None:
            rows = fourier_series(
                self.matrix * cell.span, self.spring * cell.span, self._stiffness_terms(cell),
                self._constant_and_forcing(cell), contact, angles, ctx.prec)
            return Flow(rows)
        key = cell.length, bool(contact), cell.level if contact else None
        if key not in self._tables:
            self._tables[key] = constant_series(self._extended(cell, contact), self.dimension, ctx.prec)
        return Flow(with_forcing(self._tables[key], self.dimension, [*angles, arb(1), arb(contact)]))

    def _extended(self, cell: Cell, contact: int) -> arb_mat:
        """The matrix of the equations of w, cos 2πjt, sin 2πjt, 1 and the flank σ, times the length of a cell.

        With cosine and sine of the harmonics as further unknowns the equations are autonomous.
        """
        d, h = self.dimension, len(self.harmonics)
        size = d + 2 * h + 2
        out = arb_mat(size, size)
        for i in range(d):
            for j in range(d):
                out[i, j] = self.matrix[i, j]
            out[i, size - 2] = self._constant[i]
            if contact:
                push = self.spring[i, 0] * ball(cell.level or Fraction(0))
                out[i, 0] -= push
                out[i, size - 1] = push
        for n, (j, (cosine, sine)) in enumerate(zip(self.harmonics, self._forcing, strict=True)):
            at, turn = d + 2 * n, 2 * arb.pi() * j
            out[1, at], out[1, at + 1] = cosine, sine
            out[at, at + 1], out[at + 1, at] = -turn, turn
        return out * cell.span

    def _constant_and_forcing(self, cell: Cell) -> tuple[list[arb], list[tuple[arb, arb, arb]]]:
        """The forcing in a cell: the constants (d), and (angle per cell, cosine, sine coefficient) of each harmonic."""
        length = cell.span
        terms = [(2 * arb.pi() * j * length, c * length, s * length)
                 for j, (c, s) in zip(self.harmonics, self._forcing, strict=True)]
        return [value * length for value in self._constant], terms

    def _stiffness_terms(self, cell: Cell) -> list[tuple[arb, arb, arb]]:
        """(angle per cell, cosine and sine coefficient) of the harmonics of a Fourier stiffness in a cell."""
        start = ball(cell.start + self.phase)
        out = []
        for j, amplitude, angle in self._chi:
            shift = 2 * arb.pi() * j * start - ball(angle)
            size = ball(amplitude)
            out.append((2 * arb.pi() * j * cell.span, size * shift.cos(), -size * shift.sin()))
        return out

    def _cosines_and_sines(self, time: Fraction) -> list[arb]:
        """cos 2πjt and sin 2πjt of the harmonics at a time from τ = 0 on."""
        out: list[arb] = []
        for j in self.harmonics:
            sine, cosine = (2 * j * ball(time)).sin_cos_pi()
            out += [cosine, sine]
        return out

    def forcing_over(self, low: arb, high: arb) -> list[arb]:
        """T f(τ) as balls (d) that contain its values from time ``low`` to ``high`` after the section."""
        out = list(self._constant)
        time = interval(low, high) + ball(self.phase)
        for j, (cosine, sine) in zip(self.harmonics, self._forcing, strict=True):
            s, c = (2 * j * time).sin_cos_pi()
            out[1] += cosine * c + sine * s
        return out

    def forcing_change(self, tolerances: Mapping[int, Fraction]) -> float:
        """Upper bound of the change of T f(τ), all of it in z'', if the amplitude of each harmonic j of ε changes.

        Parameters
        ----------
        tolerances : mapping of int to Fraction
            The largest change of each amplitude ε_j.
        """
        damping, change = abs(ball(self._rows["z_dot"]["eps_dot"])), arb(0)
        for j, size in tolerances.items():
            rate = 2 * arb.pi() * j / self.duration
            change += self.duration * rate * (rate + damping) * ball(size)
        return magnitude(change)


def equations_at(parameters: Mapping[str, Any], phase: Fraction, bits: int) -> tuple[MeshEquations, int]:
    """Equations for results of a precision, and the precision in bits at which they are to be used.

    Rounding errors grow with the norm of each cell, by a little more than a bit.
    """
    with precision(bits):
        working = bits + math.ceil(_BITS_PER_CELL * len(MeshEquations(parameters, phase, bits).cells))
    with precision(working):
        return MeshEquations(parameters, phase, bits), working


class _Numbers:
    """The parameters of a certificate as fractions by name."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters = parameters
        self.kind: str = parameters["kind"]

    def __getitem__(self, name: str) -> Fraction:
        return from_text(self.parameters[name])

    def series(self, amplitudes: list[str], phases: list[str]) -> list[tuple[int, Fraction, Fraction]]:
        """(j, amplitude, phase) of the harmonics of a Fourier series whose amplitude is not 0."""
        values = zip(map(from_text, amplitudes), map(from_text, phases), strict=True)
        return [(j, a, p) for j, (a, p) in enumerate(values, start=1) if a]


def linear_rows(known: _Numbers) -> tuple[tuple[str, ...], dict[str, Row]]:
    """The coordinates and the equation of each.

    Returns
    -------
    tuple of str
        The d coordinates.
    dict of str to Row
        The right side of each: coefficients of the coordinates, of the constant "one", of the "force" χ(τ) f(z), and,
        in the row of z', of "eps_dot"; the term -ε'' of that row is not listed.
    """
    rows: dict[str, Row] = {"z": {"z_dot": Fraction(1)}}
    J1, J2 = known["J1"], known["J2"]
    force, rows["z_dot"] = -(1 / J1 + 1 / J2), {"one": known["q1"] / J1 + known["q2"] / J2}
    friction1, friction2 = 2 * known["beta1"] / J1, 2 * known["beta2"] / J2
    lateral = _supports(known)
    rows["z_dot"]["z_dot"] = rows["z_dot"]["eps_dot"] = -friction1
    for name, sign, stiffness, damping, share in lateral:
        rows["z_dot"][f"{name}_dot"] = sign * (friction1 - damping)
        rows["z_dot"][name] = -sign * stiffness
        force -= share
    if friction1 != friction2:
        rows["z_dot"]["x2_dot"] = friction2 - friction1
        rows["x2_dot"] = {"x2_dot": -friction2, "one": -known["q2"] / J2, "force": 1 / J2}
    for name, sign, stiffness, damping, share in lateral:
        rows[name] = {f"{name}_dot": Fraction(1)}
        rows[f"{name}_dot"] = {name: -stiffness, f"{name}_dot": -damping, "force": -sign * share}
    rows["z_dot"]["force"] = force
    for row in rows.values():  # the mesh force is 2ζz' + χ f(z)
        row.setdefault("force", Fraction(0))
        row.setdefault("one", Fraction(0))
        if row["force"]:
            row["z_dot"] = row.get("z_dot", Fraction(0)) + 2 * known["zeta"] * row["force"]
    return tuple(rows), rows


def _supports(known: _Numbers) -> list[tuple[str, int, Fraction, Fraction, Fraction]]:
    """The lateral coordinates: name, sign in y1 - y2, stiffness and damping over mass, share of the mesh force."""
    if known.kind != "full":
        return []
    wheels = []
    for n, sign in (("1", 1), ("2", -1)):
        mass = known[f"mu{n}"]
        wheels.append((f"y{n}", sign, known[f"kappa{n}"] / mass, 2 * known[f"zeta_support{n}"], 1 / mass))
    first, second = wheels
    if first[2:4] == second[2:4]:
        return [("y", 1, first[2], first[3], first[4] + second[4])]
    return wheels


def _forcing(known: _Numbers, row: Row, duration: arb) -> tuple[list[int], list[tuple[arb, arb]]]:
    """The harmonics in the row of z', and their cosine and sine coefficients times T: of -ε'' and of ε'."""
    orders, out = [], []
    for j, size, angle in known.series(known.parameters["eps"], known.parameters["theta"]):
        rate, amplitude = ball(j * known["omega"]), ball(size) * duration
        cosine, sine = amplitude * ball(angle).cos(), amplitude * ball(angle).sin()
        damping = ball(row["eps_dot"])
        orders.append(j)
        out.append((rate * (rate * cosine + damping * sine), rate * (rate * sine - damping * cosine)))
    return orders, out


def _fourier(known: _Numbers) -> list[tuple[int, Fraction, Fraction]]:
    """(j, c_j, α_j) of a Fourier stiffness; empty for any other."""
    stiffness = known.parameters["stiffness"]
    families = [q.name for q in STIFFNESS_FORMS[stiffness["form"]].families]
    return known.series(*(stiffness[name] for name in families)) if families else []


def _levels(known: _Numbers) -> list[tuple[Fraction, Fraction]]:
    """(start in mesh periods from τ = 0, χ) of the levels of the stiffness; empty for a Fourier stiffness."""
    parts = exact_parts(known.parameters["stiffness"])
    ends = [*(start for start, _ in parts[1:]), Fraction(1)]
    return [part for part, end in zip(parts, ends, strict=False) if part[0] < end]


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
