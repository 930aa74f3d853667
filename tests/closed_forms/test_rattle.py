"""Rattle of a loose wheel: the onset in closed form, and what a scan says of it."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.rattle import rattle_document
from gearchaos.dynamics import Classification
from gearchaos.dynamics.orbits import tangent_frame
from gearchaos.errors import InputError
from gearchaos.flow import Measure
from gearchaos.gears.operation.operating import as_model
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.initial_value_problems import PERIODS_PER_VALUE, initial_value_problems
from gearchaos.studies.operation.followed_motions import parts_between
from tests.closed_forms.linear_gears import loose_train, onset

SHORT = Classification(transient_lengths=(80,), longest_period=8, exponent_run=40, doublings=0, longest_transient=0)
"""Enough for motions in contact, which decay by e⁻⁰·⁴⁶ in a period; chaos is not followed to its end."""


@pytest.fixture(scope="module")
def scan():
    return gc.rattle(loose_train("always"), "loose.torque=-0.2:-0.08:4", settings=SHORT)


def test_the_onset_is_that_of_the_closed_form(scan):
    assert onset() == pytest.approx(0.1000035, abs=5e-8)
    assert scan.onset_value.values == pytest.approx([-onset()], rel=1e-7)
    assert scan.onset_linear.values == pytest.approx([-onset()], rel=1e-7)
    assert scan.onset_mesh.values.tolist() == ["driver/loose"]


def two_loose_wheels() -> gc.Rattle:
    """Alike but for their drag, which is half as large again for the second one, on a driver that nothing moves."""
    one = loose_train("always")
    wheels = [replace(one.body("loose"), name=name, torque=torque) for name, torque in (("p", -0.2), ("q", -0.3))]
    meshes = [replace(one.meshes[0], between=("driver", wheel.name), name=wheel.name + "!") for wheel in wheels]
    train = gc.Train(speed=800.0, damping_law="always", bodies=[one.bodies[0], *wheels], meshes=meshes)
    return gc.Rattle(train, "torque=-0.2:-0.05:4", settings=SHORT)


def test_onsets_of_several_meshes_are_searched_together():
    found = two_loose_wheels().run(threads=2)
    assert found.onset_mesh.values.tolist() == ["p!", "q!"]
    assert found.onset_value.values == pytest.approx([-onset(), -onset() / 1.5], rel=1e-7)
    assert found.onset_linear.values == pytest.approx([-onset(), -onset() / 1.5], rel=1e-7)


def test_a_part_that_is_tried_has_a_round_of_the_search_of_onsets_and_the_price_has_all():
    study = two_loose_wheels()
    part, whole = study.thinned(1.0), study.run()
    found = part.run()
    assert found.mesh_contact.equals(whole.mesh_contact) and "search_over_scans" not in whole.attrs
    assert (miss := np.abs(found.onset_value - whole.onset_value)).max() < 0.05 / 9 and miss.min() > 0.05 / 9**3
    assert found.attrs["search_over_scans"] > 0
    assert study.thinned(0.0).run().onset_value.values == pytest.approx([-0.125, -0.075]) and not study.smaller(0.5)
    # scans that take 2 s and a round of 1 s are 3 s, to become 2 s + 9 of 1 s, or twice 2 s + 9 of 1 s
    half, price = found.assign_attrs(search_over_scans=0.5), part.cost.seconds()
    assert 3 * part.needed(half) == pytest.approx(2 + 9)
    part._set(trial_of=replace(part.cost, steps=2 * part.cost.steps))
    assert 3 * part.needed(half) * part.trial_of.seconds() / price == pytest.approx(2 * 2 + 9)


@pytest.mark.slow
def test_the_law_of_the_damping_does_not_change_the_onset():
    found = gc.rattle(loose_train("contact"), "loose.torque=-0.12:-0.0995:2", settings=SHORT)
    assert found.onset_value.values == pytest.approx([-onset()], rel=1e-7)


def test_the_excitation_ratio_is_the_fall_of_the_force_over_its_mean(scan):
    assert scan.excitation_ratio.values[:, 0] == pytest.approx(onset() / np.array([0.2, 0.16, 0.12, 0.08]), rel=1e-12)


def test_two_orders_fall_together_at_the_instant_of_their_least_sum():
    both = ({"order": 1, "acceleration": 200.0}, {"order": 2, "acceleration": 150.0, "phase": math.pi})
    found = gc.rattle(loose_train(motion=both), "loose.torque=-0.4:-0.3:2").excitation_ratio.values[:, 0]
    angle = np.linspace(0, 2 * math.pi, 100_001)
    least = (onset(1, 200.0) * np.cos(angle) - onset(2, 150.0) * np.cos(2 * angle)).min()
    assert found == pytest.approx(-least / np.array([0.4, 0.3]), rel=1e-5)


def test_the_price_has_both_slow_sweeps():
    study = gc.Rattle(loose_train(), Axis("loose.torque", -0.2, -0.1, 3), settings=SHORT)
    assert study.cost.sequential == 2 * 3 * PERIODS_PER_VALUE and study.cost.motions == 9


@pytest.mark.parametrize(("changed", "speed", "parts"), [
    ({}, 2000.0, 100), ({"stiffness": {"levels": [2.1e8, 1.9e8], "starts": [0.0, 0.5]}}, 2000.0, 200),
    ({"error_amplitudes": [1e-7]}, 2000.0, 200), ({"eccentricity": [1e-6, 0]}, 2000.0, 200), ({}, 80e3, 200)])
def test_speeds_are_close_where_an_excitation_may_meet_a_resonance(changed, speed, parts):
    model = as_model(loose_train(**changed))  # at 2000 rpm the order 2 is at 67 Hz, the natural frequency 4530 Hz
    assert parts_between(model, speed / 2, speed, 0.01) == parts


@pytest.mark.parametrize("miss", [1e-7, -1e-7])
def test_a_throw_is_a_parabola_and_no_touch_of_the_back_flank_is_passed_over(miss):
    flow = initial_value_problems(as_model(loose_train(motion=(), speed=300.0))).flow
    fall, until = flow.system.f0[0, 1], np.linspace(10.0, 100.0, 61)  # the turning point
    w = np.stack([miss - 1 + fall * until**2 / 2, -fall * until])
    plain, measured, beside = (flow.advance(w, 1, points=np.zeros(61, int), **options) for options in (
        {}, {"measured": True}, {"tangent": tangent_frame(2, 61)}))
    least, touched = measured.measures[Measure.Z_MIN] + 1, measured.measures[Measure.BACK_TIME] > 0
    assert not flow.system.A[0, 1].any() and touched.all() == touched.any() == (miss < 0)
    assert least == pytest.approx(miss, abs=1e-13) if miss > 0 else (least < 0).all() and (least > miss).all()
    assert np.abs(plain.w - measured.w).max() < 1e-11 and np.abs(plain.w - beside.w).max() < 1e-11


@pytest.mark.parametrize("order", [2, 8, 16])
def test_a_flight_under_a_fast_excitation_ends_where_integrals_say(order):
    """z'' = f0 + Σ a cos jωτ + b sin jωτ leaves z' + f0 T and z + z' T + f0 T²/2 + Σ b T/(jω) after a period T."""
    motion = [{"order": n, "acceleration": 300.0 * n, "phase": 0.7} for n in {1, order}]
    flow = initial_value_problems(as_model(loose_train(motion=motion, speed=3000.0, backlash=4e-3))).flow
    contacts, w0 = flow.system.contacts, np.array([-0.8, 0.0])
    period, f0, b = 2 * np.pi / flow.system.omega[0], flow.system.f0[0, 1], contacts.f_sin[0, :, 1]
    turns = b / contacts.orders / flow.system.omega[0] * period
    expected = [w0[0] + w0[1] * period + f0 * period**2 / 2 + turns.sum(), w0[1] + f0 * period]
    run = flow.advance(w0[:, None], 1, measured=True)
    assert run.measures[Measure.BACK_TIME] == run.measures[Measure.FRONT_TIME] == 0
    assert np.abs(turns).max() > 1e-3 and run.w[:, 0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_exponents_of_a_rattling_wheel_sum_to_its_mean_trace():
    found = gc.regime(loose_train(wheel={"torque": -0.05}), settings=SHORT)
    assert found.contact == "two-sided" and found.trace_error < 1e-11


def stepped(level: float, torques: str) -> Any:
    steps = {"levels": [2e8 * (1 + level), 2e8 * (1 - level)], "starts": [0.0, 0.5]}
    return gc.rattle(loose_train("always", stiffness=steps), f"loose.torque={torques}", settings=SHORT)


@pytest.mark.slow
def test_where_the_stiffness_varies_there_is_no_linear_onset_and_contact_is_lost_earlier():
    found = stepped(0.05, "-0.2:-0.13:2")
    assert np.isnan(found.excitation_ratio.values).all()
    assert found.onset_mesh.values.tolist() == ["driver/loose"] and np.isnan(found.onset_linear.values).all()
    assert found.onset_value.values < -1.3 * onset()


@pytest.mark.slow
def test_where_the_stiffness_varies_by_a_quarter_no_drag_keeps_the_contact():
    """The ripple of the force grows with the drag, as the deflection does."""
    found = stepped(0.25, "-30:-0.1:2")
    assert (found.mesh_contact.values > 0).all() and found.sizes["onset"] == 0


def test_forces_and_impacts_of_a_mesh_in_contact_are_those_of_the_linear_train(scan):
    units, first = as_model(loose_train()).units, scan.sel(history="rest").isel({"loose.torque": 0, "mesh": 0})
    assert float(first.mesh_force_deviation) * units.force == pytest.approx(
        onset() / 0.045 / math.sqrt(2) * abs(1 + 60j * 2 * 800 * 2 * math.pi / 60 / 2e8), rel=1e-9)  # with the damper
    assert float(first.mesh_impulse) * units.force == pytest.approx(0.2 / 0.045, rel=1e-9)
    assert float(first.mesh_impacts) == 0
    assert float(scan.sel(history="rest").isel({"loose.torque": -1, "mesh": 0}).mesh_impacts) > 0


def test_the_document_says_where_each_mesh_is_in_contact(scan):
    axis = Axis("loose.torque", -0.2, -0.08, 4)
    content = rattle_document(scan, axis)
    found = content["meshes"]["driver/loose"]
    assert found["lost"] == [[pytest.approx(-0.08)] * 2] and found["both_flanks"] in ([], found["lost"])
    assert found["lost_after_sweeps_alone"] == [] and content["onsets"][0]["value"] == pytest.approx(-onset())


@pytest.mark.parametrize(("model", "options", "field"), [
    (gc.MeshModel.of(q0=0.1), {"axis": "q0=0.1:0.2:2"}, "model"), (loose_train(), {"mesh": "other"}, "mesh"),
    (loose_train(), {"axis": "z=0:1:2"}, "axis")])
def test_what_cannot_rattle_is_refused(model, options, field):
    with pytest.raises(InputError) as error:
        gc.rattle(model, **{"axis": "loose.torque=-0.2:-0.08:4", **options})
    assert error.value.field == field
