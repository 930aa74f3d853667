"""States after a change of the load, and knocks: energies in closed form, an integrator of its own, exact phases."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import binomtest, kstest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow
from gearchaos.gears.operation.operating import as_model
from gearchaos.model.switched import begun_at
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.maps.cells_to_avoid import to_avoid
from gearchaos.studies.operation.knocks import LARGEST
from gearchaos.studies.operation.load_change import LoadChange, stored_energy
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from tests.closed_forms.linear_gears import SPUR

LOAD = 0.2  # deflection at rest, in half backlashes


def energy(z, v, load=LOAD):
    return v**2 / 2 + np.maximum(0, np.abs(z) - 1) ** 2 / 2 - load * z


@pytest.mark.parametrize("ratio", [1.0, 0.3, 0.0, -0.3, -0.5, -0.8])
def test_the_energy_is_that_at_the_turning_point_of_a_sudden_change(ratio):
    def motion(_, w):
        return [w[1], -ratio * LOAD - np.sign(w[0]) * max(0.0, abs(w[0]) - 1)]

    found = solve_ivp(motion, (0, 200), [1 + LOAD, 0.0], rtol=1e-10, atol=1e-12, max_step=0.01)
    assert stored_energy(1.0, 1.0, LOAD, ratio) == pytest.approx(energy(*found.y).max(), rel=1e-4)


def test_lost_and_reversed_loads_in_closed_form():
    assert stored_energy(1.0, 1.0, LOAD, 0.0) == pytest.approx(LOAD**2 / 2 + LOAD * (1 + LOAD))
    behind = LOAD + np.sqrt(4 * LOAD**2 + 4 * LOAD)  # y of y²/2 − F (1 + y) = F²/2 + F (1 + F)
    assert stored_energy(1.0, 1.0, LOAD, 1.0) == pytest.approx(behind**2 / 2 + LOAD * (1 + behind))
    assert stored_energy(1.0, 1.0, LOAD, -0.5) == pytest.approx(-LOAD)  # flanks just touch
    assert stored_energy(1.0, 4.0, LOAD, 0.0) == pytest.approx(LOAD**2 / 8 + LOAD * (1 + LOAD / 4))


@pytest.mark.parametrize("ratio", [1.0, 0.0, -0.3, -0.8])
def test_states_fill_what_is_stored_evenly(ratio):
    model = as_model(SPUR.at(speed=1000.0, torque=200.0))
    load = initial_value_problems(model).flow.system.static_force[0, 0]
    w = LoadChange(ratio)(model, {"speed": np.array([1000.0, 2000.0])}, [1.0, 1.0], 4096, (0,))
    z, v = w[0], w[1]
    most = stored_energy(1.0, 1.0, load, ratio)
    assert w.shape == (2, 8192) and (energy(z, v, load) <= most + 1e-3).all()
    assert energy(z, v, load).max() > most - 0.02 * (most + load + load**2 / 2)
    grid = np.meshgrid(np.linspace(z.min() - 0.01, z.max() + 0.01, 1001),
                       np.linspace(v.min() - 0.01, v.max() + 0.01, 1001))
    inside = energy(*grid, load) <= most
    for drawn, at in ((z, grid[0][inside]), (v, grid[1][inside])):
        assert kstest(drawn, at).statistic < 0.02
    assert np.array_equal(z, LoadChange(ratio)(model, {"speed": np.array([1000.0, 2000.0])}, [1.0, 1.0], 4096, (0,))[0])
    livelier = LoadChange(ratio)(model, {"speed": np.array([1000.0])}, [1.5], 4096, (0,))
    rest = -load - load**2 / 2
    more = rest + (np.sqrt(most - rest) + 0.5 * load / np.sqrt(2)) ** 2
    assert most < energy(*livelier, load).max() <= more + 1e-3


@pytest.mark.parametrize(("given", "words"), [
    (1, "a reversal of the load"), (0, "a loss of the load"), (-0.5, "a fall of the load to 50 %"),
    (0.5, "a reversal of the load to 50 %")])
def test_a_change_is_named(given, words):
    assert LoadChange.checked(given).words == words


@pytest.mark.parametrize("given", [-1, 3.1, "much", float("nan")])
def test_a_change_that_cannot_be_is_refused(given):
    with pytest.raises(InputError, match="load_change must"):
        gc.assess(SPUR, "1000:1100", 100, load_change=given)


@pytest.mark.parametrize("model", [
    gc.MeshModel.of(kind="single", q0=0.1, eps1=0.05, chi1=0.3),
    gc.MeshModel.of(kind="single", q0=0.1, eps1=0.05, eps2=0.02,
                    stiffness=gc.HarmonicStiffness((0.2, 0.1), (0.0, 1.0))),
    replace(SPUR, load_sharing="tooth pairs").at(speed=1000.0, torque=100.0).to_model()])
def test_a_motion_from_a_phase_is_that_which_passes_it(model):
    problem = initial_value_problems(model, samples=32)
    passed = problem.flow.advance(problem.w + np.array([[0.3], [0.1]]), 3, sample=True).samples[:, :, :-1, 0]
    for at in (0, 1, 16, 27):
        flow = ExactFlow(begun_at(problem.flow.system, np.array([at / 32])))
        assert np.abs(flow.advance(passed[0, at][:, None], 2).w[:, 0] - passed[2, at]).max() < 1e-12


def test_the_least_knock_leads_away_and_one_that_is_smaller_does_not():
    """As many as are tried at 64 phases of both directions, by a model that begins at another phase."""
    found = gc.speeds_to_avoid(SPUR, "795:797:2", "100 N*m", starts=0)
    (knock,) = found.knocks
    assert "knocks of up to 556 rpm of the speed of wheel 1" in found.tried and not found.windows
    operating = SPUR.at(speed=knock.speed, torque=100.0)
    pair = operating.to_pair()
    turn = knock.speed_step * 2 * np.pi / 60
    assert knock.impulse == pytest.approx(pair.I1 * turn)
    step = turn * pair.R1 / (pair.half_backlash * pair.omega0)
    assert abs(step) <= LARGEST
    model = pair.to_model()
    problem = initial_value_problems(model, samples=32)
    steady = problem.flow.advance(problem.w, 400).w
    passed = problem.flow.advance(steady, 1, sample=True).samples[0, :, :-1, 0]

    def lost(phase, size):
        flow = ExactFlow(begun_at(problem.flow.system, np.array([phase / 32])))
        after = flow.advance(passed[phase][:, None] + np.array([[0.0], [size]]), 2000).w
        return flow.advance(after, 32, measured=True).measures[8, 0] < 1  # the least z

    phase = round(knock.phase * 32)
    assert lost(phase, step)
    assert not any(lost(phase, size * sign) for size in np.linspace(0, 0.9 * abs(step), 24) for sign in (-1, 1))


def test_the_least_knock_of_a_range_is_no_larger_than_that_of_its_part():
    shared = replace(SPUR, transmission_error="from quality (typical)", load_sharing="tooth pairs")
    whole, part, near = (gc.speeds_to_avoid(shared, speeds, "300 N*m", load_change=None).knocks
                         for speeds in ("2100:2200:8", "2195:2200:2", "2100:2110:40"))
    assert len(whole) == len(part) == len(near) == 1  # none between speeds at which thin sets of knocks lead away
    assert abs(whole[0].speed_step) <= 1.1 * abs(part[0].speed_step)


CELLS = {
    # in operation and after load changes, each contact, force over that at no speed and deflection: code and share
    "nothing": ([(0, 2.5, 0.1), (0, 1.5, 0.1)], [(0, 1.5, 0.1)] * 4, 0, 0.0),
    "small": ([(0, 1.5, 0.1), (1, 1.9, 0.1)], [(0, 1.5, 0.1)] * 4, 1, 0.0),
    "hits": ([(1, 1.5, 0.1), (1, 2.1, 0.1)], [(2, 3.0, 0.1)] * 4, 2, 1.0),
    "both flanks": ([(2, 2.1, 0.1), (1, 2.5, 0.1)], [(0, 1.5, 0.1)] * 4, 3, 0.0),
    "both flanks, small": ([(2, 1.9, 0.1), (0, 1.0, 0.1)], [(0, 1.5, 0.1)] * 4, 1, 0.0),
    "beside what is beyond": ([(1, 2.1, 0.1), (2, 1000.0, 0.1)], [(0, 1.5, 0.1)] * 4, 2, 0.0),
    "beyond": ([(0, 1.5, 0.1), (1, 2.1, 1000.0)], [(0, 1.5, 0.1)] * 4, 4, 0.0),
    "beyond in contact": ([(0, 1000.0, 0.1), (0, 1.0, 0.1)], [(0, 1.5, 0.1)] * 4, 4, 0.0),
    "diverged": ([(3, np.nan, np.nan), (0, 1.0, 0.1)], [(0, 1.5, 0.1)] * 4, 4, 0.0),
    "after a load change": ([(0, 1.5, 0.1)] * 2, [(1, 2.1, 0.1), (0, 1.5, 0.1), (1, 1.9, 0.1), (0, 1.5, 0.1)], 6, 0.5),
}


@pytest.mark.parametrize("name", CELLS)
def test_what_is_to_be_avoided_in_a_cell(name):
    operation, after, code, share = CELLS[name]
    contact, factor, deflection = np.array([operation[0], *after, operation[1]]).T[:, None]
    at, model = {"speed": np.array([1000.0]), "torque": np.array([200.0])}, as_model(SPUR.at(speed=1000.0, torque=50.0))
    ratio = quasi_static_ratio(model)
    found = to_avoid(model, at, {
        "contact": contact.astype(int), "dynamic_factor": ratio * factor, "deflection": deflection}, slice(1, -1))
    assert found["to_avoid"].tolist() == [code]
    low, high = (found[f"share_of_load_changes_{end}"].item() for end in ("lo", "hi"))
    assert low <= found["share_of_load_changes"].item() == share <= high
    interval = binomtest(round(4 * share), 4).proportion_ci()
    assert (low, high) == pytest.approx((interval.low, interval.high))


def test_a_knock_into_a_transient_of_a_thousand_periods_is_none():
    """Beside a range to avoid, where its motion has just ended to attract; Runge and Kutta's method comes back too."""
    design = gc.GearDesign(
        teeth=(21, 27), module="5 mm", face_width="58.66217 mm", profile_shift=(0.27559669, 0.08548866),
        rack={"addendum": 0.88078387, "dedendum": 1.13078387, "root_radius": 0.25},
        bore=("45.748625 mm", "58.81966 mm"), speed=1000.0,
        quality={"standard": "ISO 1328-1:1995", "grade": 5}, damping_ratio=0.03359744, torque=720.35842,
        backlash={"value": "0.14549605 mm", "of": "line of action, total"}, damping_law="contact",
        transmission_error="from quality (typical)")
    found = gc.speeds_to_avoid(design, "6118:6121:40", load_change=None, starts=0)
    assert not found.knocks and "knocks of up to" in found.tried
