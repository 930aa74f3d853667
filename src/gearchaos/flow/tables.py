"""Step tables, computed once per parameter point: E and g of w(k+1) = E w(k) + g for each step and contact state."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.arrays import Steps, new_workspace
from gearchaos.flow.kernels.offsets import Columns, Harmonics, harmonics
from gearchaos.flow.kernels.tabulate import tabulate_steps
from gearchaos.flow.rates import bounds
from gearchaos.flow.system import SwitchedSystem

_MAX_SHARED_HARMONICS = 4
"""With more harmonics of the forcing, tables for every step cost less than adding the waves in every step."""


def harmonics_of(system: SwitchedSystem) -> Harmonics:
    """The numbers of harmonics of a system, and the offsets that depend on them."""
    return harmonics(system.dimension, system.f_cos.shape[1], system.chi_cos.shape[1])


def parameter_array(system: SwitchedSystem) -> np.ndarray:
    """The arrays of a system and its bounds side by side, (P, total), in the order of `offsets.Columns`."""
    own = dict(zip(("bound0", "bound"), bounds(system), strict=True))
    *names, _ = Columns._fields  # the last one is the total
    columns = [own[name] if name in own else getattr(system, name) for name in names]
    return np.ascontiguousarray(np.concatenate([c.reshape(system.points, -1) for c in columns], axis=1))


def shared(system: SwitchedSystem) -> bool:
    """Whether equal steps on one stiffness level share their entry in the step tables.

    Every step has its own where the stiffness has harmonics, the split differs from point to point, or the harmonics of
    the forcing are many.
    """
    return system.one_split and system.chi_cos.shape[1] == 0 and system.f_cos.shape[1] <= _MAX_SHARED_HARMONICS


def tabulated_harmonics(system: SwitchedSystem) -> int:
    """Harmonics of the forcing whose responses have rows of their own in the step tables: all if steps share their
    entries, else none, and the forcing is part of the constant."""
    return system.f_cos.shape[1] if shared(system) else 0


def tabulate(system: SwitchedSystem, parameters: np.ndarray, steps: Steps, count: int) -> np.ndarray:
    """The step tables of points that share one grid.

    Parameters
    ----------
    system : SwitchedSystem
        P points.
    parameters : (P, total)
        Their `parameter_array`.
    steps : Steps
        The ``count`` steps of one period, or those of one period for each point.

    Returns
    -------
    (P, entries, 3, rows)
        Contact states in the order back, free, front. Rows: E (d * d), constant (d), then the responses to cos jωτ and
        those to sin jωτ (d each) for all `tabulated_harmonics`.
    """
    d, own = system.dimension, tabulated_harmonics(system)
    described = np.searchsorted(steps.entry[:count], np.arange(steps.entry[count - 1] + 1))
    table = np.zeros((system.points, len(described), 3, d * d + d + 2 * own * d))
    each = count if len(steps.entry) > count else 0
    first, offsets = each * np.arange(system.points), harmonics_of(system)
    work = new_workspace(offsets)
    tabulate_steps((0,) * d, parameters, offsets, steps.values, first, described, own, work, table)
    return table
