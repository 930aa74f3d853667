"""Corner contact against a search on constructed flanks, curvatures by Euler and Savary, racks, and springs at rest."""

import math
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.explorer.core.text import pair_at
from gearchaos.gears.geometry.corner_contact import DEEPEST, corner_contact, corner_gap
from gearchaos.gears.geometry.dimensions import mating_geometry
from gearchaos.gears.operation.loaded_error import loaded_error
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import ToothPairStiffness, vary
from gearchaos.model.static import static_deflection
from gearchaos.model.switched import switched_system
from gearchaos.studyfile import load_design
from tests import EXAMPLES
from tests.oracles import involute_oracle as oracle
from tests.oracles.test_gear_geometry_oracle import construct

SPUR = replace(load_design(EXAMPLES / "spur_50_50.toml"), load_sharing="tooth pairs", corner_contact=True)


def spur(teeth, shifts=(0.0, 0.0), module=3e-3, degrees=20.0):
    return mating_geometry({"teeth": teeth, "normal_module": module, "pressure_angle": math.radians(degrees),
                            "helix_angle": 0.0, "face_width": (0.02, 0.02)}, None, shifts, (0.0, 0.0))


def random_spur(rng):
    return spur(tuple(rng.integers(22, 120, 2).tolist()), tuple(rng.uniform(-0.1, 0.4, 2).tolist()),
                rng.uniform(1e-3, 8e-3), rng.choice([20, 22.5, 25]))


def turned(point, centre, angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s], [-s, c]]) @ (point - centre) + centre  # clockwise


def searched(pair, x, leaving):
    """The gap by turning wheels until the mate's involute passes through the tip corner."""
    own, mate = (pair.wheel1, pair.wheel2) if leaving else (pair.wheel2, pair.wheel1)
    here, there = (np.zeros(2), pair.centre2) if leaving else (pair.centre2, np.zeros(2))
    tip = pair.point(pair.end if leaving else pair.start)

    def origin(corner):
        """The direction in which the involute of the mate begins that passes through the corner."""
        seen = there - corner if leaving else corner - there
        t = oracle.root(lambda t: oracle.norm(mate.involute(t, 0.0)) - oracle.norm(seen), 0.0, 9.0)
        flank = mate.involute(t, 0.0)
        return math.atan2(flank[0] * seen[1] - flank[1] * seen[0], flank @ seen)

    return x - mate.base * (origin(turned(tip, here, x / own.base)) - origin(tip))


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("leaving", [True, False])
def test_the_gap_is_that_of_a_search_on_constructed_flanks(seed, leaving):
    geometry = random_spur(np.random.default_rng(seed))
    if leaving and seed % 2:
        geometry = replace(geometry, centre_distance=1.003 * geometry.centre_distance)
    x = np.linspace(0.0, 0.5, 7) * geometry.normal_module
    found = corner_gap(geometry, x, leaving=leaving)
    expected = [searched(construct(geometry), value, leaving) for value in x]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    assert found[0] == pytest.approx(0, abs=1e-15) and np.all(np.diff(found) > 0)


@pytest.mark.parametrize(("teeth", "leaving", "published"), [
    ((50, 50), True, [0.00039, 0.00246, 0.01001, 0.02291, 0.04143]),
    ((27, 35), True, [0.00087, 0.00551, 0.02251, 0.05170, 0.09374]),
    ((27, 35), False, [0.00105, 0.00661, 0.02685, 0.06134, 0.11068])])
def test_the_gap_of_two_pairs_and_its_curvature_by_euler_and_savary(teeth, leaving, published):
    geometry = spur(teeth)
    x = np.array([0.2, 0.5, 1.0, 1.5, 2.0]) * 1e-3
    assert np.abs(corner_gap(geometry, x, leaving=leaving) * 1e3 - published).max() < 6e-6
    own, mate = (0, 1) if leaving else (1, 0)
    tangent, angle = geometry.tip_tangents[own], geometry.working_pressure_angle
    flank = geometry.tangent_length - tangent
    bases, pitches = np.array(geometry.base_diameter) / 2, np.array(geometry.working_diameter) / 2
    to_pitch_point = tangent - bases[own] * math.tan(angle)
    path = to_pitch_point - 1 / (1 / to_pitch_point + (1 / pitches).sum() / math.sin(angle))
    slide = tangent / bases[own] - flank / bases[mate]
    assert corner_contact(geometry, leaving=leaving).gap[0] == pytest.approx(
        (1 / path + 1 / flank) / 2 * slide**2, rel=4e-3)


def test_mirrored_pairs_and_a_rack():
    x = np.linspace(0.0, 1.5e-3, 6)
    one, other = spur((27, 35), (0.2, -0.1)), spur((35, 27), (-0.1, 0.2))
    np.testing.assert_allclose(corner_gap(one, x, leaving=True), corner_gap(other, x, leaving=False), atol=1e-15)
    geometry = spur((30, 40_000))
    base, tangent = geometry.base_diameter[0] / 2, geometry.tip_tangents[0]
    at = math.atan2(tangent, base)
    rack = x - math.hypot(tangent, base) * (np.sin(at + x / base) - math.sin(at))
    np.testing.assert_allclose(corner_gap(geometry, x, leaving=True), rack, rtol=2e-3, atol=1e-11)


@pytest.mark.parametrize("leaving", [True, False])
def test_a_polynomial_is_the_gap_up_to_what_teeth_can_bend(leaving):
    for seed in range(30):
        geometry = random_spur(np.random.default_rng(seed))
        length, gap = corner_contact(geometry, leaving=leaving)
        x = np.linspace(0.0, length, 1000)
        exact = corner_gap(geometry, x, leaving=leaving)
        assert np.abs(exact - sum(a * x ** (k + 2) for k, a in enumerate(gap))).max() < 2e-8
        assert exact[-1] == pytest.approx(DEEPEST * geometry.normal_module, rel=1e-6)


def test_no_contact_below_the_form_circle():
    geometry = spur((15, 60))  # the tip of wheel 2 enters below where the involute of wheel 1 begins
    assert np.isnan(corner_gap(geometry, np.zeros(1), leaving=False)) and corner_contact(geometry, leaving=True).length
    with pytest.raises(InputError, match="the tip corner of wheel 2 is off the involute of its mate"):
        corner_contact(geometry, leaving=False)


def gaps_of(pairs, phase):
    """Gap and stiffness of the pairs that may touch, by position and flank, from their definition."""
    found, alpha = [], pairs.contact_ratio
    for side in (1, -1):
        for j in range(-3, 8):
            x = (phase + j) / alpha if side > 0 else 1 + (pairs.back_phase - phase - j) / alpha
            if -pairs.corner_length2 < x < 1 + pairs.corner_length1:
                inside = min(max(x, 0.0), 1.0)
                gap = pairs.crowning * (2 * inside - 1) ** 2
                gap += pairs.relief1 * max(0.0, (inside - 1) / pairs.relief_length1 + 1) ** pairs.relief_exponent
                gap += pairs.relief2 * max(0.0, 1 - inside / pairs.relief_length2) ** pairs.relief_exponent
                gap += sum(a * max(x - 1, 0.0) ** (k + 2) for k, a in enumerate(pairs.corner1))
                gap += sum(a * max(-x, 0.0) ** (k + 2) for k, a in enumerate(pairs.corner2))
                found.append((side, pairs.levels[np.searchsorted(pairs.starts, inside, side="right") - 1], gap))
    return sorted(found)


@pytest.mark.parametrize("seed", range(12))
def test_pairs_have_the_gaps_of_their_definition_at_every_phase(seed):
    rng = np.random.default_rng(seed)
    cubic = seed % 2 * rng.uniform(0, 30, 2)  # a square alone is met exactly
    pairs = ToothPairStiffness(
        levels=tuple(rng.uniform(0.4, 1.0, 3)), starts=(0.0, 0.4, 0.6), contact_ratio=rng.uniform(1.1, 1.95),
        relief1=rng.uniform(0, 0.4), relief2=rng.uniform(0, 0.4), relief_length1=0.3, relief_length2=0.25,
        relief_exponent=float(rng.choice([1, 2])), crowning=rng.uniform(0, 0.2), back_phase=rng.uniform(0, 1),
        corner1=(rng.uniform(5, 60), cubic[0]), corner2=(rng.uniform(5, 60), cubic[1]),
        corner_length1=rng.uniform(0.05, 0.9), corner_length2=rng.uniform(0.05, 0.9))
    contacts = pairs.contacts(pairs.numbers(), 1)
    for phase in rng.uniform(0, 1, 200):
        piece = np.searchsorted(contacts.edges[0], phase, side="right") - 1
        powers = (phase - contacts.edges[0, piece]) ** np.arange(3)
        found = sorted(zip(contacts.sides, contacts.stiffness[0, :, piece], contacts.gap[0, :, piece] @ powers,
                           strict=True))
        found = [each for each in found if each[1] > 0]
        np.testing.assert_allclose(found, gaps_of(pairs, phase), rtol=0, atol=3e-4 if seed % 2 else 1e-12)


def test_at_rest_the_springs_that_touch_carry_the_load():
    """50/50: the loaded error, the pairs in contact and the torque from which two always touch, of own computations."""
    def touching(torque):
        pairs, geometry = replace(SPUR, torque=torque).tooth_pairs, SPUR.geometry
        force, phase = torque / geometry.base_diameter[0] * 2, np.arange(2000) / 2000
        at = (phase[:, None] + np.arange(-1, 3)) / geometry.contact_ratio
        gap = sum(np.where(way > 0, sum(a * np.maximum(way, 0.0) ** (k + 2) for k, a in enumerate(gaps)), 0.0)
                  for way, gaps in zip((at - 1, -at), pairs.corner.gap, strict=True))
        gap = np.where((at > -pairs.corner.length[1]) & (at < 1 + pairs.corner.length[0]), gap, np.inf)
        levels = np.array(pairs.stiffness)[np.searchsorted(pairs.starts, at.clip(0, 1 - 1e-15), side="right") - 1]
        low, high = np.zeros(2000), np.full(2000, 1e-3)
        for _ in range(60):
            middle = (low + high) / 2
            less = (levels * np.maximum(middle[:, None] - gap, 0)).sum(axis=1) < force
            low, high = np.where(less, middle, low), np.where(less, high, middle)
        return low, (gap < low[:, None]).sum(axis=1), phase

    deflection, count, phase = touching(300.0)
    np.testing.assert_allclose(loaded_error(SPUR, 300.0, phase), deflection, rtol=0, atol=2e-8)
    assert np.ptp(deflection) == pytest.approx(4.99e-6, abs=5e-8) and count.mean() == pytest.approx(2.012, abs=3e-3)
    assert touching(234.0)[1].min() == 1 and touching(234.7)[1].min() == 2
    reach = 1 + sum(SPUR.tooth_pairs.corner.length)
    assert touching(2e4)[1].mean() == pytest.approx(SPUR.geometry.contact_ratio * reach, abs=2e-3)
    assert touching(1e-3)[1].mean() == pytest.approx(SPUR.geometry.contact_ratio, abs=0.02)


def test_without_corner_contact_the_path_is_the_nominal_one():
    plain = replace(SPUR, corner_contact=False, speed=2000, torque=100, transmission_error="none").to_model().stiffness
    assert (plain.corner1, plain.corner2, plain.corner_length1) == ((), (), 0.0)
    corner = replace(SPUR, speed=2000, torque=100, transmission_error="none").to_model().stiffness
    assert replace(corner, corner1=(), corner2=(), corner_length1=0.0, corner_length2=0.0) == plain
    for (own, level), (beside, other) in zip(*(s.parts(s.numbers()) for s in (corner, plain)), strict=True):
        assert (own, level) == pytest.approx((beside, other), rel=1e-12)
    light = np.linspace(0, 1, 50, endpoint=False)
    np.testing.assert_allclose(*(static_deflection(s, 1e-9, light) for s in (corner, plain)), rtol=0, atol=1e-8)


@pytest.mark.parametrize(("changes", "words"), [
    ({"corner_contact": 1}, "corner_contact must be true or false"),
    ({"load_sharing": "prescribed"}, "must be left out where the mesh is one spring"),
    ({"load_sharing": "prescribed", "corner_contact": False}, "must be left out where the mesh is one spring"),
    ({"helix_angle": 0.2, "load_sharing": "prescribed", "centre_distance": None}, "leave load_sharing out")])
def test_bad_input_names_what_to_do(changes, words):
    with pytest.raises(InputError, match=words):
        replace(SPUR, **changes)


def test_the_datasheet_says_how_many_pairs_touch():
    found = datasheet(replace(SPUR, torque=300.0))
    assert found["loaded_error_peak_to_peak"].value == pytest.approx(4.99, abs=0.05)
    assert found["contact_ratio_under_load"].value == pytest.approx(2.012, abs=3e-3)
    assert found["two_pairs_from"].value == pytest.approx(234.3, abs=0.1)
    assert found["corner_gap_coefficient"].value == pytest.approx((0.0097, 0.0097), abs=5e-5)
    path = datasheet(replace(SPUR, torque=300.0, corner_contact=False))
    assert path["contact_ratio_under_load"].value == pytest.approx(SPUR.geometry.contact_ratio, abs=1e-3)
    for name, words in (("two_pairs_from", "No torque that the teeth can bear"), ("corner_gap_coefficient", "nominal")):
        assert path[name].value is None and words in path[name].reason
    spring = datasheet(replace(SPUR, corner_contact=None, load_sharing="prescribed"))
    assert "The mesh is one spring" in spring["contact_ratio_under_load"].reason


@pytest.mark.parametrize("values", [
    {"corner_length1": 0.2}, {"corner2": (3.0,)}, {"corner1": (3.0,), "corner_length1": -0.1},
    {"corner1": (math.nan,), "corner_length1": 0.1}, {"corner1": (3.0, -40.0), "corner_length1": 0.1}])
def test_a_gap_beyond_the_path_needs_its_polynomial_and_its_length(values):
    with pytest.raises(InputError, match="corner"):
        ToothPairStiffness(**values)


@pytest.mark.parametrize(("corner", "words"), [
    ({"length": [0.2, 0.0], "gap": [[], []]}, r"tooth_pairs.corner.gap\[0\] must have coefficients"),
    ({"length": [1.2, 0.0], "gap": [["2 mm"], []]}, r"tooth_pairs.corner.length\[0\] must lie in \[0, 1\)"),
    ({"length": 0.2, "gap": [["2 mm"], ["2 mm"]]}, "tooth_pairs.corner.length must be a list of two"),
    ({"length": [0.0, 0.2], "gap": [[], ["-2 mm"]]}, r"tooth_pairs.corner.gap\[1\] must make a gap")])
def test_a_table_of_a_pair_names_its_own_fields(corner, words):
    pair = replace(SPUR, speed=2000, torque=100).to_pair()
    with pytest.raises(InputError, match=words):
        replace(pair, tooth_pairs={"stiffness": 3e8, "contact_ratio": 1.6, "corner": corner})


@pytest.mark.parametrize("kind", ["single", "torsional"])
def test_a_pair_has_the_gaps_of_its_design_and_of_its_model(kind):
    design = replace(SPUR, speed=2000, torque=300)
    pair, model = design.to_pair(), design.to_model(kind)
    assert model.stiffness.corner1 == pytest.approx(pair.to_model(kind).stiffness.corner1, rel=1e-12)
    again = pair_at(pair, pair.to_model(kind))
    for name in ("length", "gap"):
        np.testing.assert_allclose(getattr(again.tooth_pairs.corner, name), getattr(pair.tooth_pairs.corner, name),
                                   rtol=1e-12)


def test_corners_change_neither_the_mean_stiffness_of_a_train_nor_which_teeth_are_faulty():
    designs = [replace(SPUR, speed=2000, torque=300, corner_contact=corner, faults=[
        {"wheel": 1, "tooth": 3, "stiffness_loss": 0.4}, {"wheel": 2, "tooth": 5, "wear": "20 um"}],
        pitch_errors={"seed": 3}) for corner in (False, True)]
    on_path, beyond = (as_model(design.to_train()) for design in designs)
    modes = [gc.natural_frequencies(design.to_train())["natural_frequency"].values for design in designs]
    np.testing.assert_allclose(*modes, rtol=1e-12)
    few, many = (switched_system(vary(model, {})).contacts for model in (on_path, beyond))
    for phase in np.random.default_rng(1).uniform(0, 1, 300):
        own, all_ = ([(side, k, *offset) for side, k, offset in zip(
            found.sides, found.stiffness[0, :, piece], found.offset[0, :, piece] @ (
                phase - found.edges[0, piece]) ** np.arange(3)[:, None], strict=True) if k > 0]
            for found in (few, many) for piece in [np.searchsorted(found.edges[0], phase, side="right") - 1])
        for contact in own:
            assert np.abs(np.array(all_) - contact).max(axis=1).min() < 1e-9, phase


def test_a_train_has_the_gaps_of_its_pair():
    """The wear of one tooth, by a hair, makes a train of it; with this backlash the gap has the same pieces."""
    design = replace(SPUR, speed=2000, torque=300, transmission_error="none", backlash={
        "value": f"{2.0**-12} m", "of": "line of action, total"})
    train = replace(design, faults=[{"wheel": 1, "tooth": 1, "wear": "1e-15 m"}])
    found = [gc.simulate(as_model(each), transient=transient, periods=1, samples=samples)
             for each, transient, samples in ((design, 200, 16), (train, 4, 16 * 50))]  # periods of a turn
    alone, among = (np.abs(each["mesh_force"].values) for each in found)
    assert np.ptp(alone) > 0.05 * alone.mean()
    np.testing.assert_allclose(among.ravel()[:16] / among.mean(), alone / alone.mean(), rtol=1e-6)
