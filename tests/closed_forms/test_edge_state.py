"""The saddle between the basins of two attractors."""

import json

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.studies.orbits.saddles import EdgeTracking
from tests.commands import ask, run_json

SINGLE = gc.MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05, omega=2.3)
FULL = gc.MeshModel.of(kind="full", kappa=0.5, kappa1=0.6, omega=0.7, eps1=0.06, q0=0.1)


def test_the_edge_state_of_two_coordinates_is_the_saddle_on_the_boundary():
    found = gc.edge_state(SINGLE, {"z": 1.04, "z_dot": 0.0}, {"z": 0.28, "z_dot": 0.92}, period=5)
    assert found.orbit is not None and found.orbit.unstable == 1 and found.orbit.residual < 1e-10
    kept = EdgeTracking(SINGLE, {"z": 1.04, "z_dot": 0.0}, {"z": 0.28, "z_dot": 0.92}, period=5)
    assert json.loads(kept.dataset().attrs["orbit"])["period"] == found.orbit.period
    saddles = gc.orbits(SINGLE, period=found.orbit.period)
    assert min(abs(o.multipliers[0] - found.orbit.multipliers[0]) for o in saddles) < 1e-8


def test_the_command_says_which_saddle_it_is(tmp_path):
    values = {"kind": "single", "zeta": 0.025, "q0": 0.1, "eps1": 0.05, "omega": 2.3}
    command = ["edge-state", *(text for item in values.items() for text in ("--set", "{}={}".format(*item))),
               "--first", "z=1.04", "--first", "z_dot=0", "--second", "z=0.28", "--second", "z_dot=0.92",
               "--period", 5, "--out", tmp_path / "edge.nc"]
    found, page = run_json(*command), ask(*command).stdout
    orbit = json.loads(gc.load(tmp_path / "edge.nc").attrs["orbit"])
    saddle = found["saddle"]
    assert saddle == {name: orbit[name] for name in saddle} and {"period", "multipliers", "state"} <= saddle.keys()
    assert f"a saddle of period {orbit['period']}T, unstable in 1 direction" in page
    assert f"{orbit['multipliers'][0][0]:+.6f} +0.000000i" in page and f"z = {orbit['state']['z']:.6g}" in page


@pytest.mark.exhaustive
def test_the_edge_state_of_six_coordinates_divides_two_attractors():
    rows = gc.attractors(FULL, starts=40)
    numbers = rows.attractor.values
    names = [str(n) for n in rows.data_vars if str(n).startswith("start_")]
    starts = [{n.removeprefix("start_"): float(rows[n][np.flatnonzero(numbers == k)[0]]) for n in names}
              for k in (0, 1)]
    found = gc.edge_state(FULL, *starts)
    assert found.orbit is not None and found.orbit.unstable == 1 and len(found.orbit.multipliers) == 6
    factors = {round(gc.regime(FULL.with_values(start)).v_rms, 6) for start in starts}
    pushed = {
        round(gc.regime(FULL.with_values({**found.orbit.state, "x1_dot": found.orbit.state["x1_dot"] + d})).v_rms, 6)
        for d in (0.02, -0.02)}
    assert len(factors) == 2 and pushed == factors


def test_two_starts_of_one_attractor_are_refused():
    with pytest.raises(gc.InputError, match=r"second.*another attractor"):
        gc.edge_state(SINGLE, {"z": 1.04}, {"z": 1.05})


@pytest.mark.parametrize(("first", "second", "words"), [
    (None, {"z": 1.05}, "first must give initial values"), ({"z": 1.04}, {"y": 1.2}, "second must be one of")])
def test_starts_that_are_no_states_are_refused(first, second, words):
    with pytest.raises(InputError, match=words):
        gc.edge_state(SINGLE, first, second)
