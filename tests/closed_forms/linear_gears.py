"""Gears whose motion is known in closed form while the teeth keep contact, and the commands that take their files."""

import math
from typing import Any

import numpy as np

import gearchaos as gc
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from tests import ONE_SPRING

PAIR_FILE = ONE_SPRING
PAIR = {"n1": 25, "n2": 40, "I1": 4.88e-4, "I2": 3.2e-3, "R1": 0.03524, "R2": 0.056384, "c0": 4e8, "k": 2000.0,
        "backlash": 1.2e-4, "M10": 85.0, "speed": 4000.0}
LINEAR = gc.GearPair(**PAIR, error_amplitudes=[2e-7], chi1=0.0, chi2=0.0)

SPUR = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="300 N*m",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    load_sharing="prescribed", quality={"standard": "ISO 1328-1:1995", "grade": 6})


def steady_force(gears: gc.GearPair, speeds: Any) -> tuple[np.ndarray, np.ndarray]:
    """The static force and the amplitude beside it at each speed: z'' + 2ζz' + z = q + ε1 ω² cos ωτ has the force
    √(1 + (2ζω)²) |Z|."""
    system = switched_system(vary(as_model(gears), {"speed": np.asarray(speeds)}))
    w, damping = system.omega, system.damping  # 2ζ
    return system.static_force[:, 0], np.hypot(1, damping * w) * np.abs(system.f_cos[:, 0]) / np.hypot(
        1 - w**2, damping * w)


def loose_train(law: str = "contact", motion: Any = ({"order": 2, "acceleration": 300.0},), wheel: Any = None,
                speed: float = 800.0, **mesh: Any) -> gc.Train:
    """A wheel with a drag (-0.2 N m if nothing else is given), which follows its driver as long as its inertia asks
    for less."""
    return gc.Train(speed=speed, damping_law=law, bodies=[
        gc.Body(name="driver", motion=list(motion)),
        gc.Body(name="loose", inertia=5e-4, **wheel or {"torque": -0.2})], meshes=[gc.Mesh(**{
            "between": ("driver", "loose"), "teeth": (20, 30), "base_radii": (0.03, 0.045), "stiffness": 2e8,
            "damping": 60.0, "backlash": 0.12e-3, **mesh})])


def onset(order: float = 2, acceleration: float = 300.0, k: float = 2e8) -> float:
    """The drag in N m below which the loose wheel loses contact: r_b m r_a α k/|k − m w² + i c w| with m = J/r_b²."""
    m, w = 5e-4 / 0.045**2, order * 800 * 2 * math.pi / 60
    return 0.045 * m * 0.03 * acceleration * k / abs(k - m * w**2 + 60j * w)
