"""Trains whose meshes stay in contact: natural modes and forced motions of linear systems, in closed form."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.linalg

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.train.modes import modes
from tests import EXAMPLES


def mesh(a: str, b: str, z1: int, z2: int, **values: Any) -> gc.Mesh:
    return gc.Mesh(between=(a, b), teeth=(z1, z2), base_radii=(z1 * 1e-3, z2 * 1e-3),
                   **{"stiffness": 2e8, "damping": 600.0, "backlash": 1e-4, **values})


def idler(**values: Any) -> gc.Train:
    bodies = [gc.Body(name=n, inertia=1.0, torque=t) for n, t in (("a", 1.0), ("i", 0.0), ("b", -1.0))]
    meshes = [gc.Mesh(between=ends, teeth=(20, 20), base_radii=(1.0, 1.0), stiffness=1.0, backlash=1e-3, **values)
              for ends in (("a", "i"), ("i", "b"))]
    return gc.Train(speed=100.0, bodies=bodies, meshes=meshes)


def test_the_modes_of_an_idler_between_equal_wheels():
    found = modes(idler(damping=0.02))
    assert found.frequency == pytest.approx([0.0, 1.0, math.sqrt(3)], rel=1e-12)
    # each in its own sense: all turn alike, the outer wheels against each other, and the idler against both
    assert found.angle[0] == pytest.approx(np.full(3, 1 / math.sqrt(3)), rel=1e-12)
    assert np.abs(found.angle[1]) == pytest.approx([1 / math.sqrt(2), 0.0, 1 / math.sqrt(2)], abs=1e-12)
    assert found.angle[1, 0] * found.angle[1, 2] < 0
    assert found.angle[2] == pytest.approx(np.array([-1.0, 2.0, -1.0]) / math.sqrt(6), rel=1e-12)
    assert found.damping_ratio[1:] == pytest.approx([0.02 * 1 / 2, 0.02 * math.sqrt(3) / 2], rel=1e-12)
    assert np.isnan(found.damping_ratio[0])
    assert found.strain_energy == pytest.approx(np.array([[0, 0], [0.5, 0.5], [0.5, 0.5]]), abs=1e-12)
    assert found.kinetic_energy[2] == pytest.approx([1 / 6, 2 / 3, 1 / 6], rel=1e-12)


def test_idlers_side_by_side_share_the_load_by_their_stiffnesses():
    bodies = [gc.Body(name=n, inertia=1e-3, torque=t) for n, t in (("a", 8.0), ("i", 0.0), ("j", 0.0), ("b", -8.0))]
    meshes = [mesh(*ends, 20, 20, stiffness=k) for *ends, k in (
        ("a", "i", 2e8), ("i", "b", 6e8), ("a", "j", 3e8), ("j", "b", 1e8))]
    found = gc.regime(gc.Train(speed=100.0, bodies=bodies, meshes=meshes))
    series = np.array([1 / (1 / 2e8 + 1 / 6e8), 1 / (1 / 3e8 + 1 / 1e8)])
    share = series / series.sum()
    assert found.load_shares == {"a": pytest.approx({"a/i": share[0], "a/j": share[1]}, rel=1e-9),
                                 "b": pytest.approx({"i/b": share[0], "j/b": share[1]}, rel=1e-9)}
    for name, part in (("a/i", share[0]), ("j/b", share[1])):
        for force in ("force_mean", "force_least", "force_peak"):
            assert found.meshes[name][force] == pytest.approx(8.0 / 0.02 * part, rel=1e-9)


def on_a_shaft(**values: Any) -> gc.Train:
    """Two wheels of a stiff and well damped mesh, and a load on a soft shaft."""
    bodies = [gc.Body(name=n, inertia=i, torque=t) for n, i, t in (("a", 1e-3, 1.0), ("b", 1e-3, 0.0), ("c", 1, -1.0))]
    return gc.Train(speed=100.0, bodies=bodies, meshes=[mesh("a", "b", 20, 20, damping=2e3)],
                    shafts=[gc.Shaft(between=("b", "c"), **{"stiffness": 1e3, **values})])


def test_a_mode_that_hardly_decays_is_named_with_the_damping_that_it_lacks():
    (words,) = on_a_shaft().warnings
    hertz, damping = map(float, re.search(r"of ([\d.]+) Hz .*= '([\d.]+) N\*m\*s/rad'", words).groups())
    joined = 1 / (1 / 2e-3 + 1 / 1)  # both wheels as one body against the load
    assert hertz == pytest.approx(math.sqrt(1e3 / joined) / (2 * math.pi), rel=1e-2)
    assert damping == pytest.approx(2 * 0.01 * math.sqrt(1e3 * joined), rel=0.03)
    assert "in a 5" in words and "b 5" in words and "strain energy in b-c" in words
    weak, usual = (on_a_shaft(damping=damping * share) for share in (0.04, 0.06))  # the limit is 0.0005
    assert len(weak.warnings) == 1 and not usual.warnings
    assert modes(on_a_shaft(damping=damping)).damping_ratio[1] == pytest.approx(0.01, rel=0.03)


def test_of_stops_without_a_spring_their_own_damping_is_named():
    (words,) = on_a_shaft(stiffness=0.0, stop=0.01, stop_stiffness=1e3).warnings
    assert "in b-c, where stop_damping = " in words


def test_modes_of_one_frequency_that_hardly_decay_are_named_once():
    *first, more = planetary(3).warnings
    found = modes(planetary(3)).frequency
    distinct = np.unique((found[found > 0] / (2 * np.pi)).round(2))
    assert len(first) == 3 and more.startswith(f"So do {len(distinct) - 3} more modes") and len(distinct) < found.size
    assert "N*s/m' makes" in first[0]


def planetary(count: int) -> gc.Train:
    """The planetary set of J. Lin, R. G. Parker, J. Vib. Acoust. 121 (1999) 316, table 1."""
    sun, planet, ring, angle = 0.0387, 0.05015, 0.1390, math.radians(24.6)
    orbit, held = (sun + planet) / math.cos(angle), {"stiffness": 1e8}
    bodies = [gc.Body(name="sun", inertia=0.39 * sun**2, mass=0.4, support=held),
              gc.Body(name="carrier", inertia=6.29 * orbit**2, mass=5.43, support=held),
              gc.Body(name="ring", inertia=3.0 * ring**2, mass=2.35, support=held)]
    meshes = []
    for n in range(count):
        name, values = f"planet{n}", {"stiffness": 5e8, "backlash": 1e-4, "pressure_angle": angle}
        bodies.append(gc.Body(name=name, inertia=0.61 * planet**2, mass=0.66, carrier="carrier", orbit=orbit,
                              position=2 * math.pi * n / count, pin=held))
        meshes += [gc.Mesh(between=("sun", name), teeth=(774, 1003), base_radii=(sun, planet), **values),
                   gc.Mesh(between=(name, "ring"), teeth=(1003, 2780), base_radii=(planet, ring), internal=True,
                           **values)]
    shaft = gc.Shaft(between=("ring", "ground"), stiffness=1e9 * ring**2)
    return gc.Train(speed=100.0, bodies=bodies, shafts=[shaft], meshes=meshes)


def lin_and_parker(count: int) -> np.ndarray:
    """Natural frequencies in Hz by their equations, with x, y, u = r θ of carrier, ring and sun, and ζ, η, u of planets
    in the frame of the carrier; the order of bodies and all lengths are theirs."""
    alpha, size = math.radians(24.6), 9 + 3 * count
    carrier, ring, sun = 0, 3, 6
    rows: list[tuple[float, dict[int, float]]] = [(1e8, {i: 1.0}) for i in (0, 1, 3, 4, 6, 7)]
    rows.append((1e9, {ring + 2: 1.0}))
    for n in range(count):
        psi, p = 2 * math.pi * n / count, 9 + 3 * n
        s, r = psi - alpha, psi + alpha
        rows += [(5e8, {sun: -math.sin(s), sun + 1: math.cos(s), sun + 2: 1, p: -math.sin(alpha),
                        p + 1: -math.cos(alpha), p + 2: 1}),
                 (5e8, {ring: -math.sin(r), ring + 1: math.cos(r), ring + 2: 1, p: math.sin(alpha),
                        p + 1: -math.cos(alpha), p + 2: -1}),
                 (1e8, {carrier: math.cos(psi), carrier + 1: math.sin(psi), p: -1}),
                 (1e8, {carrier: -math.sin(psi), carrier + 1: math.cos(psi), carrier + 2: 1, p + 1: -1})]
    masses = np.array([5.43, 5.43, 6.29, 2.35, 2.35, 3.0, 0.4, 0.4, 0.39] + [0.66, 0.66, 0.61] * count)
    K = np.zeros((size, size))
    for k, row in rows:
        at, c = list(row), np.array(list(row.values()))
        K[np.ix_(at, at)] += k * np.outer(c, c)
    squares = np.linalg.eigvalsh(K / np.sqrt(np.outer(masses, masses)))
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * math.pi)


@pytest.mark.parametrize("count", [3, 5])
def test_planetary_sets_have_the_frequencies_of_lin_and_parker(count):
    found = gc.natural_frequencies(planetary(count)).natural_frequency.values
    assert found[0] == pytest.approx(0, abs=1e-2)  # of turning as a whole: the root of what rounding leaves
    assert found[1:] == pytest.approx(lin_and_parker(count)[1:], rel=1e-9)
    if count == 3:  # their table 2
        distinct = [f for i, f in enumerate(found) if f > 1 and f - found[i - 1] > 1e-3]
        assert distinct == pytest.approx([743.2, 1102.4, 1475.7, 1896.0, 1930.3, 2276.4, 2658.3, 6986.3, 7462.8, 9647.9,
                                          11775.3], abs=0.05)


def test_one_mesh_has_the_frequency_and_the_damping_ratio_of_its_pair():
    pair = gc.GearPair(n1=24, n2=36, I1=1e-3, I2=2e-3, R1=0.024, R2=0.036, c0=2e8, k=600.0, backlash=1e-4, M10=40.0,
                       speed=1000.0)
    found = gc.natural_frequencies(gc.Train(speed=1000.0, meshes=[mesh("a", "b", 24, 36)], bodies=[
        gc.Body(name="a", inertia=1e-3, torque=40.0), gc.Body(name="b", inertia=2e-3, torque=-60.0)]))
    assert found.natural_frequency.values == pytest.approx([0, pair.omega0 / (2 * math.pi)], abs=1e-3)
    assert float(found.damping_ratio[1]) == pytest.approx(pair.to_model().zeta, rel=1e-12)
    for law in ("always", "unilateral"):
        own = gc.natural_frequencies(replace(pair, damping_law=law))
        for name in ("natural_frequency", "damping_ratio", "strain_energy", "order"):
            assert np.array_equal(own[name], found[name], equal_nan=True)


def connected(speed: float, stiff: float, inertias: dict[str, float], shafts: dict[str, float],
              meshes: dict[str, tuple[int, int]]) -> gc.Train:
    """A train whose meshes are so ``stiff``, N m/rad, that they only couple angles."""
    return gc.Train(
        speed=speed, bodies=[gc.Body(name=name, inertia=inertia) for name, inertia in inertias.items()],
        shafts=[gc.Shaft(between=ends.split(), stiffness=k) for ends, k in shafts.items()],
        meshes=[gc.Mesh(between=ends.split(), teeth=z, base_radii=(1.0, z[1] / z[0]), stiffness=stiff, backlash=1e-4)
                for ends, z in meshes.items()])


STEEL = 68e9 * math.pi / 32  # G π/32
INCH_POUND = 0.11298  # N m


@pytest.mark.parametrize(("train", "frequencies", "digits"), [
    # M. I. Friswell and others, Dynamics of Rotating Machines (2010): geared shafts, and its section 9.6.3
    (connected(600, 1e9, {"motor": 4e-4, "a": 25e-6, "b": 25e-6, "rotor1": 7e-4, "rotor2": 7e-4},
               {"motor a": 1e4, "b rotor1": 5e3, "a rotor2": 5e3}, {"a b": (20, 20)}), [425.4, 634.1, 3247.2], 0.05),
    (connected(600, 1e12, {"drive": 3200, "a": 200, "b": 200, "c": 800, "d": 800, "load1": 450, "load2": 450},
               {"drive a": STEEL * 0.2**4 / 2.5, "c load1": STEEL * 0.25**4 / 3.5, "d load2": STEEL * 0.25**4 / 3.5},
               {"a b": (50, 50), "a c": (50, 80), "b d": (50, 80)}), [10.304, 20.479, 24.423], 5e-4),
    # E. J. Gunter, W. J. Chen, Introduction to Dynamics of Rotor-Bearing Systems (2001), example 8.1, in cycles per
    # minute: a propeller, a bull gear, and two turbines behind intermediate gears
    (connected(85, 1e13, {n: v * INCH_POUND for n, v in {
        "propeller": 2.454e6, "bull": 0.826e6, "low1": 0.02, "low2": 1.283e4, "low3": 0.02, "lowturbine": 1.509e4,
        "high1": 0.02, "high2": 2.723e4, "high3": 0.02, "highturbine": 2.612e2}.items()},
        {n: v * INCH_POUND for n, v in {
            "propeller bull": 826e6, "low1 low2": 203.94e6, "low3 lowturbine": 30.51e6, "high1 high2": 24.17e6,
            "high3 highturbine": 14.26e6}.items()},
        {"bull low1": (94094, 10000), "low2 low3": (400424, 94094), "bull high1": (94094, 10000),
         "high2 high3": (782365, 94094)}), np.array([177.7, 220.2, 1282.6]) / 60, 0.1 / 60)])
def test_published_geared_systems(train, frequencies, digits):
    found = gc.natural_frequencies(train)
    assert found.natural_frequency.values[~found.rigid.values][:3] == pytest.approx(frequencies, abs=digits)


def test_a_pair_on_supports_has_the_frequencies_of_its_matrices():
    pair = gc.open(EXAMPLES / "physical_pair.toml")
    pair = replace(pair, R2=pair.R1 * pair.n2 / pair.n1)  # a train takes the ratio of the numbers of teeth
    found = gc.natural_frequencies(pair)
    row = np.array([pair.R1, 1.0, pair.R2, 1.0])
    stiffness = 1.075 * pair.c0 * np.outer(row, row) + np.diag([0, pair.c1, 0, pair.c2])  # the mean over time
    mass = np.diag([pair.I1, pair.m1, pair.I2, pair.m2])
    squares = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    assert found.natural_frequency.values[1:] == pytest.approx(np.sqrt(squares[1:]) / (2 * np.pi), rel=1e-9)
    assert found.speed == pair.speed and found.rigid.values.tolist() == [True, False, False, False]


def test_a_design_without_speed_has_its_frequencies_at_its_main_resonance():
    design = replace(gc.open(EXAMPLES / "spur_50_50.toml"), speed=None)
    found = gc.natural_frequencies(design)
    pair = design.at(speed=float(found.speed)).to_pair()
    assert pair.mesh_frequency == pytest.approx(pair.omega0, rel=1e-12)
    assert found.order.values.tolist() == [50.0]


def test_a_body_on_a_damped_support_and_the_wheel_that_it_meets():
    """The centre moves along the line of action, so that both springs are in one line."""
    held = {"stiffness": 1e8, "damping": 300.0, "direction": 0.3}
    train = gc.Train(speed=1000.0, bodies=[
        gc.Body(name="a", motion=[]), gc.Body(name="b", inertia=1e9, mass=2.0, support=held)],
        meshes=[mesh("a", "b", 24, 36, line_of_action=0.3)])
    found = modes(train)
    assert found.frequency[-1] == pytest.approx(math.sqrt(3e8 / 2.0), rel=1e-9)
    assert found.damping_ratio[-1] == pytest.approx(900.0 / (2 * math.sqrt(3e8 * 2.0)), rel=1e-6)
    assert found.elements == ("a/b", "support of b")
    assert found.strain_energy[-1] == pytest.approx([2 / 3, 1 / 3], rel=1e-6)
    assert np.abs(found.displacement[-1, 1]) == pytest.approx(
        np.abs([math.cos(0.3), math.sin(0.3)]) / math.sqrt(2.0), rel=1e-9)


@pytest.mark.parametrize(("shaft", "frequency"), [({}, 3.0), ({"stiffness": 4.0}, 2.0)])
def test_stops_act_where_a_shaft_has_no_spring(shaft, frequency):
    bodies = [gc.Body(name="drive", motion=[]), gc.Body(name="a", inertia=1.0), gc.Body(name="b", inertia=1e-9)]
    stopped = gc.Shaft(between=("drive", "a"), stop=0.01, stop_stiffness=9.0, **shaft)
    train = gc.Train(speed=100.0, bodies=bodies, meshes=[mesh("a", "b", 20, 20)], shafts=[stopped])
    assert modes(train).frequency[0] == pytest.approx(frequency, rel=1e-6)


def test_what_is_no_train_has_no_frequencies():
    with pytest.raises(InputError, match="gears must be a Train, a GearDesign or a GearPair"):
        gc.natural_frequencies(gc.MeshModel())


@pytest.mark.parametrize("law", ["always", "contact"])
def test_a_train_in_permanent_contact_moves_as_its_frequency_response_says(law):
    """Two stages on a shaft, with errors, a torque of the third order, a damped load and a sprung centre."""
    speed, k, c, e = 4500.0, (2e8, 3e8), (700.0, 900.0), (2e-6, 1e-6)
    J, radii, kt, ct = (1e-3, 2e-3, 5e-4, 3e-3), ((0.02, 0.04), (0.03, 0.03)), 2e4, 0.4
    support, mass, load, alpha = (4e8, 500.0), 3.0, 0.05, 0.4
    train = gc.Train(speed=speed, damping_law=law, bodies=[
        gc.Body(name="a", inertia=J[0], torque=30.0, torque_orders=[{"order": 3, "amplitude": 4.0, "phase": 0.7}]),
        gc.Body(name="b", inertia=J[1]), gc.Body(name="c", inertia=J[2]),
        gc.Body(name="d", inertia=J[3], torque=-60.0, damping=load, mass=mass,
                support={"stiffness": support[0], "damping": support[1], "direction": 0.1})],
        shafts=[gc.Shaft(between=("b", "c"), stiffness=kt, damping=ct)],
        meshes=[mesh("a", "b", 20, 40, stiffness=k[0], damping=c[0], error_amplitudes=[e[0]], phase=0.5),
                mesh("c", "d", 30, 30, stiffness=k[1], damping=c[1], error_amplitudes=[0.0, e[1]],
                     error_phases=[0.0, 1.2], line_of_action=0.1 + alpha)])
    # a, b, c, d in their own senses, and the centre of d
    rows = np.array([[radii[0][0], -radii[0][1], 0, 0, 0], [0, 0, radii[1][0], -radii[1][1], -math.cos(alpha)]])
    shaft, centre = np.array([0, 1.0, -1.0, 0, 0]), np.array([0, 0, 0, 0, 1.0])

    def matrix(mesh_values: tuple[float, float], twist: float, held: float) -> np.ndarray:
        return rows.T @ (np.array(mesh_values)[:, None] * rows) + twist * np.outer(shaft, shaft) + (
            held * np.outer(centre, centre))

    M, K, C = np.diag([*J, mass]), matrix(k, kt, support[0]), matrix(c, ct, support[1]) + np.diag([0, 0, 0, load, 0])
    omega = speed * 2 * math.pi / 60
    deflection = rows @ np.linalg.lstsq(K, np.array([30.0, 0, 0, -60.0, 0]), rcond=None)[0]
    rate = np.zeros(2)
    # at the end of whole common periods, of complex amplitudes: torque of order 3, errors of orders 20 and 2·15
    for order, error, torque in ((3, (0, 0), 4.0 * np.exp(0.7j)), (20, (e[0] * np.exp(0.5j), 0), 0),
                                 (30, (0, e[1] * np.exp(-1.2j)), 0)):
        w, error = order * omega, np.array(error)
        force = np.array([torque, 0, 0, 0, 0]) + rows.T @ ((np.array(k) + 1j * w * np.array(c)) * error)
        s = rows @ np.linalg.solve(K + 1j * w * C - w**2 * M, force) - error
        deflection, rate = deflection + s.real, rate + (1j * w * s).real
    units = as_model(train).units
    found = gc.simulate(train, periods=1, transient=3000)
    assert found.section_contact.values.tolist() == [[1, 1]]
    assert found.section_deflection.values[0] * units.length == pytest.approx(deflection, rel=1e-11)
    assert found.section_deflection_rate.values[0] * units.length * units.rate == pytest.approx(rate, rel=1e-10)


@pytest.mark.filterwarnings("ignore:The mode of .* is hardly damped")
def test_the_coordinate_of_a_support_is_named_by_its_axis():
    """The meshes of two driven wheels on opposite sides say how far the wheel between them turns, and moves along x."""
    bodies = [gc.Body(name="a", motion=[]), gc.Body(name="c", motion=[]),
              gc.Body(name="b", inertia=1e-3, mass=1.0, support={"stiffness": 1e8})]
    train = gc.Train(speed=1000.0, bodies=bodies, meshes=[
        mesh("a", "b", 20, 40, line_of_action=0.0), mesh("c", "b", 20, 40, line_of_action=math.pi)])
    assert as_model(train).state_names == ("z", "z_dot", "c_b.z", "c_b.z_dot", "b2.z", "b2.z_dot")
