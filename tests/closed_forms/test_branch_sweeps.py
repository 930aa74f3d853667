"""Branches against slow sweeps: a motion that stays on one orbit over a whole sweep lies on the branch of its start."""

from __future__ import annotations

import numpy as np
import pytest

import gearchaos as gc

NAMES = ("omega", "eps1", "q0", "zeta", "chi1", "contact_ratio")
LOW, HIGH = (0.3, 0.02, 0.02, 0.015, 0.0, 1.2), (2.6, 0.3, 0.3, 0.08, 0.4, 1.8)
VALUES = 41


def random_sweep(seed: int) -> tuple[gc.MeshModel, gc.Axis]:
    """A random model, and an axis from its own value of one of its parameters."""
    rng = np.random.default_rng(seed)
    values = dict(zip(NAMES, rng.uniform(LOW, HIGH), strict=True))
    model = gc.MeshModel.of(kind="single", **values)
    name = NAMES[seed % len(NAMES)]
    width = 0.1 * (HIGH[NAMES.index(name)] - LOW[NAMES.index(name)])
    return model, gc.Axis(name, values[name], values[name] + width, VALUES)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_the_end_of_a_sweep_lies_on_the_branch_of_its_start(seed):
    model, axis = random_sweep(seed)
    sweep = gc.bifurcation(model, axis, mode="up", points=64)
    periods, section = sweep.period.values, np.sort(sweep.section_z.values, axis=1)
    jump = np.abs(np.diff(section, axis=0)).max()
    if np.any(sweep.label.values != 1) or np.any(periods != periods[0]) or jump > 0.05:
        pytest.skip("the motion changes on the way")
    found = gc.branch(model, gc.Axis(axis.name, axis.start, axis.stop, 2))
    assert found.period.values[0] == periods[0]
    at_end = found.section_z.values[found[axis.name].values == axis.stop]
    expected = np.sort(sweep.section_z.values[-1, : periods[0]])
    assert min(np.abs(np.sort(row) - expected).max() for row in at_end) < 1e-6


@pytest.mark.slow
def test_enough_sweeps_are_compared():
    """Fewer than half of the random sweeps may be skipped."""
    kept = 0
    for seed in range(24):
        model, axis = random_sweep(seed)
        sweep = gc.bifurcation(model, axis, mode="up", points=0)
        kept += int(np.all(sweep.label.values == 1) and np.ptp(sweep.period.values) == 0)
    assert kept >= 12
