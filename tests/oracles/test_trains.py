"""Gear trains against an integration of all their angles that shares no code with the flow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import OK
from gearchaos.gears.operating import as_model
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.train.parts import parameter_owner
from gearchaos.studies.initial_value_problems import initial_value_problems
from tests.oracles.trains_oracle import Oracle

TEETH = (12, 18, 24, 36)


def random_mesh(rng: np.random.Generator, between: tuple[str, str]) -> dict[str, Any]:
    z1, z2 = (int(z) for z in rng.choice(TEETH, 2))
    k = float(rng.uniform(0.5, 3) * 1e8)
    amplitudes = rng.uniform(-8e-6, 8e-6, int(rng.integers(0, 3))).tolist()
    found: dict[str, Any] = {
        "between": between, "teeth": (z1, z2), "base_radii": (z1 * 1.5e-3, z2 * 1.5e-3),
        "damping": float(rng.uniform(50, 1500)), "backlash": float(rng.uniform(0.02, 0.15) * 1e-3),
        "error_amplitudes": amplitudes, "error_phases": rng.uniform(0, 6, len(amplitudes)).tolist(),
        "internal": bool(rng.random() < 0.2), "damping_law": str(rng.choice(["always", "contact"]))}
    phase, kind = float(rng.uniform(0, 6)), rng.random()
    if kind < 0.25:
        found["tooth_pairs"] = {
            "stiffness": 0.7 * k, "contact_ratio": float(rng.uniform(1.2, 1.9)),
            "crowning": float(rng.choice([0, 3e-6])), "relief": {
                "amount": [float(rng.uniform(0, 2e-5)), 1e-5], "length": [0.2, 0.2],
                "shape": str(rng.choice(["linear", "parabolic"]))}}
    elif kind < 0.75:
        found["stiffness"] = {"levels": [k, k * float(rng.uniform(0.6, 0.9))], "starts": [
            float(rng.choice([0.0, 0.13])), float(rng.uniform(0.4, 0.8))]}
    else:
        found["stiffness"] = k
    if kind < 0.75 or amplitudes:
        found["phase"] = phase
    return found


def random_shaft(rng: np.random.Generator, between: tuple[str, str]) -> dict[str, Any]:
    found = {"between": between, "stiffness": float(rng.uniform(1e3, 2e4)), "damping": float(rng.uniform(0, 1))}
    if rng.random() < 0.5:
        found |= {"stop": float(rng.uniform(2e-4, 2e-3)), "stop_stiffness": float(rng.uniform(1e4, 5e4)),
                  "stop_damping": float(rng.uniform(0, 2))}
    return found


def random_train(seed: int) -> tuple[gc.Train, np.random.Generator]:
    """A tree of 2 to 5 bodies, of which the first drives and the last resists."""
    rng = np.random.default_rng(seed)
    n, driven, braked = int(rng.integers(2, 6)), rng.random() < 0.4, rng.random() < 0.3
    names, ratio = [f"b{i}" for i in range(n)], [1.0]
    meshes, shafts, bodies = [], [], []
    for i in range(1, n):
        parent = i - 1 if rng.random() < 0.6 else int(rng.integers(0, i))
        between = names[parent], names[i]
        if i > 1 and rng.random() < 0.3:
            shafts.append(random_shaft(rng, between))
            ratio.append(ratio[parent])
        else:
            meshes.append(random_mesh(rng, between))
            ratio.append(ratio[parent] * meshes[-1]["teeth"][0] / meshes[-1]["teeth"][1])
    load = float(rng.uniform(1, 60))
    for i, name in enumerate(names):
        if i == 0 and driven:
            bodies.append({"name": name, "motion": [{"order": float(rng.choice([1, 2, 3])), "acceleration": float(
                rng.uniform(50, 2000)), "phase": float(rng.uniform(0, 6))}]})
            continue
        body: dict[str, Any] = {"name": name, "inertia": float(10 ** rng.uniform(-4, -2.5))}
        body["torque"] = load if i == 0 else -load / ratio[-1] if i == n - 1 else 0.0
        if rng.random() < 0.3:
            body["torque_orders"] = [{"order": float(rng.choice([1, 2, 4])), "amplitude": float(rng.uniform(1, 10)),
                                      "phase": float(rng.uniform(0, 6))}]
        body["damping"] = float(rng.uniform(0, 0.1)) * braked
        if rng.random() < 0.2 and any(name in mesh["between"] for mesh in meshes):
            body |= {"mass": float(rng.uniform(0.3, 3)), "support": {
                "stiffness": float(rng.uniform(1e7, 2e8)), "damping": float(rng.uniform(0, 2e3)),
                "direction": float(rng.uniform(0, 3))}}
        bodies.append(body)
    for mesh in meshes:
        if any("support" in body for body in bodies if body["name"] in mesh["between"]):
            mesh["line_of_action"] = float(rng.uniform(0, 3))
    return gc.Train(speed=float(rng.uniform(800, 6000)), bodies=bodies, meshes=meshes, shafts=shafts), rng


def compare(train: gc.Train, rng: np.random.Generator, periods: int = 1) -> float:
    """Largest difference of deflections and rates after some common periods, over the growth of perturbations."""
    oracle, model = Oracle(train), as_model(train)
    units, q = model.units, np.zeros(2 * oracle.n)
    q[: oracle.n] = rng.uniform(-1, 1, oracle.n) * 3e-3
    if not any(body.damping for body in train.bodies):  # else the speed of turning as a whole is a coordinate
        q[oracle.n :] = rng.uniform(-1, 1, oracle.n) * 0.3
    for i in oracle.moved.values():
        q[i], q[oracle.n + i] = rng.uniform(-1, 1) * 2e-5, 0.0
    parts = {part.name: part for part in (*train.meshes, *train.shafts)}
    initial = {f"{parameter_owner(name)}.{suffix}": value for name, i in oracle.moved.items()
               for suffix, value in (("z", q[i] / units.length), ("z_dot", 0.0))}
    for name, part in parts.items():
        s, rate = oracle.deflection(part, q, 0.0)
        own = "" if part is train.meshes[0] else f"{parameter_owner(name)}."
        middle = part.backlash / 2 if hasattr(part, "teeth") else 0.0
        initial |= {f"{own}z": (s + middle) / units.length, f"{own}z_dot": rate / (units.length * units.rate)}
    problem = initial_value_problems(TrainModel(train, initial))
    d, contacts = problem.flow.dimension, problem.flow.system.contacts
    out = problem.flow.advance(problem.w, periods, tangent=np.eye(d)[:, :, None])
    assert out.status[0] == OK
    end = oracle.run(q, train.period * periods)
    displacement, rate = contacts.rows @ out.w[:, 0], contacts.rates @ out.w[:, 0]
    worst = 0.0
    for m, name in enumerate(contacts.names):
        s, s_dot = oracle.deflection(parts[name], end, train.period * periods)
        middle = parts[name].backlash / 2 if hasattr(parts[name], "teeth") else 0.0
        worst = max(worst, abs(displacement[m] - (s + middle) / units.length),
                    abs(rate[m] - s_dot / (units.length * units.rate)))
    return worst / max(1.0, np.abs(out.tangent).max()) / max(1.0, np.abs(out.w).max())


@pytest.mark.parametrize("seed", [0, 1, 2, 4, 7, 8, 11, 13, 16, 18, 21, 23, 28, 30, 35, 36, 37, 42])
def test_random_trains_agree_with_an_independent_integration(seed):
    assert compare(*random_train(seed)) < 1e-11


@pytest.mark.exhaustive
def test_many_random_trains_agree_with_an_independent_integration():
    assert max(compare(*random_train(seed)) for seed in range(100, 200)) < 1e-10
