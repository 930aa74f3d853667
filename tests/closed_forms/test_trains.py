"""Gear trains in closed form, and as pairs that they are."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import InputError
from gearchaos.flow import Measure
from gearchaos.gears.operation.operating import as_model
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from tests.closed_forms.linear_gears import loose_train

STEPS = {"levels": [3e8, 2e8], "starts": [0.0, 0.6]}


def mesh(a: str, b: str, z1: int, z2: int, **values: Any) -> gc.Mesh:
    return gc.Mesh(between=(a, b), teeth=(z1, z2), base_radii=(z1 * 1e-3, z2 * 1e-3),
                   **{"stiffness": STEPS, "damping": 600.0, "backlash": 1e-4, "error_amplitudes": [5e-6], **values})


def deflections(train: gc.Train, periods: int = 6) -> np.ndarray:
    """Deflections in m, (periods, meshes), from the static state."""
    return gc.simulate(train, periods).section_deflection.values * as_model(train).units.length


def pair_and_train(law: str, k: float = 600.0, levels: tuple[float, float] = (3e8, 2e8)) -> tuple[Any, Any]:
    """One mesh as a gear pair and as a train."""
    stiffness = {"levels": levels, "starts": [0.0, 0.6]}
    pair = gc.GearPair(n1=24, n2=36, I1=1e-3, I2=2e-3, R1=0.024, R2=0.036, c0=0.6 * levels[0] + 0.4 * levels[1], k=k,
                       backlash=1e-4, M10=40.0, speed=6000.0, stiffness_levels=levels, stiffness_starts=[0.0, 0.6],
                       error_amplitudes=[5e-6], damping_law=law)
    train = gc.Train(speed=6000.0, damping_law=law, meshes=[mesh("a", "b", 24, 36, damping=k, stiffness=stiffness)],
                     bodies=[gc.Body(name="a", inertia=1e-3, torque=40.0),
                             gc.Body(name="b", inertia=2e-3, torque=-60.0)])
    return pair, train


@pytest.mark.parametrize("law", ["always", "contact", "unilateral"])
def test_one_mesh_is_a_gear_pair(law):
    pair, train = pair_and_train(law)
    model = as_model(train)
    start = {"z": 1.4, "z_dot": 0.2}
    single, whole = (replace(each, initial=start) for each in (as_model(pair).with_values({"kind": "single"}), model))
    one, other = gc.simulate(single, 8), gc.simulate(whole, 8)
    assert model.units.length == pair.half_backlash
    assert model.units.rate == pytest.approx(pair.omega0, rel=1e-13)
    ours, theirs = model.train.scales, pair.scales
    assert (ours.torque1, ours.torque2) == pytest.approx((theirs.torque1, theirs.torque2), rel=1e-13)
    assert np.abs(one.section_z.values - other.section_z.values).max() < 1e-12
    found, expected = gc.regime(whole), gc.regime(single)
    assert (found.label, found.contact) == (expected.label, "one-sided") and expected.contact == "one-sided"
    assert found.dynamic_factor == pytest.approx(expected.dynamic_factor, rel=1e-10)
    assert found.meshes["a/b"]["force_peak"] == pytest.approx(expected.mesh_force_peak * pair.scales.force, rel=1e-10)


def test_a_flank_that_is_released_pushes_again_where_its_stiffness_jumps():
    """Motions of a grid of states, in the kernels of one spring and in those of several contacts."""
    pair, train = pair_and_train("unilateral", 3000.0, (1e8, 9e8))
    w = np.stack(np.meshgrid(np.linspace(0.8, 2.5, 40), np.linspace(-1.5, 0.5, 40))).reshape(2, -1)
    one, other = (initial_value_problems(model).flow.advance(w, 1, points=np.zeros(w.shape[1], int)).w
                  for model in (as_model(pair).with_values({"kind": "single"}), as_model(train)))
    assert np.abs(one - other).max() < 1e-11


def test_two_loose_wheels_on_one_driver_are_each_a_pair_of_their_own():
    one = loose_train()
    other = replace(one.meshes[0], between=("driver", "second"), name="driver/second", teeth=(20, 40),
                    base_radii=(0.03, 0.06))
    second = gc.Body(name="second", inertia=9e-4, torque=-0.08)
    alone = gc.Train(speed=800.0, bodies=[one.bodies[0], second], meshes=[other])
    both = gc.Train(speed=800.0, bodies=[*one.bodies, second], meshes=[*one.meshes, other])
    found = deflections(both, 1)
    assert np.abs(found[:, 0] - deflections(one, 1)[:, 0]).max() < 1e-15
    assert np.abs(found[:, 1] - deflections(alone, 1)[:, 0]).max() < 1e-15


def idler(inertia: float = 4e-4) -> gc.Train:
    return gc.Train(speed=5000.0, meshes=[mesh("a", "i", 24, 30), mesh("i", "b", 30, 36, phase=1.0)], bodies=[
        gc.Body(name="a", inertia=1e-3, torque=20.0), gc.Body(name="i", inertia=inertia),
        gc.Body(name="b", inertia=2e-3, torque=-30.0)])


def test_the_order_of_bodies_and_meshes_has_no_effect():
    one = idler()
    other = replace(one, bodies=[one.bodies[i] for i in (0, 2, 1)], meshes=one.meshes[::-1])
    assert np.abs(deflections(one) - deflections(other)[:, ::-1]).max() < 1e-15


def test_an_idler_of_infinite_inertia_parts_the_train_into_two_pairs():
    whole = idler(1e9)
    (a, i, b), meshes = whole.bodies, whole.meshes
    first = gc.Train(speed=5000.0, bodies=[a, replace(i, torque=-25.0)], meshes=meshes[:1])
    second = gc.Train(speed=4000.0, bodies=[replace(i, torque=25.0), b], meshes=meshes[1:])
    found = deflections(whole)
    assert np.abs(found[:, 0] - deflections(first)[:, 0]).max() < 1e-13
    assert np.abs(found[:, 1] - deflections(second)[:, 0]).max() < 1e-13


def test_a_shaft_that_is_nearly_rigid_makes_one_body():
    motor, load = gc.Body(name="motor", inertia=1e-3, torque=20.0), gc.Body(name="load", inertia=4e-2, torque=-100.0)

    def reducer(stiffness: float) -> gc.Train:
        return gc.Train(speed=3000.0, shafts=[gc.Shaft(between=("wheel", "pinion"), stiffness=stiffness, damping=20.0)],
                        meshes=[mesh("motor", "wheel", 20, 40), mesh("pinion", "load", 20, 50)], bodies=[
            motor, gc.Body(name="wheel", inertia=2e-3), gc.Body(name="pinion", inertia=4e-4), load])

    rigid = deflections(gc.Train(
        speed=3000.0, meshes=[mesh("motor", "wheel", 20, 40), mesh("wheel", "load", 20, 50)],
        bodies=[motor, gc.Body(name="wheel", inertia=2.4e-3), load]))[-1]
    far, near = (np.abs(deflections(reducer(k))[-1] - rigid).max() for k in (1e8, 1e9))
    assert near < 2e-9
    assert near == pytest.approx(far / 10, rel=0.1)  # it goes with the reciprocal of the stiffness


def test_the_exponents_of_a_train_sum_to_its_mean_trace():
    bodies = [gc.Body(name="a", inertia=1e-3, torque=8.0), gc.Body(name="i", inertia=4e-4),
              gc.Body(name="b", inertia=2e-3, torque=-12.0)]
    train = gc.Train(speed=6000.0, bodies=bodies, meshes=[
        mesh("a", "i", 24, 30), mesh("i", "b", 30, 36, phase=1.0, damping_law="always")])
    verdict = gc.regime(train)
    assert verdict.contact != "permanent" and verdict.trace_error < 1e-9


def stopped(speed: float, inertia: float, **shaft: float) -> gc.Train:
    """A body on a shaft with stops, on a frame that turns uniformly."""
    bodies = [gc.Body(name="frame", motion=[]), gc.Body(name="body", inertia=inertia)]
    return gc.Train(speed=speed, bodies=bodies, shafts=[gc.Shaft(name="stop", between=("body", "frame"), **shaft)])


@pytest.mark.filterwarnings("ignore:The mode of .* is hardly damped")
def test_an_oscillator_with_one_soft_wall_has_the_period_of_both_halves():
    """From rest on the free side, π/ω with the spring alone and π/ω with both: S. W. Shaw, P. J. Holmes, J. Sound Vib.
    90 (1983) 129."""
    spring, wall, inertia, start = 1e3, 9e4, 2.0, -0.3
    periods = [np.pi / np.sqrt(k / inertia) for k in (spring, spring + wall)]
    train = stopped(60 / sum(periods), inertia, stiffness=spring, stop=0, stop_back=100, stop_stiffness=wall)
    assert train.period == pytest.approx(sum(periods), rel=1e-14)
    model = replace(as_model(train), initial={"z": start / as_model(train).units.length, "z_dot": 0.0})
    found = gc.physical(gc.simulate(model, 3, samples=4))
    assert found.section_z.values == pytest.approx(np.full(3, 1e6 * start), rel=1e-9)
    assert np.abs(found.section_z_dot.values).max() < 1e-6 * 1e3 * abs(start) * np.sqrt(spring / inertia)
    assert (found.section_z.units, found.section_z_dot.units, found.mesh_force.units) == ("µrad", "mrad/s", "N*m")
    assert found.mesh_force.values[0, 0] == 0  # the wall's torque


def test_a_body_that_rattles_between_stops_loses_half_a_damped_cycle_at_each():
    """The body of MSL's example of backlash, whose stops are damped while they touch: from one turning point to the
    next the amplitude beyond the play falls by exp(−πζ/√(1 − ζ²))."""
    inertia, stiffness, damping, half = 5.0, 2e4, 50.0, np.pi / 8
    train = stopped(20.0, inertia, stop=half, stop_stiffness=stiffness, stop_damping=damping)
    model = replace(as_model(train), initial={"z": np.pi / 2 / as_model(train).units.length, "z_dot": 0.0})
    found = gc.physical(gc.simulate(model, 1, samples=2**14)).z.values * 1e-6
    ratio = damping / 2 / np.sqrt(inertia * stiffness)
    fall = np.exp(-np.pi * ratio / np.sqrt(1 - ratio**2))
    turning = [half + (np.pi / 2 - half) * fall**n for n in (1, 2)]
    lowest = int(np.argmin(found))
    assert found[lowest] == pytest.approx(-turning[0], rel=1e-5)  # -1.3108 rad
    assert found[lowest:].max() == pytest.approx(turning[1], rel=1e-5)


@pytest.mark.parametrize(("law", "pull"), [("contact", True), ("unilateral", False)])
def test_a_body_between_stops_turns_back_where_it_is_known_to(law, pull):
    """Inertia, stiffness, damping and play of an example of the Modelica Standard Library, in closed form, and where it
    turns back with a Kelvin–Voigt element that is cut off where it would pull."""
    J, k, c, play, start = 5.0, 2e4, 50.0, math.pi / 4, math.pi / 2
    train = gc.Train(speed=30.0, damping_law=law, bodies=[
        gc.Body(name="frame", motion=[]), gc.Body(name="J", inertia=J)],
                     shafts=[gc.Shaft(between=("frame", "J"), stop=play / 2, stop_stiffness=k, stop_damping=c)])
    problem = initial_value_problems(replace(as_model(train), initial={"z": start / (play / 2)}))
    run = problem.flow.advance(problem.w, 1, measured=True)
    delta, omega = c / (2 * J), math.sqrt(k / J - (c / (2 * J)) ** 2)

    def state(x: float, v: float, t: float) -> tuple[float, float]:
        b = (v + delta * x) / omega
        x, b = (math.exp(-delta * t) * each for each in (
            x * math.cos(omega * t) + b * math.sin(omega * t), b * math.cos(omega * t) - x * math.sin(omega * t)))
        return x, omega * b - delta * x

    begun = start - play / 2
    ends = brentq(lambda t: state(begun, 0.0, t)[0] if pull else np.dot((k, c), state(begun, 0.0, t)), 0.01, 0.04)
    _, speed = state(begun, 0.0, ends)
    furthest = -minimize_scalar(lambda t: state(0.0, speed, t)[0], (0.0, 0.02, 0.03)).fun
    assert run.measures[Measure.Z_MIN, 0] * play / 2 == pytest.approx(-play / 2 - furthest, rel=1e-9)
    if not pull:
        assert -play / 2 - furthest == pytest.approx(-1.322587, abs=1e-6)


@pytest.mark.filterwarnings("ignore:The mode of .* is hardly damped")
def test_the_momentum_of_an_undamped_free_train_stays_as_it_is():
    """Without damping and excitation the energy after many impacts is that of the start."""
    bodies = [gc.Body(name="a", inertia=1e-3), gc.Body(name="b", inertia=2e-3)]
    train = gc.Train(speed=1000.0, bodies=bodies, meshes=[
        mesh("a", "b", 20, 40, damping=0.0, error_amplitudes=[], stiffness=2e8)])
    model = replace(as_model(train), initial={"z": 0.5, "z_dot": 0.3})
    motion = gc.simulate(model, 50, samples=16)
    potential = np.maximum(np.abs(motion.z.values) - 1, 0.0) ** 2 / 2
    energy = motion.z_dot.values**2 / 2 + potential
    assert np.ptp(energy) < 1e-13 and np.any(potential > 0)


def soft_shaft(damping: float) -> gc.Train:
    """Its slowest mode, of 0.49 Hz, has a cycle of 30 000 mesh cycles; contact is kept, at constant stiffness."""
    bodies = [gc.Body(name="a", inertia=1e-3, torque=20.0), gc.Body(name="b", inertia=3e-3),
              gc.Body(name="rotor", inertia=1.0, torque=-30.0)]
    return gc.Train(speed=15000.0, bodies=bodies, shafts=[
        gc.Shaft(between=("b", "rotor"), stiffness=0.05, damping=damping)], meshes=[
        gc.Mesh(between=("a", "b"), teeth=(60, 90), base_radii=(0.02, 0.03), stiffness=3e8, damping=400.0,
                backlash=2e-5, error_amplitudes=[5e-8])])


@pytest.mark.parametrize(("damping", "labels"), [(1e-4, {"undecided", "1T"}), (6e-4, {"1T"})])
def test_a_train_that_keeps_contact_is_never_chaotic(damping, labels):
    """A linear motion has no positive exponent, however slow its modes are in mesh cycles."""
    found = gc.regime(soft_shaft(damping))
    assert found.label in labels and found.contact == "permanent"
    assert found.label == "1T" or "no contact changes" in found.reason


def test_a_common_period_is_that_of_all_orders():
    train = hunting_train()
    assert train.cycles == {"motor/wheel": 41, "wheel/load": 19}
    assert train.period == pytest.approx(60 / 3000 / 20 * 41)


def hunting_train(speed=3000.0, damping=600.0, **given):
    meshes = [mesh("motor", "wheel", 20, 41, damping=damping), mesh("wheel", "load", 19, 50, damping=damping)]
    return gc.Train(speed=speed, meshes=meshes, bodies=[
        gc.Body(name="motor", inertia=1e-3, torque=20.0), gc.Body(name="wheel", inertia=2e-3),
        gc.Body(name="load", inertia=4e-2, torque=-20.0 * 41 / 20 * 50 / 19)], **given)


def test_orders_that_deviate_shorten_the_common_period():
    """20 and 20·19/41 in a turn, at 41/19: its convergents and what lies between are 11/5, 13/6 and 28/13."""
    exact = hunting_train()
    for tolerance, cycles in ((0.03, (11, 5)), (0.008, (13, 6)), (0.002, (28, 13)), (1e-6, (41, 19))):
        near = hunting_train(frequency_tolerance=tolerance)
        assert tuple(near.cycles.values()) == cycles
        assert near.deviation == pytest.approx(abs(cycles[1] / cycles[0] * 41 / 19 - 1), abs=1e-14)
        assert near.deviation <= tolerance
        assert near.period == pytest.approx(exact.period * cycles[0] / 41, rel=1e-14)


def test_forces_with_orders_that_deviate_are_near_the_exact_ones():
    exact, near = (gc.regime(hunting_train(400.0, 4e3, frequency_tolerance=tolerance)).meshes
                   for tolerance in (0.0, 0.002))
    for name, one in exact.items():
        assert near[name]["force_rms"] == pytest.approx(one["force_rms"], rel=2e-3)
        assert near[name]["contact"] == one["contact"] == "permanent"


def test_teeth_that_repeat_late_and_orders_that_are_no_ratio_are_followed_nearly():
    three = [mesh(*names, *teeth) for names, teeth in (("ab", (97, 101)), ("bc", (103, 107)), ("cd", (109, 113)))]
    torque = 20.0 * 101 / 97 * 107 / 103 * 113 / 109
    bodies = [gc.Body(name=name, inertia=1e-3, torque={"a": 20.0, "d": -torque}.get(name, 0.0)) for name in "abcd"]
    late = gc.Train(speed=3000.0, bodies=bodies, meshes=three)
    assert max(late.cycles.values()) <= 2000 and 0 < late.deviation < 1e-3
    assert f"frequencies are up to {100 * late.deviation:.2g} % off" in as_model(late).in_words
    assert "off" not in as_model(hunting_train()).in_words
    circle = replace(late, meshes=three[:1], bodies=[
        gc.Body(name="a", inertia=1e-3, torque=20.0, torque_orders=[{"order": np.pi, "amplitude": 1.0}]),
        gc.Body(name="b", inertia=1e-3, torque=-20.0 * 101 / 97)])
    assert circle.excitation_orders()["order 3.14159 of a"] == pytest.approx(np.pi, rel=1e-3)
    assert 0 < circle.deviation < 1e-3


def test_a_mesh_and_the_turns_of_its_wheels_stay_in_their_ratio():
    bent = hunting_train(frequency_tolerance=0.02)
    bent = replace(bent, meshes=[replace(bent.meshes[0], eccentricity=(2e-6, 0.0)), bent.meshes[1]])
    turn, first, second = (bent.excitation_orders()[name] for name in (
        "turn of motor in motor/wheel", "mesh motor/wheel", "mesh wheel/load"))
    assert first == 20 * turn and bent.turns == {"motor": int(turn / bent.base_order)}
    assert 0 < abs(float(second / first) * 41 / 19 - 1) < 0.04


def test_runs_over_long_periods_have_about_as_many_mesh_cycles():
    given = Classification()
    assert given.over(16) is given
    assert given.over(160) == Classification(transient_lengths=(8, 8, 16, 32, 64), longest_period=6, exponent_run=25,
                                             longest_transient=1000, averaging_periods=10)
    assert given.over(100_000) == Classification(transient_lengths=5 * (3,), longest_period=1, exponent_run=21,
                                                 longest_transient=2, averaging_periods=1)


def test_a_train_of_a_long_period_repeats_as_longer_runs_say():
    train = gc.Train(speed=3000.0, bodies=[
        gc.Body(name="motor", inertia=1e-2, torque=20.0), gc.Body(name="wheel", inertia=2e-3),
        gc.Body(name="load", inertia=4e-1, torque=-20.0 * 61 / 20 * 73 / 19)],
        meshes=[mesh(*ends, *teeth, stiffness=3e8, error_amplitudes=[5e-7]) for ends, teeth in (
            (("motor", "wheel"), (20, 61)), (("wheel", "load"), (19, 73)))])
    brief, full = gc.regime(train), gc.regime(train, settings=SINGLE_MOTION)
    assert train.cycles == {"motor/wheel": 61, "wheel/load": 19} and brief.label == full.label == "1T"
    assert brief.periods_spent == 21 < full.periods_spent
    assert brief.dynamic_factor == pytest.approx(full.dynamic_factor, rel=1e-9)
    assert gc.Zones(as_model(train), "speed=1000:2000:2", "torque=10:20:2").classification.longest_period == 17


def test_results_of_one_motion_do_not_depend_on_others():
    model = as_model(loose_train())
    three, one = (initial_value_problems(model, {"loose.torque": np.array(torques)})
                  for torques in ([-0.05, -0.2, -0.08], [-0.08]))
    a, b = (each.flow.advance(each.w, 50, measured=True) for each in (three, one))
    assert np.array_equal(a.w[:, 2], b.w[:, 0]) and np.array_equal(a.measures[:, 2], b.measures[:, 0])


@pytest.mark.filterwarnings("ignore:The stiffness of a/b, a Fourier series")
@pytest.mark.parametrize("form", [
    3e8, STEPS, {"mean": 3e8, "amplitudes": [5e7, 2e7], "phases": [0.3]}, {"levels": [2e8, 3e8], "starts": [0.2, 0.7]}])
def test_another_mean_stiffness_keeps_the_form(form):
    model = as_model(gc.Train(speed=6000.0, meshes=[mesh("a", "b", 24, 36, stiffness=form)], bodies=[
        gc.Body(name="a", inertia=1e-3, torque=40.0), gc.Body(name="b", inertia=2e-3, torque=-60.0)]))
    own, twice = (each.train.meshes[0].contacts() for each in (
        model, model.with_values({"a/b.stiffness": 2 * model.value("a/b.stiffness")})))
    assert np.array_equal(own.edges, twice.edges)
    assert twice.stiffness == pytest.approx(2 * own.stiffness, rel=1e-12)


def test_a_train_answers_what_a_pair_is_asked():
    train = gc.Train(speed=6000.0, bodies=[
        gc.Body(name="a", inertia=1e-3, torque=40.0), gc.Body(name="i", inertia=1e-3),
        gc.Body(name="b", inertia=2e-3, torque=-60.0)], meshes=[mesh("a", "i", 24, 30), mesh("i", "b", 30, 36)])
    model, pair = as_model(train), gc.MeshModel.of(zeta=0.04)
    modes = gc.natural_frequencies(train)
    assert model.zeta == modes.damping_ratio.values[~modes.rigid.values].min() and pair.zeta == 0.04
    assert (model.mesh_names, pair.mesh_names) == (("a/i", "i/b"), ())
    assert model.cycles == train.cycles == {"a/i": 1, "i/b": 1} and pair.cycles == {}
    assert np.isnan(quasi_static_ratio(train))


def test_a_mesh_has_the_contact_ratio_of_a_pair_with_two_levels():
    pair = gc.GearPair(n1=24, n2=36, I1=1e-3, I2=2e-3, R1=0.024, R2=0.036, c0=2.6e8, k=600.0, backlash=1e-4, M10=40.0,
                       speed=6000.0, chi1=0.2, chi2=0.1, contact_ratio=1.7)
    found = gc.Mesh(between=("a", "b"), design=pair, pitch_errors=([0.0] * 23 + [1e-6], []))
    assert found.contact_ratio == 1.7


def test_a_common_period_that_is_too_long_names_the_tolerance_that_does(monkeypatch):
    monkeypatch.setattr("gearchaos.gears.train.period.MOST_CYCLES", 12)
    with pytest.raises(InputError, match=r"Give frequency_tolerance = 0\.019, by which orders may deviate"):
        hunting_train()
    assert max(hunting_train(frequency_tolerance=0.02).cycles.values()) <= 12


def test_a_long_common_period_is_warned_of_with_what_shortens_it():
    train = hunting_train()
    long = replace(train, meshes=[mesh("motor", "wheel", 40, 143), train.meshes[1]], bodies=[
        *train.bodies[:2], replace(train.bodies[2], torque=-20.0 * 143 / 40 * 50 / 19)])
    assert "counted. frequency_tolerance = 0.001 may shorten it." in long.warnings[0] and not train.warnings
    near = replace(long, frequency_tolerance=1e-3)
    assert 100 < max(near.cycles.values()) < 143 and near.warnings[0].endswith("sections are counted.")


def stopped_train(**stops):
    """A driver that shakes in the play of a coupling."""
    return gc.Train(speed=600.0, meshes=[mesh("hub", "load", 20, 30)], bodies=[
        gc.Body(name="driver", inertia=2e-3, torque=2.0, torque_orders=[{"order": 2, "amplitude": 30.0}]),
        gc.Body(name="hub", inertia=1e-3), gc.Body(name="load", inertia=5e-3, torque=-3.0)],
        shafts=[gc.Shaft(between=("driver", "hub"), stop_stiffness=2e4, stop_damping=0.5, **stops)])


def test_a_coupling_with_unlike_stops_is_one_with_like_stops_turned():
    """Without a spring the play from stop to stop alone counts: that from -0.1° to 0.3° is that of ±0.2°."""
    alike, apart, none = (deflections(stopped_train(**stops), 40) for stops in (
        {"stop": "0.2 deg"}, {"stop": "0.3 deg", "stop_back": "0.1 deg"}, {"stop": "0.2 deg", "stop_back": "60 deg"}))
    assert np.ptp(alike) > 1e-4 and apart == pytest.approx(alike, abs=1e-6 * np.ptp(alike))
    assert np.abs(none - alike).max() > 1e-5  # the other side is met


def test_stops_of_the_other_side_are_a_parameter():
    model = as_model(stopped_train(stop=0.004, stop_back=0.001))
    assert model.parameters()["driver-hub.stop_back"] == 0.001
    changed = initial_value_problems(model, {"driver-hub.stop_back": np.array([0.001, 0.003])}).flow
    assert np.ptp(changed.system.contacts.offset[:, -1, 0, 0]) == pytest.approx(0.002 / model.units.length)
    with pytest.raises(InputError, match="stop_back must be left out without stop"):
        gc.Shaft(between=("a", "b"), stiffness=1.0, stop_back=0.1)


@pytest.mark.parametrize(("torque", "twist"), [
    (3.0, 0.03), (8.0, (8.0 + 2000 * 0.05) / 2100), (-3.0, -0.03), (-8.0, -(8.0 + 2000 * 0.04) / 2100)])
def test_a_stop_beside_a_spring_carries_at_rest_what_exceeds_its_play(torque, twist):
    train = gc.Train(
        speed=1000.0, bodies=[gc.Body(name="motor", inertia=0.1, torque=torque), gc.Body(name="frame", motion=[])],
        shafts=[gc.Shaft(between=("motor", "frame"), stiffness=100.0, damping=0.05, stop=0.05, stop_back=0.04,
                         stop_stiffness=2000.0)])
    model = as_model(train)
    assert initial_value_problems(model).w[0, 0] * model.units.length == pytest.approx(twist, rel=1e-12)
    assert gc.regime(train).label == "1T"


def test_a_stop_that_is_open_under_the_load_is_no_loss_of_contact():
    shaft = gc.Shaft(between=("wheel", "load"), stiffness=1e4, damping=5.0, stop=0.05, stop_stiffness=1e5)
    train = gc.Train(
        speed=3000.0, shafts=[shaft], meshes=[mesh("motor", "wheel", 24, 36, stiffness="3e8 N/m", error_amplitudes=[])],
        bodies=[gc.Body(name="motor", inertia=1e-3, torque=40.0), gc.Body(name="wheel", inertia=2e-3),
                gc.Body(name="load", inertia=2e-2, torque=-60.0)])
    verdict = gc.regime(train)
    assert [each["contact"] for each in verdict.meshes.values()] == ["permanent", "none"]
    assert verdict.contact == "permanent"


def test_steady_motions_are_sampled_in_every_mesh_cycle_and_fewer_samples_are_warned_of():
    """With 23 and 46 teeth of which one is weak, the motion repeats after 23 cycles."""
    train = gc.Train(
        speed=3000.0,
        bodies=[gc.Body(name="a", inertia=2e-4, torque=30.0), gc.Body(name="b", inertia=3e-4, torque=-60.0)],
        meshes=[mesh("a", "b", 23, 46, contact_ratio=1.6, faults=[{"wheel": 1, "tooth": 5, "stiffness_loss": 0.3}])])
    motion, swings = gc.steady(train, gc.regime(train)), math.ceil(1 / (as_model(train).omega * 23))
    assert motion.sizes["tau"] == 64 * 23 * swings and motion.sizes["period"] == 1
    with pytest.warns(UserWarning, match="64 in a period of 23 mesh cycles do not show .* Take 1472,"):
        gc.simulate(train, 1, samples=64)
    gc.simulate(train, 1, samples=4 * 23)
