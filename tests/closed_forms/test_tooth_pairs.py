"""Tooth pairs that share the load: their contacts by definition, at rest, and in the limits with a closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import gearchaos as gc
from gearchaos.flow import ExactFlow
from gearchaos.model import vary
from gearchaos.model.static import static_deflection
from gearchaos.model.switched import reversed_in_time, switched_system, velocity_signs
from gearchaos.studies.operation.quasi_static import quasi_static_ratio


def random_pairs(seed: int) -> gc.ToothPairStiffness:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    return gc.ToothPairStiffness(
        tuple(rng.uniform(0.3, 0.9, n)), (0.0, *np.sort(rng.uniform(0.1, 0.9, n - 1))), rng.uniform(1.05, 2),
        *rng.uniform(0, 0.4, 2), *rng.uniform(0.1, 0.5, 2), float(rng.integers(1, 3)), rng.uniform(0, 0.2),
        rng.uniform(0, 0.99))


def on_path(pairs: gc.ToothPairStiffness, x: float) -> tuple[float, float]:
    """Stiffness and gap of one pair at x on its path, as the class defines them."""
    entry = max(0.0, 1 - x / pairs.relief_length2) ** pairs.relief_exponent
    exit_ = max(0.0, 1 - (1 - x) / pairs.relief_length1) ** pairs.relief_exponent
    level = [v for v, start in zip(pairs.levels, pairs.starts, strict=True) if start <= x][-1]
    return level, pairs.relief2 * entry + pairs.relief1 * exit_ + pairs.crowning * (2 * x - 1) ** 2


def touching(pairs: gc.ToothPairStiffness, phase: float, side: int) -> list[tuple[float, float]]:
    """Stiffness and gap of the pairs that can touch on one flank, sorted."""
    ratio = pairs.contact_ratio
    paths = ((phase + j) / ratio if side > 0 else 0.5 - (phase + j - ratio / 2 - pairs.back_phase) / ratio
             for j in range(-3, 6))
    return sorted(on_path(pairs, x) for x in paths if 0 < x < 1)


def flow_of(model: gc.MeshModel, w: np.ndarray, periods: int) -> np.ndarray:
    """The states (d, L) after so many periods of one model."""
    return ExactFlow(switched_system(vary(model, {}))).advance(w, periods, points=np.zeros(w.shape[1], int)).w


@pytest.mark.parametrize("seed", range(8))
def test_contacts_and_the_deflection_at_rest_are_those_of_the_pairs_on_their_paths(seed):
    pairs, rng = random_pairs(seed), np.random.default_rng(seed)
    contacts = pairs.contacts(pairs.numbers(), 1)
    for phase in rng.uniform(0, 1, 50):
        n = np.searchsorted(contacts.edges[0], phase, side="right") - 1
        gap = contacts.gap[0, :, n] @ (phase - contacts.edges[0, n]) ** np.arange(3)
        for side in (1, -1):
            present = (contacts.sides == side) & (contacts.stiffness[0, :, n] > 0)
            found = sorted(zip(contacts.stiffness[0, present, n], gap[present], strict=True))
            assert np.allclose(found, touching(pairs, phase, side), atol=1e-12)
    phases, forces = rng.uniform(0, 1, 12), rng.uniform(0.01, 2, 3)
    for force, row in zip(forces, static_deflection(pairs, forces, phases), strict=True):
        for phase, z in zip(phases, row, strict=True):
            def excess(z: float, phase: float = phase, force: float = force) -> float:
                return sum(k * max(0.0, z - 1 - gap) for k, gap in touching(pairs, phase, 1)) - force

            assert z == pytest.approx(brentq(excess, 0.9, 50), abs=1e-9)


@pytest.mark.parametrize("values", [
    {"contact_ratio": [1.2, 1.45, 1.9], "relief1": [0.0, 0.2, 0.5]},
    {"relief1": [0.0, 0.1, 0.4], "crowning": [0.1] * 3},
    {"contact_ratio": [1.0, 1.6, 2.0], "relief1": [0.2, 0.3, 0.0], "relief2": [0.2, 0.0, 0.0]},
    {"contact_ratio": [1.6, 1.7, 1.0], "relief_length1": [0.375, 0.3, 0.2], "relief2": [0.0, 0.1, 0.0]}])
def test_a_point_has_the_same_bits_beside_any_others(values):
    pairs = gc.ToothPairStiffness((0.7, 1.0, 0.7), (0.0, 0.375, 0.625), 1.6, 0.3, 0.3)
    model = gc.MeshModel.of(kind="single", omega=0.8, zeta=0.05, q0=0.4, eps1=0.1, stiffness=pairs)
    w = np.array([[1.3] * 3, [0.1] * 3])
    together = ExactFlow(switched_system(vary(model, values))).advance(w, 5).w
    for i in range(3):
        alone = ExactFlow(switched_system(vary(model, {k: [v[i]] for k, v in values.items()})))
        assert np.array_equal(together[:, i], alone.advance(w[:, :1], 5).w[:, 0])


@pytest.mark.parametrize("law", ["always", "contact"])
def test_without_gaps_the_sum_is_the_prescribed_stiffness(law):
    pairs = gc.ToothPairStiffness((0.7, 1.0, 0.7), (0.0, 0.375, 0.625), contact_ratio=1.6, back_phase=0.0)
    assert pairs.parts(pairs.numbers()) == pytest.approx(np.array([(0.0, 1.4), (0.6, 1.0)]))
    model = gc.MeshModel.of(kind="single", omega=0.9, zeta=0.05, q0=0.3, eps1=0.05, damping_law=law, stiffness=pairs)
    steps = replace(model, stiffness=gc.SteppedStiffness((1.4, 1.0), (0.0, 0.6)))
    w = np.array([[1.4, 0.5, 1.0], [0.3, 0.9, -0.2]])
    assert np.abs(flow_of(model, w, 8) - flow_of(steps, w, 8)).max() < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_exchanged_wheels_meet_the_same_pairs_backwards(seed):
    """With the path, and so the reliefs, from the other end both deflections and motions run backwards in time."""
    pairs = random_pairs(seed)
    other = replace(
        pairs, levels=pairs.levels[::-1], starts=(0.0, *(1 - start for start in pairs.starts[:0:-1])),
        relief1=pairs.relief2, relief2=pairs.relief1, relief_length1=pairs.relief_length2,
        relief_length2=pairs.relief_length1, back_phase=0.0)
    phases = np.random.default_rng(seed).uniform(0, 1, 20)
    backwards = static_deflection(other, 0.4, pairs.contact_ratio - phases)
    assert static_deflection(pairs, 0.4, phases) == pytest.approx(backwards, rel=1e-12)
    first, second = (switched_system(vary(gc.MeshModel.of(
        kind="single", omega=0.9, zeta=0.0, q0=0.4, stiffness=replace(each, contact_ratio=2.0, back_phase=0.0)), {}))
        for each in (pairs, other))
    w = np.array([[1.5], [0.1]])
    there, back = ExactFlow(reversed_in_time(first)).advance(w, 2).w, ExactFlow(second).advance(w, 2).w
    assert np.abs(there - back).max() < 1e-11


@pytest.mark.parametrize("relief", [0.0, 0.3])
def test_one_pair_alone_is_one_spring_with_its_gap(relief):
    pairs = gc.ToothPairStiffness((0.8,), (0.0,), 1.0, relief, relief, 0.25, 0.25)
    gap = relief * np.array([0.8, 0.0, 0.0, 0.6])
    assert static_deflection(pairs, 0.2, [0.05, 0.3, 0.6, 0.9]) == pytest.approx(1 + gap + 0.25, rel=1e-12)
    model = gc.MeshModel.of(kind="single", omega=0.9, zeta=0.05, q0=0.2, stiffness=pairs)
    assert quasi_static_ratio(model) == pytest.approx(1.0)
    if not relief:
        steps, w = replace(model, stiffness=gc.SteppedStiffness((0.8,), (0.0,))), np.array([[1.4], [0.3]])
        assert np.abs(flow_of(model, w, 6) - flow_of(steps, w, 6)).max() < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_a_motion_and_its_reverse_end_where_they_began(seed):
    model = gc.MeshModel.of(kind="single", omega=0.9, zeta=0.02, q0=0.2, eps1=0.1, damping_law="contact",
                            stiffness=random_pairs(seed))
    system = switched_system(vary(model, {}))
    w = np.random.default_rng(seed).uniform(-1.5, 1.5, (2, 6))
    sign, points = velocity_signs(system.names)[:, None], np.zeros(6, int)
    back = ExactFlow(reversed_in_time(system)).advance(sign * flow_of(model, w, 2), 2, points=points).w
    assert np.abs(sign * back - w).max() < 1e-10


@pytest.mark.parametrize(("values", "message"), [
    ({"force": [0.3, -0.1]}, "force must not be negative; got -0.1"), ({"force": "a lot"}, "force must be numbers"),
    ({"force": np.nan}, "force must be a finite number"), ({"phases": [0.2, np.inf]}, "phases must be a finite number"),
    ({"phases": 0.5}, "phases must be a list of positions"),
    ({"stiffness": gc.MeshModel.of(stiffness=gc.ToothPairStiffness())}, "stiffness must be a mesh stiffness")])
def test_a_deflection_of_anything_else_is_refused(values, message):
    with pytest.raises(gc.InputError, match=message):
        static_deflection(**{"stiffness": gc.ToothPairStiffness(), "force": 0.2, "phases": [0.5], **values})


def test_very_slow_motion_follows_the_deflection_at_rest():
    pairs = gc.ToothPairStiffness((0.7,), (0.0,), 1.6, 0.3, 0.3, 0.25, 0.25)
    model = gc.MeshModel.of(kind="single", omega=0.002, zeta=0.2, q0=0.2, damping_law="contact", stiffness=pairs)
    system = switched_system(vary(model, {}))
    flow = ExactFlow(system, samples=20)
    w = flow.advance(np.array([[1.3], [0.0]]), 1).w
    sampled = flow.advance(w, 1, sample=True).samples[0, :, 0, 0]
    assert np.abs(sampled - static_deflection(pairs, 0.2, np.arange(20) / 20)).max() < 2e-3


def test_relief_that_takes_up_the_load_ends_the_jump_of_the_force():
    def ratio(relief: float) -> float:
        pairs = gc.ToothPairStiffness((0.7,), (0.0,), 1.6, relief, relief, 0.2, 0.2)
        return quasi_static_ratio(gc.MeshModel.of(kind="single", zeta=0.05, q0=0.14, stiffness=pairs))

    assert ratio(0.0) == pytest.approx(2.0)  # the second pair enters with the deflection of one
    assert 1 < ratio(0.1) < 2
    assert ratio(0.25) == 1.0  # more than the deflection 0.14/0.7 of one pair


def test_the_peak_at_a_jump_is_the_force_of_all_pairs_that_touch_there():
    pairs, force = gc.ToothPairStiffness((0.4, 1.0), (0.0, 0.8), 1.6, relief2=0.6), 0.04
    phase = 0.8 * 1.6 - 1  # where the leading pair becomes stiffer
    before = static_deflection(pairs, force, [phase - 1e-9])[0]
    pushing = sum(k * max(0.0, before - 1 - gap) for k, gap in touching(pairs, phase + 1e-9, 1))
    model = gc.MeshModel.of(kind="single", zeta=0.05, q0=force, stiffness=pairs)
    assert pushing / force == pytest.approx(2.3125, abs=1e-3)
    assert quasi_static_ratio(model) >= pushing / force - 1e-6


@pytest.mark.parametrize(("values", "field"), [
    ({"relief1": -0.1}, "relief1"), ({"relief1": 0.3, "relief_length1": 1.0, "relief2": 0.1}, "relief_length"),
    ({"relief_exponent": 3}, "relief_exponent"), ({"contact_ratio": 4.1}, "contact_ratio"),
    ({"levels": (0.7, 0.0), "starts": (0.0, 0.5)}, "stiffness.levels"), ({"starts": (0.2,)}, "stiffness.starts")])
def test_bad_pairs_are_refused(values, field):
    with pytest.raises(gc.InputError) as caught:
        gc.MeshModel.of(stiffness=gc.ToothPairStiffness(**values)).with_values({})
        vary(gc.MeshModel.of(stiffness=gc.ToothPairStiffness()), values)
    assert caught.value.field == field


def test_pairs_that_never_pull_are_refused():
    with pytest.raises(gc.InputError, match="one damper"):
        gc.MeshModel.of(stiffness=gc.ToothPairStiffness(), damping_law="unilateral")


@pytest.mark.parametrize("ask", [
    gc.prove, gc.prove_chaos, gc.to_sympy, lambda model: gc.prove_box(model, {"omega": 1e-6}),
    lambda model: gc.prove_event(model, "fold", "omega", 0.8), lambda model: gc.script(model, "scipy"),
    lambda model: gc.script(model, "dynamicalsystems.jl"),
], ids=["orbit", "chaos", "SymPy", "box", "event", "SciPy", "Julia"])
def test_what_has_one_spring_alone_refuses_tooth_pairs(ask):
    with pytest.raises(gc.InputError, match=r"stiffness must be one spring for .*; got 'tooth pairs, "):
        ask(gc.MeshModel.of(kind="single", stiffness=gc.ToothPairStiffness(relief1=0.1)))


def test_the_force_along_a_motion_is_that_of_the_pairs_in_contact():
    """With a relief it is less than stiffness times deflection; its samples reach the peak that the flow measures."""
    pairs = gc.ToothPairStiffness((0.7,), (0.0,), 1.6, relief1=0.1, relief2=0.1,
                                  relief_length1=0.25, relief_length2=0.25)
    model = gc.MeshModel(kind="single", omega=0.9, q1=0.1, q2=0.1, zeta=0.05, damping_law="contact", stiffness=pairs)
    motion = gc.simulate(model, periods=1, transient=300, samples=4000)
    assert float(np.abs(motion.mesh_force).max()) == pytest.approx(gc.regime(model).mesh_force_peak, rel=1e-5)
