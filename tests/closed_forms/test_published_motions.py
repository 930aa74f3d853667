"""Motions that others have computed and published with all inputs."""

import math

import pytest

import gearchaos as gc

INERTIA, BASE_RADIUS = 0.0365, 0.1 * math.cos(math.radians(20))
ONE_PAIR, TWO_PAIRS, SHARE = 3.6228e8, 6.5072e8, 0.5568


def yi_and_others(speed: float) -> gc.Train:
    """Y. Yi, K. Huang, Y. Xiong, M. Sang, Mech. Syst. Signal Process. 132 (2019) 18, in its torsional form.

    Wheels 20/20 of module 10 mm; two pairs are in contact for a share of the mesh period from t = 0. Half the backlash
    is 50 µm, the error 20 µm sin zΩt, the torque of both wheels 300 + 100 sin Ωt N m. The damper is a constant one with
    ζ = 0.07 at the mean stiffness.
    """
    mean, mass = SHARE * TWO_PAIRS + (1 - SHARE) * ONE_PAIR, INERTIA / (2 * BASE_RADIUS**2)
    bodies = [gc.Body(name=name, inertia=INERTIA, torque=sign * 300.0, torque_orders=[
        {"order": 1, "amplitude": sign * 100.0, "phase": -math.pi / 2}]) for name, sign in (("1", 1), ("2", -1))]
    mesh = gc.Mesh(
        between=("1", "2"), teeth=(20, 20), base_radii=(BASE_RADIUS, BASE_RADIUS), backlash=100e-6,
        stiffness={"levels": [TWO_PAIRS, ONE_PAIR], "starts": [0.0, SHARE]},
        damping=2 * 0.07 * math.sqrt(mean * mass), error_amplitudes=[20e-6], error_phases=[math.pi / 2])
    return gc.Train(speed=speed, bodies=bodies, meshes=[mesh])


@pytest.mark.parametrize(("speed", "least", "largest"), [(1000, 897.7, 7291.7), (3000, 467.5, 6443.2)])
def test_the_mesh_force_of_yi_and_others(speed, least, largest):
    """Least and largest force within 1.2 N of the published ones, which have four digits; the period is one turn."""
    train = yi_and_others(speed)
    found = gc.regime(train)
    assert (found.label, found.contact) == ("1T", "permanent")
    force = gc.physical(gc.simulate(train, 1, transient=80, samples=80_000)).mesh_force.values
    assert [force.min(), force.max()] == pytest.approx([least, largest], abs=1.2)
