"""Boxes of parameters, and the coefficients of the equations of motion over them with their derivatives.

A box is p = p0 + D u with |u_j| <= 1; D has the half-widths. Every coefficient is a ball that contains its values over
the box, with balls that contain its derivatives by u_1, ..., u_m there (automatic differentiation).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, cast

import numpy as np
from flint import arb, arb_mat

from gearchaos.errors import InputError
from gearchaos.model import STIFFNESS_FORMS
from gearchaos.proof.balls import ball, from_text, interval, magnitude, to_text
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations, Numbers, Terms

LEVELS = tuple(name for kind in STIFFNESS_FORMS.values() for name in kind.level_names)


class Dual:
    """A number that depends on u: a ball of its values over the box, and balls of its derivatives."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: arb, slopes: list[arb]) -> None:
        self.value, self.slopes = value, slopes

    def _pair(self, other: Any) -> Dual:
        if isinstance(other, Dual):
            return other
        return Dual(other if isinstance(other, arb) else ball(other), [arb(0)] * len(self.slopes))

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
    """The parameters of a model by name, as functions of u.

    ``parameters`` are those at the centre of the box, as in a certificate. ``widths`` has for each parameter that
    varies its derivatives by u_1, ..., u_m: usually one half-width, else 0. With ``at_centre``, values and derivatives
    are those at the centre alone.
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
    """The models p0 + D u about that of some equations.

    Parameters
    ----------
    equations : MeshEquations
        At the centre.
    widths : list of dict
        For each u_j the parameters that it changes, with their half-widths.

    Attributes
    ----------
    count : int
        Number m of the u_j.
    centre : BoxTerms
        At the centre, with the half-widths for the derivatives.
    blocks : dict
        Derivatives of the flows of whole cells by u_j, by length, contact state and level.

    Raises
    ------
    InputError
        If an amplitude of the transmission error that varies is 0 at the centre.
    UndecidedError
        If the motions of the box need other coordinates than those at its centre.
    """

    def __init__(self, equations: MeshEquations, widths: list[dict[str, Fraction]]) -> None:
        self.equations, self.widths, self.count = equations, widths, len(widths)
        self.blocks: dict[Any, list[arb_mat]] = {}
        varied = {name for together in widths for name in together}
        present = {f"eps{j}" for j in equations.harmonics}  # the equations at the centre leave out the others
        for name in sorted(name for name in varied - present if name.startswith("eps")):
            raise InputError(name, "must not be 0 at the centre of the box", 0.0,
                             "Another width or value moves the centre of the interval of an event.")
        if self.coefficients(Fraction(1)).names != equations.names:
            raise UndecidedError("coordinates not the same", 0.0)
        self.centre = self.coefficients(Fraction(1), at_centre=True)

    def coefficients(self, scale: Fraction, *, at_centre: bool = False) -> BoxTerms:
        """The coefficients over the box with its half-widths times ``scale``, or at its centre with these."""
        names = dict.fromkeys(name for together in self.widths for name in together)
        slopes = {name: [together.get(name, Fraction(0)) * scale for together in self.widths] for name in names}
        known = VariedNumbers(self.equations.parameters, slopes, at_centre)
        kind = STIFFNESS_FORMS[known.parameters["stiffness"]["form"]]
        levels = [level for _, level in kind.parts(cast(Any, known))] if kind.level_names else []
        return BoxTerms(**vars(known.terms(lambda value: value)), levels=levels)


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
