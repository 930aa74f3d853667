"""Planetary sets: the dimensions of helical gears with profile shift, and the phases of their meshes."""

import math
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears.design.transverse_section import transverse_section
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.train.train_file import read_train
from tests import EXAMPLES

STIFF = {"stiffness": {"levels": [6e8, 4e8], "starts": [0, 0.5]}, "backlash": 1e-4}
BODIES = {"sun": {"inertia": 1e-3}, "carrier": {"inertia": 0.05}, "ring": {"fixed": True},
          "planet": {"inertia": 1e-3, "mass": 0.5}}
SHIFTED = {"teeth": (27, 36, 100), "module": 2.8e-3, "helix_angle": "15 deg", "profile_shift": (0.3, 0.2)}
DESIGN = gc.GearDesign(teeth=(27, 36), module="2.8 mm", helix_angle="15 deg", face_width="20 mm",
                       profile_shift=(0.3, 0.2), bore="20 mm", damping_ratio=0.05, load_sharing="prescribed",
                       backlash={"value": "0.1 mm", "of": "line of action"})


def planets(**given):
    return gc.PlanetarySet(**{"count": 1, **BODIES, "sun_mesh": STIFF, "ring_mesh": STIFF, **given})


def inv(angle):
    return math.tan(angle) - angle


def test_helical_sets_have_the_dimensions_of_the_transverse_section():
    """ISO 21771: m_t = m_n/cos β, tan α_t = tan α_n/cos β, r_b = z m_t cos α_t/2."""
    found = planets(count=3, teeth=(27, 36, 99), module="2.8 mm", helix_angle="-15 deg")
    beta = math.radians(15)
    angle = math.atan(math.tan(math.radians(20)) / math.cos(beta))
    sun, ring = found.meshes[:2]
    assert found.orbit == pytest.approx(63 * 2.8e-3 / math.cos(beta) / 2, rel=1e-14)
    for mesh, teeth in ((sun, (27, 36)), (ring, (36, 99))):
        radii = [z * 2.8e-3 / math.cos(beta) * math.cos(angle) / 2 for z in teeth]
        assert mesh.base_radii == pytest.approx(radii, rel=1e-14)
        assert mesh.pressure_angle == pytest.approx(angle, rel=1e-12)


def test_with_profile_shift_both_meshes_work_at_the_centre_distance_of_the_sun():
    """inv α_wt = inv α_t + 2 (x_s + x_p) tan α_n/(z_s + z_p), a cos α_wt = a_d cos α_t, of the ring with z_r − z_p."""
    found = planets(**SHIFTED)
    beta, normal = math.radians(15), math.radians(20)
    angle = math.atan(math.tan(normal) / math.cos(beta))
    sun, ring = (mesh.pressure_angle for mesh in found.meshes)
    assert inv(sun) == pytest.approx(inv(angle) + 2 * 0.5 * math.tan(normal) / 63, rel=1e-12)
    base = 2.8e-3 / math.cos(beta) * math.cos(angle) / 2
    assert found.orbit * math.cos(sun) == pytest.approx(63 * base, rel=1e-12)
    assert found.orbit * math.cos(ring) == pytest.approx(64 * base, rel=1e-12)
    given = planets(**SHIFTED, centre_distance=found.orbit)
    assert [mesh.base_radii for mesh in given.meshes] == [mesh.base_radii for mesh in found.meshes]
    wider = planets(**SHIFTED, centre_distance=1.002 * found.orbit)
    assert math.cos(wider.meshes[0].pressure_angle) == pytest.approx(math.cos(sun) / 1.002, rel=1e-12)


NREL = {  # teeth, module, face width, centre distance, profile shifts; α_wt, ε_α, d_a, d_f, c′ and c_γα of the ring
    "stage 1": ((19, 17, 56), 45, 491, 863, (0.617, 0.8021, -0.5013),
                (17.161, 1.278, 2475.118, 2677.618, 13.289, 16.063)),
    "stage 2": ((18, 36, 93), 21, 550, 584, (0.389, 0.5039, 0.1171),
                (15.630, 1.618, 1906.081, 2000.581, 14.053, 20.563))}
"""Those of the NREL 5 MW gearbox (A. R. Nejad and others, Wind Energy 19, 2016), by the reports of KISSsoft
@NREL_5MW/stage_0N.rtf in github.com/gfsReboucas/Drivetrain."""


@pytest.mark.parametrize("stage", NREL)
def test_the_rings_of_the_nrel_gearbox_as_kisssoft_computes_them(stage):
    teeth, module, width, distance, (*shifts, shift), expected = NREL[stage]
    tips = {"stage 1": ["978.808 mm", "905.470 mm"], "stage 2": ["432.838 mm", "815.663 mm"]}[stage]
    design = gc.GearDesign(
        teeth=teeth[:2], module=f"{module} mm", face_width=f"{width} mm", centre_distance=f"{distance} mm",
        profile_shift=shifts, tip_diameter=tips, bore="100 mm", damping_ratio=0.05, load_sharing="prescribed",
        backlash={"value": "0.4 mm", "of": "line of action"},
        blank={"rim": f"{3.5 * module} mm", "web": f"{0.25 * width} mm"})
    found = planets(count=3, teeth=teeth, design=design.at(speed=50, torque=1e5), sun_mesh=None, ring_mesh=None)
    ring, mesh = found.ring_geometry, found.meshes[1]
    angle = math.degrees(ring.working_pressure_angle)
    assert (angle, ring.contact_ratio) == pytest.approx(expected[:2], rel=0, abs=6e-4)
    diameters = 1e3 * ring.tip_diameter[1], 1e3 * ring.root_diameter[1]
    assert diameters == pytest.approx(expected[2:4], rel=0, abs=2 * module * 5e-5 + 1e-3)  # of a rounded shift
    assert ring.profile_shift[1] == pytest.approx(shift, abs=3e-4)
    single, double = sorted(mesh.stiffness.levels)
    assert single / width / 1e6 == pytest.approx(expected[4], abs=2e-3)
    assert double / single == pytest.approx(1.75, rel=1e-12)  # 0.75 n + 0.25 of n pairs
    assert mesh.backlash == pytest.approx(0.4e-3)
    mean = single * (0.75 * ring.contact_ratio + 0.25)
    assert mean / width / 1e6 == pytest.approx(expected[5], abs=6e-3)
    assert mesh.damping == found.meshes[0].damping > 0
    assert ring.theoretical_backlash == pytest.approx(0, abs=1e-9 * module)


def test_what_is_given_of_a_ring_mesh_stands_before_what_follows_from_a_design():
    given = {"stiffness": 3e8, "damping": 1.0, "backlash": 2e-4}
    design = DESIGN.at(speed=1000, torque=50)
    mesh = planets(teeth=(27, 36, 100), design=design, ring_mesh=given).meshes[1]
    assert {name: getattr(mesh, name) for name in given} == given


@pytest.mark.slow
def test_forces_of_a_wind_turbine_s_gearbox_are_those_of_statics():
    """A torque T at a carrier is T z_s/(z_s + z_r) at the sun, and 1/r_b of a third of this at each planet."""
    train = gc.open(EXAMPLES / "train_wind_turbine.toml")
    assert train.speeds["rotor"] == pytest.approx(-12.1, rel=1e-12)
    still = replace(train, meshes=[replace(mesh, stiffness=7e9, error_amplitudes=()) for mesh in train.meshes])
    found, torque = gc.regime(still).meshes, train.body("rotor").torque
    for name, (sun, ring) in {"low": (19, 56), "mid": (18, 93)}.items():
        torque *= sun / (sun + ring)
        radius = next(mesh for mesh in train.meshes if mesh.name == f"{name}_sun/planet1").base_radii[0]
        for mesh in (f"{name}_{pair}" for n in (1, 2, 3) for pair in (f"sun/planet{n}", f"planet{n}/ring")):
            assert found[mesh]["force_peak"] == pytest.approx(torque / 3 / radius, rel=1e-9), mesh
    assert found["high"]["force_peak"] == pytest.approx(torque / 0.6329, rel=1e-9)


PIN = {"stiffness": 1e8, "damping": 1e3}
SHARING = {"count": 3, "teeth": (27, 36, 99), "module": "2.8 mm",
           "sun_mesh": {"stiffness": 5e8, "damping": 800, "backlash": 1e-3},
           "ring_mesh": {"stiffness": 4e8, "damping": 800, "backlash": 1e-3}}


def train_of_planets(errors, pin=None, sun=None):
    """Three planets at 200 N m."""
    held = planets(**{**SHARING, **BODIES, "sun": {"inertia": 1e-3, "torque": 200, **(sun or {})},
                      "carrier": {"inertia": 0.05, "torque": -200 * (1 + 99 / 27)}, "position_errors": errors,
                      "planet": {**BODIES["planet"], **({"pin": pin} if pin else {})}})
    return gc.Train(speed=1000, bodies=held.bodies, meshes=held.meshes)


def forces_of_planets(*given, wanted="force_peak"):
    """Peak forces of the sun and ring meshes of three planets, N."""
    found = gc.regime(train_of_planets(*given)).meshes
    return np.array([[found[mesh][wanted] for mesh in (f"sun/planet{n}", f"planet{n}/ring")] for n in (1, 2, 3)])


@pytest.mark.parametrize("pin", [None, PIN])
def test_a_pin_that_stands_ahead_changes_the_share_of_its_planet(pin):
    """The centre of a planet that leads by e presses sun and ring meshes in series: ΔF = 2 cos α (e − ē)/(1/k_s + 1/k_r
    + 4 cos² α/k_pin), where the sun's centre rests and its angle lets the forces sum up to the torque; the sign is that
    of a planet that is driven by the sun and drives the carrier, which leads it against the load."""
    errors, cosine = np.array([4e-6, -1e-6, 0]), math.cos(math.radians(20))
    series = 1 / 5e8 + 1 / 4e8 + (4 * cosine**2 / PIN["stiffness"] if pin else 0)
    mean = 200 / 3 / (27 * 2.8e-3 * cosine / 2)
    expected = mean - 2 * cosine * (errors - errors.mean()) / series
    assert forces_of_planets(errors.tolist(), pin) == pytest.approx(np.stack([expected, expected], axis=1), rel=1e-9)
    shares = gc.regime(train_of_planets(errors.tolist(), pin)).load_shares
    assert list(shares) == ["sun", "ring"]
    for load in shares.values():
        assert list(load.values()) == pytest.approx(expected / expected.sum(), rel=1e-9)
    model = as_model(train_of_planets(errors.tolist(), pin))
    deflection = gc.simulate(model, 1).section_deflection.values[0] * model.units.length
    assert deflection == pytest.approx(np.outer(expected, [1 / 5e8, 1 / 4e8]).ravel(), rel=1e-9)


def test_a_planet_that_stands_too_far_ahead_carries_nothing():
    """The others share by what they lead each other; the dynamic factor refers to that."""
    (first, *others), cosine = forces_of_planets([20e-6, -5e-6, 0]), math.cos(math.radians(20))
    mean, apart = 200 / 2 / (27 * 2.8e-3 * cosine / 2), 2 * cosine * 2.5e-6 / (1 / 5e8 + 1 / 4e8)
    assert first.tolist() == [0, 0]
    assert np.array(others) == pytest.approx(np.array([2 * [mean + apart], 2 * [mean - apart]]), rel=1e-9)
    factors = forces_of_planets([20e-6, -5e-6, 0], wanted="dynamic_factor")[1:]
    assert factors == pytest.approx(np.ones((2, 2)), rel=1e-9)


@pytest.mark.slow
def test_a_floating_sun_shares_the_load_of_three_planets_alike():
    """Three forces on a sun whose centre is free are in balance only if they are alike."""
    soft = {"mass": 0.4, "support": {"stiffness": 1e3, "damping": 10}}
    apart = forces_of_planets([20e-6, -5e-6, 0], PIN, soft)
    assert apart == pytest.approx(np.full((3, 2), apart.mean()), rel=1e-3)


def flank(radius):
    """The angle between the axis and the flank of a planet's tooth, by the outline of its generated teeth."""
    section = transverse_section(DESIGN)
    section = replace(section, backlash=DESIGN.geometry.theoretical_backlash)
    points = section.outline(1, [0], detail=40) - section.centres[1]
    radii, angles = np.hypot(*points.T), np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    first = slice(0, int(np.argmax(radii)) + 1)
    return abs(np.mean(angles) - np.interp(radius, radii[first], angles[first]))


def test_the_ring_mesh_is_ahead_by_the_angle_between_the_flanks_that_touch_sun_and_ring():
    found = planets(**SHIFTED)
    sun, ring = found.meshes
    pitch = [found.orbit * 36 / 63, found.orbit * 36 / 64]  # radii of the planet's pitch circles
    ahead = 36 * (math.pi + sum(map(flank, pitch)))
    assert (ring.phase - sun.phase - ahead + math.pi) % (2 * math.pi) - math.pi == pytest.approx(0, abs=1e-3)
    plain = planets(teeth=(27, 36, 99), module=2.8e-3).meshes
    assert (plain[1].phase - plain[0].phase) % (2 * math.pi) == pytest.approx(math.pi, rel=1e-12)


def test_a_design_has_the_dimensions_and_the_mesh_of_sun_and_planet():
    table = {"speed": 1000, "planets": {"count": 1, "teeth": [27, 36, 100], "design": "pair.toml", **BODIES,
                                        "ring_mesh": STIFF}}
    found = read_train(table, lambda path: DESIGN.at(speed=1000, torque=50) if path == "pair.toml" else None)
    sun, ring = found.meshes
    expected = planets(**SHIFTED).meshes
    assert sun.base_radii == expected[0].base_radii and ring == replace(
        expected[1], damping=sun.damping)
    assert sun.backlash == pytest.approx(1e-4) and sun.stiffness is not None and sun.damping > 0


def test_several_sets_have_names():
    one = {"count": 1, "teeth": [27, 36, 99], "module": "2.8 mm", **BODIES, "sun_mesh": STIFF, "ring_mesh": STIFF}
    shafts = [{"between": ["low_sun", "high_carrier"], "stiffness": 1e6}]
    found = read_train({"speed": {"high_sun": 7000}, "planets": [{"name": "low", **one}, {"name": "high", **one}],
                        "shafts": shafts}, None)
    assert [mesh.name for mesh in found.meshes] == [
        "low_sun/planet1", "low_planet1/ring", "high_sun/planet1", "high_planet1/ring"]
    assert found.body("high_planet1").carrier == "high_carrier"
    assert found.speeds["low_carrier"] == pytest.approx(7000 / (1 + 99 / 27) ** 2, rel=1e-14)
    with pytest.raises(InputError, match="planets high: count must divide"):
        read_train({"speed": 100, "planets": [{"name": "low", **one}, {"name": "high", **one, "count": 5}]}, None)
    with pytest.raises(InputError, match="must be that of no other part"):
        read_train({"speed": 100, "planets": [one, one]}, None)


@pytest.mark.parametrize(("speed", "words"), [
    ({"ring": 100}, "speed: body that turns must be one of"), ({"sum": 100}, "Did you mean 'sun'"),
    ({"sun": 100, "carrier": 20}, "speed must be that of one body"), ({"sun": -5}, "speed.sun must be greater than 0")])
def test_a_speed_is_that_of_one_body_that_turns(speed, words):
    table = {"speed": speed, "planets": {"count": 1, "teeth": [27, 36, 99], "module": "2.8 mm", **BODIES,
                                         "sun_mesh": STIFF, "ring_mesh": STIFF}}
    with pytest.raises(InputError) as error:
        read_train(table, None)
    assert words in str(error.value)


@pytest.mark.parametrize(("given", "field", "words"), [
    ({"teeth": (27, 36, 112)}, "teeth", "its base circle is too large for the planets"),
    ({"teeth": (27, 36, 90)}, "teeth", "it would need a profile shift of"),
    ({"module": None}, "module", "Or give a design"),
    ({"profile_shift": 0.3}, "profile_shift", "must be a list of two: sun and planets"),
    ({"profile_shift": None, "centre_distance": "93 mm"}, "profile_shift", "must be given with this centre distance"),
    ({"centre_distance": "80 mm"}, "centre_distance", "the sum of the base radii"),
    ({"position_errors": ["5 um", 0]}, "position_errors", "must be 1, one for each planet"),
    ({"position_errors": ["1 m"]}, "position_errors", "must be at most a tenth of the module"),
    ({"design": DESIGN}, "module", "must be left out beside design"),
    ({"design": DESIGN, "teeth": (20, 36, 92), "module": None, "helix_angle": None, "profile_shift": None}, "teeth",
     "must begin with [27, 36], those of the design"),
    ({"design": "pair.toml"}, "design", "must be a GearDesign"),
    ({"design": replace(DESIGN, faults=[{"wheel": 2, "tooth": 1, "stiffness_loss": 0.1}]), "module": None},
     "design.faults", "must leave out wheel 2")])
def test_dimensions_that_do_not_do_are_refused(given, field, words):
    with pytest.raises(InputError) as error:
        planets(**{**SHIFTED, **given})
    assert error.value.field == field and words in str(error.value), str(error.value)
