"""The mesh deflection against closed forms: of one spring, and of two tooth pairs with their gaps."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.page import sheet_html
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.gears.operation.loaded_error import best_relief, contact_ratio_under_load, loaded_error, peak_to_peak
from gearchaos.studyfile import load_design
from tests import EXAMPLES
from tests.branches import axes
from tests.pictures import legend_words

DESIGN = gc.GearDesign(teeth=(24, 36), module="3 mm", face_width="30 mm", torque="300 N*m")
SPRING = replace(DESIGN, load_sharing="prescribed")
ON_PATH = replace(DESIGN, corner_contact=False)
RELIEVED = replace(ON_PATH, tip_relief={"amount": ["12 um", "8 um"], "start_diameter": ["75.2 mm", "111 mm"],
                                       "shape": "parabolic"})
PAIR = gc.GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1="35 mm", R2="70 mm", c0="400 N/um", k="500 N*s/m", M10=85,
                   backlash="0.12 mm", speed=3000)


def test_one_spring_gives_way_by_the_force_over_its_stiffness():
    tooth, geometry = SPRING.tooth_stiffness, SPRING.geometry
    single, force = tooth.single_stiffness * geometry.common_face_width, 300 / (geometry.base_diameter[0] / 2)
    found = loaded_error(SPRING, None, np.array([0.01, geometry.contact_ratio - 1 + 0.01]))
    assert found == pytest.approx([force / (1.75 * single), force / single], rel=1e-12)
    assert peak_to_peak(SPRING) == pytest.approx(force / single * (1 - 1 / 1.75), rel=1e-12)
    assert loaded_error(SPRING, "0.6 kN*m", np.array([0.01])) == pytest.approx(2 * found[:1], rel=1e-12)


def test_tooth_pairs_give_way_until_those_that_touch_carry_the_force():
    geometry, mm = RELIEVED.geometry, 1e-3
    path, pitch = geometry.path_of_contact, geometry.base_pitch
    single = RELIEVED.tooth_stiffness.single_stiffness * geometry.common_face_width
    length = [np.sqrt(tip**2 - base**2) / 2 - np.sqrt(start**2 - base**2) / 2 for tip, start, base in zip(
        (78 * mm, 114 * mm), (75.2 * mm, 111 * mm), geometry.base_diameter, strict=True)]
    positions = (np.arange(997) + 0.5) / 997
    for torque in (120, 300, 700):  # above the low loads at which the stiffness by ISO 6336-1 falls
        force, expected = torque / (geometry.base_diameter[0] / 2), []
        for position in positions:
            pairs = []
            for at in (position * pitch, (position + 1) * pitch):
                if at < path:
                    gap = (8e-6 * max(0, 1 - at / length[1])**2 + 12e-6 * max(0, 1 - (path - at) / length[0])**2)
                    pairs.append((gap, single if path - pitch < at < pitch else 0.875 * single))
            (gap, stiffness), *others = sorted(pairs)
            y = gap + force / stiffness
            if others and y > others[0][0]:
                (other, beside), = others
                y = (force + stiffness * gap + beside * other) / (stiffness + beside)
            expected.append(y)
        np.testing.assert_allclose(loaded_error(RELIEVED, torque, positions), expected, rtol=1e-9)
    assert peak_to_peak(RELIEVED) == pytest.approx(np.ptp(loaded_error(RELIEVED, 300, positions)), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(("torque", "relief", "corners"), [
    (120, RELIEVED.tip_relief, False), (700, RELIEVED.tip_relief, False), (300, RELIEVED.tip_relief, True),
    (300, {"amount": ["12 um", "0 um"], "start_diameter": ["75.2 mm", "111 mm"]}, False),
    (300, {"amount": "5 um", "start_diameter": ["76 mm", "112 mm"]}, False)],
    ids=["light", "heavy", "corners", "wheel 1", "short"])
def test_no_smaller_relief_in_the_given_ratio_makes_the_deflection_vary_less(torque, relief, corners):
    def with_amounts(amounts: list[float]) -> gc.GearDesign:
        return replace(design, tip_relief={**given, "amount": [f"{v} m" for v in amounts]})

    design = replace(RELIEVED, torque=torque, tip_relief=relief, corner_contact=corners)
    given = {"start_diameter": [f"{v} m" for v in design.tip_relief.start_diameter], "shape": design.tip_relief.shape}
    best, least = best_relief(design)
    assert best[0] * design.tip_relief.amount[1] == pytest.approx(best[1] * design.tip_relief.amount[0], rel=1e-12)
    assert peak_to_peak(with_amounts(best)) == pytest.approx(least, rel=1e-9)
    alone = torque / (design.geometry.base_diameter[0] / 2) / max(design.tooth_pairs.stiffness)
    most = 1.02 * best[0] or alone / 2  # larger ones may keep pairs apart
    others = [peak_to_peak(with_amounts([share * v for v in design.tip_relief.amount]))
              for share in np.linspace(0, most / design.tip_relief.amount[0], 52)]
    assert least <= min(others) * (1 + 2e-3)
    assert contact_ratio_under_load(with_amounts(best)) > 1.05  # pairs are not kept apart


def test_the_best_relief_of_corner_contact_does_not_keep_pairs_apart():
    """Reliefs of 24 µm and more vary less, since one pair bears all; with 13 µm, less than one bends, pairs share."""
    design = replace(load_design(EXAMPLES / "spur_50_50.toml"), torque=300, tip_relief={
        "amount": "12 um", "start_diameter": "152.3 mm"})
    best, least = best_relief(design)
    alone = 300 / (design.geometry.base_diameter[0] / 2) / max(design.tooth_pairs.stiffness)
    kept_apart = replace(design, tip_relief=replace(design.tip_relief, amount="28 um"))
    assert 0.7 * alone < best[0] < alone and peak_to_peak(kept_apart) < least
    assert contact_ratio_under_load(kept_apart) < 1.4 < 1.6 < contact_ratio_under_load(
        replace(design, tip_relief=replace(design.tip_relief, amount=best)))


def test_the_best_relief_down_to_single_contact_ends_the_variation():
    """Both gaps add up to C_a all along double contact: there y = F/(1.75 c′ b) + C_a/2, and F/(c′ b) elsewhere."""
    geometry = DESIGN.geometry
    double = geometry.path_of_contact - geometry.base_pitch
    lengths = [geometry.length_to_tip(n, d) for n, d in enumerate(geometry.single_contact_diameter)]
    assert lengths == pytest.approx([double] * 2, rel=1e-12)
    alone = 300 / (geometry.base_diameter[0] / 2) / (
        DESIGN.tooth_stiffness.single_stiffness * geometry.common_face_width)
    start = [f"{np.hypot(base, 2 * (np.sqrt(tip**2 - base**2) / 2 - double))} m"
             for tip, base in zip((0.078, 0.114), geometry.base_diameter, strict=True)]
    best, least = best_relief(replace(ON_PATH, tip_relief={"amount": "1 um", "start_diameter": start}))
    assert best == pytest.approx([6 / 7 * alone] * 2, rel=1e-3) and least < 1e-3 * alone


@pytest.mark.slow
def test_where_no_relief_is_best_the_design_without_it_varies_as_much():
    design = replace(ON_PATH, tip_relief={"amount": "5 um", "start_diameter": ["76 mm", "112 mm"]})
    best, least = best_relief(design)
    assert best == (0.0, 0.0)
    without = replace(design, tip_relief=replace(design.tip_relief, amount=best))
    assert peak_to_peak(without) == pytest.approx(least, rel=1e-12) and without.shares_load


def test_without_a_relief_the_best_one_is_alike_and_from_single_contact():
    assert best_relief(SPRING) is None
    found = datasheet(SPRING)["best_tip_relief"]
    assert found.expected and found.reason.startswith("The mesh is one spring")
    from_there = {"start_diameter": list(DESIGN.geometry.single_contact_diameter)}
    alike, twice = (best_relief(replace(DESIGN, tip_relief={**from_there, "amount": amount}))[0]
                    for amount in ("1 um", ["2 um", "1 um"]))
    for design, expected in ((DESIGN, alike), (replace(DESIGN, tip_relief=["20 um", "10 um"]), twice)):
        assert datasheet(design)["best_tip_relief"].value == pytest.approx(1e6 * np.array(expected), rel=1e-2)


COMPLETE = replace(DESIGN, backlash={"value": "0.2 mm", "of": "line of action, total"}, bore="30 mm", speed=3000,
                   damping_ratio=0.05)


def test_a_pair_of_a_design_gives_way_as_the_design_does():
    pair = replace(COMPLETE, tip_relief=RELIEVED.tip_relief, corner_contact=False).to_pair()
    positions = np.linspace(0, 1, 100, endpoint=False)
    np.testing.assert_allclose(loaded_error(pair, None, positions), loaded_error(RELIEVED, None, positions), rtol=1e-12)


def test_a_harris_map_has_a_curve_for_each_torque():
    ax, torques = gc.plot.harris_map(RELIEVED, ax=axes()), (75, 150, 225, 300, 450)
    variation = [np.ptp(line.get_ydata()) for line in ax.lines]
    assert legend_words(ax) == [f"{torque:g} N m: {found:.3g} µm"
                                for torque, found in zip(torques, variation, strict=True)]
    for line, torque in zip(ax.lines, torques, strict=True):
        np.testing.assert_allclose(line.get_ydata(), 1e6 * loaded_error(RELIEVED, torque, line.get_xdata()))
    own = [line.get_color() for line in ax.lines]
    assert len(set(own)) == 5 and own[3] == "#c03a1e"
    ax.figure.canvas.draw()
    assert ax.child_axes[0].get_xlim() == pytest.approx((0, 15)) and ax.get_ylabel().endswith("[µm]")


def test_a_harris_map_is_of_any_gears_at_the_torques_given():
    ax = gc.plot.harris_map(PAIR, ["40 N*m", 85], ax=axes(), legend=False)
    assert len(ax.lines) == 2 and ax.get_legend() is None
    low, high = (85 / 0.035 / (4e8 * chi) * 1e6 for chi in (1.25, 0.75))
    assert set(np.round(ax.lines[1].get_ydata(), 9)) == {round(low, 9), round(high, 9)}
    assert ax.lines[1].get_color() == "#c03a1e"


@pytest.mark.parametrize(("gears", "torques", "message"), [
    (RELIEVED, "300 N*m", "torques must be a list of torques at wheel 1"), (RELIEVED, [], "torques must be a list"),
    (RELIEVED, 300, "torques must be a list"), (RELIEVED, [100, -3], r"torques\[1\] must be greater than 0; got -3"),
    (RELIEVED, ["3 mm"], r"torques\[0\] must be a torque"), (RELIEVED, [0], r"torques\[0\] must be greater than 0"),
    (replace(PAIR, M10=0.0), None, r"torques\[0\] must be greater than 0"), ("pair", None, "must be a GearPair or"),
    (replace(RELIEVED, torque=None), None, "torque must be given")])
def test_a_harris_map_without_torques_is_refused(gears, torques, message):
    with pytest.raises(InputError, match=message):
        gc.plot.harris_map(gears, torques, axes())


@pytest.mark.slow
def test_the_datasheet_has_the_variation_and_the_map_where_tooth_pairs_share_the_load():
    sheet, shared, plain = datasheet(RELIEVED), DesignAnswer.of(RELIEVED), DesignAnswer.of(SPRING)
    found = sheet["loaded_error_peak_to_peak"]
    assert (found.value, found.unit) == (pytest.approx(1e6 * peak_to_peak(RELIEVED)), "µm")
    assert datasheet(replace(RELIEVED, torque=None))["loaded_error_peak_to_peak"].reason.startswith("torque must be")
    (first, second), least = (sheet[f"best_{n}"].value for n in ("tip_relief", "loaded_error_peak_to_peak"))
    assert dict(shared.facts)["load sharing"] == (
        f"tooth pairs on their nominal path alone, mesh deflection {found.value:.3g} µm peak to peak; "
        f"at rest least with a relief of {first:.3g} / {second:.3g} µm from these diameters: {least:.3g} µm")
    assert dict(plain.facts)["load sharing"] == "prescribed, one spring"
    unloaded = DesignAnswer.of(replace(DESIGN, torque=None))
    assert dict(unloaded.facts)["load sharing"] == "tooth pairs with corner contact"
    helical = dict(DesignAnswer.of(replace(DESIGN, helix_angle=0.2)).facts)["load sharing"]
    assert helical.startswith("under load, in strips across the width with corner contact, mesh deflection 2.9")
    page = sheet_html([shared])
    assert "Mesh deflection" in page and "12 / 8 µm, parabolic from diameter 75.2 / 111 mm" in page
    assert "Mesh deflection" not in sheet_html([plain])


@pytest.mark.slow
def test_what_is_left_out_does_not_name_a_load_sharing_that_there_is():
    for changes, left_out in (({}, "other meshes"), ({"corner_contact": False}, "contact beyond the path, other"),
                              ({"load_sharing": "prescribed"}, "load sharing, other")):
        design = replace(COMPLETE, **changes)
        speeds = gc.speeds_to_avoid(design, gc.Axis("speed", 3000, 3100, 2), starts=0)
        assert list(DesignAnswer.of(design, speeds).basis)[-1].startswith(f"Left out: {left_out}")
