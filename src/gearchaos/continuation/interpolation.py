"""The equations of a model along parameters as polynomials of these, on cells.

The arrays of the equations are smooth functions of the parameters, but for a few places. On a cell of parameters they
are interpolated at Chebyshev nodes, which takes one batch of models; an evaluation anywhere in the cell, with
derivatives, then takes no model. A cell where the last coefficients have not fallen to rounding errors is divided.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM 2013.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from gearchaos.errors import InputError
from gearchaos.flow import PeriodEquations, PolynomialEquations, Polynomials

_NODES = 16  # in each direction of a cell
_TAIL = 2  # number of the last coefficients in each direction that must have vanished
_ROUNDING = 2e-14
"""Largest of these, relative to the larger of 1 and the largest value: the equations are dimensionless."""

_LEAST = 0.125  # width of the first cells beside 0, for parameters by which the equations do not divide
_MOST_PARAMETERS = 2  # of a curve; a cell has N^Q nodes
_HALVINGS = 6  # most times that a cell is halved; where that is not enough, the equations are not interpolated


_AT = np.cos(np.pi * np.arange(_NODES) / (_NODES - 1))  # the nodes, with both ends
# All polynomials but the first vanish at −1, so that the equations at the lower ends of a cell are those of the model
# to the bit: a transmission error of 0 is none.
_FROM_LOWER_END = chebvander(_AT, _NODES - 1) - np.append(0.0, (-1.0) ** np.arange(1, _NODES))
_COEFFICIENTS = np.linalg.inv(_FROM_LOWER_END)  # (N, N) coefficients from values at nodes
_COEFFICIENTS[0] = np.arange(_NODES) == _NODES - 1  # the first one is the value at the lower end

Models = Callable[[np.ndarray], PeriodEquations]
"""The equations at values (P, Q) of the parameters; raises `InputError` where there are none."""


class Box(NamedTuple):
    """The corner nearest to −∞ and the widths of a box of Q parameters."""

    low: tuple[float, ...]
    width: tuple[float, ...]

    def part(self, values: list[float], directions: tuple[int, ...]) -> Box:
        """The part with these values, halved in these directions."""
        low, width = list(self.low), list(self.width)
        for i in directions:
            width[i] /= 2
            low[i] += width[i] * (values[i] >= low[i] + width[i])
        return Box(tuple(low), tuple(width))

    @property
    def nodes(self) -> np.ndarray:
        """The values at all nodes, (N^Q, Q)."""
        each = [low + 0.5 * width * (1 + _AT) for low, width in zip(self.low, self.width, strict=True)]
        return np.array(list(product(*each)))


@dataclass(frozen=True, eq=False)
class Cell:
    """A box of parameters on which the equations are polynomials."""

    box: Box
    equations: PolynomialEquations
    accepted: bool  # whether the model accepts the values at its nodes

    def contains(self, values: list[float]) -> bool:
        """Whether values (Q,) lie inside, at no side of it."""
        return all(a < x < a + b for x, a, b in zip(values, *self.box, strict=True))


class Cells:
    """The equations along Q parameters, interpolated where that is exact to rounding errors, for Q of 1 or 2.

    The equations divide by the parameters ``divides`` (Q,), so that their cells begin as octaves.
    """

    def __init__(self, models: Models, check: Callable[[np.ndarray], object], divides: np.ndarray) -> None:
        self._models, self._check, self._divides = models, check, divides.tolist()
        self._found: dict[Box, Cell | tuple[int, ...]] = {}  # a cell, or the directions in which it is divided
        self._last: Cell | None = None

    def cell(self, values: np.ndarray) -> Cell | None:
        """The cell with values (Q,); None where the equations are not interpolated."""
        at, last = values.tolist(), self._last
        if not 0 < len(at) <= _MOST_PARAMETERS:
            return None
        if last is not None and last.contains(at):
            return last
        octaves = [_octave(*each) for each in zip(at, self._divides, strict=True)]
        if None in octaves:
            return None
        box = Box(*zip(*octaves, strict=True))
        least = [width / 2**_HALVINGS for width in box.width]
        while True:
            found = self._found.get(box) or self._found.setdefault(box, self._interpolated(box))
            if isinstance(found, Cell):
                self._last = found
                return found
            if any(box.width[i] <= least[i] for i in found):
                return None
            box = box.part(at, found)

    def _interpolated(self, box: Box) -> Cell | tuple[int, ...]:
        """The cell, or the directions in which it has to be divided."""
        nodes, q = box.nodes, len(box.low)
        everywhere = tuple(range(q))
        try:
            own = self._models(nodes)
        except InputError:
            return everywhere
        columns = np.column_stack([own.parameters, own.starts, own.steps])
        if not np.all(np.isfinite(columns)):
            return everywhere
        coefficients = (columns - columns[-1]).reshape(*[_NODES] * q, -1)
        for i in range(q):
            coefficients = np.moveaxis(np.tensordot(_COEFFICIENTS, coefficients, (1, i)), 0, i)
        most = _ROUNDING * np.maximum(1.0, np.abs(columns).max(axis=0))
        tails = (np.moveaxis(np.abs(coefficients), i, 0)[-_TAIL:] > most for i in range(q))
        rough = tuple(i for i, tail in enumerate(tails) if np.any(tail[..., :-1]))  # steps need not be exact
        low, width = map(np.array, box)
        polynomials = Polynomials(low, width, columns[-1], coefficients.reshape(_NODES**q, -1))
        if rough:
            return rough
        accepted = False
        with suppress(InputError):
            self._check(nodes)
            accepted = True
        return Cell(box, PolynomialEquations(own.first, polynomials), accepted)


def _octave(value: float, divides: bool) -> tuple[float, float] | None:
    """The lower end and the width of the first interval with a value; None if there is none."""
    if not math.isfinite(value) or (divides and value == 0):
        return None
    fraction, exponent = math.frexp(value)
    width = math.ldexp(0.5, exponent)
    if not divides and abs(value) < _LEAST:
        return (0.0 if value >= 0 else -_LEAST), _LEAST
    return (width if fraction > 0 else -2 * width), width
