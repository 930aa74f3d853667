"""Slow sweeps against their definition: the motion simulated on and on, a value of the parameter after the other."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.studies.core.initial_value_problems import swept_initial_values
from gearchaos.studies.maps.zones import _count_distinct

PERIODS_PER_VALUE = 400
"""Mesh periods at every value, as docs/verdicts.md says."""

BENT = gc.MeshModel.of(q0=0.1, eps1=0.02)
AXIS = gc.Axis("omega", 0.6, 0.9, 7)
SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
NAMES = {"single": ("z",), "torsional": ("x1", "x2"), "full": ("x1", "x2", "y1", "y2")}


def arrivals(model, name, values):
    """The model at each value as a sweep reaches it, in the order of the sweep: from the last section of the motion at
    the value before, the mean rotation turned back, which the mesh does not feel."""
    for value in values:
        model = model.with_values({name: value})
        yield model
        last = gc.simulate(model, 1, transient=PERIODS_PER_VALUE - 1)
        model = model.with_values({n: float(last[f"section_{n}"][0]) for each in NAMES[model.kind] for n in (
            each, f"{each}_dot")})


@pytest.mark.parametrize("up", [True, False])
@pytest.mark.parametrize("model", [
    BENT, BENT.with_values({"kind": "full", "kappa1": 0.6, "eps1": 0.1}), BENT.with_values({"kind": "single"}),
], ids=lambda model: model.kind)
def test_a_sweep_carries_the_state_from_value_to_value(model, up):
    axis = gc.Axis("omega", 0.62, 0.74, 3)
    found = swept_initial_values(model, axis, up)
    for column, start in enumerate(arrivals(model, "omega", axis.values if up else axis.values[::-1])):
        here = {n: v[0, column if up else -1 - column] for n, v in found.items()}
        known = {"z": 1.0 - model.error.amplitudes[0], "x1": 1.0, **start.initial}
        if "z" not in here:  # the wheels may have turned
            here["x1"], known["x1"] = here["x1"] - here.pop("x2"), known["x1"] - known.pop("x2", 0.0)
        for name, value in here.items():
            assert value == pytest.approx(known.get(name, 0.0), abs=1e-9)


def test_softening_bends_the_resonance_and_sweeps_tell_which_way():
    """Lost contact softens the mesh, so the resonance leans to low frequencies: where two motions are possible a sweep
    downwards rides on the large one and a sweep upwards on the small one (A. Kahraman, R. Singh, *Non-linear dynamics
    of a spur gear pair*, J. Sound Vib. 142 (1990) 49)."""
    up, down = (gc.bifurcation(BENT, AXIS, points=1, mode=m, settings=SHORT) for m in ("up", "down"))
    differ = np.abs(up.v_rms.values - down.v_rms.values) > 0.01
    assert differ.any() and np.all(down.v_rms.values[differ] > up.v_rms.values[differ])
    row = gc.zones(BENT, AXIS, gc.Axis("eps1", 0.02, 0.021, 2), starts=2, settings=SHORT).isel(eps1=0)
    np.testing.assert_allclose(row.v_rms_up, up.v_rms, rtol=1e-6)
    np.testing.assert_allclose(row.v_rms_down, down.v_rms, rtol=1e-6)
    np.testing.assert_array_equal(row.hysteresis, differ)


def test_sweeps_reach_their_attractors_whatever_the_own_start_leads_to():
    """At both ends of the sweeps there is one motion only; between them two, of which they take one each, as above."""
    model, sweep = BENT.with_values({"omega": 0.7}), gc.Axis("omega", 0.38, 0.8, 22)
    found = gc.attractors(model, 32, settings=SHORT)
    assert found.sizes["number"] == 2
    large = int(np.argmax(found.attractor_v_rms.values))
    for number in (0, 1):
        lane = int(np.flatnonzero(found.attractor.values == number)[0])
        own = {n: float(found[f"start_{n}"][lane]) for n in ("x1", "x1_dot")}
        swept = gc.attractors(model.with_values(own), 32, sweep=sweep, settings=SHORT)
        assert (int(swept.attractor_down), int(swept.attractor_up)) == (large, 1 - large)


def test_motions_of_a_cell_are_one_if_their_mean_points_agree_to_a_millionth():
    """Rows: one motion twice; two a hundred thousandth apart; one known and one not; another period; nothing known."""
    centre = np.array([[0.2, 0.2 + 5e-7, 0.2], [0.2, 0.20001, 0.2], [0.2, 0.7, 0.2], [0.2, 0.2, 0.2], [0.1, 0.2, 0.3]])
    label, period = np.ones((5, 3), dtype=int), np.full((5, 3), 2)
    known = np.ones((5, 3), dtype=bool)
    known[2, 1], known[4], period[3, 2] = False, False, 4
    motions = {"label": label, "period": period, "centre_z": centre, "centre_z_dot": np.zeros((5, 3))}
    assert _count_distinct(motions, known).tolist() == [1, 2, 1, 2, 0]
    motions |= {"centre_z_dot": centre, "centre_z": 0 * centre}
    assert _count_distinct(motions, known).tolist() == [1, 2, 1, 2, 0]


def test_a_sweep_that_runs_away_starts_anew():
    """Far beyond the backlash the varying stiffness drives the motion ever on, by parametric resonance."""
    model = gc.MeshModel.of(kind="single", omega=2.0, z=30.0)
    np.testing.assert_array_equal(swept_initial_values(model, gc.Axis("omega", 2.0, 2.1, 2), True)["z"], [[30.0, 30.0]])


def test_rows_of_a_sweep_do_not_mix():
    axis, values = gc.Axis("omega", 0.6, 0.8, 3), [0.01, 0.02, 0.03]
    together = swept_initial_values(BENT, axis, True, {"eps1": np.array(values)})
    for row, value in enumerate(values):
        for name, alone in swept_initial_values(BENT.with_values({"eps1": value}), axis, True).items():
            np.testing.assert_array_equal(together[name][row], alone[0])


def test_a_row_of_a_sweep_with_equal_bearings_turns_on_beside_one_whose_bearings_differ():
    """Its mean rotation follows from the state of the wheels, so that it is not set back."""
    model, axis = BENT.with_values({"beta1": 1e-4, "beta2": 1e-4, "x1_dot": 0.3}), gc.Axis("omega", 0.6, 0.7, 2)
    together = swept_initial_values(model, axis, True, {"beta2": np.array([1e-4, 2e-4])})
    alone = swept_initial_values(model, axis, True)
    assert alone["x2"][0, 1] > 100
    np.testing.assert_allclose(together["x2"][0], alone["x2"][0], rtol=1e-9)
