"""Tooth pairs that share the load, of gear pairs and of designs: how they are read, checked and computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.text import as_python, as_toml, design_values, from_query, pair_at, to_query
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.transverse_section import TransverseSection
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.mesh.tooth_pairs import back_phase
from gearchaos.gears.operation.operating import gears_from_json, gears_json, operating_model
from gearchaos.gears.stiffness.potential_energy import ToothPairs as EnergyPairs
from gearchaos.model import TwoLevelStiffness
from gearchaos.studyfile import load_study
from tests.contracts.gears.test_design_keys import GIVEN, PAIR

RELIEF = {"amount": "30 um", "length": 0.2, "shape": "linear"}
PAIRS = {"stiffness": "1.5e8 N/m", "contact_ratio": 1.6, "relief": RELIEF}
TIP_RELIEF = {"amount": ["30 um", "18 um"], "start_diameter": ["76 mm", "112 mm"]}
FZG = {**GIVEN, "teeth": [16, 24], "module": "4.5 mm", "face_width": "14 mm", "centre_distance": "91.5 mm",
       "profile_shift": [0.182, 0.171], "tip_diameter": ["82.46 mm", "118.36 mm"]}
HIGH = {"teeth": [50, 60], "rack": {"addendum": 1.35, "dedendum": 1.6, "root_radius": 0.1}}  # contact ratio 2.316
HIGHEST = {"teeth": [100, 100], "pressure_angle": "16 deg", "centre_distance": None,
           "rack": {"addendum": 2.0, "dedendum": 2.15, "root_radius": 0.02}}


def of_design(**changes):
    return GearDesign(**{**GIVEN, **changes})


CORNERS = "tooth pairs with corner contact"
ACTIVE, TIP = list(of_design().geometry.start_of_active_profile), of_design().geometry.tip_diameter[0]


def test_values_of_a_pair_are_those_of_its_model_over_c0_and_half_the_backlash():
    found = GearPair(**PAIR, tooth_pairs={
        "stiffness": ["150 N/um", "180 N/um"], "starts": [0, 0.4], "contact_ratio": 1.6, "crowning": "6 um",
        "back_phase": 0.4, "relief": {"amount": ["30 um", "12 um"], "length": [0.2, 0.3], "shape": "parabolic"},
    }).to_model().stiffness
    assert found.levels == pytest.approx((0.375, 0.45)) and found.starts == (0.0, 0.4)
    assert (found.relief1, found.relief2, found.crowning) == pytest.approx((0.5, 0.2, 0.1))
    assert (found.relief_length1, found.relief_length2, found.relief_exponent) == (0.2, 0.3, 2.0)
    assert (found.contact_ratio, found.back_phase) == (1.6, 0.4)


def test_one_value_of_a_relief_holds_for_both_wheels_and_none_is_none():
    for changes, relief in (({}, 0.5), ({"relief": None}, 0.0)):
        found = GearPair(**PAIR, tooth_pairs={**PAIRS, **changes}).to_model().stiffness
        assert found.relief1 == found.relief2 == pytest.approx(relief) and found.relief_exponent == 1.0


@pytest.mark.parametrize(("changes", "field", "words"), [
    ({"relief": {**RELIEF, "length": [0.6, 0.5]}}, "relief.length", "sum of both wheels of at most 1, the path"),
    ({"relief": {**RELIEF, "length": 0}}, "relief.length", r"in (0, 1]"),
    ({"relief": {**RELIEF, "amount": "-3 um"}}, "relief.amount", "must not be negative; got '-3 um'"),
    ({"relief": {**RELIEF, "amount": ["3 um"]}}, "relief.amount", "one value, or a list of two"),
    ({"relief": {**RELIEF, "shape": "cubic"}}, "relief.shape", "must be one of linear, parabolic; got 'cubic'"),
    ({"relief": {}}, "relief.amount", "must be given"),
    ({"relief": "30 um"}, "relief", "must be a table with amount, length, shape"),
    ({"stiffness": ["1e8 N/m", "2e8 N/m"], "starts": [0.1, 0.5]}, "starts", "must rise from 0 and stay below 1"),
    ({"stiffness": ["1e8 N/m", "2e8 N/m"], "starts": [0, 1]}, "starts", "must rise from 0 and stay below 1"),
    ({"stiffness": ["1e8 N/m"] * 3, "starts": [0, 0.6, 0.3]}, "starts", "must rise from 0 and stay below 1"),
    ({"stiffness": ["1e8 N/m", "2e8 N/m"]}, "starts", "as many values as stiffness (2)"),
    ({"starts": []}, "starts", "must rise from 0"), ({"starts": "0"}, "starts", "must be a list of numbers"),
    ({"stiffness": []}, "stiffness", "must have 1 to 64 values; got 0"),
    ({"stiffness": ["1e8 N/m", "-1 N/m"], "starts": [0, 0.5]}, "stiffness[1]", "must be greater than 0; got '-1 N/m'"),
    ({"contact_ratio": 4.3}, "contact_ratio", "must lie in [1, 4]; got 4.3. Below 1 contact is lost"),
    ({"contact_ratio": 0.9}, "contact_ratio", "must lie in [1, 4]; got 0.9"),
    ({"back_phase": 1}, "back_phase", "must lie in [0, 1); got 1"),
    ({"back_phase": -0.1}, "back_phase", "must lie in [0, 1); got -0.1"),
    ({"crowning": "-3 um"}, "crowning", "must not be negative"),
    ({"length": 0.2}, "", "must have no key but stiffness, starts"),
])
def test_what_is_wrong_with_tooth_pairs_is_said(changes, field, words):
    with pytest.raises(InputError) as refusal:
        GearPair(**PAIR, tooth_pairs={**PAIRS, **changes})
    assert refusal.value.field == f"tooth_pairs.{field}".rstrip(".") and words in str(refusal.value)


def test_a_gap_that_only_another_unit_explains_is_warned_of():
    for changes, warned in (({}, False), ({"crowning": 2.0}, True), ({"relief": {**RELIEF, "amount": [30, 20]}}, True),
                            ({"relief": None}, False)):
        found = GearPair(**PAIR, tooth_pairs={**PAIRS, **changes}).warnings
        assert any("more than the backlash: a plain number is in m" in text for text in found) is warned
    assert GearPair(**PAIR).warnings == ()


def test_a_study_file_has_tooth_pairs_and_takes_other_values_of_them(tmp_path):
    path, lines = tmp_path / "pair.toml", [f"{name} = {value!r}" for name, value in PAIR.items()]
    path.write_text("\n".join(["[gearpair]", *lines, 'tooth_pairs = { stiffness = "1.5e8 N/m", contact_ratio = 1.6, '
                               'relief = { amount = "30 um", length = 0.2, shape = "linear" } }']))
    assert load_study(path).model.stiffness == GearPair(**PAIR, tooth_pairs=PAIRS).to_model().stiffness
    other = load_study(path, {"gearpair.tooth_pairs.relief.amount": ["12 um", "6 um"]}).model.stiffness
    assert (other.relief1, other.relief2) == pytest.approx((0.2, 0.1))
    assert load_study(path, {"relief1": 0.3}).model.stiffness.relief1 == 0.3


@pytest.mark.parametrize("gears", [
    GearPair(**PAIR, tooth_pairs=PAIRS), of_design(tip_relief=TIP_RELIEF),
    of_design(load_sharing="tooth pairs", corner_contact=True).to_pair(),
    of_design(blank=["solid", {"rim": "9 mm", "web": "12 mm"}]),
], ids=["pair", "design", "pair of a design", "blank"])
def test_gears_are_made_again_from_json(gears):
    assert gears_from_json(gears_json(gears)) == gears and hash(gears_from_json(gears_json(gears))) == hash(gears)
    if isinstance(gears, GearDesign):
        assert GearDesign(**design_values(gears)) == gears


@pytest.mark.parametrize("change", [
    lambda view: view, lambda view: view.with_value("relief1", 0.25), lambda view: view.with_value("torque", 61.7),
    lambda view: view.with_stiffness("steps").with_stiffness("tooth pairs")], ids=["plain", "relief", "torque", "kind"])
@pytest.mark.parametrize("gears", [
    GearPair(**PAIR, tooth_pairs=PAIRS), GearPair(**PAIR, tooth_pairs={**PAIRS, "relief": None}),
    of_design(tip_relief=TIP_RELIEF), of_design(tip_relief=TIP_RELIEF, corner_contact=True),
    of_design(load_sharing="tooth pairs", corner_contact=True).to_pair(),
    of_design(load_sharing="tooth pairs", corner_contact=True, **HIGH),
], ids=["relief", "no relief", "design", "corners", "pair with corners", "high contact ratio"])
def test_the_explorer_writes_addresses_study_files_and_scripts_of_gears_with_tooth_pairs(gears, change, tmp_path):
    first = view_of(operating_model(gears))
    view, path, made = change(first), tmp_path / "study.toml", {}
    model = view.operating_point
    assert from_query(to_query(view), first).operating_point == model
    path.write_text(as_toml(view))
    exec("\n".join(as_python(view).split("\n")[:5]), made)
    for found in (load_study(path).model, made["model"]):
        assert found.stiffness.kind == "tooth pairs"
        assert found.parameters() == pytest.approx(model.parameters(), rel=1e-12)
        assert found.stiffness.levels == pytest.approx(model.stiffness.levels, rel=1e-12)
        assert found.stiffness.corner1 == pytest.approx(model.stiffness.corner1, rel=1e-9)


def test_a_pair_with_a_changed_relief_is_a_pair_again():
    pair = GearPair(**PAIR, tooth_pairs=PAIRS)
    found = pair_at(pair, pair.to_model().with_values({"relief1": 0.25}))
    assert found is not None and found.tooth_pairs.relief.amount == pytest.approx((15e-6, 30e-6))


@pytest.mark.parametrize(("changes", "words"), [
    ({}, CORNERS), ({"tip_relief": TIP_RELIEF}, CORNERS), ({"tip_relief": {**TIP_RELIEF, "amount": "0 um"}}, CORNERS),
    ({"tip_relief": "20 um", "transmission_error": "none"}, CORNERS), ({"tip_relief": "0 um"}, CORNERS),
    ({"load_sharing": "tooth pairs"}, CORNERS), ({"stiffness": "potential energy"}, CORNERS),
    ({"corner_contact": True}, CORNERS), ({"corner_contact": False}, "tooth pairs on their nominal path alone"),
    ({"load_sharing": "prescribed"}, "prescribed, one spring"),
    ({"tip_relief": TIP_RELIEF, "helix_angle": "10 deg"},
     "under load, in strips across the width with corner contact"),
    ({"helix_angle": "10 deg", "load_sharing": "prescribed"}, "prescribed, one spring"),
    ({**HIGH, "tip_relief": {"amount": "20 um", "start_diameter": ["156 mm", "186 mm"]}}, CORNERS),
])
def test_tooth_pairs_share_the_load_wherever_a_model_can_have_that(changes, words):
    design, shared = of_design(**changes), "tooth pairs " in words.partition(",")[0]
    pairs = design.to_pair().tooth_pairs
    assert design.sharing_in_words == words and design.shares_load is shared
    assert (design.to_model().stiffness.kind == "tooth pairs") is shared and (pairs is not None) is shared
    assert design.has_corner_contact is ("with corner contact" in words)
    assert (words == CORNERS) is (pairs is not None and pairs.corner is not None)


def test_teeth_whose_corners_leave_the_involute_touch_on_their_path_alone_and_a_warning_says_so():
    """Wheel 2 of these is undercut, and the path of contact ends at its base circle."""
    bare = {"teeth": (55, 15), "module": "5 mm", "face_width": "20 mm", "profile_shift": (0.05, 0.44),
            "pressure_angle": "14.5 deg"}
    for design in (GearDesign(**bare), GearDesign(**{**GIVEN, **bare})):
        assert design.shares_load and design.tooth_pairs.corner is None and not design.has_corner_contact
        (text,) = [each for each in design.warnings if "without corner contact" in each]
        assert text.endswith("the gap of the tip corner of wheel 1 is no polynomial of 8 terms.")
        assert not [each for each in replace(design, corner_contact=False).warnings if "corner contact" in each]
    assert GearDesign(**{**GIVEN, **bare}).to_model().stiffness.corner1 == ()
    with pytest.raises(InputError, match="corner_contact must be false or left out for these teeth") as refusal:
        GearDesign(**bare, corner_contact=True)
    assert refusal.value.field == "corner_contact" and "tip corner of wheel 1" in refusal.value.advice


def test_a_relief_of_nothing_and_no_relief_are_the_same():
    """So what the best relief says where none lessens the variation is what a design with a relief of 0 does."""
    none = of_design(tip_relief=None)
    for relief in ({**TIP_RELIEF, "amount": "0 um"}, "0 um", {**TIP_RELIEF, "amount": ["0 um", "0 um"]}):
        design = of_design(tip_relief=relief)
        assert design.to_model() == none.to_model() and design.to_pair() == none.to_pair()


@pytest.mark.parametrize(("changes", "field", "words"), [
    ({"tip_relief": TIP_RELIEF, "load_sharing": "prescribed"}, "load_sharing", "on one spring it would do nothing"),
    *(({"load_sharing": "prescribed", "corner_contact": given}, "corner_contact",
       "Tip corners meet where each tooth pair has a gap: leave load_sharing out") for given in (True, False)),
    ({**HIGHEST, "corner_contact": True}, "corner_contact", "The contact ratio is 4."),
    ({"helix_angle": "10 deg", "load_sharing": "tooth pairs"}, "load_sharing", "helical teeth enter contact bit by"),
    ({"load_sharing": "shared"}, "load_sharing", "must be one of prescribed, tooth pairs"),
    ({"load_sharing": "tooth pairs", **HIGHEST}, "load_sharing",
     "the contact ratio is 4.017, and tooth pairs need 1 to 4"),
    ({"load_sharing": "tooth pairs", "stiffness": {"table": "c.csv"}}, "load_sharing",
     "a table has the stiffness of all pairs together"),
    ({"load_sharing": "tooth pairs", "tip_relief": "20 um"}, "tip_relief.start_diameter", "must be given"),
    ({"tip_relief": {"amount": "20 um", "start_diameter": [TIP, "112 mm"]}}, "tip_relief.start_diameter[0]",
     "must be smaller than the tip diameter"),
    ({"tip_relief": {"amount": "20 um", "start_diameter": ACTIVE}}, "tip_relief.length",
     "reliefs of both wheels would overlap"),
])
def test_reliefs_and_a_load_sharing_that_cannot_be_are_refused(changes, field, words, tmp_path, monkeypatch):
    (tmp_path / "c.csv").write_text("fraction,level [N/um]\n0,500\n0.6,300\n")
    monkeypatch.chdir(tmp_path)
    assert not of_design(stiffness={"table": "c.csv"}, tip_relief=TIP_RELIEF).shares_load  # but all on one spring
    with pytest.raises(InputError) as refusal:
        of_design(**changes).to_model()
    assert refusal.value.field == field and words in str(refusal.value)


def test_a_relief_acts_through_tooth_pairs_and_not_through_the_transmission_error(tmp_path):
    plain, relieved = of_design(), of_design(tip_relief=TIP_RELIEF)
    assert relieved.error_harmonics == plain.error_harmonics
    assert relieved.to_model().error == plain.to_model().error
    assert not [text for text in relieved.warnings if text.startswith("tip_relief")]
    path = tmp_path / "te.csv"
    path.write_text("order,peak [um],phase [deg]\n1,2,30\n")
    for changes, words in (
            ({"transmission_error": {"orders": str(path)}}, "must be that of teeth without relief"),
            ({"tip_relief": "20 um", "transmission_error": "none"},
             "tip_relief has no effect on the motion: give its start_diameter, where it begins.")):
        (text,) = [each for each in replace(relieved, **changes).warnings if each.startswith("tip_relief")]
        assert words in text


@pytest.mark.parametrize("method", ["ISO 6336-1", "potential energy"])
def test_the_levels_over_c0_are_the_same_at_every_torque(method):
    design = of_design(tip_relief=TIP_RELIEF, stiffness=method)
    first, *others = [design.at(torque=torque).to_model() for torque in (20.0, 37.3, 61.7, 300.0)]
    assert all(each.stiffness == first.stiffness for each in others)
    assert design.to_pair().to_model().stiffness.levels == pytest.approx(first.stiffness.levels, rel=1e-14)


def test_the_relief_of_a_drawing_is_that_on_the_path_of_contact():
    design = of_design(tip_relief=TIP_RELIEF)
    found, path = design.to_model().stiffness, design.geometry.path_of_contact
    assert (found.relief1, found.relief2) == pytest.approx((0.5, 0.3))
    for n, length in enumerate((found.relief_length1, found.relief_length2)):
        base = np.array([72.0, 108.0])[n] * np.cos(np.radians(20))  # d cos α
        tip, start = np.array([78.0, 114.0])[n], np.array([76.0, 112.0])[n]
        assert length == pytest.approx((np.sqrt(tip**2 - base**2) - np.sqrt(start**2 - base**2)) / 2e3 / path)


def test_a_relief_of_one_wheel_may_cover_the_whole_path():
    found = of_design(tip_relief={"amount": ["20 um", "0 um"], "start_diameter": ACTIVE}).to_model().stiffness
    assert found.relief_length1 == pytest.approx(1) and found.relief2 == 0


@pytest.mark.parametrize("given", [GIVEN, FZG], ids=["24/36", "FZG C"])
def test_pairs_by_iso_without_gaps_have_the_prescribed_sum(given):
    design = GearDesign(**given, load_sharing="tooth pairs")
    pair, prescribed = design.to_pair(), design.mesh_stiffness
    assert pair.c0 == prescribed.reference and isinstance(prescribed.waveform, TwoLevelStiffness)
    single = design.tooth_stiffness.single_stiffness * design.geometry.common_face_width
    assert max(pair.tooth_pairs.stiffness) == pytest.approx(single, rel=1e-12)
    assert min(pair.tooth_pairs.stiffness) == pytest.approx(1.75 * single / 2, rel=1e-12)
    found, tau = pair.to_model().stiffness, (np.arange(500) + 0.5) / 500
    parts = found.parts(found.numbers())
    total = np.array([level for _, level in parts])[np.searchsorted([at for at, _ in parts], tau, side="right") - 1]
    assert np.abs(total * pair.c0 - prescribed(tau)).max() < 1e-12 * pair.c0


@pytest.mark.parametrize("given", [GIVEN, FZG], ids=["24/36", "FZG C"])
def test_pairs_by_potential_energy_have_the_means_of_their_own_curve(given):
    design = GearDesign(**given, stiffness="potential energy", load_sharing="tooth pairs")
    found, energy = design.tooth_pairs, EnergyPairs(design.geometry, design.material, (0.03, 0.03))
    assert len(found.stiffness) <= 32
    for start, stop, level in zip(found.starts, (*found.starts[1:], 1.0), found.stiffness, strict=True):
        nodes, weights = np.polynomial.legendre.leggauss(12)
        x = start + (stop - start) * (nodes + 1) / 2
        own = energy.stiffness(*energy.pressure_angles(x * design.geometry.contact_ratio)) @ weights / 2
        assert level == pytest.approx(own, rel=1e-5)
    mean = np.diff([*found.starts, 1.0]) @ np.array(found.stiffness) * design.geometry.contact_ratio
    assert mean == pytest.approx(design.to_pair().c0, rel=1e-4)


@pytest.mark.parametrize("given", [GIVEN, FZG, {**GIVEN, "profile_shift": [0.4, -0.4]}, {**GIVEN, **HIGH}],
                         ids=["24/36", "FZG", "V0", "high contact ratio"])
@pytest.mark.parametrize("phase", [0.05, 0.4, 0.8])
def test_back_flanks_are_where_the_outline_of_wheel_1_crosses_their_line_of_action(given, phase):
    geometry = GearDesign(**given).geometry
    section = TransverseSection(geometry, max(geometry.theoretical_backlash, 0.0), phase)
    outline = section.outline(0, detail=60) * [-1, 1]  # the back flanks in the place of the front flanks
    height = (outline - section.on_line(0.0)) @ np.array([-section.direction[1], section.direction[0]])
    along = (outline - section.on_line(0.0)) @ section.direction
    crossing = np.flatnonzero(height[:-1] * height[1:] < 0)
    share = height[crossing] / (height[crossing] - height[crossing + 1])
    distance = along[crossing] + share * (along[crossing + 1] - along[crossing])
    steep = np.abs(np.diff(along)[crossing]) < 0.2 * np.abs(np.diff(height)[crossing])  # a flank that can touch
    on_path = (distance > section.start) & (distance < section.end) & steep
    assert on_path.any()
    x = (distance[on_path] - section.start) / geometry.path_of_contact
    turns = geometry.contact_ratio * (1 - x) + back_phase(geometry) - phase
    assert np.abs(turns - np.round(turns)).max() < 2e-4
