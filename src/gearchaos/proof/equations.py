"""The equations of motion (2.12)-(2.18) of ``docs/model.md`` with exact coefficients, and their flow in balls.

In coordinates w that begin with z and z', while the contact state σ lasts (0 free, 1 front flank, -1 back flank),

    w' = A w + f(τ) - b χ(τ) (z - σ) [σ ≠ 0].

The entries of A and b are rational functions of the parameters and are computed as fractions. The coordinates that do
not act on z are left out where the fractions say so. Time t is counted in mesh periods from the section.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
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
    set.

    Attributes
    ----------
    names : tuple of str
        The d coordinates; ``dimension`` is d.
    duration : arb
        The mesh period T = 2π/ω.
    cells : list of Cell
        The parts of the mesh period in order of time.
    matrix, spring : arb_mat
        T A, (d, d), and T b, (d, 1).
    norms : (float, float)
        Upper bounds of the norms of ``matrix`` and ``spring``.
    stiffness : arb
        The interval from 0 to an upper bound of χ.
    """

    def __init__(self, parameters: Mapping[str, Any], phase: Fraction = Fraction(0), bits: int = 128) -> None:
        self.bits, self.phase, self.parameters = bits, phase, parameters
        known = Numbers(parameters)
        terms = known.terms(ball)
        self.names, self._rows, self.dimension = terms.names, terms.rows, len(terms.names)
        self.duration = terms.duration
        self.matrix = arb_mat(terms.matrix)
        self.spring = arb_mat([[value] for value in terms.spring])
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
            shift = 2 * arb.pi() * j * start - ball(angle)
            size = ball(amplitude)
            chi.append((2 * arb.pi() * j * length, size * shift.cos(), -size * shift.sin()))
        terms = [(2 * arb.pi() * j * length, c * length, s * length)
                 for j, (c, s) in zip(self.harmonics, self._forcing, strict=True)]
        return Flow(fourier_series(
            self.matrix * length, self.spring * length, chi, ([value * length for value in self._constant], terms),
            contact, self.cosines_and_sines(start), ctx.prec))

    def cosines_and_sines(self, time: arb) -> list[arb]:
        """cos 2πjt and sin 2πjt of the harmonics at a time from τ = 0 on."""
        out: list[arb] = []
        for j in self.harmonics:
            sine, cosine = (2 * j * time).sin_cos_pi()
            out += [cosine, sine]
        return out

    def forcing_over(self, low: arb, high: arb) -> list[arb]:
        """T f(τ) as balls (d) that contain its values from time ``low`` to ``high`` after the section."""
        return self.forcing_of(self._constant, self._forcing, low, high)

    def forcing_of(
        self, constant: list[arb], forcing: Iterable[tuple[arb, arb]], low: arb, high: arb
    ) -> list[arb]:
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


def autonomous_matrix(
    matrix: arb_mat, constant: list[arb], push: list[arb] | None, harmonics: list[int],
    forcing: Iterable[tuple[arb, arb]], turning: bool = True,
) -> arb_mat:
    """The matrix of the equations of w, cos 2πjt, sin 2πjt, 1 and the flank σ.

    With cosine and sine of the harmonics as further unknowns the equations are autonomous. ``matrix`` (d, d) is without
    the force of the teeth, ``push`` is b χ in contact, and ``forcing`` has the coefficients of cosine and sine in the
    row of z'. ``turning`` is False for a derivative by a parameter: cosine and sine depend on none.
    """
    d, h = matrix.nrows(), len(harmonics)
    out = arb_mat(d + 2 * h + 2, d + 2 * h + 2)
    for i in range(d):
        for j in range(d):
            out[i, j] = matrix[i, j]
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


@dataclass(frozen=True)
class Terms:
    """The coefficients of w' = A w + constant + Σ (c_j cos 2πjt + s_j sin 2πjt) - b χ (z - σ) [σ ≠ 0], times T.

    They are balls, or where parameters vary functions of these (`families.coefficients.Dual`).
    """

    names: tuple[str, ...]  # the d coordinates
    rows: dict[str, Row]  # see `linear_rows`
    duration: Any  # T
    matrix: list[list[Any]]  # A, (d, d)
    spring: list[Any]  # b, (d,)
    constant: list[Any]  # (d,)
    harmonics: list[int]  # j
    forcing: list[tuple[Any, Any]]  # c_j and s_j, which act on z'


class Numbers:
    """The parameters of a certificate by name, as fractions."""

    def __init__(self, parameters: Mapping[str, Any]) -> None:
        self.parameters = parameters
        self.kind: str = parameters["kind"]

    def __getitem__(self, name: str) -> Any:
        return from_text(self.parameters[name])

    def amplitude(self, j: int, value: Fraction) -> Any:
        """The amplitude of harmonic j of the transmission error, from its value in the certificate."""
        return value

    def series(self, amplitudes: list[str], phases: list[str]) -> list[tuple[int, Fraction, Fraction]]:
        """(j, amplitude, phase) of the harmonics of a Fourier series whose amplitude is not 0."""
        values = zip(map(from_text, amplitudes), map(from_text, phases), strict=True)
        return [(j, a, p) for j, (a, p) in enumerate(values, start=1) if a]

    def terms(self, number: Callable[[Any], Any]) -> Terms:
        """The coefficients; ``number`` makes of a parameter, or what was computed of some, a number to compute with."""
        names, rows = linear_rows(self)
        duration = 2 * arb.pi() / number(self["omega"])

        def entry(row: str, column: str) -> Any:
            return duration * number(rows[row].get(column, Fraction(0)))

        harmonics, forcing = [], []  # of -ε'' and of the damping of ε'
        for j, size, angle in self.series(self.parameters["eps"], self.parameters["theta"]):
            rate, amplitude = number(j * self["omega"]), duration * number(self.amplitude(j, size))
            cosine, sine = amplitude * ball(angle).cos(), amplitude * ball(angle).sin()
            damping = number(rows["z_dot"]["eps_dot"])
            harmonics.append(j)
            forcing.append((rate * (rate * cosine + damping * sine), rate * (rate * sine - damping * cosine)))
        return Terms(names, rows, duration, [[entry(row, column) for column in names] for row in names],
                     [-entry(name, "force") for name in names], [entry(name, "one") for name in names], harmonics,
                     forcing)


def linear_rows(known: Numbers) -> tuple[tuple[str, ...], dict[str, Row]]:
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
    wheels = []  # name, sign in y1 - y2, stiffness and damping over mass, share of the mesh force
    for n, sign in (("1", 1), ("2", -1)) if known.kind == "full" else ():
        mass = known[f"mu{n}"]
        wheels.append((f"y{n}", sign, known[f"kappa{n}"] / mass, 2 * known[f"zeta_support{n}"], 1 / mass))
    if wheels and wheels[0][2:4] == wheels[1][2:4]:  # y = y1 - y2 alone acts on z
        lateral = [("y", 1, *wheels[0][2:4], wheels[0][4] + wheels[1][4])]
    else:
        lateral = wheels
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
