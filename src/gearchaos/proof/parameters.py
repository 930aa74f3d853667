"""A model as exact numbers: its parameters as a certificate states them, and the coefficients of its equations.

In coordinates w that begin with z and z', while the contact state σ lasts (0 free, 1 front flank, -1 back flank), the
equations (2.12)-(2.18) of ``docs/model.md`` are

    w' = A w + f(τ) - b χ(τ) (z - σ) [σ ≠ 0].

The entries of A and b are rational functions of the parameters and are computed as fractions. The coordinates that do
not act on z are left out where the fractions say so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from gearchaos.errors import InputError
from gearchaos.model import SCALARS, STIFFNESS_FORMS, SUPPORTS, MeshModel, check_is_pair
from gearchaos.proof.balls import ball, from_text, to_text
from gearchaos.proof.verifier import STIFFNESS
from gearchaos.quantities import parse


def check_provable(model: MeshModel) -> None:
    """Raise `InputError` unless the mesh is one spring and its damping acts always, as in the equations of proofs."""
    check_is_pair(model, "a proof")
    model.stiffness.check_one_spring("a proof")
    if model.stiffness.form not in STIFFNESS:
        raise InputError("stiffness", f"must be of a form that can be verified: {', '.join(STIFFNESS)}",
                         model.stiffness.form, "The program that checks certificates reads them in its own way, and "
                         "knows no other: proof/verifier.py. Classify the motion without a proof.")
    if model.law.in_contact or model.law.acts_as:
        raise InputError("damping_law", "must be always for a proof", model.damping_law,
                         "Proofs need a right side that is continuous at a contact switch. Classify the motion of this "
                         "model without a proof, or set damping_law='always', --set damping_law=always, and prove that "
                         "of the model in which the mesh damping also acts across the gap.")


def exact_parameters(model: MeshModel) -> dict[str, Any]:
    """The parameters of a model as they stand in a certificate: every number a string, exactly the float it had.

    They are ``kind``; the parameters of `docs/model.md` by name, those of the supports for ``full`` alone; ``eps`` and
    ``theta``, lists from harmonic 1 on; ``stiffness``, a dict with its ``form`` and values. Raises `InputError` for a
    kind of stiffness that the program which checks certificates does not know, and for damping that ends with contact.
    """
    check_provable(model)

    def text(value: Any) -> Any:
        return [text(v) for v in value] if isinstance(value, tuple) else to_text(Fraction(value))

    names = [n for n in SCALARS if model.kind == "full" or parse(n).family not in SUPPORTS]
    return {
        "kind": model.kind, **{name: text(getattr(model, name)) for name in names},
        "eps": text(model.error.amplitudes), "theta": text(model.error.phases),
        "stiffness": {"form": model.stiffness.form,
                      **{name: text(value) for name, value in model.stiffness.numbers().items()}},
    }


def exact_parts(stiffness: Mapping[str, Any]) -> list[tuple[Fraction, Fraction]]:
    """(start, χ) of each part of a stiffness of a certificate in which it is constant; none for a Fourier stiffness."""
    numbers = {name: [*map(from_text, value)] if isinstance(value, list) else from_text(value)
               for name, value in stiffness.items() if name != "form"}
    return [(Fraction(start), level) for start, level in STIFFNESS_FORMS[stiffness["form"]].parts(numbers)]


_NAMES = {
    2: ("z", "z_dot"), 3: ("z", "z_dot", "x2_dot"), 4: ("z", "z_dot", "y", "y_dot"),
    5: ("z", "z_dot", "x2_dot", "y", "y_dot"), 6: ("z", "z_dot", "y1", "y1_dot", "y2", "y2_dot"),
    7: ("z", "z_dot", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"),
}
"""The coordinates of a state by their number."""


def lifted(points: np.ndarray, wanted: tuple[str, ...]) -> list[list[Fraction]]:
    """Points (n, d) in the coordinates ``wanted`` of some equations, as exact fractions.

    Which coordinates have no effect on z is decided on exact fractions here, elsewhere to rounding. So approximate
    points may lack coordinates of the exact equations: the rotation x2', or y1 and y2 instead of y. A missing rotation
    starts at 0, from where Newton's method finds it; y1 and y2 share y equally. Raises `InputError` if the points do
    not have as many coordinates as a state of the model.
    """
    known = _NAMES.get(points.shape[1], ())
    if known == wanted:
        return [[Fraction(v) for v in row] for row in points.tolist()]
    if not known or known[-1].startswith("y") != wanted[-1].startswith("y"):
        raise InputError("points", f"must have the {len(wanted)} coordinates {', '.join(wanted)}", points.shape)

    def value(name: str, at: dict[str, float]) -> Fraction:
        if name in at:
            return Fraction(at[name])
        if name in ("y", "y_dot"):
            return Fraction(at[f"y1{name[1:]}"]) - Fraction(at[f"y2{name[1:]}"])
        if name[0] == "y":
            return Fraction(at[f"y{name[2:]}"]) / (2 if name[1] == "1" else -2)
        return Fraction(0)

    return [[value(name, dict(zip(known, row, strict=True))) for name in wanted] for row in points.tolist()]


Row = dict[str, Fraction]


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
    """The d coordinates, and the right side of the equation of each.

    A row has the coefficients of the coordinates, of the constant "one", of the "force" χ(τ) f(z), and, in the row of
    z', of "eps_dot"; the term -ε'' of that row is not listed.
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
