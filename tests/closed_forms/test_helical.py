"""Helical gears in strips at rest under load, against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.gears.mesh import helical
from gearchaos.gears.mesh.helical import Strips
from gearchaos.gears.mesh.tooth_pairs import ToothPairs
from gearchaos.gears.operation.loaded_error import contact_ratio_under_load, loaded_error, peak_to_peak
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.operation.separation import separation_margin
from gearchaos.gears.stiffness.iso6336 import relative_length
from gearchaos.model import vary
from gearchaos.plot._contact_pattern import line_loads
from gearchaos.studyfile import load_design
from tests import EXAMPLES
from tests.branches import axes

HELICAL = gc.GearDesign(
    teeth=(27, 35), module="3 mm", helix_angle="20 deg", face_width="25 mm", torque="200 N*m", speed=3000, bore="30 mm",
    backlash={"value": "0.12 mm", "of": "line of action, total"}, damping_ratio=0.05, transmission_error="none")
SPUR = load_design(EXAMPLES / "spur_50_50.toml").at(torque=300)
PHASES = np.linspace(0, 1, 60, endpoint=False) + 0.003


def plain(ratio=1.6, **given):
    """Strips of pairs with one stiffness on their path alone: 1000 N/µm in all where one pair touches."""
    pairs = ToothPairs(stiffness=1e9, contact_ratio=ratio)
    return Strips(**{"pairs": pairs, "reference": 1e9, "overlap": 0.7, "face_width": 0.02, "force": 5e3, **given})


@pytest.mark.parametrize(("ratio", "overlap"), [(1.6, 0.7), (1.2, 1.3), (2.4, 0.4), (1.6, 5.3)])
def test_without_gaps_the_stiffness_is_that_of_the_contact_lines(ratio, overlap):
    at = plain(ratio, overlap=overlap).at(PHASES)
    lines = ratio * relative_length(ratio, overlap)(PHASES)
    np.testing.assert_allclose(at.pairs, lines, atol=2.1 / helical.STRIPS)  # an end of a line is within a strip


@pytest.mark.parametrize("overlap", [1.0, 3.0, 12.0, 49.0])
def test_where_all_of_the_mesh_cycle_is_on_the_width_nothing_varies(overlap):
    """A fixed number of strips would step together at some overlap ratio: 49 of them at 49, as in a spur pair."""
    strips = plain(overlap=overlap)
    assert np.ptp(strips.cycle.pairs) < 2.1 / len(strips.across)
    assert max(strips.stiffness.waveform.amplitudes) < 2e-3 and max(strips.error.amplitudes) < 2e-3 * 5e3 / 1.6e9


def test_few_strips_that_touch_are_said_to_be_few():
    assert not plain(slope=1e-5).stiffness.notes
    (note,) = [text for text in plain(1.0, overlap=0.0, slope=5e-4).stiffness.notes if "strips" in text]
    assert "of 49 strips across the width touch" in note


@pytest.mark.parametrize(("ratio", "overlap"), [(1.6, 0.7), (1.2, 1.3), (2.4, 0.4)])
def test_without_gaps_the_deflection_is_the_force_over_the_stiffness(ratio, overlap):
    at = plain(ratio, overlap=overlap).at(PHASES)
    np.testing.assert_allclose(at.stiffness, 1e9 * at.pairs, rtol=1e-12)
    np.testing.assert_allclose(at.deflection, 5e3 / at.stiffness, rtol=1e-12)


def test_the_strips_carry_the_force():
    strips = HELICAL.strips
    carried = strips.cycle.line_load.sum(axis=(1, 2)) * strips.face_width / len(strips.across)
    np.testing.assert_allclose(carried, strips.force, rtol=1e-12)


@pytest.mark.parametrize(("crowning", "slope"), [(4e-5, 0.0), (0.0, 3e-5), (0.0, -3e-5)])
def test_a_lead_that_leaves_ends_open_touches_where_a_parabola_or_a_line_is_within_the_deflection(crowning, slope):
    """One pair at each instant: F = k (δ u − ∫ gap) over the share u of the width that touches."""
    at = plain(1.0, overlap=0.0, crowning=crowning, slope=slope).at(PHASES)
    if crowning:  # gap C (2y − 1)², u = √(δ/C), F = (2/3) k δ u
        deflection = (1.5 * 5e3 / 1e9 * math.sqrt(crowning)) ** (2 / 3)
        share = math.sqrt(deflection / crowning)
    else:  # gap |s| y from either end, u = δ/|s|, F = k δ²/(2 |s|)
        deflection = math.sqrt(2 * abs(slope) * 5e3 / 1e9)
        share = deflection / abs(slope)
    np.testing.assert_allclose(at.deflection, deflection, rtol=1e-3)
    np.testing.assert_allclose(at.width, share, atol=1.01 / helical.STRIPS)
    closed = at.line_load[0].any(axis=1)
    assert not closed.all() and closed[0 if slope > 0 else -1 if slope < 0 else len(closed) // 2]


def test_a_relief_acts_in_the_strips_and_no_second_time_without_load():
    given = replace(HELICAL, quality={"standard": "ISO 1328-1:1995", "grade": 6}, transmission_error="from quality")
    relieved = replace(given, tip_relief={"amount": "15 um", "start_diameter": ["88 mm", "113.5 mm"]})
    assert relieved.strips.pairs.relief.amount == pytest.approx((15e-6, 15e-6)) and given.strips.pairs.relief is None
    assert relieved.error_harmonics == given.error_harmonics and relieved.mesh_error != given.mesh_error
    alone = replace(relieved, load_sharing="prescribed")
    assert alone.error_harmonics != given.error_harmonics and alone.mesh_error == alone.error_harmonics


def test_the_separation_torque_has_the_error_under_each_load():
    """Exact teeth have no error without load, so that nothing would separate them."""
    speeds, torques = np.linspace(1000.0, 12000.0, 40), np.array([50.0, 200.0])
    margin = separation_margin(HELICAL, speeds, torques)
    assert np.all(margin < torques[:, None]) and not np.allclose(*(torques[:, None] - margin), rtol=0.05)
    prescribed = separation_margin(replace(HELICAL, load_sharing="prescribed"), speeds, torques)
    np.testing.assert_allclose(prescribed, np.broadcast_to(torques[:, None], prescribed.shape), rtol=1e-12)


def test_the_contact_pattern_has_the_load_of_the_pair_that_is_there():
    """At the share x of its path a pair of the strip y is at the phase ε_α x + ε_β y, and bears κ(x) δ there."""
    design = replace(HELICAL, corner_contact=False)
    strips, (found, beyond) = design.strips, line_loads(design)
    x = -beyond + (1 + 2 * beyond) * (np.arange(found.shape[1]) + 0.5) / found.shape[1]
    for n in (0, 20, len(found) - 1):
        phase = design.geometry.contact_ratio * x + design.geometry.overlap_ratio * strips.across[n]
        level = np.searchsorted(strips.pairs.starts, x, side="right") - 1
        borne = np.array(strips.pairs.stiffness)[level.clip(0)] * strips.at(phase).deflection / strips.face_width
        expected = np.where((x > 0) & (x < 1), borne, 0.0)
        near = np.abs(found[n] - expected) < 0.03 * expected.max()  # phases are those of the nearest of 512
        assert near.mean() > 0.98 and not found[n][(x < -0.005) | (x > 1.005)].any()
    ax = gc.plot.contact_pattern(HELICAL, axes())
    (mesh,) = ax.collections
    assert mesh.get_array().shape == line_loads(HELICAL)[0].shape and ax.get_ylabel() == "face width [mm]"
    with pytest.raises(InputError, match="must be a helical pair under a torque"):
        gc.plot.contact_pattern(SPUR)


def test_a_helix_of_nothing_is_a_spur_pair():
    slight = replace(SPUR, helix_angle=1e-8, centre_distance=None)
    np.testing.assert_allclose(loaded_error(slight, None, PHASES), loaded_error(SPUR, None, PHASES), rtol=1e-6)
    assert contact_ratio_under_load(slight) == pytest.approx(contact_ratio_under_load(SPUR), abs=3e-3)


def test_ten_times_as_many_strips_are_the_same(monkeypatch):
    given = replace(HELICAL, lead_crowning="8 um", lead_slope="5 um")
    few = given.strips.at(PHASES)
    monkeypatch.setattr(helical, "STRIPS", 480)
    many = given.strips.at(PHASES)
    np.testing.assert_allclose(few.deflection, many.deflection, rtol=3e-3)
    assert np.ptp(few.deflection) == pytest.approx(np.ptp(many.deflection), rel=0.05)


def test_the_spring_of_the_model_deflects_as_the_strips_do():
    """κ(τ)(δ − e(τ)) = F, but for the harmonics left out."""
    strips, stiffness, error = HELICAL.strips, HELICAL.mesh_stiffness, HELICAL.mesh_error
    tau = np.arange(512) / 512
    deflection = strips.force / stiffness(tau) + error.at(tau)
    exact = strips.cycle.deflection
    left_out = error.residual_peak + 4 * stiffness.truncation * exact.max()
    assert np.abs((deflection - deflection.mean()) - (exact - exact.mean())).max() < left_out
    assert np.ptp(deflection) == pytest.approx(peak_to_peak(HELICAL), rel=0.2)
    pair = HELICAL.to_pair()
    assert pair.c0 == stiffness.reference and pair.error_amplitudes == error.amplitudes and pair.tooth_pairs is None


def test_the_curves_are_those_of_each_torque():
    batch = vary(as_model(HELICAL), {"torque": np.array([50.0, 200.0, 500.0])})
    for name in ("c1", "c3", "eps1", "alpha2"):
        own = [HELICAL.at(torque=t).to_model().parameters()[name] for t in (50.0, 200.0, 500.0)]
        np.testing.assert_allclose(batch.values[name], own, rtol=1e-12)
        assert len(set(own)) == 3


def test_prescribed_is_the_stiffness_of_the_nominal_path():
    prescribed = replace(HELICAL, load_sharing="prescribed")
    assert not prescribed.under_load and prescribed.mesh_error.amplitudes == ()
    nominal = prescribed.tooth_stiffness.mesh_stiffness * 0.025
    assert prescribed.mesh_stiffness.reference == HELICAL.nominal_stiffness.reference
    assert HELICAL.nominal_stiffness.reference == pytest.approx(nominal, rel=1e-12)
    alone = replace(HELICAL, corner_contact=False)
    assert contact_ratio_under_load(alone) == pytest.approx(HELICAL.geometry.contact_ratio, abs=1e-2)
    assert contact_ratio_under_load(HELICAL) > contact_ratio_under_load(alone)
    assert replace(HELICAL, torque=None).mesh_stiffness.waveform == replace(
        prescribed, torque=None).mesh_stiffness.waveform


@pytest.mark.parametrize(("design", "changes", "field", "words"), [
    (SPUR, {"load_sharing": "under load"}, "load_sharing", "Strips across the width are for helical teeth"),
    (HELICAL, {"load_sharing": "tooth pairs"}, "load_sharing", "must be under load, prescribed or left out"),
    (SPUR, {"lead_crowning": "5 um"}, "lead_crowning", "It acts on helical pairs"),
    (HELICAL, {"lead_slope": "5 um", "load_sharing": "prescribed"}, "lead_slope", "It acts on helical pairs"),
    (HELICAL, {"lead_slope": "-1 mm"}, "lead_slope", "at most a fifth of a module"),
    (HELICAL, {"lead_crowning": "-1 um"}, "lead_crowning", "must not be negative"),
    (HELICAL, {"corner_contact": True, "load_sharing": "prescribed"}, "corner_contact", "leave load_sharing out"),
])
def test_bad_input_names_the_field_and_what_to_do(design, changes, field, words):
    with pytest.raises(InputError) as refusal:
        replace(design, **changes)
    assert refusal.value.field == field and words in str(refusal.value)


def test_what_does_not_follow_a_varied_torque_is_warned_of():
    turning = [text for text in replace(HELICAL, eccentricity="5 um").warnings if "stay those at the torque" in text]
    assert len(turning) == 1 and not [text for text in HELICAL.warnings if "stay those at the torque" in text]


def test_a_datasheet_says_why_a_quantity_of_strips_is_missing():
    for design, words in ((SPUR, "Spur gears are not cut"), (replace(HELICAL, torque=None), "need a torque"),
                          (replace(HELICAL, load_sharing="prescribed"), "The mesh is one spring")):
        assert datasheet(design)["width_in_contact"].reason.startswith((words, f"Strips across the width {words}"))
    prescribed = datasheet(replace(HELICAL, load_sharing="prescribed"))
    assert "one spring. Leave load_sharing out" in prescribed["contact_ratio_under_load"].reason
    assert "does not share the load" in prescribed["best_tip_relief"].reason
