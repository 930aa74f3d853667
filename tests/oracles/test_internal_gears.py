"""Internal gear pairs against the construction of `involute_oracle`, outlines in positions, and published values."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from matplotlib.path import Path
from scipy.linalg import eigh

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears.design.transverse_section import TransverseSection, transverse_section
from gearchaos.gears.geometry.backlash import ThicknessAllowances
from gearchaos.gears.geometry.checks import check_geometry, interference_depth, largest_tip_diameter
from gearchaos.gears.geometry.corner_contact import corner_gap
from gearchaos.gears.geometry.dimensions import KEEP_CLEARANCE, mating_geometry, shift_sum
from gearchaos.gears.geometry.internal import InternalGeometry
from gearchaos.gears.mesh.tooth_pairs import back_phase
from tests.closed_forms.test_planetary_sets import NREL
from tests.oracles import involute_oracle as oracle
from tests.oracles.test_tip_interference import circumferential_depth

DEGREE = math.pi / 180
CLOSE = {"rel": 1e-11, "abs": 0.0}


def internal(teeth, shifts=(0.0, 0.0), alterations=(0.0, 0.0), distance=None, **changes):
    values = {"teeth": teeth, "normal_module": 3e-3, "pressure_angle": 20 * DEGREE, "helix_angle": 0.0,
              "face_width": (0.02, 0.02), **changes}
    return mating_geometry(values, distance, shifts, alterations, None, InternalGeometry)


def construct(geometry):
    """The same pair: the spaces of a ring are the teeth of an external wheel with the opposite shift."""
    (z, ring), (x, inwards), m = geometry.teeth, geometry.profile_shift, geometry.normal_module
    k, lowered = geometry.tip_alteration
    given = m, geometry.pressure_angle, geometry.helix_angle
    pinion = oracle.Wheel(z, *given, x, (geometry.addendum + x) * m + k)
    space = oracle.Wheel(ring, *given, -inwards, (geometry.dedendum - inwards) * m)
    return oracle.InternalPair(
        pinion, space, space.reference - (geometry.addendum + inwards) * m - lowered, geometry.centre_distance)


PAIR = internal((20, 61), (0.2, -0.2), (0.0, -0.4e-3))
WIDE = internal((24, 70), (0.5, 0.1), (0.0, -0.6e-3), helix_angle=12 * DEGREE)

pairs = st.fixed_dictionaries({
    "teeth": st.tuples(st.integers(14, 60), st.integers(10, 90)).map(lambda z: (z[0], sum(z))),
    "normal_module": st.floats(2e-4, 2e-2), "pressure_angle": st.floats(15 * DEGREE, 28 * DEGREE),
    "helix_angle": st.one_of(st.just(0.0), st.floats(0.5 * DEGREE, 35 * DEGREE)), "addendum": st.floats(0.5, 1.0)})


@settings(max_examples=120, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(pairs, st.tuples(st.floats(-0.3, 0.6), st.floats(-0.5, 0.4)), st.one_of(st.none(), st.floats(-0.01, 0.06)))
def test_dimensions_are_those_of_the_construction(values, shifts, relative):
    pinion, ring = values["teeth"]
    reference = values["normal_module"] / math.cos(values["helix_angle"]) * (ring - pinion) / 2
    try:
        geometry = internal(shifts=shifts, distance=None if relative is None else (1 + relative) * reference, **values)
        check_geometry(replace(geometry, root_radius=0.0))
    except InputError:
        assume(False)
    pair = construct(geometry)
    assert geometry.working_pressure_angle == pytest.approx(pair.angle, **CLOSE)
    assert geometry.tangent_length == pytest.approx(-pair.ring_start, **CLOSE)
    assert geometry.path_of_contact == pytest.approx(pair.end - pair.start, rel=1e-10)
    for i, radius in enumerate((pair.pinion.base, pair.space.base)):
        assert geometry.base_diameter[i] == pytest.approx(2 * radius, **CLOSE)
        assert geometry.working_diameter[i] == pytest.approx(2 * radius / math.cos(pair.angle), **CLOSE)
    assert geometry.tip_diameter[1] == pytest.approx(2 * pair.ring_tip, **CLOSE)
    assert geometry.root_diameter[1] == pytest.approx(2 * pair.space.tip, **CLOSE)
    ends = pair.point(pair.start), pair.point(pair.end) - pair.ring_centre
    assert geometry.start_of_active_profile == pytest.approx([2 * oracle.norm(end) for end in ends], **CLOSE)
    assert geometry.theoretical_backlash == pytest.approx(pair.backlash(), abs=1e-11 * geometry.reference_diameter[1])
    if relative is None:
        assert pair.backlash() == pytest.approx(0, abs=1e-11 * geometry.reference_diameter[1])
    assert sum(replace(geometry, profile_shift=(shift_sum(geometry), 0.0)).profile_shift) == pytest.approx(
        sum(shifts) + geometry.theoretical_backlash * math.pi / geometry.base_pitch / (
            2 * math.tan(geometry.pressure_angle)), abs=1e-9)
    assert geometry.tip_gap == pytest.approx(pair.tip_gap(), abs=1e-9 * pair.ring_tip)
    pair.space.tip = pair.ring_tip  # what the spaces leave of the pitch there is the tooth
    helix = math.cos(math.atan(pair.ring_tip / pair.space.reference * math.tan(geometry.helix_angle)))
    pitch = 2 * math.pi * pair.ring_tip / geometry.teeth[1] * helix
    assert geometry.tip_thickness[1] == pytest.approx(pitch - pair.space.tip_thickness(), rel=1e-9)


@pytest.mark.parametrize("geometry", [PAIR, WIDE, internal((60, 100), (0.3, -0.1), (0.0, -0.5e-3))])
@pytest.mark.parametrize("leaving", [True, False])
def test_the_gap_of_tip_corners_is_that_of_the_construction(geometry, leaving):
    x = np.linspace(0.01, 0.5, 7) * geometry.normal_module
    found = corner_gap(geometry, x, leaving=leaving)
    np.testing.assert_allclose(found, [construct(geometry).gap(each, leaving) for each in x], rtol=0, atol=1e-12)
    assert 0 < found[0] < 1e-7 and np.all(np.diff(found) > 0)


def free_of_the_ring(section, ahead, teeth=4):
    """Whether no corner of the pinion's teeth in mesh lies in the ring, which is turned on clockwise by a length along
    the line of action."""
    near, angle = range(-teeth, teeth + 1), 2 * ahead / section.geometry.base_diameter[1]
    c, s = math.cos(angle), math.sin(angle)
    ring = (section.body(1, near, 4.0) - section.centres[1]) @ np.array([[c, -s], [s, c]]) + section.centres[1]
    return not Path(ring).contains_points(section.outline(0, near[1:-1], 4.0)).any()


@pytest.mark.parametrize("geometry", [
    PAIR, WIDE, internal((30, 90), (0.3, -0.1), (0.0, -0.5e-3)), internal((40, 60), (0.0, -0.6), (0.0, -0.3e-3))])
def test_drawn_teeth_touch_in_the_path_of_contact_and_overlap_nowhere(geometry):
    """The flanks are conjugate: in every position the ring is free to turn by the backlash, forwards and no further."""
    backlash, rounding = 0.04 * geometry.normal_module, 1e-7  # m; chords of the ring's flanks lie in the space
    for phase in np.arange(0, 1, 1 / 8):
        section = TransverseSection(geometry, max(geometry.theoretical_backlash, 0.0) + backlash, float(phase))
        for contact in map(section.on_line, section.contacts):
            for outline in (section.outline(wheel) for wheel in (0, 1)):
                assert np.hypot(*(outline - contact).T).min() < 1e-9
        for ahead, free in ((rounding, True), (0.5 * backlash, True), (backlash - rounding, True), (-rounding, False),
                            (backlash + rounding, False)):
            assert free_of_the_ring(section, ahead) == free, (phase, ahead)


def test_with_too_few_teeth_of_difference_the_tips_collide():
    for ring in (50, 46, 44, 43):
        geometry, half = internal((40, ring), addendum=0.6), 5e-5
        assert (geometry.tip_gap > 0) == (ring > 44)
        sections = [TransverseSection(geometry, 2 * half, phase) for phase in np.arange(0, 1, 1 / 8).tolist()]
        assert (geometry.tip_gap > 0) == all(free_of_the_ring(each, half, 8) for each in sections)
        if ring > 44:
            check_geometry(geometry)
            continue
        with pytest.raises(InputError, match="room to pass each other"):
            check_geometry(geometry)


def test_the_smallest_ring_only_just_passes_the_fillet_of_the_pinion():
    geometry = internal((40, 90), (0.0, 0.0), root_radius=0.45, dedendum=1.1)
    assert interference_depth(geometry, 0) > 0
    smallest = largest_tip_diameter(geometry, 0)
    for change, enters in ((1e-6, False), (-1e-6, True)):
        other = replace(geometry, tip_alteration=(0.0, (geometry.tip_diameter[1] - smallest - change) / 2))
        assert other.tip_diameter[1] == pytest.approx(smallest + change, rel=1e-12)
        assert (interference_depth(other, 0) > 1e-9 * geometry.normal_module) is enters


def test_the_depth_in_the_fillet_of_the_pinion_is_that_of_the_outlines():
    geometry = internal((40, 90), (0.0, 0.0), (0.0, -0.05e-3), root_radius=0.45, dedendum=1.1)
    depths = [-math.inf]
    for phase in np.arange(0, 1, 1 / 64):
        section = TransverseSection(geometry, 0.0, float(phase))
        ring, near = section.outline(1, range(-3, 4), 0.0), section.outline(0, range(-3, 4), 40.0)
        corners = ring[np.hypot(*(ring - section.centres[1]).T) < geometry.tip_diameter[1] / 2 * (1 + 1e-9)]
        depths += [circumferential_depth(near, math.hypot(x, y), math.atan2(y, x)) for x, y in corners
                   if math.hypot(x, y) < geometry.root_form_diameter[0] / 2]
    assert max(depths) == pytest.approx(interference_depth(geometry, 0), rel=0.02)
    assert max(depths) > 5e-6


def test_a_published_pair_of_khk():
    """Their x2 is positive outwards: 16/24, m 3, x2 = +0.5; Gear Technical Reference, table of profile shifted internal
    gears."""
    found = internal((16, 24), (0.0, -0.5))
    assert 1e3 * found.centre_distance == pytest.approx(13.1683, abs=5e-5)
    # from the involute function to six digits
    assert found.working_pressure_angle / DEGREE == pytest.approx(31.0937, abs=1.3e-4)
    expected = {"working_diameter": (52.673, 79.010), "base_diameter": (45.105, 67.658), "tip_diameter": (54, 69),
                "root_diameter": (40.5, 82.5)}
    for name, values in expected.items():
        assert 1e3 * np.array(getattr(found, name)) == pytest.approx(values, abs=5.1e-4), name


def test_the_least_backlash_is_at_the_greatest_distance():
    given = {"tooth_thickness_allowances": [["-30 um", "-50 um"]] * 2, "centre_distance_allowance": "20 um"}
    least, mean, most = (ThicknessAllowances(**given, at=at).along_line_of_action(PAIR) for at in (
        "minimum", "mean", "maximum"))
    moved = 2 * math.sin(PAIR.working_pressure_angle) * 20e-6
    assert least == pytest.approx(60e-6 * math.cos(20 * DEGREE) - moved, abs=2e-8)
    assert most == pytest.approx(100e-6 * math.cos(20 * DEGREE) + moved, abs=2e-8)
    assert least < mean < most


def test_teeth_kept_at_the_clearance_of_the_rack():
    found = internal((24, 70), (0.5, 0.2), KEEP_CLEARANCE)
    assert found.tip_alteration[0] == found.tip_alteration[1] <= 0
    shorter = internal((24, 70), (0.5, 0.2), KEEP_CLEARANCE, distance=1.02 * found.centre_distance)
    assert shorter.tip_alteration[0] < 0 and shorter.tip_clearance == pytest.approx((0.75e-3, 0.75e-3), rel=1e-9)


@pytest.mark.parametrize("geometry", [PAIR, WIDE])
def test_back_flanks_enter_where_the_outlines_have_them(geometry):
    """They go the mirrored path the other way: from E, where a tooth has its axis mirrored."""
    section = TransverseSection(geometry, max(geometry.theoretical_backlash, 0.0), 0.0)
    turned = section.tooth_axis(0, section.start) - (math.pi - section.tooth_axis(0, section.end))  # clockwise
    later = turned / (2 * math.pi / geometry.teeth[0]) - back_phase(geometry)
    assert later - round(later) == pytest.approx(0, abs=1e-9)


SET = {"sun": {"inertia": 1e-3}, "carrier": {"inertia": 0.05}, "ring": {"fixed": True},
       "planet": {"inertia": 1e-3, "mass": 0.5}}
DESIGN = {"teeth": (20, 61), "internal": True, "module": "3 mm", "face_width": "20 mm", "profile_shift": (0.2, -0.2),
          "tip_alteration": (0, "-0.4 mm"), "inertia": ("2e-4 kg*m^2", "2e-2 kg*m^2"), "damping_ratio": 0.05,
          "backlash": {"value": "0.12 mm", "of": "line of action"}, "torque": 60, "speed": 3000}


def test_a_train_of_both_wheels_moves_as_the_pair():
    design = gc.GearDesign(**DESIGN, load_sharing="prescribed")
    pair = design.to_pair()
    mesh = gc.Mesh(between=("pinion", "ring"), design=design)
    assert mesh.internal and mesh.teeth == (20, 61)
    train = gc.Train(speed=3000, meshes=[mesh], bodies=[
        gc.Body(name="pinion", inertia=pair.I1, torque=60), gc.Body(name="ring", inertia=pair.I2, torque=-183)])
    assert train.speeds["ring"] == pytest.approx(3000 * 20 / 61)  # both turn the same way
    one, other = (gc.natural_frequencies(each).natural_frequency.values[-1] for each in (design, train))
    assert other == pytest.approx(one, rel=1e-12)
    with pytest.raises(InputError, match="internal must be left out or as in the design"):
        gc.Mesh(between=("pinion", "ring"), design=gc.GearDesign(
            teeth=(20, 61), module="3 mm", face_width="20 mm"), internal=True)
    with pytest.raises(InputError, match="two external wheels"):
        gc.PlanetarySet(count=1, teeth=(20, 61, 142), design=design, **SET)


def test_on_supports_the_wheels_move_by_the_moments_of_the_tooth_force():
    """Natural frequencies where each wheel moves along the line of action too, signs from the drawn pair."""
    design = gc.GearDesign(**DESIGN, load_sharing="prescribed", mass=("0.5 kg", "4 kg"),
                           supports={"stiffness": ["2e8 N/m", "3e8 N/m"], "damping_ratio": 0.05})
    pair, section = design.to_pair(), transverse_section(design)
    force = section.direction  # on the ring; clockwise moments of it
    (x, y), reach = force, section.pitch_point - section.centres
    moments = reach[:, 1] * x - reach[:, 0] * y
    deflection = np.array([moments[0], -moments[1], 1.0, -1.0])
    stiffness = pair.c0 * np.outer(deflection, deflection) + np.diag([0, 0, pair.c1, pair.c2])
    expected = eigh(stiffness, np.diag([pair.I1, pair.I2, pair.m1, pair.m2]), eigvals_only=True)[1:]
    found = gc.natural_frequencies(design).natural_frequency.values[-3:]
    np.testing.assert_allclose(found, np.sqrt(expected) / (2 * math.pi), rtol=1e-9)


@pytest.mark.parametrize("stage", NREL)
def test_the_rings_of_the_nrel_gearbox_are_those_of_kisssoft(stage):
    (_, *teeth), module, width, distance, (_, *shifts), expected = NREL[stage]
    planet_tip = {"stage 1": "905.470 mm", "stage 2": "815.663 mm"}[stage]
    design = gc.GearDesign(
        teeth=teeth, internal=True, module=f"{module} mm", face_width=f"{width} mm", centre_distance=f"{distance} mm",
        profile_shift=shifts, tip_diameter=[planet_tip, f"{expected[2]} mm"], torque=1e5,
        blank=[{"rim": f"{3.5 * module} mm", "web": f"{0.25 * width} mm"}, "solid"])
    found, stiffness = design.geometry, design.tooth_stiffness
    assert found.working_pressure_angle / DEGREE == pytest.approx(expected[0], abs=6e-4)
    assert found.contact_ratio == pytest.approx(expected[1], abs=5e-4)
    assert 1e3 * found.root_diameter[1] == pytest.approx(expected[3], abs=1.1e-3)
    assert abs(found.theoretical_backlash) < 1e-6 and design.warnings == ()
    assert (stiffness.single_stiffness / 1e9, stiffness.mesh_stiffness / 1e9) == pytest.approx(expected[4:], abs=6e-4)


def test_the_stiffness_is_that_of_the_ring_of_a_planetary_set():
    rack = {"addendum": 0.8}
    design = gc.GearDesign(teeth=(27, 36), module="2.8 mm", face_width="20 mm", bore="20 mm", damping_ratio=0.05,
                           rack=rack, backlash={"value": "0.1 mm", "of": "line of action"}, speed=1000, torque=200)
    planets = gc.PlanetarySet(count=3, teeth=(27, 36, 99), design=design, **SET)
    own = gc.GearDesign(teeth=(36, 99), internal=True, module="2.8 mm", face_width="20 mm", inertia=1e-3, torque=200,
                        rack=rack, load_sharing="prescribed", damping_ratio=0.05, speed=1000, backlash=design.backlash)
    ring, mesh = planets.ring_geometry, planets.meshes[1]
    assert own.geometry.contact_ratio == pytest.approx(ring.contact_ratio, rel=1e-12)
    found = gc.Mesh(between=("a", "b"), design=own).stiffness
    assert found.levels == pytest.approx(mesh.stiffness.levels, rel=1e-12)
    assert found.starts == pytest.approx(mesh.stiffness.starts, abs=1e-12)
