"""The geometry of random gear pairs against the construction of `involute_oracle`, which shares no formula with it."""

import math

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from gearchaos.gears.geometry.dimensions import mating_geometry
from tests.oracles import involute_oracle as oracle

DEGREE = math.pi / 180
CLOSE = {"rel": 1e-12, "abs": 0.0}

racks = st.fixed_dictionaries({
    "teeth": st.tuples(st.integers(10, 150), st.integers(10, 150)),
    "normal_module": st.floats(2e-4, 2e-2),
    "pressure_angle": st.floats(14 * DEGREE, 26 * DEGREE),
    "helix_angle": st.one_of(st.just(0.0), st.floats(0.5 * DEGREE, 35 * DEGREE)),
    "face_width": st.tuples(st.floats(1e-3, 0.2), st.floats(1e-3, 0.2)),
    "addendum": st.floats(0.7, 1.2)})
shifts = st.tuples(st.floats(-0.3, 0.7), st.floats(-0.3, 0.7))
alterations = st.tuples(st.floats(-2e-4, 1e-4), st.floats(-2e-4, 1e-4))
slow_to_draw = settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def construct(geometry):
    """The same pair, constructed."""
    wheels = [
        oracle.Wheel(z, geometry.normal_module, geometry.pressure_angle, geometry.helix_angle, x,
                     (geometry.addendum + x) * geometry.normal_module + k)
        for z, x, k in zip(geometry.teeth, geometry.profile_shift, geometry.tip_alteration, strict=True)]
    return oracle.Pair(*wheels, geometry.centre_distance)


def assert_same(geometry):
    """Every angle, diameter and ratio of the pair agrees with the construction to 1e-12."""
    assume(all(tip > base for tip, base in zip(geometry.tip_diameter, geometry.base_diameter, strict=True)))
    pair = construct(geometry)
    wheels, pitch = (pair.wheel1, pair.wheel2), pair.base_pitch()
    assert geometry.working_pressure_angle == pytest.approx(pair.angle, **CLOSE)
    assert geometry.tangent_length == pytest.approx(pair.length, **CLOSE)
    assert geometry.base_pitch == pytest.approx(pitch, **CLOSE)
    assert geometry.contact_ratio == pytest.approx((pair.end - pair.start) / pitch, rel=1e-12, abs=1e-12)
    for i, wheel in enumerate(wheels):
        assert geometry.reference_diameter[i] == pytest.approx(2 * wheel.reference, **CLOSE)
        assert geometry.base_diameter[i] == pytest.approx(2 * wheel.base, **CLOSE)
        assert geometry.tip_diameter[i] == pytest.approx(2 * wheel.tip, **CLOSE)
        assert geometry.working_diameter[i] == pytest.approx(2 * wheel.base / math.cos(pair.angle), **CLOSE)
        assert geometry.tip_thickness[i] == pytest.approx(wheel.tip_thickness(), rel=1e-12, abs=1e-12 * wheel.tip)
        lead = 2 * math.pi * wheel.reference / math.tan(geometry.helix_angle) if geometry.helix_angle else math.inf
        assert geometry.base_helix_angle == pytest.approx(math.atan(2 * math.pi * wheel.base / lead), **CLOSE)
        # the teeth of the same wheel have one axial pitch, and each crosses the face along it
        axial = lead / geometry.teeth[i]
        assert geometry.overlap_ratio == pytest.approx(min(geometry.face_width) / axial, **CLOSE)
    starts = (pair.point(pair.start), pair.point(pair.end) - pair.centre2)
    lengths = (pair.start, pair.length - pair.end)
    for i, (start, length) in enumerate(zip(starts, lengths, strict=True)):
        if length > 0:
            assert geometry.start_of_active_profile[i] == pytest.approx(2 * oracle.norm(start), **CLOSE)
        elif length < 0:
            assert math.isnan(geometry.start_of_active_profile[i])
    assert geometry.theoretical_backlash == pytest.approx(pair.backlash(), abs=1e-12 * geometry.centre_distance)


@slow_to_draw
@given(racks, shifts, alterations)
def test_pairs_whose_centre_distance_follows_from_the_shifts(rack, profile_shift, alteration):
    geometry = mating_geometry(rack, None, profile_shift, alteration)
    assert_same(geometry)
    assert construct(geometry).backlash() == pytest.approx(0, abs=2e-12 * geometry.centre_distance)


@slow_to_draw
@given(racks, shifts, alterations, st.floats(-0.01, 0.04))
def test_pairs_with_a_centre_distance(rack, profile_shift, alteration, relative):
    transverse = rack["normal_module"] / math.cos(rack["helix_angle"])
    assert_same(mating_geometry(rack, (1 + relative) * transverse * sum(rack["teeth"]) / 2, profile_shift, alteration))


@slow_to_draw
@given(racks, shifts, alterations)
def test_exchanging_the_wheels_exchanges_their_values(rack, profile_shift, alteration):
    one = mating_geometry(rack, None, profile_shift, alteration)
    swapped = {**rack, "teeth": rack["teeth"][::-1], "face_width": rack["face_width"][::-1]}
    other = mating_geometry(swapped, None, profile_shift[::-1], alteration[::-1])
    for name in ("reference_diameter", "base_diameter", "tip_diameter", "root_diameter", "working_diameter",
                 "root_form_diameter", "tip_clearance", "tip_thickness", "virtual_teeth", "undercut_shift"):
        assert getattr(other, name) == getattr(one, name)[::-1], name
    starts = other.start_of_active_profile[::-1]
    assert [repr(start) for start in starts] == [repr(start) for start in one.start_of_active_profile]
    for name in ("contact_ratio", "overlap_ratio", "working_pressure_angle", "theoretical_backlash", "centre_distance"):
        assert getattr(other, name) == getattr(one, name), name
