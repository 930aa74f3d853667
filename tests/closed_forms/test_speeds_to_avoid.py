"""Which speeds to avoid: edges in closed form and by fine scans, motions that one scan misses, ranges by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from benchmarks.speeds_to_avoid import trial
from gearchaos.dynamics import Label
from gearchaos.errors import InputError
from gearchaos.gears.io.units import RPM
from gearchaos.studies.operation.beyond_the_teeth import BEYOND, TeethLimits
from gearchaos.studies.operation.factor_context import peak_root_stress
from gearchaos.studies.operation.followed_motions import FollowedMotions, Motion, speeds_between
from gearchaos.studies.operation.severities import CRITERION, FORCE_CRITERION
from gearchaos.studies.speeds import speeds_to_avoid as inner
from gearchaos.studies.speeds.criteria import Criteria
from gearchaos.studies.speeds.speed_search import AtTorque
from gearchaos.studies.speeds.speed_windows import MOST_PEAKS, Peak
from tests.closed_forms.linear_gears import SPUR

DESIGN = gc.GearDesign(
    teeth=(23, 81), module="2.5 mm", face_width="22 mm", centre_distance="131.5 mm", profile_shift=(0.31255, 0.31255),
    bore="15 mm", damping_ratio=0.05, transmission_error="from quality", torque="180 N*m", load_sharing="prescribed",
    quality={"standard": "ISO 1328-1:1995", "grade": 7},
    backlash={"value": "0.15 mm", "of": "line of action, total"})

NARROW = replace(DESIGN, profile_shift=(0.35, 0.2751), bore="20 mm", torque=60.0)
"""The same pair with a narrow range to avoid near 2500 rpm."""

EXACT = replace(SPUR, transmission_error="none", torque=400.0)
BRAKED = replace(DESIGN, damping_law="always")
"""Damping across the gap leads to long transients."""


def motions_of(window):
    return tuple(each.motion for each in window.reached)


def separated(dataset):
    return dataset.speed.values[dataset.contact.values > 0]


def test_motions_that_no_start_from_rest_reaches_are_found():
    assert len(separated(gc.dynamic_factor(DESIGN, "6350:7300:20"))) == 0
    there = gc.attractors(DESIGN.at(speed="7000 rpm"), 256)
    (worst,) = np.flatnonzero(there.attractor_contact.values > 0)
    assert there.attractor_fraction.values[worst] > 0.45
    for options, name, words in (({}, "load change", "load change"), ({"wide": True}, "other", "other initial states")):
        found = gc.speeds_to_avoid(DESIGN, "6350:7300:20", **options)
        (window,) = found.windows
        assert motions_of(window) == (words,) and window.reached_by == [words] and not window.operation
        assert (window.share_of_load_changes is None) == bool(options)
        assert window.contact == "loss of contact" and window.start < 7000 < window.stop and found.coarse == ""
        factor = float(found.dataset.dynamic_factor.sel(motion=name).interp(speed=7000))
        assert factor == pytest.approx(float(there.attractor_dynamic_factor[worst]), rel=0.01)
        states = "random states" if options else "states after a reversal of the load"
        assert found.tried.startswith(f"from rest, sweeps at {found.dataset.sizes['speed']} speeds, ")
        assert f" {states} at " in found.tried
    assert gc.speeds_to_avoid(DESIGN, "6350:7300:20", load_change=None).windows == ()
    assert [part.start for part in found.usable_in_operation] == [6350] and found.usable == []


@pytest.mark.slow
def test_a_window_between_the_given_speeds_is_found_and_its_edges_located():
    assert len(separated(gc.dynamic_factor(NARROW, "2000:3000:8"))) == 0
    found = gc.speeds_to_avoid(NARROW, "2000:3000:8")
    (window,) = found.windows
    fine = separated(gc.dynamic_factor(NARROW, "2400:2600:401"))
    assert window.start <= fine[0] <= window.start + 0.5 and window.stop - 0.5 <= fine[-1] <= window.stop
    followed = gc.branch(NARROW.at(speed=(window.start + window.stop) / 2), "speed=2400:2600")
    grazes = followed.event_value.values[followed.event_kind.values == "graze"]
    assert [window.start, window.stop] == pytest.approx(grazes, rel=1e-10)
    assert (window.begins_with, window.ends_with) == ("graze", "graze")
    assert (window.start_resolution, window.stop_resolution, window.depends_on_history) == (0, 0, False)
    assert found.coarse == "" and found.main_resonance == pytest.approx(17900, rel=0.02)


@pytest.fixture(scope="module")
def linear(tmp_path_factory):
    """Constant stiffness and one harmonic of the error: in contact a linear oscillator."""
    folder = tmp_path_factory.mktemp("linear")
    table, orders = folder / "k.csv", folder / "te.csv"
    table.write_text("fraction,level [N/um]\n0,400\n0.5,400\n")
    orders.write_text("order,peak [um],phase [deg]\n1,2,0\n")
    return replace(SPUR, stiffness={"table": str(table)}, transmission_error={"orders": str(orders)})


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The mesh stiffness of the table is constant")
def test_the_upper_edge_is_where_the_linear_oscillator_loses_contact(linear):
    """|2 µm s²/(1 − s² + 2iζs)| = F/c0 has two roots s = ω/ω0; above the upper one no other motion exists, since the
    resonance of separating teeth bends to lower speeds."""
    pair = linear.at(speed=100.0).to_pair()
    deflection, error, zeta = 300 / pair.R1 / 4e8, 2e-6, 0.05
    # (1 - u)² + 4ζ²u = (error/deflection)² u² for u = s²
    roots = np.sort(np.roots([1 - (error / deflection) ** 2, 4 * zeta**2 - 2, 1]).real)
    lower, upper = np.sqrt(roots) * pair.omega0 / 50 / RPM
    found = gc.speeds_to_avoid(linear, f"{0.5 * lower}:{1.3 * upper}:12")
    (window,) = found.windows
    assert (window.stop, window.ends_with) == (pytest.approx(upper, rel=1e-10), "graze")
    assert window.start < 0.99 * lower  # the falling speed stays on the bent branch, to its fold
    assert (window.begins_with, window.depends_on_history) == ("fold", True)
    jumps = {jump.direction: (jump.speed, jump.event) for jump in found.jumps}
    assert jumps["down"] == (pytest.approx(window.start, rel=1e-9), "fold")
    assert motions_of(window) == ("from rest", "speed rising", "speed falling")
    at = found.dataset.sel(speed=slice(window.start, lower))
    assert (at.contact.sel(motion="rising") == 0).all() and (at.contact.sel(motion="falling") == 1).any()
    fine = separated(gc.dynamic_factor(linear, f"{0.5 * lower}:{1.3 * upper}:300", mode="down"))
    assert window.start <= fine[0] and found.quasi_static_ratio == 1


@pytest.mark.filterwarnings("ignore:The mesh stiffness of the table is constant")
def test_the_first_speeds_are_as_dense_as_the_damping_asks_for(linear):
    speeds = gc.speeds_to_avoid(linear, "2000:3000:2", starts=0, spacing=1).dataset.speed.values
    steps = np.diff(speeds) / speeds[:-1]  # over the bandwidth 2ζ = 0.1 at least four of them
    assert steps.max() <= 0.025 and steps.min() > 0.01


@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")  # of the low damping
def test_what_is_not_known_so_well_is_said(linear, monkeypatch):
    weak = gc.speeds_to_avoid(replace(linear, damping_ratio=0.005), "400:410:2", starts=0)
    assert weak.coarse == "at a damping ratio of 0.005 a resonance may pass between the first speeds"
    for module in ("operation.followed_motions", "speeds.speeds_to_avoid"):
        monkeypatch.setattr(f"gearchaos.studies.{module}.MOST_SPEEDS", 8)
    found = gc.speeds_to_avoid(linear, "4600:5200:2", starts=0, spacing=1)
    assert found.coarse == "the search ended at 8 speeds"


def test_speeds_without_separation_are_none_and_say_what_was_tried():
    found = gc.speeds_to_avoid(EXACT, "200:300:3", starts=8)
    assert found.windows == () and found.coarse == "" and "8 states after a reversal of the load" in found.tried
    assert found.largest.start == 200 and found.largest.stop == 300
    assert "state" not in gc.speeds_to_avoid(EXACT, "200:300:3", starts=0, knocks=False).tried


@pytest.mark.slow
def test_only_what_exceeds_the_quasi_static_ratio_counts():
    """At a few turns a minute it is the dynamic factor."""
    found = gc.speeds_to_avoid(EXACT, "20:50:2", factor=1.2)
    assert found.quasi_static_ratio == pytest.approx(1.75, rel=1e-12) and found.windows == ()
    assert found.dataset.dynamic_factor.sel(motion="rest").values == pytest.approx(1.75, rel=1e-3)
    assert float(gc.dynamic_factor(EXACT, "20:50:2").quasi_static_ratio) == found.quasi_static_ratio
    found = gc.speeds_to_avoid(EXACT, "200:300:3", factor=0.1)
    (window,) = found.windows
    assert (window.criterion, window.contact) == (FORCE_CRITERION, "permanent contact")
    assert window.from_scan_start and window.to_scan_end
    assert found.criterion == "the teeth separate, or the dynamic factor over the quasi-static ratio exceeds 0.1"


@pytest.mark.slow
def test_the_result_is_the_same_with_any_number_of_threads():
    one, two = (gc.speeds_to_avoid(NARROW, "2300:2720:4", threads=n) for n in (1, 2))
    assert one.dataset.identical(two.dataset) and one.windows == two.windows


@pytest.mark.slow
@pytest.mark.parametrize(("speeds", "follows"), [("5700:9000:12", False), (
    gc.Axis("speed", 5000 + 229 * 7000 / 399, 5000 + 292 * 7000 / 399, 2), True)])
def test_the_motion_from_rest_is_that_of_a_map(speeds, follows):
    """Chaos that ends after a long time is no motion of its own."""
    mapped = gc.operating_map(BRAKED, speeds, "60:60:1").isel(torque=0)
    found = gc.speeds_to_avoid(BRAKED, speeds, "60 N*m", starts=0).dataset.sel(motion="rest", speed=mapped.speed)
    for name in ("label", "period", "contact"):
        assert np.array_equal(found[name], mapped[name])
    periodic = mapped.period.values > 0
    assert np.array_equal(found.dynamic_factor.values[periodic], mapped.dynamic_factor.values[periodic])
    if follows:
        assert periodic.all() and (mapped.periods_spent > 2600).all()
    else:
        assert 0 < periodic.sum() < len(periodic)  # chaotic ones too


def test_a_pair_on_elastic_supports_has_speeds_to_avoid_too():
    pair = replace(SPUR, supports={"stiffness": ("200 N/um", "300 N/um"), "damping_ratio": 0.05}, mass="3 kg",
                   damping_law="always")
    found = gc.speeds_to_avoid(pair, "1900:2200:4", starts=4)
    (window,) = found.windows
    assert window.to_scan_end and 2000 < window.start < 2100


def test_the_document_is_json():
    found = gc.speeds_to_avoid(NARROW, "2400:2600:3", starts=0)
    document = json.loads(json.dumps(found.document()))
    assert document["quasi_static_ratio"] == pytest.approx(1.75) and document["tried"] == found.tried
    assert [each["motion"] for each in document["ranges"][0]["reached"]] == [
        "from rest", "speed rising", "speed falling"]
    assert document["computed"]["count"] == len(document["along_speed"]["speed"]) == found.dataset.sizes["speed"]
    assert document["along_speed"]["motions"]["from rest"] == document["along_speed"]["dynamic_factor"]


@pytest.mark.parametrize(("options", "message"), [
    ({"factor": 0}, "factor must be greater than 0"), ({"starts": -1}, "starts must be"),
    ({"starts": 10**9}, "speeds times starts must"), ({"starts": 0, "wide": True}, "starts must be at least 1"),
    ({"starts": 0, "load_change": 0.5}, "starts must be at least 1"),
    ({"separation": False}, "factor must be given with separation=False"), ({"seed": 0.5}, "seed must be"),
    ({"speed": "500"}, "speed must read start:stop or start:stop:count"),
    ({"speed": "500:500:1"}, "speed must be a range of speeds"), ({"torque": 0}, "torque must be greater than 0"),
    ({"design": 3}, "design must be a GearDesign"), ({"settings": 3}, "settings must be a Classification")])
def test_bad_input_is_refused(options, message):
    with pytest.raises(InputError) as error:
        gc.speeds_to_avoid(**{"design": SPUR, "speed": "1000:2000:2", **options})
    assert str(error.value).startswith(message)


def motion(contact: int, factor: float, **values) -> Motion:
    label = values.get("label", Label.DIVERGED if contact == 3 else Label.PERIODIC)
    return Motion(int(label), 1, contact, factor, values.get("compression", 0.5), (factor, 0.0), np.zeros(2))


def made_up(*motions: list[Motion]) -> FollowedMotions:
    """Motions at the speeds 100, 200, ... rpm, each of which becomes the one at the same place of the next list, or the
    first one."""
    found = FollowedMotions.__new__(FollowedMotions)
    found.torque = found.model = None
    found.drawn = {}
    found.speeds = [100.0 * n for n in range(1, len(motions) + 1)]
    found.at = dict(zip(found.speeds, motions, strict=True))
    for here, there in [*zip(found.speeds, found.speeds[1:], strict=False),
                        *zip(found.speeds[1:], found.speeds, strict=False)]:
        for i, each in enumerate(found.at[here]):
            each.leads_to[there] = (found.at[there] + [found.at[there][0]] * 9)[i]
    return found


def criterion(each: Motion) -> int:
    return 2 if each.contact > 0 else 1 if each.dynamic_factor > 5 else 0


def windows(*motions: list[Motion], found: FollowedMotions | None = None):
    at = AtTorque(Criteria(factor=5), found or made_up(*motions), 1.0, TeethLimits())
    at.edges = [edge.found for edge in at.brackets()]  # not located
    return inner._windows(at, inner._dataset(at))


def test_ranges_are_runs_of_speeds_with_any_motion_to_avoid():
    rest = [0, 1, 2, 1, 0, 0, 0, 3], [9.0, 2.0, 4.0, 3.0, 4.0, 1.0, 1.5, np.nan]
    first, middle, after, last = windows(*(
        [motion(c, f), *([motion(1, 4.5)] if i == 4 else [])] for i, (c, f) in enumerate(zip(*rest, strict=True))))
    assert (first.start, first.stop, first.criterion, first.from_scan_start) == (100, 200, FORCE_CRITERION, True)
    assert first.stop_resolution == 0  # of the next range, which may begin before
    assert (middle.start, middle.stop, middle.criterion, middle.operation) == (200, 400, CRITERION, True)
    assert (middle.start_resolution, middle.stop_resolution) == (100, 100)
    assert (middle.dynamic_factor, middle.speed_of_largest, middle.contact) == (4.0, 300, "both flanks")
    assert motions_of(middle) == ("from rest", "speed rising", "speed falling")
    assert middle.reached_by == ["rest", "rising speed", "falling speed"]
    assert (after.start, after.stop, after.operation) == (400, 500, False)  # a load change alone leads there
    assert (after.start_resolution, after.stop_resolution, after.dynamic_factor) == (0, 100, 4.5)
    assert [(each.motion, each.share, each.dynamic_factor) for each in after.reached] == [("load change", 1.0, 4.5)]
    assert (middle.words, first.words) == ("100 to 500 rpm", "100 to 200 rpm")  # as far as they may reach
    assert (last.start, last.stop, last.to_scan_end, last.stop_resolution) == (800, 800, True, 0)
    assert last.contact == BEYOND == last.severity and last.beyond_the_teeth
    assert np.isnan(last.dynamic_factor) and np.isnan(last.speed_of_largest)


def test_teeth_that_do_not_touch_at_all_are_no_motion_without_bound():
    (floating,) = windows([motion(0, 1.0)], [motion(3, 0.0, label=Label.CHAOTIC)], [motion(0, 1.0)])
    assert floating.contact == "no contact" and floating.reached[0].dynamic_factor == 0
    (both,) = windows([motion(2, 7.0), motion(3, np.nan)], [motion(2, 8.0)])
    assert both.contact == "both flanks" and both.dynamic_factor == 8  # the largest one of those that teeth bear
    assert windows([motion(3, np.nan), motion(2, 7.0)], [motion(2, 8.0)])[0].beyond_the_teeth


def test_what_teeth_cannot_bear_has_no_factor_and_is_not_the_worst():
    limits = TeethLimits(deflection=4.0, factor=6.0)
    assert [limits.exceeded(*each) for each in ((6.0, 4.0), (6.1, 1.0), (1.0, 4.1), (np.nan, np.nan))] == [
        False, True, True, True]
    stronger = replace(SPUR, material={"E": "206 GPa", "poisson": 0.3, "density": 7830, "root_strength": "300 N/mm^2"})
    stress = max(peak_root_stress(SPUR, 300.0, 1.0))
    for design, strength in ((SPUR, 1500), (stronger, 300)):
        found = TeethLimits.of(design.at(speed=1000), 300.0)
        assert found.factor == pytest.approx(strength / stress) and f"{strength} N/mm²" in found.words
        assert ("assumed" in found.words) is (design is SPUR)
        assert found.deflection == pytest.approx(0.75 / 0.06)  # a quarter of the module over half the backlash
    at = AtTorque(Criteria(), made_up([motion(1, 7.0)], [motion(1, 5.0)]), 1.0, limits)
    (window,) = inner._windows(at, inner._dataset(at))
    assert (window.dynamic_factor, window.speed_of_largest, window.beyond_the_teeth) == (5.0, 200.0, True)
    assert window.severity == "contact lost, hits" and np.isnan(window.reached[0].dynamic_factor)
    at = AtTorque(Criteria(), made_up([motion(0, 7.0)], [motion(0, 5.0)]), 1.0, limits)  # in contact, overloaded
    at.edges = [edge.found for edge in at.brackets()]
    (window,) = inner._windows(at, inner._dataset(at))
    assert (window.start, window.operation, window.severity) == (100.0, True, "beyond the teeth") and window.stop < 200
    for deflection, rank in ((3.9, 0), (4.1, 1)):
        assert at.criterion(replace(motion(0, 5.0), deflection=deflection)) == rank
    at = AtTorque(Criteria(), made_up([motion(1, 5.0), motion(1, 7.0)]), 1.0, limits)  # after a load change
    (window,) = inner._windows(at, inner._dataset(at))
    assert (window.operation, window.dynamic_factor, window.beyond_the_teeth) == (True, 5.0, True)


@pytest.mark.slow
def test_overloaded_teeth_in_contact_have_the_edges_of_a_limit_of_their_root_stress():
    shared = replace(SPUR, transmission_error="from quality (typical)", load_sharing="tooth pairs")
    steel = {"E": "206 GPa", "poisson": 0.3, "density": 7830}
    weak = replace(shared, material={**steel, "root_strength": "320 N/mm^2"})
    (one,), (other,) = (gc.speeds_to_avoid(design, "1150:1250:4", "300 N*m", load_change=None, **limit).windows
                        for design, limit in ((weak, {}), (shared, {"root_stress": 320})))
    assert one.severity == "beyond the teeth" and other.severity == FORCE_CRITERION
    assert one.reach == pytest.approx(other.reach, rel=1e-9) and one.start_resolution == one.stop_resolution == 0


def test_a_range_of_operation_has_beside_its_factor_a_larger_one_after_a_load_change():
    def largest(*motions):
        (window,) = windows(*motions)
        return window.operation, window.dynamic_factor, window.largest_after_load_change

    assert largest([motion(1, 2.0), motion(2, 9.0)]) == (True, 2.0, Peak(100.0, 9.0))
    assert largest([motion(1, 2.0), motion(1, 1.5)]) == (True, 2.0, None)
    assert largest([motion(1, 2.0)], [motion(0, 4.0)]) == (True, 2.0, None)  # outside the range
    assert largest([calm(), motion(1, 3.0)]) == (False, 3.0, None)
    assert largest([motion(0, 4.0), motion(1, 3.0)]) == (False, 3.0, None)  # the larger one keeps contact


@pytest.mark.parametrize(("factor", "limit", "severity"), [
    (1.9, {}, "contact lost, small"), (2.1, {}, "contact lost, hits"), (2.9, {"factor": 3}, "contact lost, small"),
    (2.9, {"root_stress": 290.0}, "contact lost, small"), (3.0, {"root_stress": 290.0}, "contact lost, hits")])
def test_a_force_above_the_limit_hits(factor, limit, severity):
    at = AtTorque(Criteria(**limit), made_up([motion(1, factor)]), 1.0, TeethLimits(), root=100.0)
    assert inner._windows(at, inner._dataset(at))[0].severity == severity


def test_only_the_motions_that_separate_are_named():
    (window,) = windows([calm()], [calm(), motion(1, 2.0)], [calm()])
    assert (window.start, window.stop, motions_of(window)) == (200, 200, ("load change",))
    (window,) = windows([motion(0, 6.0), motion(1, 2.0)])  # what operation meets comes first
    assert (window.criterion, window.operation) == (FORCE_CRITERION, True)
    assert motions_of(window)[::3] == ("from rest", "load change")
    falling = made_up([calm()], [calm(), motion(1, 2.0)], [motion(1, 3.0)])
    falling.at[300.0][0].leads_to[200.0] = falling.at[200.0][1]
    (window,) = windows(found=falling)
    assert motions_of(window) == ("from rest", "speed rising", "speed falling") and window.history == (200, 300)
    named = falling.named()
    assert [[m and m.contact for m in named[name]] for name in ("falling", "rising", "other")] == [
        [0, 1, 1], [0, 0, 1], [None] * 3]
    (worst,) = made_up([calm(), motion(0, 9.0), motion(1, 2.0), motion(1, 3.0)]).named()["other"]
    assert (worst.contact, worst.dynamic_factor) == (1, 3.0)


def test_the_history_decides_up_to_the_speeds_from_which_on_every_motion_separates():
    def row(*first):  # apart or either, of which the second is met with falling speed from where it is alone
        found = made_up(*([calm()] if each == "free" else [motion(1, 2.0)] if each == "apart" else
                          [motion(1, 2.0), calm()] for each in first))
        for here, there in zip(found.speeds[::-1], found.speeds[-2::-1], strict=False):
            for each in found.at[here]:  # what keeps contact goes on where it can
                each.leads_to[there] = min(found.at[there], key=lambda m: abs(m.contact - each.contact))
        return windows(found=found)

    (window,) = row("free", "apart", "apart", "either", "either", "free")
    assert (window.start, window.stop, window.history) == (200, 500, (300, 500))
    assert [window.history for window in row("free", "apart", "free")] == [None]
    (window,) = windows([motion(1, 2.0), calm()], [motion(1, 2.0), calm()])  # operation never meets the other one
    assert window.history is None


def test_operation_meets_what_starts_elsewhere_and_comes_slowly():
    """Neither rest there nor a sweep from the ends, but a start in the middle leads to the motion that separates."""
    found = made_up([calm()], [motion(1, 2.0), calm()], [calm(), motion(1, 3.0)], [calm()])
    found.at[100.0][0].leads_to[200.0] = found.at[200.0][1]
    found.at[200.0][1].leads_to[300.0] = found.at[300.0][0]
    found.at[300.0][0].leads_to[200.0] = found.at[200.0][1]
    found.at[200.0][0].leads_to[300.0] = found.at[300.0][1]
    assert [[m.contact for m in motions] for motions in found.operation()] == [[0], [1, 0], [0, 1], [0]]
    (window,) = windows(found=found)
    assert (window.start, window.stop, window.operation) == (200, 300, True)
    assert motions_of(window) == ("from rest", "after other speeds")
    assert window.reached_by == ["rest", "rising speed", "falling speed"]


def test_the_largest_local_peaks_of_a_range_are_listed_in_rising_order_of_speed():
    factor = [9.0, 1.0, 3.0, 3.0, 1.0, 8.0, 1.0, 4.0, 1.0, 5.0, 1.0, 6.0, 1.0, 2.0, 1.0, 7.0]
    (window,) = windows(*([motion(1, each)] for each in factor))
    assert MOST_PEAKS == 5 and window.peaks == (
        Peak(300.0, 3.0), Peak(600.0, 8.0), Peak(800.0, 4.0), Peak(1000.0, 5.0), Peak(1200.0, 6.0))


def calm() -> Motion:
    return motion(0, 1.0)


@pytest.mark.parametrize(("motions", "added", "limit"), [
    ([[calm()], [calm()], [calm()]], [], np.inf),
    ([[calm()], [calm()], [motion(1, 2.0)]], [250], np.inf),  # an edge
    ([[calm()], [motion(0, 1.2, compression=0.1)], [calm()]], [150, 250], np.inf),  # may separate at the tip
    ([[calm()], [motion(0, 1.2, compression=0.45)], [calm()]], [], np.inf),
    ([[calm()], [motion(0, 3.0)], [calm()]], [150, 250], 4),
    ([[calm()], [motion(0, 1.2)], [calm()]], [], 4),
    ([[motion(1, factor)] for factor in (2.0, 2.0, 3.0, 2.0, 2.0)], [250, 350], np.inf),  # the largest force of a range
    ([[calm(), motion(0, 2.0)], [calm()], [calm()]], [150], np.inf),  # a motion that the next speed lacks
])
def test_speeds_are_added_where_something_changes(motions, added, limit):
    assert speeds_between(made_up(*motions), criterion, limit) == added


def test_a_gap_between_motions_that_do_not_lead_to_each_other_is_looked_for():
    found = made_up(*([calm(), motion(1, factor)] for factor in (2.0, 2.0, 2.0, 3.0)))
    assert speeds_between(found, criterion, np.inf) == [350]  # about the largest force
    found.at[100.0][1].leads_to[200.0] = found.at[200.0][0]
    assert speeds_between(found, criterion, np.inf) == [350]  # reached from above
    found.at[200.0][1].leads_to[100.0] = found.at[100.0][0]
    assert speeds_between(found, criterion, np.inf) == [150, 350]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")  # random designs are unusual
@pytest.mark.parametrize("number", [3, *(pytest.param(n, marks=pytest.mark.exhaustive) for n in (0, 1, 2, 4))])
def test_a_sample_of_random_designs_is_not_contradicted(number):
    found = trial(number, load=2)
    assert found["contradictions"] == [] and found["coarse"] == ""
