"""Pairs whose teeth differ, against an integration that shares no code, and against a spring with a level for each part
of the turn."""

from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.gears.operation.operating import as_model
from tests.oracles import uneven_teeth

LOST = 0.3


def train(teeth: tuple[int, int], **mesh: Any) -> gc.Train:
    given = {"stiffness": {"levels": [3e8, 2e8], "starts": [0, 0.6]}, "contact_ratio": 1.6, **mesh}
    if "tooth_pairs" in mesh:
        del given["stiffness"], given["contact_ratio"]
    bodies = [gc.Body(name="a", inertia=2e-4, torque=30.0),
              gc.Body(name="b", inertia=3e-4, torque=-30.0 * teeth[1] / teeth[0])]
    return gc.Train(speed=3000.0, bodies=bodies, meshes=[gc.Mesh(
        between=("a", "b"), teeth=teeth, base_radii=[1.5e-3 * z for z in teeth], damping=400.0, backlash=2e-5,
        error_amplitudes=[3e-6], **given)])


def forces_of_a_period(train: gc.Train, samples: int) -> tuple[np.ndarray, np.ndarray]:
    """The mesh force of a common period, N, by the flow and by the integration from the same state."""
    model, cycles = as_model(train), max(train.cycles.values())
    motion = gc.simulate(model, 1, transient=3, samples=samples * cycles)
    units, backlash = model.units, train.meshes[0].backlash
    z, rate = motion.z.values[0], motion.z_dot.values[0]
    start = np.array([z * units.length - backlash / 2, rate * units.length * units.rate])
    expected = uneven_teeth.forces(train, start, cycles, samples)
    return motion.mesh_force.values.ravel()[: len(expected)] * units.force, expected


@pytest.mark.slow
def test_the_spectrum_of_a_cracked_tooth_agrees_with_an_independent_integration_of_the_turn():
    found, expected = forces_of_a_period(train((23, 46), faults=[{"wheel": 1, "tooth": 5, "stiffness_loss": LOST}]), 32)
    line, other = (np.abs(np.fft.rfft(force)) / len(force) * 2 for force in (found, expected))
    assert np.abs(line - other).max() < 1e-9 * other.max()
    assert line[[21, 22, 24, 25]].min() > 1e-3 * line[23]  # sidebands, at orders of the turn


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_teeth_agree_with_an_independent_integration(seed):
    rng, teeth = np.random.default_rng(seed), (3, 4)
    given: dict[str, Any] = {
        "faults": [{"wheel": 1, "tooth": 2, "stiffness_loss": rng.uniform(0, 1)},
                   {"wheel": 2, "tooth": 3, "stiffness_loss": rng.uniform(0, 0.5), "wear": 2e-6}],
        "pitch_errors": [rng.uniform(-3e-6, 3e-6, z).tolist() for z in teeth],
        "eccentricity": rng.uniform(0, 2e-6, 2).tolist(), "eccentricity_phases": rng.uniform(0, 6, 2).tolist(),
        "contact_ratio": rng.uniform(1.1, 2.7), "phase": rng.uniform(0, 9)}
    if seed % 2:
        given["tooth_pairs"] = {"stiffness": [1.5e8, 1.9e8], "starts": (0.0, rng.uniform(0.2, 0.8)),
                                "contact_ratio": rng.uniform(1.1, 1.9), "back_phase": rng.uniform(0, 1)}
    found, expected = forces_of_a_period(train(teeth, **given), 24)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_a_cracked_tooth_is_one_spring_with_a_level_for_each_part_of_the_turn():
    """That of the pairs in contact, each with an equal share, in the kernel of a single spring."""
    teeth, weak = 23, 5
    cracked = as_model(train((teeth, teeth), stiffness=2e8, damping_law="always", faults=[
        {"wheel": 1, "tooth": weak + 1, "stiffness_loss": LOST}]))
    levels, starts = [], []
    for cycle in range(teeth):
        now, before = ((LOST if n % teeth == weak else 0.0) for n in (cycle, cycle - 1))
        levels += [1 - (now + before) / 2, 1 - now]
        starts += [cycle / teeth, (cycle + 0.6) / teeth]
    amplitude = 3e-6 / cracked.units.length
    error = gc.TransmissionError((0.0,) * (teeth - 1) + (amplitude,))
    damping = 400.0 * cracked.units.rate / cracked.units.stiffness
    one = gc.MeshModel.of(kind="single", omega=cracked.omega, zeta=damping / 2).with_values({
        "error": error, "stiffness": gc.SteppedStiffness(tuple(levels), tuple(starts)),
        "q0": 30.0 / 0.0345 / cracked.units.force})
    found, expected = gc.regime(cracked), gc.regime(one)
    assert found.label == expected.label == "1T"
    assert found.dynamic_factor == pytest.approx(expected.dynamic_factor, rel=1e-11)
    assert found.z_rms == pytest.approx(expected.z_rms, rel=1e-11)
    assert found.lyapunov == pytest.approx(expected.lyapunov, rel=1e-9)


def test_teeth_that_do_not_differ_are_those_of_the_healthy_pair_bit_for_bit():
    healthy = gc.regime(train((23, 46), contact_ratio=None))
    alike = train((23, 46), faults=[{"wheel": 1, "tooth": 5}], pitch_errors=([], [0.0] * 46))
    assert gc.regime(alike).to_dict() == healthy.to_dict()
