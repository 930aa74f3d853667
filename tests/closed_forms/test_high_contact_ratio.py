"""Tooth pairs of gears of high contact ratio, three and four at a time: at rest, in limits, and of drawings."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.quantities import datasheet
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.text import from_query, to_query
from gearchaos.flow import ExactFlow
from gearchaos.gears.operation.loaded_error import contact_ratio_under_load, loaded_error, peak_to_peak, two_pairs_from
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.stiffness.iso6336 import METHOD
from gearchaos.model import vary
from gearchaos.model.static import static_contacts, static_deflection
from gearchaos.model.switched import switched_system
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from tests.branches import axes

HIGH = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", rack={"addendum": 1.3, "dedendum": 1.5, "root_radius": 0.25},
    bore="60 mm", torque=300, speed=2000, corner_contact=False, damping_ratio=0.05, transmission_error="none",
    backlash={"value": "0.12 mm", "of": "line of action, total"})
DESIGNS = {
    "50/50": HIGH, "30/45": replace(HIGH, teeth=(30, 45), module="2 mm", bore="20 mm", torque=80),
    "20/30": replace(HIGH, teeth=(20, 30), module="1 mm", face_width="10 mm", bore="8 mm", torque=15),
    "100/100": replace(HIGH, teeth=(100, 100), module="1 mm", torque=80, rack={
        "addendum": 1.6, "dedendum": 1.8, "root_radius": 0.02})}


def advanced(stiffness, w, periods=6, **values):
    model = gc.MeshModel.of(**{"kind": "single", "omega": 0.9, "zeta": 0.05, "q0": 0.3, "eps1": 0.05, **values},
                            stiffness=stiffness)
    return ExactFlow(switched_system(vary(model, {}))).advance(w, periods, points=np.zeros(w.shape[1], int)).w


STATES = np.array([[1.4, 0.5, -1.3], [0.3, 0.9, -0.2]])


@pytest.mark.parametrize("ratio", [1.0, 1.0 + 1e-13, 1.6, 2.0 - 1e-13, 2.0, 2.0 + 1e-13, 2.3, 3.0, 3.7, 4.0])
def test_the_mean_of_the_sum_of_all_pairs_by_iso_is_the_mesh_stiffness(ratio):
    """c′ (0.75 + 0.25/n) of each of n pairs: the sum is c′ (0.75 n + 0.25), its mean c′ (0.75 ε_α + 0.25)."""
    levels, starts = METHOD.pair(SimpleNamespace(geometry=SimpleNamespace(contact_ratio=ratio)))
    assert ratio * (np.diff([*starts, 1.0]) @ levels) == pytest.approx(1, rel=1e-11)
    tau = (np.arange(200) + 0.5) / 200
    n = np.ceil(ratio - tau)  # pairs on the path, far from where one enters or leaves
    found = gc.ToothPairStiffness(levels, starts, ratio).at(tau, 2 * np.pi)
    np.testing.assert_allclose(found, (0.75 * n + 0.25) / (0.75 * ratio + 0.25), rtol=1e-12)


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("method", ["ISO 6336-1", "potential energy"])
def test_pairs_of_drawings_have_the_prescribed_sum(name, method):
    design = replace(DESIGNS[name], stiffness=method)
    ratio, prescribed = design.geometry.contact_ratio, design.mesh_stiffness
    assert 2 < ratio < 3 and design.to_pair().c0 == prescribed.reference
    pairs = design.to_model().stiffness
    mean = ratio * (np.diff([*pairs.starts, 1.0]) @ np.array(pairs.levels))
    assert mean == pytest.approx(1, rel=1e-13 if method == "ISO 6336-1" else 1e-4)
    tau = (np.arange(500) + 0.5) / 500
    if method == "ISO 6336-1":
        np.testing.assert_allclose(pairs.at(tau, 2 * np.pi) * prescribed.reference, prescribed(tau), rtol=1e-12)
        single = design.tooth_stiffness.single_stiffness * design.geometry.common_face_width
        assert sorted({round(level, 9) for level in np.multiply(pairs.levels, prescribed.reference) / single}) == [
            round(0.75 + 0.25 / 3, 9), 0.875]


def test_three_springs_with_gaps_give_way_as_their_closed_form_says():
    """Three pairs with k 0.4 and crowning 0.2 at the phase 0.2 of 2.5: x = 0.08, 0.48, 0.88 with known gaps."""
    pairs = gc.ToothPairStiffness((0.4,), (0.0,), 2.5, crowning=0.2)
    gaps = np.sort([0.2 * (2 * x - 1) ** 2 for x in (0.08, 0.48, 0.88)])
    for force in (0.005, 0.03, 0.2, 3.0):
        found = static_deflection(pairs, force, [0.2])[0] - 1
        expected = min((force / 0.4 + gaps[:n].sum()) / n for n in (1, 2, 3))
        assert found == pytest.approx(expected, rel=1e-13)
        assert static_contacts(pairs, force, np.array([0.2]))[0] == (gaps < expected).sum()
    assert [int(static_contacts(pairs, force, np.array([0.2]))[0]) for force in (0.005, 0.05, 3.0)] == [1, 2, 3]
    assert static_contacts(pairs, 1e3, np.array([0.2, 0.6])).tolist() == [3, 2]  # and as many as are on the path


@pytest.mark.parametrize("ratio", [2.0, 3.0, 4.0])
@pytest.mark.parametrize("back", [0.0, 0.37])
def test_a_whole_contact_ratio_is_one_constant_spring(ratio, back):
    """Where a pair leaves, the next one enters: pieces of no length, also where rounding leaves some of 1e-13."""
    spring = advanced(gc.SteppedStiffness((0.4 * ratio,), (0.0,)), STATES)
    for off in (0.0, -1e-13, 1e-13 * (ratio < 4)):
        pairs = gc.ToothPairStiffness((0.4,), (0.0,), ratio + off, back_phase=back)
        assert np.abs(advanced(pairs, STATES) - spring).max() < 1e-11


@pytest.mark.parametrize(("ratio", "levels"), [(2.6, (1.2, 0.8)), (3.2, (1.6, 1.2)), (1.6, (0.8, 0.4))])
@pytest.mark.parametrize("law", ["always", "contact"])
def test_without_gaps_pairs_are_one_stepped_spring(ratio, levels, law):
    pairs = gc.ToothPairStiffness((0.4,), (0.0,), ratio, back_phase=0.0)
    steps = gc.SteppedStiffness(levels, (0.0, ratio % 1))
    there, other = (advanced(each, STATES, damping_law=law) for each in (pairs, steps))
    assert np.abs(there - other).max() < 1e-12


@pytest.mark.parametrize("ratio", [2.0, 2.3, 3.0, 3.6, 4.0])
def test_a_point_has_the_same_bits_beside_others_of_other_contact_ratios(ratio):
    pairs = gc.ToothPairStiffness((0.4, 0.5), (0.0, 0.3), 1.7, 0.1, 0.2, crowning=0.05)
    model = gc.MeshModel.of(kind="single", omega=0.8, zeta=0.05, q0=0.4, eps1=0.1, stiffness=pairs)
    w, values = np.array([[1.3, 1.3], [0.1, 0.1]]), [ratio, 1.4]
    together = ExactFlow(switched_system(vary(model, {"contact_ratio": values}))).advance(w, 4).w
    alone = ExactFlow(switched_system(vary(model, {"contact_ratio": [ratio]}))).advance(w[:, :1], 4).w
    assert np.array_equal(together[:, :1], alone)


@pytest.mark.parametrize("corner", [False, True])
def test_under_much_torque_all_pairs_of_a_drawing_touch(corner):
    design = replace(HIGH, corner_contact=corner, tip_relief={"amount": "20 um", "start_diameter": "154 mm"})
    ratio = design.geometry.contact_ratio
    reach = 1 + sum(design.tooth_pairs.corner.length) if corner else 1.0
    light, heavy = (contact_ratio_under_load(replace(design, torque=torque)) for torque in (1e-3, 2e4))
    assert heavy == pytest.approx(ratio * reach, abs=1e-3) and light < ratio - 0.2
    positions = np.arange(300) / 300
    assert static_contacts(design.at(torque=2e4).to_model().stiffness, 1e3, positions).max() == 3
    assert two_pairs_from(design) > 1 and two_pairs_from(replace(design, tip_relief=None)) == 0


def test_the_loaded_error_of_exact_teeth_is_that_of_three_and_two_springs():
    single = HIGH.tooth_stiffness.single_stiffness * HIGH.geometry.common_face_width
    force, rest = 300 / (HIGH.geometry.base_diameter[0] / 2), HIGH.geometry.contact_ratio - 2
    found = loaded_error(HIGH, None, np.array([0.5 * rest, 0.99]))
    assert found == pytest.approx([force / (2.5 * single), force / (1.75 * single)], rel=1e-12)
    assert peak_to_peak(HIGH) == pytest.approx(force / single * (1 / 1.75 - 1 / 2.5), rel=1e-12)
    assert quasi_static_ratio(HIGH) == pytest.approx(2.5 / 1.75, rel=1e-12)
    ax = gc.plot.harris_map(HIGH, [100, 300], ax=axes())
    np.testing.assert_allclose(ax.lines[1].get_ydata(), 1e6 * loaded_error(HIGH, 300, ax.lines[1].get_xdata()))


def test_the_datasheet_says_that_two_pairs_touch_under_any_torque():
    sheet = datasheet(HIGH)
    assert sheet["two_pairs_from"].value == 0 and "contact ratios from 2 on" in sheet["two_pairs_from"].formula
    assert sheet["contact_ratio_under_load"].value == pytest.approx(HIGH.geometry.contact_ratio, abs=1e-3)
    assert 0 < sheet["best_tip_relief"].value[0] == sheet["best_tip_relief"].value[1]
    tip, start = 1e3 * HIGH.geometry.tip_diameter[0], sheet["best_tip_relief_start"].value[0]
    base, rest = 1e3 * HIGH.geometry.base_diameter[0], HIGH.geometry.contact_ratio - 2
    along = (np.sqrt(tip**2 - base**2) - np.sqrt(start**2 - base**2)) / 2
    assert along == pytest.approx(rest * 1e3 * HIGH.geometry.base_pitch, abs=0.02)
    short = replace(HIGH, tip_relief={"amount": "5 um", "start_diameter": "157 mm"})
    assert datasheet(short)["best_tip_relief_start"].value == (157.0, 157.0)
    assert "contact of 2 pairs begins at" in dict(DesignAnswer.of(short).facts)["load sharing"] or any(
        datasheet(short)["best_tip_relief"].value)


@pytest.mark.parametrize("corner", [False, True])
def test_a_train_of_the_drawing_moves_as_its_pair(corner):
    backlash = {"value": f"{2.0**-12} m", "of": "line of action, total"}  # with the pieces of the gap of a train
    design = replace(HIGH, corner_contact=corner, backlash=backlash)
    pair = as_model(design.to_pair())
    train = as_model(replace(design, faults=[{"wheel": 1, "tooth": 1, "wear": "1e-15 m"}]))  # a train by a hair
    alone, among = (np.abs(gc.simulate(each, transient=transient, periods=1, samples=samples)["mesh_force"].values)
                    for each, transient, samples in ((pair, 200, 16), (train, 4, 16 * 50)))  # of a turn of the wheels
    assert np.ptp(alone) > 0.05 * alone.mean()
    np.testing.assert_allclose(among.ravel()[:16] / among.mean(), alone / alone.mean(), rtol=1e-6)


@pytest.mark.parametrize("kind", [gc.TwoLevelStiffness, gc.ToothPairStiffness])
def test_the_contact_ratio_has_a_rule_for_each_kind_of_stiffness(kind):
    most = {gc.TwoLevelStiffness: 2, gc.ToothPairStiffness: 4}[kind]
    model = gc.MeshModel.of(kind="single", stiffness=kind())
    for ask in (lambda v: kind(contact_ratio=v), lambda v: model.with_values({"contact_ratio": v}),
                lambda v: vary(model, {"contact_ratio": [1.5, v]})):
        ask(most)
        for wrong in (0.99, most + 1e-9, 7, np.nan):
            with pytest.raises(gc.InputError) as caught:
                ask(wrong)
            assert caught.value.field == "contact_ratio"
            assert np.isnan(wrong) or (f"must lie in [1, {most}]" in str(caught.value) and caught.value.advice)


def test_the_explorer_takes_contact_ratios_of_tooth_pairs_up_to_4():
    view = view_of(gc.MeshModel.of(kind="single", stiffness=gc.ToothPairStiffness())).with_value("contact_ratio", 3.2)
    assert from_query(to_query(view), view).operating_point.stiffness.contact_ratio == 3.2
    for kind, words in ((view.with_stiffness("two-level"), r"\[1, 2\]; got 4"), (view, r"\[1, 4\] in the explorer")):
        with pytest.raises(gc.InputError, match=words):
            kind.with_value("contact_ratio", 4.0 if "2" in words else 4.5)


def test_a_contact_ratio_that_is_varied_across_2_and_3_has_the_motions_of_its_points():
    model = gc.MeshModel.of(kind="single", omega=0.8, zeta=0.05, q0=0.3, stiffness=gc.ToothPairStiffness(
        (0.4,), relief1=0.1, relief2=0.1, corner1=(9.0,), corner2=(9.0,), corner_length1=0.15, corner_length2=0.15))
    along = gc.bifurcation(model, "contact_ratio=1.5:3.5:5", points=0)
    assert along["contact_ratio"].values.tolist() == [1.5, 2.0, 2.5, 3.0, 3.5]
    for ratio in along["contact_ratio"].values.tolist():
        one, own = along.sel(contact_ratio=ratio), gc.regime(model.with_values({"contact_ratio": ratio}))
        assert int(one["period"]) == own.period == 1
        assert float(one["dynamic_factor"]) == pytest.approx(own.dynamic_factor, rel=1e-9)


def test_a_train_with_more_contacts_than_can_be_told_apart_is_refused():
    design = replace(HIGH, corner_contact=True)
    contacts = len(as_model(design.to_pair()).stiffness.contacts(design.to_model().stiffness.numbers(), 1).sides)
    most = 62 // contacts

    def train(meshes):
        bodies = [{"name": f"b{i}", "inertia": 1e-3, "torque": 0.0} for i in range(meshes + 1)]
        bodies[0]["torque"] = 100.0
        bodies[-1]["torque"] = -100.0
        return gc.Train(speed=500, bodies=bodies, meshes=[
            {"between": (f"b{i}", f"b{i + 1}"), "design": design} for i in range(meshes)])

    assert contacts == 8 and len(switched_system(vary(as_model(train(most)), {})).contacts.sides) == most * contacts
    with pytest.raises(gc.InputError, match=r"meshes must have at most 62 tooth pairs .*; got 64\. b0/b1 alone has 8"):
        gc.simulate(train(most + 1), periods=1)
