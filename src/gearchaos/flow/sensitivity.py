"""One mesh period of many trajectories with monodromy matrices, derivatives by parameters, contact switches and
extrema of z."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple, Self

import numpy as np

from gearchaos.flow.exact import ExactFlow, raise_if_cancelled
from gearchaos.flow.kernels.orbits.recording import new_segment
from gearchaos.flow.kernels.orbits.sensitivity import SensitivityCall, advance_with_sensitivities
from gearchaos.flow.kernels.vector.arrays import Harmonics, dimensions, new_workspace, sensitivity_rows
from gearchaos.flow.step_tables import harmonics_of, parameter_array, rounded_counts, step_values, steps_in_parts
from gearchaos.flow.system import DampingLaw, SwitchedSystem, contact_states, min_steps_per_period

_MIN_RECORDS = 32  # least numbers of contact switches and of extrema of z that are recorded in a mesh period


def record_count(steps: int) -> int:
    """How many contact switches and extrema of z are recorded in a mesh period of so many steps."""
    return _MIN_RECORDS + 2 * steps


class Derivatives(NamedTuple):
    """Derivatives of the equations by Q parameters at P points.

    Attributes
    ----------
    equations : (P, Q, total)
        Of the arrays of the system side by side.
    starts : (P, Q, N)
        Of the starts of the parts of the period.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import Derivatives
    >>> Derivatives(np.zeros((3, 1, 20)), np.zeros((3, 1, 2))).equations.shape
    (3, 1, 20)
    """

    equations: np.ndarray
    starts: np.ndarray


@dataclass(frozen=True, eq=False)
class PeriodEquations:
    """The equations of P parameter points as plain arrays, with derivatives by Q parameters.

    Attributes
    ----------
    dimension : int
    law : DampingLaw
    same_starts : bool
        As in `SwitchedSystem`.
    harmonics : Harmonics
        The numbers of harmonics and the columns of ``parameters``.
    parameters : (P, total)
        The arrays of the system side by side.
    starts : (P, N)
        Where the parts of the period begin.
    steps : (P,)
        Least number of steps in a mesh period, see `min_steps_per_period`.
    derivatives : Derivatives

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import PeriodEquations
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> PeriodEquations.of(initial_value_problems(gc.MeshModel.of(q0=0.1)).flow.system).dimension
    2
    """

    dimension: int
    law: DampingLaw
    same_starts: bool
    harmonics: Harmonics
    parameters: np.ndarray
    starts: np.ndarray
    steps: np.ndarray
    derivatives: Derivatives

    @classmethod
    def of(cls, system: SwitchedSystem, derivatives: Derivatives | None = None) -> Self:
        """Those of a system, by default without derivatives."""
        parameters = parameter_array(system, bounded=False)
        sizes = (parameters.shape[1], system.levels.shape[1])
        none = Derivatives(*(np.zeros((system.points, 0, size)) for size in sizes))
        return cls(system.dimension, system.law, system.same_starts, harmonics_of(system), parameters,
                   system.starts, min_steps_per_period(system), derivatives or none)

    @property
    def first(self) -> PeriodEquations:
        """Those of the first point alone."""
        parameters, starts, steps, *derivatives = (
            a[:1].copy() for a in (self.parameters, self.starts, self.steps, *self.derivatives))
        return replace(self, parameters=parameters, starts=starts, steps=steps, derivatives=Derivatives(*derivatives))

    @property
    def levels(self) -> np.ndarray:
        """Stiffness level in each part of the period, (P, N)."""
        first = self.harmonics.columns.levels
        return self.parameters[:, first : first + self.starts.shape[1]]

    @property
    def chi_cos(self) -> np.ndarray:
        """Cosines of the stiffness, (P, K)."""
        first = self.harmonics.columns.chi_cos
        return self.parameters[:, first : first + self.harmonics.stiffness]

    @property
    def damping(self) -> np.ndarray:
        """Damping coefficient in the mesh force, (P,)."""
        return self.parameters[:, self.harmonics.columns.damping]


@dataclass(frozen=True)
class PeriodResult:
    """Results for L trajectories over one mesh period, with derivatives by Q parameters.

    Attributes
    ----------
    w : (L, d)
        Final states.
    monodromy : (L, d, d)
        Derivatives of the final state i by the initial state j.
    sensitivity : (L, d, Q)
        Derivatives of the final state by the parameters.
    switches : (L, S, 4)
        Contact switches in order of time, of each the instant as a fraction of the period, the boundary (1 or −1), 1
        into contact or 0 out of it, and z'. Rows from ``switch_count`` on are meaningless.
    switch_count : (L,)
    extrema : (L, E, 3 + d + Q)
        Extrema of z in order of time, of each the instant, z, 1 for a maximum or −1 for a minimum, and the derivatives
        of z there by the initial state and by the parameters. Rows from ``extremum_count`` on are meaningless.
    extremum_count : (L,)
    status : (L,)
        As in `FlowResult`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import SensitivityFlow
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = SensitivityFlow(problem.flow.system).advance(problem.w.T)
    >>> result.monodromy.shape, result.switch_count.tolist()
    ((1, 2, 2), [2])
    """

    w: np.ndarray
    monodromy: np.ndarray
    sensitivity: np.ndarray
    switches: np.ndarray
    switch_count: np.ndarray
    extrema: np.ndarray
    extremum_count: np.ndarray
    status: np.ndarray


class SensitivityFlow:
    """The exact flow over one mesh period, with derivatives by the initial state and by parameters.

    Parameters
    ----------
    system : SwitchedSystem or PeriodEquations
        P parameter points with d coordinates.
    derivatives : Derivatives, optional
        The derivatives of the equations of a `SwitchedSystem` by Q parameters. By default there are none.

    Notes
    -----
    The derivatives are exact to rounding: the variational equations are integrated beside the motion. A contact switch
    adds nothing to them where the right-hand side is continuous there, else its jump.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.flow import SensitivityFlow
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> result = SensitivityFlow(problem.flow.system).advance(problem.w.T)
    >>> system = problem.flow.system
    >>> bool(np.isclose(np.linalg.det(result.monodromy[0]), np.exp(system.trace[0] * system.period[0])))
    True
    """

    def __init__(self, system: SwitchedSystem | PeriodEquations, derivatives: Derivatives | None = None) -> None:
        own = system if isinstance(system, PeriodEquations) else PeriodEquations.of(system, derivatives)
        self._equations, self.dimension = own, own.dimension
        self._dims = dimensions(own.dimension, own.law.name)
        self._rows = row_numbers(own.dimension, own.harmonics, own.derivatives.equations.shape[1])
        keys = list(zip(np.ceil(own.steps).tolist(), map(tuple, own.starts.tolist()), strict=True))
        index = {key: number for number, key in enumerate(dict.fromkeys(keys))}
        parts = [period_steps(*key, own.same_starts, own.harmonics.highest) for key in index]
        counts, which = np.array([len(part) for part in parts]), np.array([index[key] for key in keys])
        self._values = parts[0] if len(parts) == 1 else np.concatenate(parts)  # `Steps.values` of all points
        self._first, self.step_count = (np.cumsum(counts) - counts)[which], counts[which]

    def advance(self, w: np.ndarray, points: np.ndarray | None = None) -> PeriodResult:
        """Advance trajectories from phase 0 by one mesh period.

        Parameters
        ----------
        w : (L, d)
            States at the start.
        points : (L,), optional
            Index of the parameter point of each trajectory; by default trajectory i has point i.

        Raises
        ------
        StoppedError
            If the computation is cancelled, see `cancel_event`.
        """
        raise_if_cancelled()
        own, (count, d) = self._equations, w.shape
        parameters = own.derivatives.equations.shape[1]
        points = np.arange(count) if points is None else np.asarray(points, np.int64)
        records = record_count(int(self.step_count.max()))
        call = SensitivityCall(
            own.parameters, *own.derivatives, self._values, points, self._first[points],
            np.array(w, dtype=float, order="C"), np.empty((count, d, d)), np.empty((count, parameters, d)),
            np.empty((count, records, 4)), np.zeros(count, np.int64),
            np.empty((count, records, 3 + d + parameters)), np.zeros(count, np.int64), np.zeros(count, np.int64),
            contact_states(own, w.T, points),
        )
        (work, segment), steps = scratch.of(self._rows.total), self.step_count[points]
        for number in sorted(set(steps.tolist())):
            lanes = np.flatnonzero(steps == number)
            advance_with_sensitivities(self._dims, own.harmonics, self._rows, call, number, lanes, work, segment)
        return PeriodResult(
            call.w, call.tangent.transpose(0, 2, 1), call.sensitivity.transpose(0, 2, 1), call.switches,
            call.switch_count, call.extrema, call.extremum_count, call.status,
        )


class DifferencedFlow:
    """The flow over one mesh period of a system with several contacts, with derivatives like `SensitivityFlow`.

    The monodromy matrices are exact to rounding. The derivatives by parameters are differences of exact flows, right
    to about 1e-8. Contact switches and extrema of z are not recorded.

    Parameters
    ----------
    system : SwitchedSystem
        P parameter points.
    neighbours : SwitchedSystem
        P Q S points as in `differentiate`, close to those.
    weights : (S,)
    steps : (P, Q)

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.flow import DifferencedFlow
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> model, h = gc.MeshModel.of(q0=0.1, eps1=0.1), 1e-5
    >>> centre = initial_value_problems(model)
    >>> around = initial_value_problems(model, {"zeta": 0.025 + h * np.array([-1.0, 0.0, 1.0])})
    >>> flow = DifferencedFlow(centre.flow.system, around.flow.system, np.array([-0.5, 0.0, 0.5]), np.array([[h]]))
    >>> flow.advance(centre.w.T).sensitivity.shape
    (1, 2, 1)
    """

    def __init__(self, system: SwitchedSystem, neighbours: SwitchedSystem | None = None,
                 weights: np.ndarray | None = None, steps: np.ndarray | None = None) -> None:
        self.dimension, self._flow = system.dimension, ExactFlow(system)
        self._weights = np.zeros(0) if weights is None else weights
        self._steps = np.zeros((system.points, 0)) if steps is None else steps
        self._around = None if neighbours is None else ExactFlow(neighbours)

    def advance(self, w: np.ndarray, points: np.ndarray | None = None) -> PeriodResult:
        """Advance trajectories from phase 0 by one mesh period, as `SensitivityFlow.advance` does."""
        (count, d), (q, s) = w.shape, (self._steps.shape[1], len(self._weights))
        points = np.arange(count) if points is None else np.asarray(points, np.int64)
        unit = np.repeat(np.eye(d)[:, :, None], count, axis=2)
        run, sensitivity = self._flow.advance(w.T, 1, points=points, tangent=unit), np.zeros((count, d, q))
        if self._around is not None:
            number = (points[:, None] * q * s + np.arange(q * s)).ravel()
            after = self._around.advance(np.repeat(w.T, q * s, axis=1), 1, points=number).w.reshape(d, count, q, s)
            sensitivity = np.einsum("dlqs,s->ldq", after, self._weights) / self._steps[points][:, None, :]
        none = np.zeros(count, np.int64)
        return PeriodResult(run.w.T, run.tangent.transpose(2, 1, 0), sensitivity, np.zeros((count, 0, 4)), none,
                            np.zeros((count, 0, 3 + d + q)), none, run.status)


def differentiate(neighbours: SwitchedSystem, weights: np.ndarray, steps: np.ndarray) -> Derivatives:
    """The derivatives of the equations by Q parameters at P points, from differences.

    Parameters
    ----------
    neighbours : SwitchedSystem
        P Q S points: for each point and parameter in turn S values of that parameter, at equal distances.
    weights : (S,)
        Weights of the difference formula, for the distance 1.
    steps : (P, Q)
        Distances of the values.

    Returns
    -------
    Derivatives
        For `SensitivityFlow`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.flow import SensitivityFlow, differentiate
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> model, h = gc.MeshModel.of(q0=0.1, eps1=0.1), 1e-3
    >>> centre = initial_value_problems(model, {"zeta": np.array([0.025])})
    >>> around = initial_value_problems(model, {"zeta": 0.025 + h * np.array([-1.0, 0.0, 1.0])})
    >>> derivatives = differentiate(around.flow.system, np.array([-0.5, 0.0, 0.5]), np.array([[h]]))
    >>> SensitivityFlow(centre.flow.system, derivatives).advance(centre.w.T).sensitivity.shape
    (1, 2, 1)
    """
    (points, parameters), size = steps.shape, len(weights)
    found = (parameter_array(neighbours, bounded=False), neighbours.starts)
    columns, starts = (a.reshape(points, parameters, size, -1) for a in found)
    return Derivatives(*(np.ascontiguousarray(
        np.einsum("s,pqsc->pqc", weights, a) / steps[:, :, None]) for a in (columns, starts)))


row_numbers = lru_cache(maxsize=64)(sensitivity_rows)


@lru_cache(maxsize=1024)
def period_steps(least: float, starts: tuple[float, ...], same_starts: bool, highest: int) -> np.ndarray:
    """`Steps.values` of one mesh period with at least so many steps, from where its parts begin."""
    where = np.array([starts])
    return step_values(*steps_in_parts(rounded_counts(np.array([least]), where, same_starts)[0], where), highest)


class _Scratch(threading.local):
    """The memory in which a thread computes, by its number of rows."""

    def __init__(self) -> None:
        self.of = lru_cache(maxsize=8)(lambda rows: (new_workspace(rows), new_segment()))


scratch = _Scratch()
