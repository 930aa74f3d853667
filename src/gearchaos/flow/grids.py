"""Step grids: how each parameter point divides its mesh period into steps.

Points with as many steps share a grid, and are tabulated together.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.arrays import LENGTH, LEVEL, WAVES, Grids, Points, Steps
from gearchaos.flow.rates import least_steps
from gearchaos.flow.system import SwitchedSystem
from gearchaos.flow.tables import harmonics_of, parameter_array, shared, tabulate, tabulated_harmonics

_SHARES = 8
"""Where the contact ratio differs from point to point, shares of the period are rounded up to eighths."""

_MAX_SPREAD = 8.0
"""Tangent vectors are orthonormalised before their lengths can differ by more than this factor, in logarithms."""


def prepare_points(system: SwitchedSystem, samples: int) -> tuple[Points, np.ndarray]:
    """Steps and step tables of all points, and the number of each point's grid (P,).

    Points with the same grid number have the same steps and are orthonormalised at the same ones. ``samples``
    equidistant instants of the period, or none if 0, are the start of a step.
    """
    plans, grid = np.unique(
        np.column_stack([step_counts(system), orthonormalisations(system)]), axis=0, return_inverse=True
    )
    grid, parameters = grid.ravel(), parameter_array(system)
    grids = Grids(*(np.zeros(system.points, np.int64) for _ in Grids._fields))
    parts, tables, steps_before, entries_before = [], [], 0, 0
    for i, (first, second, cuts) in enumerate(plans.tolist()):
        members = np.flatnonzero(grid == i)
        steps, count = _steps_of_grid(system.take(members), first, second, samples)
        table = tabulate(system.take(members), parameters[members], steps, count)
        number = np.arange(len(members))
        grids.first_step[members] = steps_before + (number * count if len(steps.entry) > count else 0)
        grids.step_count[members], grids.stride[members] = count, max(1, count // cuts)
        grids.first_entry[members] = entries_before + number * table.shape[1]
        parts.append(steps)
        tables.append(table.reshape(-1, *table.shape[2:]))
        steps_before, entries_before = steps_before + len(steps.entry), entries_before + len(tables[-1])
    steps = Steps(*map(np.concatenate, zip(*parts, strict=True)))
    table = np.concatenate(tables)
    return Points(parameters, steps, grids, table, harmonics_of(system), tabulated_harmonics(system)), grid


def _steps_of_grid(system: SwitchedSystem, first: int, second: int, samples: int) -> tuple[Steps, int]:
    """The steps of points with so many of them in both shares of the period, and how many a period has."""
    split = system.split[:1] if system.one_split else system.split
    if samples and not system.one_split:
        raise ValueError("samples need one contact ratio for all points")
    if samples:
        length, start, sampled = steps_with_samples(first + second, float(split[0]), samples)
    else:
        (length, start), sampled = steps_of_two_lengths(first, second, split), np.zeros(0, np.int64)
    return describe_steps(system, length, start, sampled), len(length)


def step_counts(system: SwitchedSystem) -> np.ndarray:
    """Steps (P, 2) in both shares of the period, rounded up to few distinct numbers so that points share grids.

    They and `orthonormalisations` depend on the point alone, so that a result does not depend on the other points.
    """
    needed = np.ceil(least_steps(system))
    grain = 2.0 ** np.floor(np.log2(np.maximum(needed, 16)) - 3)
    whole, share = np.ceil(needed / grain) * grain, np.stack([system.split, 1 - system.split], axis=1)
    if not system.one_split:
        share = np.ceil(_SHARES * share) / _SHARES
    return np.maximum(np.ceil(whole[:, None] * share), 1).astype(int)


def orthonormalisations(system: SwitchedSystem) -> np.ndarray:
    """How often tangent vectors are orthonormalised in a period, (P,)."""
    spread = (np.abs(system.trace) + 1.0) * system.period  # upper bound, in a period, of the logarithm of the factor
    return 2 ** np.ceil(np.log2(np.maximum(spread / _MAX_SPREAD, 1.0))).astype(int)


def steps_of_two_lengths(first: int, second: int, split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths and starts (N, Q) of the steps as shares of the period, for shares ``split`` (Q,): so many equal steps
    before the stiffness jump, and so many after it."""
    length = np.concatenate([np.tile(split / first, (first, 1)), np.tile((1 - split) / second, (second, 1))])
    start = np.concatenate(
        [np.arange(first)[:, None] * (split / first), split + np.arange(second)[:, None] * ((1 - split) / second)]
    )
    return length, start


def steps_with_samples(count: int, split: float, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lengths and starts (N, 1) of at least ``count`` steps that begin, among others, at equidistant samples and at the
    stiffness jump; and the numbers of the steps (samples,) at which the samples are taken."""
    fine = samples * int(np.ceil(count / samples))
    start = np.arange(fine) / fine
    nearest = np.argmin(np.abs(start - split))
    if abs(start[nearest] - split) < 1e-12:
        start[nearest] = split
    elif 0 < split < 1:
        start = np.sort(np.append(start, split))
    length = np.diff(np.append(start, 1.0))
    sampled = np.searchsorted(start, np.arange(samples) / samples - 1e-9)
    return length[:, None], start[:, None], sampled


def describe_steps(system: SwitchedSystem, length: np.ndarray, start: np.ndarray, sampled: np.ndarray) -> Steps:
    """`Steps` of points that share a grid: those of one period if lengths and starts (N, Q) have Q = 1, else those of
    one period for each point. ``sampled`` are the numbers of the steps at which samples are taken."""
    split = system.split[:1] if system.one_split else system.split
    level = np.all(start >= split - 1e-12, axis=1).astype(np.int64)
    harmonics = np.arange(1, max(system.f_cos.shape[1], system.chi_cos.shape[1]) + 1)
    phase = 2 * np.pi * start.T.ravel()[:, None] * harmonics
    entry: np.ndarray = _equal_runs(level, length[:, 0]) if shared(system) else np.arange(len(length))
    sample = np.full(len(length), -1)
    sample[sampled] = np.arange(len(sampled))
    periods = length.shape[1]
    values = np.empty((phase.shape[0], 2 + 2 * len(harmonics)))
    values[:, LENGTH], values[:, LEVEL] = length.T.ravel(), np.tile(level, periods)
    values[:, WAVES::2], values[:, WAVES + 1 :: 2] = np.cos(phase), np.sin(phase)
    entry_end = np.searchsorted(entry, entry, side="right")
    return Steps(np.tile(entry, periods), np.tile(entry_end, periods), np.tile(sample, periods), values)


def _equal_runs(level: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Number (N,) the runs of consecutive steps with equal lengths (N,) on one stiffness level (N,)."""
    new = (np.diff(level) != 0) | (np.abs(np.diff(length)) > 1e-15)
    return np.concatenate([[0], np.cumsum(new)]).astype(np.int64)
