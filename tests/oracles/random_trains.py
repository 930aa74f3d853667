"""Random trains of several shapes, and states from which their motions begin."""

from dataclasses import replace
from typing import Any

import numpy as np

import gearchaos as gc
from tests.oracles.physical_trains import Oracle, steady_speeds

MODULE = 3e-3  # base radii are half of it for each tooth
SHAPES = ("chain", "branched", "stages", "stops", "supported", "internal", "driven", "pairs", "star", "planetary",
          "split")


def wheel(rng: np.random.Generator, name: str, teeth: int, **more: Any) -> gc.Body:
    inertia = 0.3 * (MODULE * teeth / 2) ** 2 * rng.uniform(0.5, 2.0)
    damping = 0.02 * rng.random() if rng.random() < 0.3 else 0.0
    return gc.Body(name=name, inertia=inertia, damping=damping, **more)


def mesh(rng: np.random.Generator, a: str, b: str, teeth: tuple[int, int], pairs: bool = False, exact: bool = False,
         **more: Any) -> gc.Mesh:
    """With a constant or stepped stiffness, or tooth pairs; some with an error and phases."""
    k = rng.uniform(1e8, 4e8)
    stiffness: dict[str, Any] = {"stiffness": k}
    if pairs:
        relief = {"amount": rng.uniform(0, 2e-6, 2), "length": rng.uniform(0.1, 0.4, 2),
                  "shape": str(rng.choice(["linear", "parabolic"]))}
        stiffness = {"tooth_pairs": {
            "stiffness": list(k * rng.uniform(0.5, 1.0, 2)), "starts": (0.0, float(rng.uniform(0.2, 0.8))),
            "contact_ratio": rng.uniform(1.1, 1.9), "crowning": rng.uniform(0, 1e-6),
            "back_phase": rng.uniform(0, 1), "relief": relief}}
    elif rng.random() < 0.6:
        n = int(rng.integers(2, 4))
        starts = np.sort(rng.uniform(0, 1, n))
        if rng.random() < 0.5:
            starts[0] = 0.0
        stiffness = {"stiffness": {"levels": list(k * rng.uniform(0.6, 1.4, n)), "starts": list(starts)}}
    error: dict[str, Any] = {}
    if rng.random() < 0.4 and not exact:
        error = {"error_amplitudes": list(rng.uniform(0, 1e-6, 2)), "error_phases": list(rng.uniform(0, 6, 2))}
    if error or not isinstance(stiffness.get("stiffness"), float):
        error["phase"] = rng.uniform(0, 6)
    return gc.Mesh(between=(a, b), teeth=teeth, base_radii=[MODULE * z / 2 for z in teeth], **stiffness, **error,
                   damping=rng.uniform(50, 1500), backlash=rng.uniform(1e-6, 8e-6),
                   damping_law=str(rng.choice(["always", "contact"])), **more)


def orders(rng: np.random.Generator, amplitude: str, size: float, base: float) -> list[dict[str, float]]:
    """Up to two orders that are multiples of one."""
    return [{"order": base * int(n), amplitude: size * rng.uniform(0.2, 1.0), "phase": rng.uniform(0, 6)}
            for n in rng.permutation([1, 2, 3])[: rng.integers(0, 3)]]


def balanced(rng: np.random.Generator, bodies: list[gc.Body], **parts: Any) -> gc.Train:
    """A train whose speed is near a resonance, with torques that balance over its free bodies."""
    law = str(rng.choice(["always", "contact"]))
    speed = rng.uniform(2500, 9000)
    first = gc.Train(speed=speed, bodies=bodies, damping_law=law, **parts)
    free = [body for body in first.bodies if body.inertia is not None]
    ratios = steady_speeds(first)
    torque = {body.name: rng.uniform(-15, 15) for body in free}
    if all(body.motion is None for body in bodies):  # the last one takes what is left over of Σ torque × speed
        left = sum(torque[b.name] * abs(ratios[b.name]) for b in free[:-1])
        torque[free[-1].name] = -left / abs(ratios[free[-1].name])
    return replace(first, bodies=[replace(b, torque=torque[b.name]) if b.name in torque else b for b in first.bodies])


def random_train(shape: str, rng: np.random.Generator) -> gc.Train:
    z = (20, 30, 40, 30, 20, 40)
    base = 20.0
    if shape == "chain":
        n = int(rng.integers(2, 6))
        bodies = [wheel(rng, f"w{i}", z[i], torque_orders=orders(rng, "amplitude", 10.0, base)) for i in range(n)]
        return balanced(rng, bodies, meshes=[mesh(rng, f"w{i}", f"w{i + 1}", z[i:i + 2]) for i in range(n - 1)])
    if shape in ("branched", "driven"):
        motion = orders(rng, "acceleration", 3e4, base) or [{"order": base, "angle": 1e-5}]
        first = gc.Body(name="driver", motion=motion) if shape == "driven" else wheel(rng, "driver", 20)
        meshes = [mesh(rng, "driver", "loose1", (20, 30)), mesh(rng, "driver", "loose2", (20, 40))]
        bodies = [first, wheel(rng, "loose1", 30), wheel(rng, "loose2", 40)]
        if rng.random() < 0.5:
            bodies.append(wheel(rng, "end", 20))
            meshes.append(mesh(rng, "loose2", "end", (40, 20)))
        return balanced(rng, bodies, meshes=meshes)
    if shape in ("stages", "stops"):
        bodies = [wheel(rng, "w1", 20), wheel(rng, "w2", 40), wheel(rng, "w3", 30), wheel(rng, "w4", 30)]
        spring = {"stiffness": rng.uniform(2e4, 2e5), "damping": rng.uniform(0.0, 0.5)}
        stop = {"stop": rng.uniform(0, 1e-4), "stop_stiffness": rng.uniform(1e4, 2e5),
                "stop_damping": rng.uniform(0, 1)}
        if shape == "stops":
            spring = stop if rng.random() < 0.5 else {**spring, **stop}
        meshes = [mesh(rng, "w1", "w2", (20, 40)), mesh(rng, "w3", "w4", (30, 30))]
        shafts = [gc.Shaft(between=("w2", "w3"), **spring)]
        if rng.random() < 0.5:
            bodies.append(wheel(rng, "load", 40))
            shafts.append(gc.Shaft(between=("w4", "load"), stiffness=rng.uniform(2e4, 2e5), damping=0.1))
        return balanced(rng, bodies, shafts=shafts, meshes=meshes)
    if shape == "supported":
        def held(name: str, teeth: int, **more: Any) -> gc.Body:
            direction = {"direction": rng.uniform(0, 6)} if rng.random() < 0.5 else {}
            return wheel(rng, name, teeth, mass=rng.uniform(0.5, 2), support={
                "stiffness": rng.uniform(1e8, 4e8), "damping": rng.uniform(0, 800), **direction}, **more)
        bodies = [held("a", 20), held("b", 30), wheel(rng, "c", 20)]
        meshes = [mesh(rng, "a", "b", (20, 30), line_of_action=rng.uniform(0, 6)),
                  mesh(rng, "b", "c", (30, 20), line_of_action=rng.uniform(0, 6))]
        return balanced(rng, bodies, meshes=meshes)
    if shape == "internal":
        bodies = [wheel(rng, "a", 20), wheel(rng, "b", 30), wheel(rng, "ring", 90)]
        between = [("b", "ring", (30, 90)), ("ring", "b", (90, 30))][int(rng.integers(2))]
        return balanced(rng, bodies, meshes=[mesh(rng, "a", "b", (20, 30)), mesh(rng, *between, internal=True)])
    if shape == "pairs":
        bodies = [wheel(rng, f"w{i}", z[i]) for i in range(3)]
        return balanced(rng, bodies, meshes=[mesh(rng, "w0", "w1", z[:2], pairs=True), mesh(rng, "w1", "w2", z[1:3])])
    if shape == "split":  # the power goes two ways
        names, teeth = ("in", "a1", "b1", "a2", "b2", "out"), (20, 40, 20, 40, 20, 40)
        bodies = [wheel(rng, name, z) for name, z in zip(names, teeth, strict=True)]
        meshes = [mesh(rng, a, b, (20, 40), exact=True) for a, b in (("in", "a1"), ("in", "a2"), ("b1", "out"),
                                                                     ("b2", "out"))]
        shafts = [gc.Shaft(between=(f"a{i}", f"b{i}"), stiffness=rng.uniform(2e4, 2e5), damping=rng.uniform(0, 1))
                  for i in (1, 2)]
        return balanced(rng, bodies, meshes=meshes, shafts=shafts)
    pin = {"stiffness": rng.uniform(1e8, 4e8), "damping": rng.uniform(0, 800)}  # star: a planet on a carrier
    carrier = {"fixed": {"fixed": True}, "turning": {"inertia": 2e-3, "torque": 0.0}}[
        str(rng.choice(["fixed", "turning"]))]
    rs, rp, alpha = 20 * MODULE / 2, 30 * MODULE / 2, 0.4
    if shape == "planetary":
        bodies = [wheel(rng, "sun", 20), gc.Body(name="ring", fixed=True), gc.Body(name="carrier", inertia=0.01)]
        meshes = []
        held = None if rng.random() < 0.3 else pin
        for i in range(2):
            bodies.append(wheel(rng, f"p{i}", 30, mass=0.8, carrier="carrier", orbit=(rs + rp) / np.cos(alpha),
                                position=np.pi * i, pin=held))
            meshes += [mesh(rng, "sun", f"p{i}", (20, 30), exact=True, pressure_angle=alpha),
                       mesh(rng, f"p{i}", "ring", (30, 80), exact=True, internal=True, pressure_angle=alpha)]
        return balanced(rng, bodies, meshes=meshes)
    planet = wheel(rng, "planet", 30, mass=0.8, carrier="carrier", orbit=(rs + rp) / np.cos(alpha),
                   position=rng.uniform(0, 6), pin=pin if rng.random() < 0.7 else None)
    bodies = [wheel(rng, "sun", 20), gc.Body(name="ring", fixed=True), planet, gc.Body(name="carrier", **carrier)]
    if "fixed" in carrier:
        bodies[1] = gc.Body(name="ring", inertia=0.02)
    order = [("sun", "planet", (20, 30)), ("planet", "sun", (30, 20))][int(rng.integers(2))]
    ring = [("planet", "ring", (30, 80)), ("ring", "planet", (80, 30))][int(rng.integers(2))]
    return balanced(rng, bodies, meshes=[mesh(rng, *order, pressure_angle=alpha),
                                         mesh(rng, *ring, internal=True, pressure_angle=alpha)])


def random_state(oracle: Oracle, rng: np.random.Generator) -> np.ndarray:
    """Angles and displacements that deflect meshes by a few backlashes."""
    n = len(oracle.index)
    length = np.array([rng.uniform(-8e-6, 8e-6) / (0.04 if axis == "θ" else 1.0) for _, axis in oracle.index])
    return np.concatenate([length, length[rng.permutation(n)] * rng.uniform(-1, 1, n) * 1.5e4 * 0.2])
