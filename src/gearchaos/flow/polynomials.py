"""Equations that are polynomials of parameters, and orbits corrected along these parameters in one call of a kernel."""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from gearchaos.flow.exact import raise_if_cancelled
from gearchaos.flow.kernels.orbits.correction import (
    EXTREMUM,
    MULTIPLIER,
    NO_EVENT,
    NO_SOLUTION,
    OTHER_STEPS,
    SOLVED,
    Correction,
    Limits,
    Polynomials,
    correct_orbit,
    evaluate_polynomials,
)
from gearchaos.flow.kernels.orbits.sensitivity import SensitivityCall
from gearchaos.flow.kernels.vector.arrays import dimensions
from gearchaos.flow.sensitivity import (
    Derivatives,
    PeriodEquations,
    PeriodResult,
    SensitivityFlow,
    period_steps,
    record_count,
    row_numbers,
    scratch,
)
from gearchaos.flow.step_tables import steps_alike
from gearchaos.flow.system import SwitchedSystem

_MOST_COORDINATES = 64
"""Largest n d: the linear equations of longer orbits are solved faster by LAPACK than by the kernel."""


class NotConvergedError(Exception):
    """Newton's method for an orbit does not converge.

    Examples
    --------
    >>> from gearchaos.flow import NotConvergedError
    >>> issubclass(NotConvergedError, Exception)
    True
    """


class CriticalMultiplier(NamedTuple):
    """The event of an orbit with a multiplier of this real value.

    Attributes
    ----------
    value : float
    vectors : (2, n, d)
        The singular vectors, right and left, of its linear equations at a neighbouring orbit.
    step : float
        Of the differences for the derivatives, relative to the right one.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import CriticalMultiplier
    >>> CriticalMultiplier(-1.0, np.ones((2, 1, 2)), 1e-8).value
    -1.0
    """

    value: float
    vectors: np.ndarray
    step: float


class TouchingExtremum(NamedTuple):
    """The event of an orbit with an extremum of z at a boundary; it is the one nearest to this boundary and to this
    instant in mesh periods.

    Attributes
    ----------
    boundary : float
    instant : float

    Examples
    --------
    >>> from gearchaos.flow import TouchingExtremum
    >>> TouchingExtremum(1.0, 0.25).instant
    0.25
    """

    boundary: float
    instant: float


class CorrectedOrbit(NamedTuple):
    """A periodic orbit found along Q parameters, M = n d + Q unknowns.

    Attributes
    ----------
    u : (M,)
        Its points and the parameters.
    tangent : (M,)
        Tangent of the curve of solutions, of any length.
    orientation : int
        Sign of the determinant of the derivatives of all equations, with the row of the tangent as last one.
    residual : float
        The largest equation.
    result : PeriodResult
        The mesh period from each point.
    vectors : (2, n, d)
        The singular vectors of the critical multiplier, if there is one.
    slope : (M,)
        The derivatives of the equation of the event.
    extremum : int
        Index of the touching extremum among all those of the orbit.

    Examples
    --------
    >>> from gearchaos.flow import CorrectedOrbit
    >>> CorrectedOrbit._fields[:2]
    ('u', 'tangent')
    """

    u: np.ndarray
    tangent: np.ndarray
    orientation: int
    residual: float
    result: PeriodResult
    vectors: np.ndarray
    slope: np.ndarray
    extremum: int


@dataclass(frozen=True, eq=False)
class PolynomialEquations:
    """The equations on a box of Q parameters, as products of Chebyshev polynomials of them.

    Attributes
    ----------
    one : PeriodEquations
        Those at one of its points, of which only what is the same on all of it counts.
    polynomials : Polynomials
        Its columns are those of the parameters, the starts and the steps of the equations.

    Examples
    --------
    >>> from gearchaos.continuation.family import ParameterFamily
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> family = ParameterFamily(gc.MeshModel.of(q0=0.1, omega=0.8), ("omega",))
    >>> cell = family.cell(np.array([0.8]))
    >>> cell.equations.at([0.8]).derivatives.equations.shape[:2]
    (1, 1)
    """

    one: PeriodEquations
    polynomials: Polynomials

    def at(self, values: list[float]) -> PeriodEquations:
        """The equations at values (Q,), with derivatives."""
        one, q, columns = self.one, len(values), len(self.polynomials.origin)
        total, found = one.parameters.shape[1], np.empty((1 + q, columns))
        evaluate_polynomials(self.polynomials, np.array(values), np.empty((q, 2, self._degree)), found)
        return replace(
            one, parameters=found[:1, :total].copy(), starts=found[:1, total:-1], steps=found[0, -1:],
            derivatives=Derivatives(found[None, 1:, :total].copy(), found[None, 1:, total:-1].copy()))

    def correct(self, guess: np.ndarray, rows: np.ndarray, period: int, limits: Limits,
                event: CriticalMultiplier | TouchingExtremum | None = None) -> CorrectedOrbit | None:
        """The orbit of n mesh periods, or the one at an event, nearest to a guess.

        Parameters
        ----------
        guess : (M,)
            Its n points and Q parameters.
        rows : (2, M)
            The solution less the guess is at a right angle to the first one; the second one is the last row of the
            equations of the tangent.
        period : int
            n.
        limits : Limits
            When Newton's method ends.
        event : optional
            A further equation.

        Returns
        -------
        CorrectedOrbit, or None where Newton's method leaves the box or what the equations are defined for, or is not
        tried: the steps of the period depend on the parameters, contact ends with its force, or the orbit is long.

        Raises
        ------
        NotConvergedError
            If Newton's method does not converge.
        StoppedError
            If the computation is cancelled, see `cancel_event`.
        """
        raise_if_cancelled()
        one, d, q = self.one, self.one.dimension, len(self.polynomials.low)
        if not self._steady or one.law.releases or period * d > _MOST_COORDINATES:
            return None
        rows_of_workspace = row_numbers(d, one.harmonics, q)
        work, segment = scratch.of(rows_of_workspace.total)
        for _ in range(2):
            steps = self._steps[0]
            own, call, probe = _memory.of(self, period, len(guess), steps[0])
            own.u[:] = own.guess[:] = guess
            own.rows[:], own.steps[:] = rows, steps
            if isinstance(event, CriticalMultiplier):
                own.event[:], own.vectors[:] = (MULTIPLIER, event.value, event.step), event.vectors.reshape(2, -1)
            else:
                own.event[:] = (NO_EVENT, 0, 0) if event is None else (EXTREMUM, *event)
            found = correct_orbit(
                dimensions(d, one.law.name), one.harmonics, rows_of_workspace, own, self.polynomials,
                call, probe, limits, work, segment)
            if found != OTHER_STEPS:
                break
            self._steps[:] = [self._steps_of(own.found[0, -1])]
        if found == NO_SOLUTION:
            raise NotConvergedError
        if found != SOLVED:
            return None
        switches, extrema = (max(c.tolist()) for c in (call.switch_count, call.extremum_count))
        result = PeriodResult(
            call.w.copy(), call.tangent.transpose(0, 2, 1).copy(), call.sensitivity.transpose(0, 2, 1).copy(),
            call.switches[:, :switches].copy(), call.switch_count.copy(), call.extrema[:, :extrema].copy(),
            call.extremum_count.copy(), call.status.copy())
        residual, orientation, extremum = own.result.tolist()
        return CorrectedOrbit(own.u.copy(), own.matrix[:, -1].copy(), int(orientation), residual, result,
                              own.vectors.reshape(2, period, d).copy(), own.jacobian[-2, :-1].copy(), int(extremum))

    @cached_property
    def _degree(self) -> int:
        """Number of polynomials in each direction."""
        return round(len(self.polynomials.coefficients) ** (1 / len(self.polynomials.low)))

    @cached_property
    def _steady(self) -> bool:
        """Whether the starts of the parts of the period are the same on the whole box."""
        return not np.any(self.polynomials.coefficients[:, self.one.parameters.shape[1] : -1])

    @cached_property
    def _values(self) -> dict[int, np.ndarray]:
        """`Steps.values` of a period, by its number of steps."""
        return {}

    @cached_property
    def _steps(self) -> list[tuple[int, float, float]]:
        """The number of steps of the period used last, and between which least numbers it is this, alone in a list."""
        return [self._steps_of(float(self.one.steps[0]))]

    def _steps_of(self, least: float) -> tuple[int, float, float]:
        one, starts = self.one, tuple(self.one.starts[0].tolist())
        values = period_steps(float(np.ceil(least)), starts, one.same_starts, one.harmonics.highest)
        self._values[len(values)] = values
        return len(values), *steps_alike(least)


def correct_any(system: SwitchedSystem) -> None:
    """Differentiate a mesh period of a system and begin to correct an orbit, which compiles the kernels for both.

    Parameters
    ----------
    system : SwitchedSystem

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import correct_any
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> correct_any(initial_value_problems(gc.MeshModel.of(q0=0.1)).flow.system)
    """
    own, w = PeriodEquations.of(system).first, np.zeros((1, system.dimension))
    SensitivityFlow(own).advance(w)
    columns = np.concatenate([own.parameters[0], own.starts[0], own.steps])
    constant = Polynomials(np.zeros(1), np.ones(1), columns, np.zeros((2, len(columns))))  # along any parameter
    equations, rows = PolynomialEquations(own, constant), np.zeros((2, w.size + 1))
    equations.at([0.5])
    with suppress(NotConvergedError):
        equations.correct(np.append(w, 0.5), rows, 1, Limits(0.0, 0.0, 1.0, 1.0, 1))


def _new_memory(equations: PolynomialEquations, n: int, m: int,
                count: int) -> tuple[Correction, SensitivityCall, SensitivityCall]:
    """The arrays of a correction with m unknowns, and of the flow from n and from 2 n points, in so many steps."""
    one = equations.one
    d, q, columns = one.dimension, len(equations.polynomials.low), len(equations.polynomials.origin)
    size, parameters, parts = n * d, one.parameters.shape[1], one.starts.shape[1]
    records = record_count(count)
    own = Correction(
        np.empty(m), np.empty(m), np.empty((2, m)), np.empty((m, m + 1)), np.empty((m, m + 1)),
        np.empty((size + 1, size + 2)), np.empty((2, size)), np.empty((q, 2, equations._degree)),
        np.empty((1 + q, columns)), np.arange(2 * n), np.zeros(3), np.zeros(3), np.zeros(3))
    shared = np.empty((1, parameters)), np.empty((1, q, parameters)), np.zeros((1, q, parts)), equations._values[count]

    def call(lanes: int) -> SensitivityCall:
        none = np.zeros(lanes, np.int64)
        return SensitivityCall(
            *shared, none, none, np.empty((lanes, d)), np.empty((lanes, d, d)), np.empty((lanes, q, d)),
            np.empty((lanes, records, 4)), np.zeros(lanes, np.int64), np.empty((lanes, records, 3 + d + q)),
            np.zeros(lanes, np.int64), np.zeros(lanes, np.int64), np.empty(lanes))

    return own, call(n), call(2 * n)


class _Memory(threading.local):
    """The arrays with which a thread corrects orbits, by what they depend on."""

    def __init__(self) -> None:
        self.of = lru_cache(maxsize=16)(_new_memory)


_memory = _Memory()
