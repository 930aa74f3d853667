"""The equations of a periodic orbit along one or two parameters, in the form that `arclength` follows."""

from __future__ import annotations

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, evaluate

_MAX_CHANGE = 0.25
"""Largest change of `_positions` in a step."""


class CycleEquations:
    """Orbits of period n along one parameter: n d equations for n points and the parameter.

    Parameters
    ----------
    family : ParameterFamily
        A model along Q = 1 parameter.
    period : int
        n, in mesh periods.
    span : float
        The change of the parameter that counts as much as a change of all points by one half backlash.
    """

    def __init__(self, family: ParameterFamily, period: int, span: float) -> None:
        self.family, self.period, self.size = family, period, period * family.dimension
        self.weights = np.append(np.full(self.size, 1.0 / period), 1.0 / span**2)

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, Cycle]:
        """The defects of the cycle u, their derivatives, and the cycle."""
        self.family.check(u[None, -1:])
        cycle = evaluate(self.family, u[:-1].reshape(self.period, -1), u[-1:])
        return cycle.defect.ravel(), cycle.jacobian, cycle

    def amplitude(self, u: np.ndarray) -> float:
        """The largest coordinate of the points."""
        return float(np.abs(u[:-1]).max())

    def resolved(self, first: Cycle, last: Cycle) -> bool:
        """Whether the multipliers of two cycles differ so little that no event between them can be overlooked."""
        return bool(np.abs(_positions(first.multipliers) - _positions(last.multipliers)).max() < _MAX_CHANGE)


def _positions(multipliers: np.ndarray) -> np.ndarray:
    """Where the multipliers lie relative to 1, −1 and the unit circle: three numbers from −1 to 1.

    They are Π (μ − 1), Π (μ + 1) and Π (μ_i μ_j − 1), each factor divided by its largest value for this modulus.
    """
    size = 1.0 + np.abs(multipliers)
    i, j = np.triu_indices(len(multipliers), 1)
    products = multipliers[i] * multipliers[j]
    return np.array([
        np.prod((multipliers - 1.0) / size).real, np.prod((multipliers + 1.0) / size).real,
        np.prod((products - 1.0) / (1.0 + np.abs(products))).real,
    ])


def unknowns(cycle: Cycle) -> np.ndarray:
    """The points and parameter values of a cycle as one vector (n d + Q,)."""
    return np.append(cycle.points.ravel(), cycle.values)
