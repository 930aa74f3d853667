"""The coefficients of the equations of motion over a box of parameters, with their derivatives by the parameters.

A box is p = p0 + D u with |u_j| <= 1; D has the half-widths. Every coefficient is a ball that contains its values over
the box, with balls that contain its derivatives by u_1, ..., u_m there (automatic differentiation).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

import numpy as np
from flint import arb

from gearchaos.model import STIFFNESS_FORMS
from gearchaos.proof.balls import ball, from_text, interval, magnitude
from gearchaos.proof.equations import linear_rows

LEVELS = tuple(name for kind in STIFFNESS_FORMS.values() for name in kind.level_names)


class Dual:
    """A number that depends on u: a ball of its values over the box, and balls of its derivatives."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: arb, slopes: list[arb]) -> None:
        self.value, self.slopes = value, slopes

    def _pair(self, other: Any) -> Dual:
        return other if isinstance(other, Dual) else Dual(_exact(other), [arb(0)] * len(self.slopes))

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


def _exact(value: Any) -> arb:
    """A ball of a number that does not depend on u."""
    return value if isinstance(value, arb) else ball(value)


class _Known:  # stands for `equations._Numbers`
    """The parameters of a model by name, as functions of u."""

    def __init__(self, parameters: Mapping[str, Any], widths: Mapping[str, list[Fraction]], at_centre: bool) -> None:
        self.parameters, self.kind, self.at_centre = parameters, parameters["kind"], at_centre
        self.widths, self.count = widths, len(next(iter(widths.values())))

    def __getitem__(self, name: str) -> Dual:
        stiffness = self.parameters["stiffness"]
        return self.dual(name, from_text(stiffness[name] if name in stiffness else self.parameters[name]))

    def dual(self, name: str, centre: Fraction) -> Dual:
        """The parameter ``name`` with this value at the centre of the box."""
        width = self.widths.get(name, [Fraction(0)] * self.count)
        reach = Fraction(0) if self.at_centre else sum(map(abs, width), Fraction(0))
        value = interval(ball(centre - reach), ball(centre + reach)) if reach else ball(centre)
        return Dual(value, [ball(w) for w in width])


@dataclass(frozen=True)
class Coefficients:
    """The coefficients of w' = A w + constant + Σ (c_j cos 2πjt + s_j sin 2πjt) - b χ (z - σ) [σ ≠ 0], times T.

    Attributes
    ----------
    names : tuple of str
        The d coordinates.
    matrix : (d, d) list of Dual
    spring, constant : (d,) list of Dual
        b, and the constant forcing.
    harmonics : list of (Dual, Dual)
        c_j and s_j, which act on z'.
    levels : list of Dual
        χ in each part of a stiffness whose levels a box can vary; empty for any other.
    """

    names: tuple[str, ...]
    matrix: list[list[Dual]]
    spring: list[Dual]
    constant: list[Dual]
    harmonics: list[tuple[Dual, Dual]]
    levels: list[Dual]


def coefficients(
    parameters: Mapping[str, Any], widths: Mapping[str, list[Fraction]], at_centre: bool = False
) -> Coefficients:
    """The coefficients over a box.

    Parameters
    ----------
    parameters : mapping
        At the centre of the box, as in a certificate.
    widths : mapping of str to list of Fraction
        For each parameter that varies its derivatives by u_1, ..., u_m: usually one half-width, else 0.
    at_centre : bool
        Values and derivatives at the centre alone.
    """
    known = _Known(parameters, widths, at_centre)
    names, rows = linear_rows(cast(Any, known))
    duration = 2 * arb.pi() / known["omega"]
    zero = duration * 0

    def entry(row: str, column: str) -> Dual:
        return zero + duration * rows[row].get(column, Fraction(0))

    kind = STIFFNESS_FORMS[parameters["stiffness"]["form"]]
    levels = [level for _, level in kind.parts(cast(Any, known))] if kind.level_names else []
    return Coefficients(
        names, [[entry(row, column) for column in names] for row in names], [-entry(n, "force") for n in names],
        [entry(n, "one") for n in names], _harmonics(known, duration, rows["z_dot"]["eps_dot"]), levels)


def _harmonics(known: _Known, duration: Dual, damping: Any) -> list[tuple[Dual, Dual]]:
    """Cosine and sine coefficients times T of -ε'' and the damping of ε', for the amplitudes that are not 0."""
    out, amplitudes, phases = [], known.parameters["eps"], known.parameters["theta"]
    for j, (size, angle) in enumerate(zip(amplitudes, phases, strict=True), start=1):
        if not from_text(size):
            continue
        amplitude, rate, turn = duration * known.dual(f"eps{j}", from_text(size)), j * known["omega"], ball(
            from_text(angle))
        cosine, sine = amplitude * turn.cos(), amplitude * turn.sin()
        out.append((rate * (rate * cosine + damping * sine), rate * (rate * sine - damping * cosine)))
    return out


def magnitudes(values: list[Any]) -> np.ndarray:
    """Upper bounds of the absolute values of balls, in the shape of the nested lists."""
    return np.array([magnitudes(v) if isinstance(v, list) else magnitude(v) for v in values])


def value_of(numbers: Any) -> Any:
    """The values of nested lists of `Dual`."""
    return [value_of(v) for v in numbers] if isinstance(numbers, list) else numbers.value


def slope_of(numbers: Any, j: int) -> Any:
    """The derivatives by u_j of nested lists of `Dual`."""
    return [slope_of(v, j) for v in numbers] if isinstance(numbers, list) else numbers.slopes[j]


