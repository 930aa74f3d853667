"""Random trains in the flow, against an integration of all physical coordinates that shares no code."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import OK, Measure, of_meshes
from gearchaos.flow.kernels.many_contacts.contact_arrays import new_tables
from gearchaos.gears.operation.operating import as_model
from gearchaos.quantities import parameter_owner
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.operation.known_orbits import KnownOrbit, LinearBasin
from tests import EXAMPLES
from tests.oracles.physical_trains import Oracle, motion
from tests.oracles.random_trains import SHAPES, random_state, random_train

QUICK = [("chain", 3), ("stages", 1), ("stops", 1), ("supported", 1), ("internal", 0), ("driven", 1), ("driven", 3),
         ("pairs", 0), ("star", 1)]
"""Shapes and seeds whose states have 4 or 9 dimensions: for 4 there are kernels of their own, for 9 those for any
number."""


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "seed"), QUICK)
def test_random_trains_agree_with_an_independent_integration(shape, seed):
    assert difference(shape, seed) < 1e-11


def released(train: gc.Train) -> gc.Train:
    """With four times the damping, in contacts of one spring that never pull."""
    meshes = [mesh if mesh.tooth_pairs else replace(mesh, damping_law="unilateral", damping=4 * mesh.damping)
              for mesh in train.meshes]
    shared = any(mesh.tooth_pairs for mesh in meshes)
    return replace(train, meshes=meshes, damping_law=train.damping_law if shared else "unilateral")


def as_it_is(train: gc.Train) -> gc.Train:
    return train


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "seed"), [*QUICK, ("split", 0)])
def test_contacts_that_never_pull_agree_with_an_independent_integration(shape, seed):
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    assert difference_of(released(random_train(shape, rng)), rng) < 1e-11


@pytest.mark.parametrize(("shape", "seed"), [("driven", 1), ("stages", 1)])
def test_tangents_of_contacts_that_never_pull_are_differences_of_motions(shape, seed):
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    problem, size = initial_value_problems(as_model(released(random_train(shape, rng)))), 1e-6
    d = len(problem.w)
    begin = problem.w + rng.normal(size=(d, 1))
    run = problem.flow.advance(begin, 1, tangent=np.eye(d)[:, :, None], measured=True)
    many = problem.flow.advance(begin + size * np.hstack([np.eye(d), -np.eye(d)]), 1, points=np.zeros(2 * d, int)).w
    assert of_meshes(run.measures)[:, Measure.SWITCHES].sum() > 3
    found, expected = run.tangent[:, :, 0].T, (many[:, :d] - many[:, d:]) / (2 * size)
    assert np.abs(found - expected).max() < 1e-5 * np.abs(expected).max()


@pytest.mark.slow
def test_the_kernel_for_any_number_of_coordinates_gives_the_same_bits(monkeypatch):
    rng = np.random.default_rng([3, SHAPES.index("chain")])
    problem = initial_value_problems(as_model(random_train("chain", rng)))
    d, runs = len(problem.w), []
    for most in (d - 1, d):
        monkeypatch.setattr("gearchaos.flow.contact_tables.MOST_UNROLLED", most)
        run = problem.flow.advance(problem.w + 0.7, 5, measured=True, tangent=np.eye(d)[:, :, None], growth=True)
        runs.append([*(each.tobytes() for each in (run.w, run.tangent, run.growth, run.measures))])
    assert runs[0] == runs[1]


@pytest.mark.slow
def test_room_for_few_matrices_gives_the_same_bits(monkeypatch):
    rng = np.random.default_rng([3, SHAPES.index("chain")])
    model, runs = as_model(random_train("chain", rng)), []
    for room in (2 << 30, 100_000):
        monkeypatch.setattr("gearchaos.flow.contact_tables._LARGEST", room)
        problem = initial_value_problems(model)
        entries = problem.flow._tables.step.shape[1]
        runs.append((entries, problem.flow.advance(problem.w + 0.7, 5, measured=True)))
    (many, one), (few, other) = runs
    assert few < min(many, problem.flow.step_count[0])
    assert one.w.tobytes() == other.w.tobytes() and one.measures.tobytes() == other.measures.tobytes()


def gearbox(speed: float) -> gc.Train:
    """Two stages between motor and load with shafts: ten coordinates."""
    bodies = {"motor": 0.02, "pinion1": 5e-4, "wheel1": 8e-3, "pinion2": 1e-3, "wheel2": 3e-2, "load": 1.5}
    torques = {"motor": 60.0, "load": -240.0}
    springs = {("motor", "pinion1"): (2e4, 2.0), ("wheel1", "pinion2"): (1e5, 4.0), ("wheel2", "load"): (2e5, 20.0)}
    meshes = [(("pinion1", "wheel1"), 0.0235, 4e8, 1500.0), (("pinion2", "wheel2"), 0.03, 6e8, 2500.0)]
    return gc.Train(
        speed=speed, bodies=[gc.Body(name=n, inertia=j, torque=torques.get(n, 0.0)) for n, j in bodies.items()],
        shafts=[gc.Shaft(between=names, stiffness=k, damping=c) for names, (k, c) in springs.items()],
        meshes=[gc.Mesh(between=names, teeth=(20, 40), base_radii=(r, 2 * r), damping=c, backlash=1e-4,
                        stiffness={"levels": [k, 0.7 * k], "starts": [0, 0.6]}, error_amplitudes=[4e-6])
                for names, r, k, c in meshes])


@pytest.mark.parametrize("unrolled", [10, 8])
def test_what_stands_in_the_memory_of_tables_by_chance_has_no_effect(monkeypatch, unrolled):
    """Over ten coordinates in kernels of their own, and in those for any number, which leap."""
    monkeypatch.setattr("gearchaos.flow.contact_tables.MOST_UNROLLED", unrolled)
    model, runs = as_model(gearbox(900.0)), []
    for fill in (0.0, np.nan):
        def filled(*sizes: int, fill: float = fill) -> Any:
            tables = new_tables(*sizes)
            for array in tables[1:]:
                array.fill(fill if array.dtype == float else -7)
            return tables

        monkeypatch.setattr("gearchaos.flow.contact_tables.new_tables", filled)
        problem = initial_value_problems(model)
        run = problem.flow.advance(problem.w + 0.3, 3)
        runs.append((run.w.tobytes(), problem.flow.advance(run.w, 3, measured=True).measures.tobytes()))
    assert runs[0] == runs[1]


def test_leaps_in_contact_lead_where_their_steps_do():
    """Measured motion takes no leaps. The first motions keep contact, then some touch its end, the last ones hit."""
    problem = initial_value_problems(as_model(gearbox(900.0)))
    flow, direction = problem.flow, np.random.default_rng(5).normal(size=(len(problem.w), 2))
    size = np.linspace(0.0, 0.25, 400)
    w = flow.advance(problem.w, 60).w + np.hstack([each[:, None] * size for each in direction.T])
    points = np.zeros(w.shape[1], int)
    leaping = flow.advance(w, 3, points=points)
    made = np.count_nonzero(flow._tables.leap_part[0] >= 0)
    stepping = flow.advance(w, 3, points=points, measured=True)
    assert np.abs(leaping.w - stepping.w).max() < 1e-12 * np.abs(stepping.w).max()
    changes = of_meshes(stepping.measures)[:, Measure.SWITCHES].sum(axis=0)
    assert made > 20 and 100 < np.count_nonzero(changes) < 700


@pytest.mark.parametrize("room", [1, 2])
def test_leaps_are_exact_where_their_linear_parts_are_forgotten(monkeypatch, room):
    monkeypatch.setattr("gearchaos.flow.contact_tables._SETS", room)
    problem = initial_value_problems(as_model(gearbox(900.0)))
    w = problem.w + np.random.default_rng(3).normal(size=(len(problem.w), 60)) * np.linspace(0.0, 0.5, 60)
    leaping, stepping = (problem.flow.advance(w, 3, points=np.zeros(60, int), measured=m) for m in (False, True))
    assert np.abs(leaping.w - stepping.w).max() < 1e-12 * np.abs(stepping.w).max()
    made, parts = problem.flow._tables.leap_part[0], problem.flow._tables.parts[0]
    assert made.max() < parts


@pytest.mark.parametrize("seed", range(4))
def test_motions_from_the_linear_basin_of_an_orbit_come_to_it_and_change_no_contact(seed):
    problem = initial_value_problems(as_model(gearbox(900.0)))
    flow, sizes = problem.flow, np.linspace(-0.3, 0.3, 120)
    w = flow.advance(problem.w, 3000).w
    basin = LinearBasin.of(flow, KnownOrbit(1, w[:, 0]), 0)
    assert basin is not None
    begin, points = w + np.random.default_rng(seed).normal(size=w.shape) * sizes, np.zeros(len(sizes), int)
    inside = basin.has(begin)
    changes = of_meshes(flow.advance(begin, 20, points=points, measured=True).measures)[:, Measure.SWITCHES].sum(axis=0)
    assert not changes[inside].any() and changes.any()
    assert np.count_nonzero(inside) > 0.08 * np.count_nonzero(changes == 0)
    assert np.abs(flow.advance(begin[:, inside], 3000, points=points[inside]).w - w).max() < 1e-9


def test_tangents_leap_with_the_motion():
    problem = initial_value_problems(as_model(gearbox(900.0)))
    d = len(problem.w)
    w = problem.flow.advance(problem.w, 40).w
    runs = [problem.flow.advance(w, 1, tangent=np.eye(d)[:, :, None], measured=m) for m in (False, True)]
    assert np.abs(runs[0].tangent - runs[1].tangent).max() < 1e-11 * np.abs(runs[1].tangent).max()


@pytest.mark.exhaustive
@pytest.mark.parametrize("seed", [*range(4), *range(20, 30)])
@pytest.mark.parametrize("shape", SHAPES)
def test_many_random_trains_agree_with_an_independent_integration(shape, seed):
    assert difference(shape, seed, 2) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("speed", [600, 900, 1173])
def test_the_gearbox_of_a_wind_turbine_agrees_with_an_independent_integration(speed):
    train = gc.open(EXAMPLES / "train_wind_turbine.toml").at(speed=speed)
    assert difference_of(train, np.random.default_rng(speed)) < 1e-11


def difference(shape: str, seed: int, periods: int = 1) -> float:
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    return difference_of(random_train(shape, rng), rng, periods)


def difference_of(train: gc.Train, rng: np.random.Generator, periods: int = 1) -> float:
    """The largest difference of coordinates after common periods, relative to the growth of a disturbance."""
    oracle = Oracle(train, train.period)
    model = as_model(train)
    while not (found := motion(train, state := random_state(oracle, rng), periods))["switched"]:
        pass  # another state: contact is to be lost
    w = in_coordinates(oracle, train, model, 0.0, state)
    out = initial_value_problems(model).flow.advance(w[:, None], periods, tangent=np.eye(len(w))[:, :, None])
    expected = in_coordinates(oracle, train, model, periods * train.period, found["end"])
    assert out.status[0] == OK
    growth = max(1.0, np.abs(out.tangent).max(), np.abs(w).max())
    return float(np.abs(out.w[:, 0] - expected).max()) / growth


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "seed", "given"), [
    ("chain", 3, as_it_is), ("stages", 1, as_it_is), ("stops", 1, as_it_is), ("driven", 3, as_it_is),
    ("supported", 1, as_it_is), ("stages", 1, released), ("supported", 1, released)])
def test_what_is_measured_of_meshes_agrees_with_an_independent_integration(shape, seed, given):
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    train = given(random_train(shape, rng))
    oracle, model = Oracle(train, train.period), as_model(train)
    state = random_state(oracle, rng)
    w = in_coordinates(oracle, train, model, 0.0, state)
    out = initial_value_problems(model).flow.advance(w[:, None], 1, measured=True)
    expected, units = motion(train, state, 1), model.units
    time, force = units.rate, 1 / units.force
    for n, own in enumerate(of_meshes(out.measures)[: len(train.meshes), :, 0]):  # stops are no meshes
        size = max(abs(expected["largest"][n]), abs(expected["smallest"][n])) * force
        for measure, name, unit, tolerance in (
            (Measure.FRONT_TIME, "front_time", time, {"rel": 1e-10, "abs": 1e-10}),
            (Measure.BACK_TIME, "back_time", time, {"rel": 1e-10, "abs": 1e-10}),
            (Measure.FORCE_SQUARE, "force_square", time * force**2, {"rel": 1e-7, "abs": 1e-12}),
            (Measure.CONTACT_FORCE, "force", time * force, {"rel": 1e-7}),
            (Measure.FORCE_MAX, "largest", force, {"abs": 1e-5 * size}),
            (Measure.FORCE_MIN, "smallest", force, {"abs": 1e-5 * size}),
            (Measure.SWITCHES, "switches", 1, {"abs": 0})):
            assert own[measure] == pytest.approx(expected[name][n] * unit, **tolerance), name


def in_coordinates(oracle: Oracle, train: gc.Train, model: Any, t: float, w: np.ndarray) -> np.ndarray:
    """A state (q, q') as the coordinates of the model: deflections by name, and the speed of turning as a whole."""
    units, out = model.units, []
    known = {**{c.name: c for c in oracle.contacts}, **{s.name: s for s in oracle.springs}}
    known = {parameter_owner(name): element for name, element in known.items()}
    for name in model.state_names:
        owner = name.removesuffix("_dot").rpartition(".")[0] or next(iter(known))
        if name.startswith("rotation"):
            out.append(oracle.turning(w) * train.meshes[0].base_radii[0] / (units.length * units.rate))
            continue
        element = known[owner]
        s, rate = oracle.deflection(element, t, w)
        play = next((m.backlash / 2 for m in train.meshes if m.name == element.name), 0.0)
        out.append(rate / (units.length * units.rate) if name.endswith("_dot") else (s + play) / units.length)
    return np.array(out)
