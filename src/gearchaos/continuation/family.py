"""A model with some of its parameters as variables: its equations and their derivatives by these parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from gearchaos.continuation.arclength import LIMITS
from gearchaos.continuation.interpolation import Cell, Cells
from gearchaos.flow import (
    CorrectedOrbit,
    CriticalMultiplier,
    DifferencedFlow,
    ExactFlow,
    PeriodEquations,
    SensitivityFlow,
    TouchingExtremum,
    compile_corrections,
    differentiate,
)
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.coordinates import initial_state, to_physical, transmission_error_at_start
from gearchaos.model.switched import SwitchedAffine, coordinates, switched_system
from gearchaos.quantities import find

_STENCIL = np.array([0, -3, -2, -1, 1, 2, 3])
_WEIGHTS = np.array([0, -1, 9, -45, 45, -9, 1]) / 60
"""Central differences of sixth order. The arrays of a system are polynomials, sines or simple fractions of each
parameter, so that the differences are exact to about 1e-12."""

_STEP = 5e-3  # step of the differences of equations, relative to the parameter
_FLOW_STEP = 1e-5  # step of the differences of motions, which are smooth only between changes of their contacts

_LEAST = 0.1
"""Least magnitude to which the step is relative, for parameters by which the equations do not divide; the largest is 1,
since a phase of any size is an argument of sines."""

PeriodFlow: TypeAlias = SensitivityFlow | DifferencedFlow
"""The flow over one mesh period with derivatives, for one spring or for several contacts."""


class ParameterFamily:
    """A model, with its initial values, along Q parameters ``axes``, named as in `MeshModel.with_values`; Q may be 0.

    ``names`` are the d coordinates of the dynamic state, the same along the whole axes. They are given if they are
    those of a family along more axes.
    """

    def __init__(self, model: MeshModel, axes: Sequence[str], names: tuple[str, ...] | None = None) -> None:
        self.model, self.axes = model, tuple(axes)
        points = self._stencil(self.start[None], _STEP)[0] if self.axes else self.start[None]
        self.names = coordinates(self.batch(points)) if names is None else names
        if not self._several:
            compile_corrections(self.system(self.start[None]))

    @cached_property
    def start(self) -> np.ndarray:
        """The model's own values of the parameters, (Q,); the value of wheel 1 for a pair with different ones."""
        own = [self.model.value(name) for name in self.axes]
        first = [self.model.value(self.model.set_by(name)[0]) for name in self.axes]
        return np.array([b if a is None else a for a, b in zip(own, first, strict=True)], dtype=float)

    @property
    def dimension(self) -> int:
        """Number of coordinates of the dynamic state, d."""
        return len(self.names)

    def at(self, values: np.ndarray) -> MeshModel:
        """The model at values (Q,) of the parameters."""
        return self.model.with_values(dict(zip(self.axes, map(float, values), strict=True)))

    def check(self, values: np.ndarray) -> None:
        """Raise `InputError` if the model does not accept these values, (P, Q)."""
        cells = map(self.cell, values)
        if not all(cell is not None and cell.accepted for cell in cells):
            self._check(values)

    def _check(self, values: np.ndarray) -> None:
        vary(self.model, dict(zip(self.axes, values.T, strict=True)))

    def initial_states(self, values: np.ndarray) -> np.ndarray:
        """The initial states of the model (P, d) at values (P, Q)."""
        batch = self.batch(values)
        return initial_state(batch, switched_system(batch, self.names))

    def states_of(self, values: np.ndarray, initial: Mapping[str, np.ndarray]) -> np.ndarray:
        """The dynamic states (d, L) with these initial values, each (L,), at values (Q,)."""
        batch = vary(replace(self.at(values), initial={}), initial)
        return initial_state(batch, switched_system(batch, self.names)).T.copy()

    def exact_flow(self, values: np.ndarray) -> ExactFlow:
        """The exact flow at values (P, Q)."""
        return ExactFlow(self.system(values))

    def system(self, values: np.ndarray) -> SwitchedAffine:
        """The equations at values (P, Q)."""
        return switched_system(self.batch(values), self.names)

    def flow(self, values: np.ndarray) -> PeriodFlow:
        """The exact flow at values (1, Q), with derivatives by the Q parameters."""
        if self._several:
            own = self.system(values)
            if not self.axes:
                return DifferencedFlow(own)
            points, steps = self._stencil(values, _FLOW_STEP)
            return DifferencedFlow(own, self.system(points), _WEIGHTS, steps)
        if (cell := self.cell(values[0])) is not None:
            return SensitivityFlow(cell.equations.at(values[0].tolist()))
        if not self.axes:
            return SensitivityFlow(PeriodEquations.of(self.system(values)))
        points, steps = self._stencil(values, _STEP)
        return SensitivityFlow(
            PeriodEquations.of(self.system(values), differentiate(self.system(points), _WEIGHTS, steps)))

    def corrected(self, guess: np.ndarray, rows: np.ndarray, period: int,
                  event: CriticalMultiplier | TouchingExtremum | None = None) -> CorrectedOrbit | None:
        """The orbit nearest to a guess, or None, as `PolynomialEquations.correct` says; also None where the equations
        are not interpolated, or the model does not accept the parameters."""
        cell = self.cell(guess[period * self.dimension :])
        if cell is None or not cell.accepted:
            return None
        return cell.equations.correct(guess, rows, period, LIMITS, event)

    def cell(self, values: np.ndarray) -> Cell | None:
        """The cell with values (Q,) on which the equations are interpolated; None without one."""
        return None if self._several else self._cells.cell(values)

    @cached_property
    def _several(self) -> bool:
        """Whether the model has several contacts."""
        return self.system(self.start[None]).contacts is not None

    @cached_property
    def _cells(self) -> Cells:
        return Cells(lambda values: PeriodEquations.of(self.system(values)), self._check, self._divides)

    @cached_property
    def _divides(self) -> np.ndarray:
        """Whether the equations divide by each parameter, or it must be positive for another reason, (Q,)."""
        found = [[find(single) for single in (name, *self.model.set_by(name))] for name in self.axes]
        return np.array([any(q is not None and q.divisor for q in group) for group in found], bool)

    def batch(self, values: np.ndarray) -> Batch:
        """The model at values (P, Q), which are not checked: a difference may step beyond the end of a range."""
        flat = self.model.expand(dict(zip(self.axes, values.T, strict=True)))
        return replace(vary(self.model, {}), values=MappingProxyType(flat), size=len(values))

    def _stencil(self, values: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
        """The points of the differences about values (P, Q), in turn by parameter and stencil, and the steps (P, Q);
        ``step`` is relative to the parameter."""
        size = np.where(self._divides & (values != 0), np.abs(values), np.clip(np.abs(values), _LEAST, 1.0))
        steps, q = step * size, values.shape[1]
        offsets = np.einsum("pq,s,qr->pqsr", steps, _STENCIL, np.eye(q))
        return (values[:, None, None, :] + offsets).reshape(-1, q), steps


def as_initial_values(family: ParameterFamily, values: np.ndarray, states: np.ndarray) -> dict[str, np.ndarray]:
    """The initial values (P, n) of the model with which motions begin in dynamic states (P, n, d) at phase 0.

    They have the names of the coordinates that the model has; ``values`` (P, Q) are those of the parameters.
    """
    batch = family.batch(values)
    error, error_dot = (e[:, None] for e in transmission_error_at_start(batch))
    found = to_physical(batch, family.names, states, np.zeros(states.shape[:2]), error, error_dot)
    return {name: found[name] for name in batch.model.coordinate_names}
