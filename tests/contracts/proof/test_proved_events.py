"""Events that are proved to lie in an interval of a parameter of width 1e-9."""

import json
from fractions import Fraction

import numpy as np
import pytest

from tests.commands import ask

pytest.importorskip("flint")

import gearchaos as gc
from gearchaos.model import HarmonicStiffness, MeshModel
from gearchaos.proof.balls import from_text, precision, to_text
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.events import connection
from gearchaos.proof.families.exclusion import Region, distance, neighbours
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.verifier import verify

TORSIONAL = MeshModel.of(kind="torsional", q0=0.1, omega=1.0, eps1=0.05)
SINGLE = MeshModel.of(kind="single", zeta=0.025, q0=0.1, eps1=0.05, omega=0.6)
FULL = MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.02)
FOURIER = MeshModel.of(kind="single", stiffness=HarmonicStiffness(amplitudes=(0.2,), phases=(0.0,)))


@pytest.fixture(scope="module")
def branches():
    return {"flip": gc.branch(TORSIONAL, "eps1=0.05:0.125", cascade=1), "single": gc.branch(SINGLE, "omega=0.5:0.8"),
            "full": gc.branch(FULL, "eps1=0.02:0.04")}


def event(branches, branch, kind, number=0):
    """An event of a branch by its kind."""
    found = branches[branch]
    return found.isel(event=int(np.flatnonzero(found["event_kind"].values == kind)[number]))


def place(located):
    """The value of an event of the single model, and the state of its orbit."""
    return float(located["event_value"]), {n: float(located[f"event_section_{n}"]) for n in ("z", "z_dot")}


EVENTS = [("flip", "flip", 0), ("flip", "flip", 1), ("single", "graze", 0), ("single", "graze", 1),
          ("single", "fold", 0), ("full", "neimark-sacker", 0)]


@pytest.mark.slow
@pytest.mark.parametrize(("branch", "kind", "number"), EVENTS)
def test_located_events_are_proved_in_intervals_of_width_1e_9(branches, branch, kind, number, tmp_path):
    located = event(branches, branch, kind, number)
    proved = gc.prove_event(located)
    assert proved.proved, proved.in_words()
    low, high = proved.interval
    assert low < float(located["event_value"]) < high and Fraction(high) - Fraction(low) <= Fraction(1e-9)
    for found in proved.certificates():
        assert verify(found.document).proved
    check_facts(kind, int(located["event_period"]), proved.document)
    proved.write(tmp_path / "event.json")
    assert json.loads((tmp_path / "event.json").read_text()) == proved.document


def check_facts(kind, period, document):
    """The facts at both ends are opposite."""
    below, above = document["below"], document["above"]
    outside = [[c["stability"]["outside"] for c in end] for end in (below, above)]
    if kind == "fold":
        pair, = (end for end in outside if end)
        assert sorted(pair)[1] - sorted(pair)[0] == 1 and [] in outside
        assert document["empty"]["slices"] > 0 and document["empty"]["border"] > 0
        return
    assert below[0]["period"] == above[0]["period"] == period and document["empty"] is None
    assert float(document["connection"]["margin"]) > 0
    if kind == "graze":
        counts = [sum(map(len, c[0]["switches"])) for c in (below, above)]
        assert abs(counts[0] - counts[1]) == 2
        return
    assert abs(outside[0][0] - outside[1][0]) == (1 if kind == "flip" else 2)
    if kind == "flip":
        doubled, = (c for end in (below, above) for c in end[1:])
        assert doubled["period"] == 2 * period and doubled["stability"]["outside"] == 0


@pytest.mark.slow
def test_an_event_elsewhere_is_not_proved(branches):
    for branch, kind, number in EVENTS:
        located = event(branches, branch, kind, number)
        moved = located.assign(event_value=located["event_value"] + 1e-6)
        moved["event_value"].attrs.update(located["event_value"].attrs)
        result = gc.prove_event(moved)
        assert not result.proved and result.reason in ("no change", "region not proved empty", "orbit not found")


def test_orbits_of_different_families_are_not_connected():
    """At omega 2.3 there are a stable orbit of period 3 and a saddle: they are no ends of one family."""
    found = gc.orbits(SINGLE.with_values({"omega": 2.3}), period=3, starts=64)
    assert len(found) >= 2
    first = gc.prove(found[0])
    others = [gc.orbit(SINGLE.with_values({"omega": 2.3 + 1e-9}), period=3, near=o.state) for o in found]
    assert connection(first, gc.prove(others[0]), 128) is not None
    for other in others[1:]:
        with pytest.raises(UndecidedError, match="orbit not found"):
            connection(first, gc.prove(other), 128)


def fold_pair(branches):
    """The equations on the side of the fold where there are two orbits, on the other side, and the two orbits."""
    value, near = place(event(branches, "single", "fold"))
    sides = [MeshEquations(exact_parameters(SINGLE.with_values({"omega": each})), bits=128)
             for each in (value - 5e-10, value + 5e-10)]
    start = [[Fraction(near["z"]), Fraction(near["z_dot"])]]
    return sides, sorted((c.points for c in neighbours(sides[0], start)), key=lambda p: distance(p, start))[:2]


def test_a_region_with_orbits_is_not_proved_empty_and_the_same_region_beyond_the_fold_is(branches):
    with precision(128):
        (before, beyond), (first, second) = fold_pair(branches)
        centre = [[(a + b) / 2 for a, b in zip(first[0], second[0], strict=True)]]
        region = region_between(before, beyond, centre, Fraction(2 * distance(first, second)))
        inside, border = region.not_empty(region.whole, border=True)
        assert border > len(inside) > 0 and region.at(beyond).not_empty(inside, border=False)[1] >= len(inside)
        for slices in (inside, region.whole):
            with pytest.raises(UndecidedError, match="region not proved empty"):
                region.at(before).not_empty(slices, border=False)


@pytest.mark.slow
def test_a_border_that_orbits_cross_on_their_way_to_the_fold_is_not_proved_closed(branches):
    with precision(128):
        (before, beyond), (first, second) = fold_pair(branches)
        for orbit, other, share in ((first, second, Fraction(-1, 4)), (second, first, Fraction(1, 4))):
            beside = [[a + share * (b - a) for a, b in zip(orbit[0], other[0], strict=True)]]  # of one of the orbits
            region = region_between(before, beyond, beside, Fraction(distance(first, second) / 2))
            for at, border in ((region, True), (region.at(before), False)):
                with pytest.raises(UndecidedError, match="region not proved empty"):
                    at.not_empty(region.whole, border=border)


def region_between(before, beyond, centre, radius):
    """A region for all values of omega between those of two equations."""
    low, high = (Fraction(from_text(e.parameters["omega"])) for e in (before, beyond))
    middle = MeshEquations({**before.parameters, "omega": to_text((low + high) / 2)}, bits=128)
    return Region(middle, centre, radius, {"omega": (high - low) / 2})


TRIPLE = MeshModel.of(kind="single", omega=0.8, q0=0.1, eps1=0.1, zeta=0.03)
FOLD_OF_3 = 0.7282350394381634, {"z": 0.5759551029471504, "z_dot": 0.16489197803055108}


@pytest.mark.exhaustive
def test_a_fold_is_not_proved_where_its_two_orbits_merely_leave_the_region():
    """At both ends of this interval, 1e-7 above the fold, there are two orbits: those of the lower end move away."""
    value, near = FOLD_OF_3
    assert gc.prove_event(TRIPLE, "fold", "omega", value, period=3, near=near).proved
    found = gc.prove_event(TRIPLE, "fold", "omega", value + 1e-7 + 5e-6, period=3, near=near, width=1e-5)
    assert not found.proved and found.reason == "region not proved empty"


def beside(rng, event_value, side):
    """The middle and the width of a random interval beside an event."""
    width = 10 ** rng.uniform(-8, -4)
    return event_value + side * (width * 10 ** rng.uniform(-2, 0.5) + 1e-11 + width / 2), width


@pytest.mark.parametrize("counts", [(0, 0, 2, 1), pytest.param((10, 1, 35, 4), marks=pytest.mark.exhaustive)])
def test_no_fold_is_proved_in_random_intervals_beside_it(branches, counts):
    """Those beside the fold of period 3 take seconds each."""
    rng, of_1, of_3 = np.random.default_rng(3), (
        SINGLE, *place(event(branches, "single", "fold")), 1), (TRIPLE, *FOLD_OF_3, 3)
    cases = ((of_3, 1), (of_3, -1), (of_1, -1), (of_1, 1))
    for ((model, fold, start, period), side), count in zip(cases, counts, strict=True):
        for _ in range(count):
            value, width = beside(rng, fold, side)
            found = gc.prove_event(model, "fold", "omega", value, period=period, near=start, width=width)
            assert not found.proved and found.reason in ("region not proved empty", "orbit not found")


def test_no_graze_is_proved_in_random_intervals_beside_one(branches):
    rng = np.random.default_rng(4)
    for number in (0, 1):
        graze, near = place(event(branches, "single", "graze", number))
        for k in range(4):
            value, width = beside(rng, graze, (-1) ** k)
            found = gc.prove_event(SINGLE, "graze", "omega", value, period=1, near=near, width=width)
            assert not found.proved and found.reason == "no change"


@pytest.mark.slow
def test_no_graze_is_proved_where_a_switch_merely_passes_the_section():
    """With constant stiffness the phase of the transmission error shifts time: any switch can be put at tau = 0."""
    rng, model, done = np.random.default_rng(5), MeshModel.of(kind="single", zeta=0.08, q0=0.1, eps1=0.1, chi0=0), 0
    for _ in range(20):
        varied = model.with_values({"omega": rng.uniform(0.6, 0.9)})
        times = [switch.time for switch in gc.orbit(varied, period=1).switches]
        varied = varied.with_values({"theta1": -2 * np.pi * rng.choice(times or [0.0])})
        near, width = gc.orbit(varied, period=1).state, 10 ** rng.uniform(-8, -5)
        if abs(abs(near["z"]) - 1) > 1e-9:  # another orbit of period 1, or permanent contact
            continue
        value = varied.value("omega") + 0.3 * rng.uniform(-1, 1) * width
        found = gc.prove_event(varied, "graze", "omega", value, period=1, near=near, width=width)
        assert not found.proved and found.reason in ("no change", "orbit not found")
        done += found.reason == "no change"
    assert done >= 5  # of 10, where no orbit changes with rounding


@pytest.mark.parametrize(("arguments", "options", "message"), [
    ((TORSIONAL,), {}, "kind must be one of flip, fold, graze, neimark-sacker"),
    ((TORSIONAL, "pitchfork"), {}, "kind must be one of"),
    ((TORSIONAL, "flip", "eps1"), {}, "axis and value must be given"),
    ((TORSIONAL, "flip", "theta1", 0.1), {}, "theta1 must be a parameter that a box can vary"),
    ((FOURIER, "graze", "omega", 0.9), {}, "stiffness must be two-level or stepped"),
    ((TORSIONAL, "flip", "eps1", 0.0916), {"width": 0}, "width must be positive"),
    ((TORSIONAL, "flip", "eps1", 0.0916), {"period": 1, "width": 1e-18}, "width must be larger than the spacing"),
    ((MeshModel.of(kind="single", q0=0.1, omega=0.45841773525549895, eps1=1e-20, eps2=0.02, chi1=0.0, chi2=0.0),
      "fold", "eps1", 1e-20), {"period": 1, "near": {"z": 1.1996122802950882, "z_dot": 0.02722523760352243},
                               "width": 1e-3}, "eps1 must not be 0 at the centre of the box")])
def test_wrong_arguments_are_named(arguments, options, message):
    """The last interval is one of ± 5e-4 about exactly 0, in which both orbits exist."""
    with pytest.raises(gc.InputError, match=message):
        gc.prove_event(*arguments, **options)


def test_a_branch_without_one_event_selected_is_refused(branches):
    with pytest.raises(gc.InputError, match="subject must be a branch with one event selected"):
        gc.prove_event(branches["flip"])


def test_a_model_with_kind_axis_and_value_is_enough_and_verify_refuses_its_file_in_words(branches, tmp_path):
    value = float(event(branches, "flip", "flip")["event_value"])
    proved = gc.prove_event(TORSIONAL, "flip", "eps1", value, period=1)
    assert proved.proved
    proved.write(tmp_path / "event.json")
    gc.prove_box(TORSIONAL, {"eps1": 1e-6}).write(tmp_path / "box.json")
    said = ask("verify", tmp_path / "event.json", tmp_path / "box.json", code=1).stdout
    assert "no verifier of events" in said and "no verifier of boxes" in said
