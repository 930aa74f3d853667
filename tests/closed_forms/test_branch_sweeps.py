"""Branches against slow sweeps: a motion that stays on one orbit over a whole sweep lies on the branch of its start."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc

NAMES = ("omega", "eps1", "q0", "zeta", "chi1", "contact_ratio")
LOW, HIGH = (0.3, 0.02, 0.02, 0.015, 0.0, 1.2), (2.6, 0.3, 0.3, 0.08, 0.4, 1.8)
VALUES = 41


SEEDS = [*range(8), *(pytest.param(seed, marks=pytest.mark.exhaustive) for seed in range(8, 24))]


@cache
def random_sweep(seed: int) -> tuple[gc.MeshModel, gc.Axis, xr.Dataset]:
    """A random model, an axis from its own value of one of its parameters, and the sweep along it."""
    rng = np.random.default_rng(seed)
    values = dict(zip(NAMES, rng.uniform(LOW, HIGH), strict=True))
    model = gc.MeshModel.of(kind="single", **values)
    name = NAMES[seed % len(NAMES)]
    width = 0.1 * (HIGH[NAMES.index(name)] - LOW[NAMES.index(name)])
    axis = gc.Axis(name, values[name], values[name] + width, VALUES)
    return model, axis, gc.bifurcation(model, axis, mode="up", points=64)


def stays(sweep: xr.Dataset) -> bool:
    """Whether the motion is on one orbit all the way."""
    jump = np.abs(np.diff(np.sort(sweep.section_z.values, axis=1), axis=0)).max()
    return bool(np.all(sweep.label == 1) and np.ptp(sweep.period.values) == 0 and jump <= 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_the_end_of_a_sweep_lies_on_the_branch_of_its_start(seed):
    model, axis, sweep = random_sweep(seed)
    if not stays(sweep):
        pytest.skip("the motion changes on the way")
    period = sweep.period.values[0]
    found = gc.branch(model, gc.Axis(axis.name, axis.start, axis.stop, 2))
    assert found.period.values[0] == period
    at_end = found.section_z.values[found[axis.name].values == axis.stop]
    expected = np.sort(sweep.section_z.values[-1, :period])
    assert min(np.abs(np.sort(row) - expected).max() for row in at_end) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, pytest.param(24, marks=pytest.mark.exhaustive)])
def test_at_least_half_of_the_sweeps_are_compared(count):
    assert sum(stays(random_sweep(seed)[2]) for seed in range(count)) >= count / 2
