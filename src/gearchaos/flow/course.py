"""How the points of a system go through their mesh periods: how many steps, how long, and what stands where.

Points with as many steps share them, and are tabulated together.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.layout import LENGTH, LEVEL, STEP_ANGLE, WAVES, Courses, Nodes, Points
from gearchaos.flow.tables import kept, parameter_array, rate, shared, tabulate
from gearchaos.model.switched import SwitchedAffine

_SHARES = 8
"""Where the contact ratio differs from point to point, shares of the period are rounded up to eighths."""

_SPREAD = 8.0
"""Tangent vectors may part by this factor, in ln, before they are orthonormalised."""


def lay_out(system: SwitchedAffine, samples: int) -> tuple[Points, np.ndarray]:
    """Steps and step tables of all points, with so many equidistant samples among the steps; and the number of each
    point's plan (P,): points with the same go through their pieces step by step alike."""
    plans, plan = np.unique(np.column_stack([node_count(system), runs(system)]), axis=0, return_inverse=True)
    plan, phys = plan.ravel(), parameter_array(system)
    courses = Courses(*(np.zeros(system.points, np.int64) for _ in Courses._fields))
    nodes, tables, begun, rows = [], [], 0, 0
    for i, (first, second, cuts) in enumerate(plans.tolist()):
        members = np.flatnonzero(plan == i)
        own, steps = _planned(system.take(members), first, second, samples)
        table = tabulate(system.take(members), phys[members], own, steps)
        number = np.arange(len(members))
        courses.node[members] = begun + (number * steps if len(own.piece) > steps else 0)
        courses.steps[members], courses.stride[members] = steps, max(1, steps // cuts)
        courses.row[members] = rows + number * table.shape[1]
        nodes.append(own)
        tables.append(table.reshape(-1, *table.shape[2:]))
        begun, rows = begun + len(own.piece), rows + len(tables[-1])
    whole = Nodes(*map(np.concatenate, zip(*nodes, strict=True)))
    h, k = system.f_cos.shape[1], system.chi_cos.shape[1]
    return Points(phys, whole, courses, np.concatenate(tables), h, k, kept(system)), plan


def _planned(system: SwitchedAffine, first: int, second: int, samples: int) -> tuple[Nodes, int]:
    """The nodes of points with so many steps in both shares of the period, and how many steps that makes."""
    split = system.split[:1] if system.one_split else system.split
    if samples and not system.one_split:
        raise ValueError("samples need one contact ratio for all points")
    if samples:
        length, start, which = sampled(first + second, float(split[0]), samples)
    else:
        (length, start), which = two_lengths(first, second, split), np.zeros(0, np.int64)
    return nodes(system, length, start, which), len(length)


def node_count(system: SwitchedAffine) -> np.ndarray:
    """Steps (P, 2) that both shares of a period need, rounded up to few distinct numbers so that points share them.

    They and `runs` depend on a point alone, so that a result does not depend on what else is computed beside it.
    """
    needed = np.ceil(2 * np.pi / system.omega * rate(system) / STEP_ANGLE)
    grain = 2.0 ** np.floor(np.log2(np.maximum(needed, 16)) - 3)
    whole, share = np.ceil(needed / grain) * grain, np.stack([system.split, 1 - system.split], axis=1)
    if not system.one_split:
        share = np.ceil(_SHARES * share) / _SHARES
    return np.maximum(np.ceil(whole[:, None] * share), 1).astype(int)


def runs(system: SwitchedAffine) -> np.ndarray:
    """In how many runs of steps a period must be cut, (P,), between which tangent vectors are orthonormalised."""
    spread = (np.abs(system.trace) + 1.0) * system.period  # of ln|v| in a period, at the very most
    return 2 ** np.ceil(np.log2(np.maximum(spread / _SPREAD, 1.0))).astype(int)


def two_lengths(first: int, second: int, split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths and starts (N, Q) of the steps as shares of the period, the stiffness jump among the nodes."""
    length = np.concatenate([np.tile(split / first, (first, 1)), np.tile((1 - split) / second, (second, 1))])
    start = np.concatenate(
        [np.arange(first)[:, None] * (split / first), split + np.arange(second)[:, None] * ((1 - split) / second)]
    )
    return length, start


def sampled(count: int, split: float, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lengths and starts (N, 1) of steps that include equidistant samples, and which nodes the samples are."""
    fine = samples * int(np.ceil(count / samples))
    start = np.arange(fine) / fine
    nearest = np.argmin(np.abs(start - split))
    if abs(start[nearest] - split) < 1e-12:
        start[nearest] = split
    elif 0 < split < 1:
        start = np.sort(np.append(start, split))
    length = np.diff(np.append(start, 1.0))
    which = np.searchsorted(start, np.arange(samples) / samples - 1e-9)
    return length[:, None], start[:, None], which


def nodes(system: SwitchedAffine, length: np.ndarray, start: np.ndarray, sample_at: np.ndarray) -> Nodes:
    """The steps of a period for points with as many of them: one period if lengths and starts (N, Q) have Q = 1, else
    one for each point."""
    split = system.split[:1] if system.one_split else system.split
    level = np.all(start >= split - 1e-12, axis=1).astype(np.int64)
    harmonics = np.arange(1, max(system.f_cos.shape[1], system.chi_cos.shape[1]) + 1)
    phase = 2 * np.pi * start.T.ravel()[:, None] * harmonics
    piece: np.ndarray = _stretches(level, length[:, 0]) if shared(system) else np.arange(len(length))
    sample = np.full(len(length), -1)
    sample[sample_at] = np.arange(len(sample_at))
    periods = length.shape[1]
    values = np.empty((phase.shape[0], 2 + 2 * len(harmonics)))
    values[:, LENGTH], values[:, LEVEL] = length.T.ravel(), np.tile(level, periods)
    values[:, WAVES::2], values[:, WAVES + 1 :: 2] = np.cos(phase), np.sin(phase)
    until = np.searchsorted(piece, piece, side="right")
    return Nodes(np.tile(piece, periods), np.tile(until, periods), np.tile(sample, periods), values)


def _stretches(level: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Number the runs of equal steps on one level."""
    new = (np.diff(level) != 0) | (np.abs(np.diff(length)) > 1e-15)
    return np.concatenate([[0], np.cumsum(new)]).astype(np.int64)
