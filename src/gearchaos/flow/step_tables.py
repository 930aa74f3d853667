"""Step grids and step tables, computed once per parameter point.

A grid is how a point divides its mesh period into steps. Points with the same numbers of steps and orthonormalisations
use the same grid, and their tables are computed together. A table has E and g of w(k+1) = E w(k) + g for each step and
contact state.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.one_spring.affine import tabulate_steps
from gearchaos.flow.kernels.vector.arrays import (
    COS_SIN,
    LENGTH,
    LEVEL,
    Grids,
    Harmonics,
    ParameterColumns,
    Points,
    Steps,
    dimensions,
    harmonics,
    new_workspace,
)
from gearchaos.flow.system import SwitchedSystem, bounds, min_steps_per_period

_MAX_SHARED_HARMONICS = 4
"""Most harmonics of the forcing for which steps share table entries. With more, one entry for each step is faster than
adding up the responses to all harmonics in every step."""


def harmonics_of(system: SwitchedSystem) -> Harmonics:
    """The numbers of harmonics of a system, and the array offsets that depend on them."""
    return harmonics(system.dimension, system.f_cos.shape[1], system.chi_cos.shape[1], system.levels.shape[1],
                     system.law.name)


def parameter_array(system: SwitchedSystem, bounded: bool) -> np.ndarray:
    """The arrays of a system side by side, (P, total), in the order of `ParameterColumns`: with its bounds, or with
    zeros in their place, since they are not needed where every step is resolved."""
    points = system.points
    found = bounds(system) if bounded else (np.zeros((points, 2)), np.zeros((points, system.dimension)))
    computed = dict(zip(("bound0", "bound"), found, strict=True))
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
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
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
    """The step tables (P, entries, 3, rows) of P points with the same grid and ``count`` steps in a period.

    ``parameters`` is their `parameter_array`, ``steps`` those of one period, used by all points, or of one period for
    each point in turn. Axis 2: contact states in the order back, free, front. Rows: E (d * d), constant (d), the
    responses to all cos jωτ (d each), then those to all sin jωτ (d each), j = 1, ..., `tabulated_harmonics`.
    """
    d, tabulated = system.dimension, tabulated_harmonics(system)
    first_of_entry = np.searchsorted(steps.entry[:count], np.arange(steps.entry[count - 1] + 1))
    table = np.zeros((system.points, len(first_of_entry), 3, d * d + d + 2 * tabulated * d))
    per_point = count if len(steps.entry) > count else 0  # 0 if all points use the same steps
    first, offsets = per_point * np.arange(system.points), harmonics_of(system)
    work = new_workspace(offsets.rows.total)
    dims = dimensions(d, system.law.name)
    tabulate_steps(dims, parameters, offsets, steps.values, first, first_of_entry, tabulated, work, table)
    return table


_FRACTIONS = 8
"""If ``starts`` differ from point to point, the number of steps in each part of the period is computed from that part's
fraction of the period, rounded up to a multiple of 1/8, so that few distinct grids occur."""

_SAME_INSTANT = 1e-12
"""A sample and a stiffness jump that are closer than this fraction of the period are taken to coincide."""

_MAX_SPREAD = 8.0
"""Tangent vectors are orthonormalised before the logarithm of the ratio of their lengths can exceed this value."""


def prepare_points(system: SwitchedSystem, samples: int) -> tuple[Points, np.ndarray]:
    """Compute the steps and step tables of all points, and the index of each point's grid (P,).

    Points with the same grid index have the same steps, and orthonormalise tangent vectors after the same steps. If
    ``samples`` > 0, a step starts at each of ``samples`` equidistant instants of the period.
    """
    if samples and not system.same_starts:
        raise ValueError("samples need one contact ratio for all points")
    layouts, grid = np.unique(
        np.column_stack([step_counts(system), orthonormalisations(system)]), axis=0, return_inverse=True
    )
    grid, parameters = grid.ravel(), parameter_array(system, bounded=True)
    grids = Grids(*(np.zeros(system.points, np.int64) for _ in Grids._fields))
    parts, tables, steps_before, entries_before = [], [], 0, 0
    for i, (*counts, orthonormalised) in enumerate(layouts.tolist()):
        members = np.flatnonzero(grid == i)
        part = system.take(members)
        starts = part.starts[:1] if part.same_starts else part.starts
        if samples:
            length, start, level, sampled = steps_with_samples(sum(counts), starts[0], samples)
        else:
            (length, start, level), sampled = steps_in_parts(np.array(counts), starts), np.zeros(0, np.int64)
        steps, count = describe_steps(part, length, start, level, sampled), len(length)
        table = tabulate(part, parameters[members], steps, count)
        number = np.arange(len(members))
        grids.first_step[members] = steps_before + (number * count if len(steps.entry) > count else 0)
        grids.step_count[members], grids.orthonormalise_every[members] = count, max(1, count // orthonormalised)
        grids.first_entry[members] = entries_before + number * table.shape[1]
        parts.append(steps)
        tables.append(table.reshape(-1, *table.shape[2:]))
        steps_before, entries_before = steps_before + len(steps.entry), entries_before + len(tables[-1])
    steps = Steps(*map(np.concatenate, zip(*parts, strict=True)))
    table = np.concatenate(tables)
    return Points(parameters, steps, grids, table, harmonics_of(system), tabulated_harmonics(system)), grid


def step_counts(system: SwitchedSystem) -> np.ndarray:
    """Numbers of steps (P, N) in each part of the period, rounded up so that few distinct grids occur.

    They and `orthonormalisations` depend on the point alone, so that a result does not depend on the other points.
    """
    return rounded_counts(min_steps_per_period(system), system.starts, system.same_starts)


def rounded_counts(least: np.ndarray, starts: np.ndarray, same_starts: bool) -> np.ndarray:
    """The `step_counts` of points with at least so many steps in a period, (P,), and these parts of it."""
    rounded, _ = _rounded(np.ceil(least))
    fraction = np.diff(starts, axis=1, append=1.0)
    if not same_starts:
        fraction = np.ceil(_FRACTIONS * fraction) / _FRACTIONS
    return np.maximum(np.ceil(rounded[:, None] * fraction), 1).astype(int)


def _rounded(needed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of steps rounded up to a multiple that leaves few of them, and this multiple."""
    multiple = 2.0 ** np.floor(np.log2(np.maximum(needed, 16)) - 3)
    return np.ceil(needed / multiple) * multiple, multiple


def steps_alike(least: float) -> tuple[float, float]:
    """Limits of the least numbers of steps that lead to the same `rounded_counts` as this one: more than the first, at
    most the second."""
    rounded, multiple = map(float, _rounded(np.ceil(least)))
    return (max(rounded - multiple, 8 * multiple - 1) if multiple > 2 else rounded - multiple), rounded


def orthonormalisations(system: SwitchedSystem) -> np.ndarray:
    """Number of orthonormalisations of the tangent vectors in a period, (P,)."""
    spread = (np.abs(system.trace) + 1.0) * system.period  # bound of the growth of the logarithm in a period
    return 2 ** np.ceil(np.log2(np.maximum(spread / _MAX_SPREAD, 1.0))).astype(int)


def steps_in_parts(counts: np.ndarray, starts: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Equal steps in each part of the period: their lengths and starts (S, Q) as fractions of the period, and the index
    (S,) of the part that each belongs to.

    ``counts`` (N,) are the numbers of steps in the parts, S their sum, and ``starts`` (Q, N) where the parts begin.
    """
    part = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(part)) - np.repeat(np.cumsum(counts) - counts, counts)  # of a step within its part
    length = (np.diff(starts, axis=1, append=1.0) / counts).T[part]
    return length, starts.T[part] + number[:, None] * length, part


def steps_with_samples(count: int, starts: np.ndarray,
                       samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """At least ``count`` steps. One starts at each sample, and one at each of the ``starts`` (N,) of the parts of the
    period.

    Returns their lengths and starts (S, 1) as fractions of the period, the index (S,) of the part that each belongs to,
    and the indices (samples,) of the steps that start at a sample.
    """
    equidistant = samples * int(np.ceil(count / samples))
    start = np.arange(equidistant) / equidistant
    for jump in starts[1:]:
        nearest = np.argmin(np.abs(start - jump))
        if abs(start[nearest] - jump) < _SAME_INSTANT:
            start[nearest] = jump
        elif 0 < jump < 1:
            start = np.sort(np.append(start, jump))
    length = np.diff(np.append(start, 1.0))
    part = np.searchsorted(starts, start, side="right") - 1
    sampled = np.searchsorted(start, np.arange(samples) / samples - _SAME_INSTANT)
    return length[:, None], start[:, None], part, sampled


def describe_steps(system: SwitchedSystem, length: np.ndarray, start: np.ndarray, level: np.ndarray,
                   sampled: np.ndarray) -> Steps:
    """`Steps` of points with the same grid, from their lengths and starts (S, Q), fractions of the period.

    They are the steps of one period if Q = 1, else those of one period for each of Q points. ``level`` (S,) is the
    index of the stiffness level on each step. ``sampled`` are the indices of the steps at whose start samples are
    taken.
    """
    entry: np.ndarray = np.arange(len(length))
    if steps_share_matrices(system):  # consecutive steps of equal length on one stiffness level
        new = (np.diff(level) != 0) | (np.abs(np.diff(length[:, 0])) > 1e-15)
        entry = np.concatenate([[0], np.cumsum(new)]).astype(np.int64)
    sample = np.full(len(length), -1)
    sample[sampled] = np.arange(len(sampled))
    periods = length.shape[1]
    values = step_values(length, start, level, max(system.f_cos.shape[1], system.chi_cos.shape[1]))
    entry_end = np.searchsorted(entry, entry, side="right")
    return Steps(np.tile(entry, periods), np.tile(entry_end, periods), np.tile(sample, periods), values)


def step_values(length: np.ndarray, start: np.ndarray, level: np.ndarray, highest: int) -> np.ndarray:
    """`Steps.values` of steps as in `describe_steps`, with ``highest`` harmonics."""
    harmonics = np.arange(1, highest + 1)
    phase = 2 * np.pi * start.T.ravel()[:, None] * harmonics
    values = np.empty((phase.shape[0], 2 + 2 * highest))
    values[:, LENGTH], values[:, LEVEL] = length.T.ravel(), np.tile(level, length.shape[1])
    values[:, COS_SIN::2], values[:, COS_SIN + 1 :: 2] = np.cos(phase), np.sin(phase)
    return values
