"""Step tables, computed once per parameter point: E and g of w(k+1) = E w(k) + g for each step and contact state."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.arrays import Steps, new_workspace
from gearchaos.flow.kernels.offsets import Harmonics, ParameterColumns, harmonics
from gearchaos.flow.kernels.tabulate import tabulate_steps
from gearchaos.flow.rates import bounds
from gearchaos.flow.system import SwitchedSystem

_MAX_SHARED_HARMONICS = 4
"""Most harmonics of the forcing for which steps share table entries. With more, one entry for each step is faster than
adding up the responses to all harmonics in every step."""


def harmonics_of(system: SwitchedSystem) -> Harmonics:
    """The numbers of harmonics of a system, and the array offsets that depend on them."""
    return harmonics(system.dimension, system.f_cos.shape[1], system.chi_cos.shape[1], system.levels.shape[1])


def parameter_array(system: SwitchedSystem) -> np.ndarray:
    """The arrays of a system and its bounds side by side, (P, total), in the order of `offsets.ParameterColumns`."""
    return _side_by_side(system, dict(zip(("bound0", "bound"), bounds(system), strict=True)))


def equation_array(system: SwitchedSystem) -> np.ndarray:
    """`parameter_array` with zeros in place of the bounds, which are not needed where every step is resolved."""
    points, d = system.points, system.dimension
    return _side_by_side(system, {"bound0": np.zeros((points, 2)), "bound": np.zeros((points, d))})


def _side_by_side(system: SwitchedSystem, computed: dict[str, np.ndarray]) -> np.ndarray:
    """The arrays of a system, or those ``computed`` from it, in the order of `offsets.ParameterColumns`."""
    *names, _ = ParameterColumns._fields  # the last one is the total
    columns = [computed[name] if name in computed else getattr(system, name) for name in names]
    return np.ascontiguousarray(np.concatenate([c.reshape(system.points, -1) for c in columns], axis=1))


def steps_share_matrices(system: SwitchedSystem) -> bool:
    """Whether steps of equal length on one stiffness level use the same entry of the step tables.

    They do not if the stiffness has harmonics, if ``starts`` differ from point to point, or if the forcing has more
    than `_MAX_SHARED_HARMONICS` harmonics.

    Parameters
    ----------
    system : SwitchedSystem

    Returns
    -------
    bool

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import steps_share_matrices
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> [steps_share_matrices(initial_value_problems(m).flow.system) for m in (gc.MeshModel(), gc.MeshModel.of(c1=0.2))]
    [True, False]
    """
    return system.same_starts and system.chi_cos.shape[1] == 0 and system.f_cos.shape[1] <= _MAX_SHARED_HARMONICS


def tabulated_harmonics(system: SwitchedSystem) -> int:
    """Number of forcing harmonics whose responses have separate rows in the step tables.

    All of them if steps share entries; otherwise 0, and the response to the forcing is part of the constant.
    """
    return system.f_cos.shape[1] if steps_share_matrices(system) else 0


def tabulate(system: SwitchedSystem, parameters: np.ndarray, steps: Steps, count: int) -> np.ndarray:
    """Compute the step tables of points with the same grid.

    Parameters
    ----------
    system : SwitchedSystem
        The P points.
    parameters : (P, total)
        `parameter_array` of the system.
    steps : Steps
        The steps of one period, used by all points, or those of one period for each point in turn.
    count : int
        Number of steps in a period.

    Returns
    -------
    (P, entries, 3, rows)
        Axis 2: contact states in the order back, free, front. Rows: E (d * d), constant (d), the responses to all cos
        jωτ (d each), then those to all sin jωτ (d each), j = 1, ..., `tabulated_harmonics`.
    """
    d, tabulated = system.dimension, tabulated_harmonics(system)
    first_of_entry = np.searchsorted(steps.entry[:count], np.arange(steps.entry[count - 1] + 1))
    table = np.zeros((system.points, len(first_of_entry), 3, d * d + d + 2 * tabulated * d))
    per_point = count if len(steps.entry) > count else 0  # 0 if all points use the same steps
    first, offsets = per_point * np.arange(system.points), harmonics_of(system)
    work = new_workspace(offsets)
    tabulate_steps((0,) * d, parameters, offsets, steps.values, first, first_of_entry, tabulated, work, table)
    return table
