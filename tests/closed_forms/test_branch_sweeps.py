"""Branches against slow sweeps: a motion that stays on one orbit over a whole sweep lies on the branch of its start."""

import numpy as np
import pytest

import gearchaos as gc

NAMES = ("omega", "eps1", "q0", "zeta", "chi1", "contact_ratio")
LOW, HIGH = (0.3, 0.02, 0.02, 0.015, 0.0, 1.2), (2.6, 0.3, 0.3, 0.08, 0.4, 1.8)


def distance_from_branch(seed: int) -> float:
    """How far the orbit at the end of a random sweep is from the branch of its start; NaN where the motion changes.

    The sweep of a random model is along one of its parameters, from its own value on."""
    name, values = NAMES[seed % len(NAMES)], dict(zip(
        NAMES, np.random.default_rng(seed).uniform(LOW, HIGH), strict=True))
    model = gc.MeshModel.of(kind="single", **values)
    stop = values[name] + 0.1 * (HIGH[NAMES.index(name)] - LOW[NAMES.index(name)])
    sweep = gc.bifurcation(model, gc.Axis(name, values[name], stop, 41), mode="up", points=64)
    jump, period = np.abs(np.diff(np.sort(sweep.section_z.values, axis=1), axis=0)).max(), sweep.period.values[0]
    if np.any(sweep.label != 1) or np.any(sweep.period != period) or jump > 0.05:  # no longer on one orbit
        return np.nan
    found = gc.branch(model, gc.Axis(name, values[name], stop, 2))
    assert found.period.values[0] == period
    at_end = found.section_z.values[found[name].values == stop]
    expected = np.sort(sweep.section_z.values[-1, :period])
    return min(np.abs(np.sort(row) - expected).max() for row in at_end)


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(5), pytest.param(range(5, 24), marks=pytest.mark.exhaustive)])
def test_the_ends_of_sweeps_lie_on_the_branches_of_their_starts(seeds):
    found = np.array([distance_from_branch(seed) for seed in seeds])
    assert np.nanmax(found) < 1e-6
    assert np.isfinite(found).mean() >= 0.5, "at least half of the sweeps are compared"
