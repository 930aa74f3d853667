"""Branches against slow sweeps: a motion that stays on one orbit over a whole sweep lies on the branch of its start."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc

NAMES = ("omega", "eps1", "q0", "zeta", "chi1", "contact_ratio")
LOW, HIGH = (0.3, 0.02, 0.02, 0.015, 0.0, 1.2), (2.6, 0.3, 0.3, 0.08, 0.4, 1.8)


def random_sweep(seed: int) -> tuple[gc.MeshModel, gc.Axis, xr.Dataset]:
    """A random model, an axis from its own value of one of its parameters, and the sweep along it."""
    rng = np.random.default_rng(seed)
    values = dict(zip(NAMES, rng.uniform(LOW, HIGH), strict=True))
    model = gc.MeshModel.of(kind="single", **values)
    name = NAMES[seed % len(NAMES)]
    width = 0.1 * (HIGH[NAMES.index(name)] - LOW[NAMES.index(name)])
    axis = gc.Axis(name, values[name], values[name] + width, 41)
    return model, axis, gc.bifurcation(model, axis, mode="up", points=64)


def stays(sweep: xr.Dataset) -> bool:
    """Whether the motion is on one orbit all the way."""
    jump = np.abs(np.diff(np.sort(sweep.section_z.values, axis=1), axis=0)).max()
    return bool(np.all(sweep.label == 1) and np.ptp(sweep.period.values) == 0 and jump <= 0.05)


def distance_from_branch(seed: int) -> float:
    """How far the orbit at the end of a random sweep is from the branch of its start; NaN where the motion changes."""
    model, axis, sweep = random_sweep(seed)
    if not stays(sweep):
        return np.nan
    period = sweep.period.values[0]
    found = gc.branch(model, gc.Axis(axis.name, axis.start, axis.stop, 2))
    assert found.period.values[0] == period
    at_end = found.section_z.values[found[axis.name].values == axis.stop]
    expected = np.sort(sweep.section_z.values[-1, :period])
    return min(np.abs(np.sort(row) - expected).max() for row in at_end)


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(5), pytest.param(range(5, 24), marks=pytest.mark.exhaustive)])
def test_the_ends_of_sweeps_lie_on_the_branches_of_their_starts(seeds):
    found = np.array([distance_from_branch(seed) for seed in seeds])
    assert np.nanmax(found) < 1e-6
    assert np.isfinite(found).mean() >= 0.5, "at least half of the sweeps are compared"
