"""`gearchaos.branch`, `orbit` and `orbits`: variables, units, files, JSON, bad input."""

from __future__ import annotations

import json
import math
import re
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.cards import card
from gearchaos.errors import InputError
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.features.motion.diagram import branch_text
from tests import ONE_SPRING
from tests.branches import CHANGES, PAIR, SINGLE, axes, cascade, over_speed, resonance
from tests.commands import ask, run_json
from tests.pictures import legend_words

SPUR = ONE_SPRING
TRIPLE = gc.MeshModel.of(kind="single", omega=2.3, q0=0.1, eps1=0.1)


def test_points_describe_orbits():
    ds = resonance()
    assert ds["multipliers_real"].dims == ("point", "exponent") and ds["section_z"].dims == ("point", "cycle")
    at = int(np.argmin(np.abs(ds["omega"].values - 2.4)))
    near = {n: float(ds[f"section_{n}"][at, 0]) for n in ("z", "z_dot")}
    verdict = gc.regime(SINGLE.with_values({"omega": float(ds["omega"][at]), **near}))
    assert verdict.period == 1 == ds["period"].values[at] and ds["unstable"].values[at] == 0
    for name in ("v_rms", "z_rms", "z_peak_to_peak", "dynamic_factor", "contact_fraction", "mesh_force_peak"):
        assert float(ds[name][at]) == pytest.approx(getattr(verdict, name), rel=1e-9), name
    assert float(ds["z_max"][at] - ds["z_min"][at]) == pytest.approx(float(ds["z_peak_to_peak"][at]), rel=1e-12)
    modulus = np.abs(ds["multipliers_real"].values + 1j * ds["multipliers_imag"].values)
    np.testing.assert_array_equal(ds["unstable"].values, (modulus > 1 + 1e-9).sum(axis=1))
    assert ds["residual"].max() < 1e-10 and 0 <= ds["step"].min() <= ds["step"].max() < 0.04


def test_contact_states_are_in_order_of_time():
    ds = resonance()
    columns = (ds[name].values for name in ("contact_sequence", "switches", "contact"))
    for text, switches, contact in zip(*columns, strict=True):
        states = text.split()
        assert len(states) == switches + 1 and states[0] == states[-1]
        assert all({a, b} in ({"front", "free"}, {"back", "free"}) for a, b in pairwise(states))
        assert contact == (2 if {"front", "back"} <= set(states) else 1 if "free" in states else 0)
    assert {"front", "front free front"} <= set(ds["contact_sequence"].values)


def test_events_lie_between_their_points_start_a_branch_again_and_end_stable_intervals():
    ds = resonance()
    x, turns = ds["omega"].values, ds["event_point"].values[ds["event_kind"].values == "fold"]
    for i, (kind, before) in enumerate(zip(ds["event_kind"].values, ds["event_point"].values, strict=True)):
        value = float(ds["event_value"][i])
        assert before in turns or min(x[before : before + 2]) <= value <= max(x[before : before + 2])
        assert (ds["event_boundary"].values[i] != 0) == (kind == "graze")
        state = {n: float(ds[f"event_section_{n}"][i]) for n in ("z", "z_dot")}
        orbit = gc.orbit(SINGLE.with_values({"omega": value}), period=1, near=state)
        assert abs(orbit.state["z"] - state["z"]) < 1e-5, kind
        critical = {"fold": 1.0, "flip": -1.0}.get(kind)
        if critical is not None:
            multipliers = ds["event_multipliers_real"].values[i] + 1j * ds["event_multipliers_imag"].values[i]
            assert np.abs(multipliers - critical).min() < 1e-9
    assert np.all(np.diff(ds["event_point"].values) >= 0)
    values = [0.3, 2.5, *ds["event_value"].values[np.isin(ds["event_kind"].values, CHANGES)]]
    intervals = json.loads(ds.attrs["stable"])
    assert intervals == sorted(intervals) and all(v in values for pair in intervals for v in pair)
    for at, unstable in zip(x, ds["unstable"].values, strict=True):
        assert unstable or any(a <= at <= b for a, b in intervals)


def test_a_cascade_has_branches_of_doubled_periods():
    ds = cascade()
    assert dict(zip(ds["branch"].values.tolist(), ds["period"].values.tolist(), strict=True)) == {0: 8, 1: 16, 2: 32}
    np.testing.assert_array_equal(np.isnan(ds["section_x1"].values).sum(axis=1), 32 - ds["period"].values)
    flips = ds["event_value"].values[ds["event_kind"].values == "flip"]
    doubled = json.loads(ds.attrs["cascade"])
    assert [b["period"] for b in doubled] == [16, 32]
    assert [b["ends"][0]["value"] for b in doubled] == flips[:2].tolist()
    assert doubled[1]["stable"] == [[flips[1], flips[2]]]
    np.testing.assert_array_equal(ds["branch"].values[ds["event_point"].values], ds["event_branch"].values)


def test_a_branch_says_how_it_was_made():
    assert cascade().attrs["study"] == "branch" and "gears" not in cascade().attrs
    settings = json.loads(cascade().attrs["settings"])
    assert settings["axis"] == ["eps1", 0.0, 0.3] and settings["cascade"] == 2 and settings["period"] == 8


def test_physical_units_over_speed():
    ds = over_speed()
    scaled, length = gc.physical(ds), PAIR.scales.length * 1e6
    for name in ("z_peak_to_peak", "event_z_peak_to_peak", "section_x1", "event_section_x1", "z_max"):
        np.testing.assert_allclose(scaled[name].values, ds[name].values * length, rtol=1e-12)
        assert scaled[name].attrs["units"] == "µm"
    xr.testing.assert_identical(scaled["event_value"], ds["event_value"])
    assert scaled.attrs["range"] == ds.attrs["range"] and ds["event_value"].attrs["units"] == "rpm"


def test_physical_units_over_a_dimensionless_parameter():
    ds = gc.branch(PAIR, "eps1=0.09:0.3")
    scaled, length = gc.physical(ds, PAIR), PAIR.scales.length * 1e6
    for name in ("eps1", "event_value"):
        np.testing.assert_allclose(scaled[name].values, ds[name].values * length, rtol=1e-12)
    assert scaled["event_value"].attrs["units"] == "µm"
    for name in ("range", "stable"):
        np.testing.assert_allclose(json.loads(scaled.attrs[name]), np.multiply(json.loads(ds.attrs[name]), length))
    ends = [[e["value"] for e in json.loads(d.attrs["ends"])] for d in (scaled, ds)]
    np.testing.assert_allclose(ends[0], np.multiply(ends[1], length))


def test_orbit_and_orbits():
    found = gc.orbits(TRIPLE, period=3)
    assert sorted(o.unstable for o in found) == [0, 1]
    for o in found:
        again = gc.orbit(TRIPLE, period=3, near=o.state)
        assert (again.unstable, again.period) == (o.unstable, 3) and again.residual < 1e-11
        assert len(o.switches) == sum(abs(np.diff([s.into_contact for s in o.switches]))) + 1
        assert json.loads(json.dumps(o.to_dict()))["unstable"] == o.unstable
    assert gc.orbit(TRIPLE).period == 1
    assert set(gc.branch(TRIPLE, "omega=2.29:2.31", period=3)["period"].values) == {3}, "without a start, the nearest"
    with pytest.raises(InputError, match=r"nearest one found is at a distance of [\d.]+: z=.*z_dot="):
        gc.orbit(TRIPLE, period=3, near={"z": 1.04, "z_dot": 0.0})


@pytest.mark.parametrize(("values", "axis", "period", "events"), [
    ({"kind": "full", "kappa": 0.5, "omega": 0.9, "q0": 0.2, "eps1": 0.1}, "q0=0.15:0.21", 1,
     {"neimark-sacker": 0.16945026}),
    ({"omega": 1.0, "q0": 0.1, "eps1": 0.206}, "eps1=0.2:0.21", 8, {"fold": 0.20499237, "flip": 0.20698884}),
])
def test_the_period_of_the_motion_from_the_initial_values_chooses_that_motion(values, axis, period, events):
    """Newton's method alone finds another orbit of the period from there, without these events."""
    model = gc.MeshModel.of(**values)
    ds = gc.branch(model, axis, period=period)
    found = dict(zip(ds.event_kind.values.tolist(), ds.event_value.values, strict=True))
    assert {kind: pytest.approx(found.get(kind), abs=1e-8) for kind in events} == events
    same = np.sort_complex(gc.orbit(model, period=period).multipliers)
    np.testing.assert_allclose(same, np.sort_complex(gc.regime(model).multipliers), rtol=0, atol=1e-6)


def test_initial_values_on_an_unstable_orbit_choose_it():
    """Although the motion from there, after rounding has grown, ends on a stable orbit of the same period."""
    model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    orbit = gc.orbit(model, period=1, near={"z": 1.28, "z_dot": -0.1})
    assert orbit.unstable == 1 and gc.regime(orbit.model).period == 1
    assert gc.orbit(orbit.model, period=1).state == pytest.approx(orbit.state, abs=1e-9)


@pytest.mark.parametrize(("arguments", "words"), [
    ({"axis": "eps1=0.1:0.3"}, "must contain the model's own value"),
    ({"axis": "eps1=0:x"}, "must read"), ({"axis": "eps1=1:0"}, "must run from"), ({"axis": 3}, "must be an"),
    ({"axis": "z=0:1"}, "must be a parameter"), ({"axis": "epsilon=0:1"}, "must be one of"),
    ({"axis": "contact_ratio=0.5:2.5"}, r"must lie in \[1, 2\]"), ({"axis": "speed=1:2"}, "must be one of"),
    *(({"period": p}, "must be a whole number") for p in (0, 1025, 1.5, True)),
    ({"period": 2, "start": {"z": 1.0, "z_dot": 0.0}}, "must be near an orbit of minimal period 2"),
    ({"start": {"zz": 1.0}}, "must be one of"), ({"start": {"eps1": 0.1}}, "must be one of"),
    ({"start": 3}, "must give initial values"), ({"start": {"z": math.nan}}, "finite"),
    *(({"cascade": c}, "cascade") for c in (-1, 11, 1.5)), ({"longest_step": 0.0}, r"must lie in"),
    ({"max_points": 1}, "at least 2"), ({"events": [1]}, "events"),
    ({"events": {"fold": len}}, "must not have the name"),
])
def test_bad_arguments(arguments, words):
    with pytest.raises(InputError, match=words):
        gc.branch(SINGLE, **{"axis": "eps1=0:0.1", **arguments})


def test_a_motion_without_period_is_no_start():
    with pytest.raises(InputError, match="quasi-periodic"):
        gc.orbit(gc.MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.04))


COMMAND = ("branch", "--set", "kind=single", "--set", "zeta=0.025", "--set", "q0=0.1", "--set", "eps1=0.05",
           "--axis", "omega=0.5:2.5")


def starts(event):
    return [part for name, value in event["state"].items() for part in ("--start", f"{name}={value!r}")]


@pytest.mark.slow
def test_json_of_the_command(tmp_path):
    document = run_json(*COMMAND, "--out", tmp_path / "b.nc", "--plot", tmp_path / "b.png")
    assert list(document) == ["points", "closed", "range", "ends", "events", "stable", "neutral", "jumps"]
    ds = gc.load(tmp_path / "b.nc")
    assert document["points"] == ds.sizes["point"] and document["closed"] is False
    assert [e["kind"] for e in document["events"]] == ds["event_kind"].values.tolist()
    keys = {"kind", "value", "period", "multipliers", "boundary", "state", "residual"}
    for event in document["events"]:
        assert set(event) == keys and set(event["state"]) == {"z", "z_dot"} and len(event["multipliers"]) == 2
        assert event["boundary"] in ((1, -1) if event["kind"] == "graze" else (None,))
    assert document["ends"] == [{"value": 0.5, "why": "end of the axis"}, {"value": 2.5, "why": "end of the axis"}]
    assert len(document["jumps"]) == ds.sizes["jump"] > 0
    for jump in document["jumps"]:
        assert document["events"][jump["event"]] == {**document["events"][jump["event"]], "kind": "fold",
                                                      "value": jump["value"]}
        assert jump["direction"] in ("up", "down") and jump["to"] == "1T" and jump["on_branch"] is True
    assert (tmp_path / "b.png").stat().st_size > 10_000
    ask("plot", tmp_path / "b.nc", "--out", tmp_path / "c.png", code=0)
    flip = next(e for e in document["events"] if e["kind"] == "flip")
    again = run_json(*COMMAND, "--set", f"omega={flip['value'] - 1e-3!r}", "--period", 1, *starts(flip))
    assert [e["kind"] for e in again["events"]] == [e["kind"] for e in document["events"]]


def test_in_physical_units_an_event_is_a_start_of_the_same_command():
    design = ("branch", SPUR, "--set", "torque=200", "--set", "damping_law=always", "--axis", "speed=1800:3500",
              "--physical")
    document = run_json(*design, "--set", "speed=2000")
    assert document["units"] == {"value": "rpm"}
    fold = next(i for i, event in enumerate(document["events"]) if event["kind"] == "fold")
    event = document["events"][fold]
    again = run_json(*design, "--set", f"speed={event['value']!r}", "--period", 1, *starts(event))
    for values in zip(*(sorted((e["kind"], e["value"]) for e in d["events"]) for d in (document, again)), strict=True):
        assert values[0] == (values[1][0], pytest.approx(values[1][1], abs=1e-6))
    text = ask(*design, "--set", "speed=2000", code=0).stdout
    assert "speed = 3500 rpm: end of the axis" in text and "speed (rpm)" in text
    assert f"rpm, from event {fold + 1} to 1T" in text
    assert f"{event['value']:.6g}" in text and not re.search(r"\d{4}\.\d{3}", text), "rpm to six digits"


def test_without_damping_a_branch_is_neutral_and_nowhere_stable():
    model = SINGLE.with_values({"zeta": 0.0, "eps1": 0.01})
    orbit = gc.orbit(model.with_values({"omega": 2.3, "z": 1.1}), period=1)
    assert orbit.stability == "neutral" and repr(orbit).startswith("Orbit(1T, neutral, ") and "1T, neutral" in card(
        orbit).title
    found = gc.branch(model.with_values({"omega": 2.3, **orbit.state}), "omega=2.2:2.4", period=1)
    assert json.loads(found.attrs["stable"]) == [] and json.loads(found.attrs["neutral"]) == [[2.2, 2.4]]
    assert legend_words(gc.plot.branch(found, ax=axes())) == ["neutral"]
    text = branch_text(found.assign_attrs(period=1), Units())
    assert [words for _, words in text.lines] == ["neutral"] and text.sentences[1] == "Neutral from 2.2 to 2.4."
    states = [part for name, value in orbit.state.items() for part in ("--start", f"{name}={value!r}")]
    command = ["branch", *(part for name, value in {"kind": "single", "omega": 2.3, "zeta": 0, "q0": 0.1, "eps1": 0.01
                                                    }.items() for part in ("--set", f"{name}={value}")),
               "--axis", "omega=2.2:2.4", "--period", "1", *states]
    said = ask(*command, code=0).stdout
    assert "neutral, in order" in said and "nowhere: no damping decides" in said
    document = run_json(*command)
    assert (document["stable"], document["neutral"]) == ([], [[2.2, 2.4]])
    damped = gc.branch(SINGLE.with_values({"omega": 2.3, "eps1": 0.01}), "omega=2.2:2.4", period=1)
    assert json.loads(damped.attrs["neutral"]) == [] != json.loads(damped.attrs["stable"])


@pytest.mark.slow
def test_the_page_of_the_command():
    isola = ("branch", "--set", "kind=single", "--set", "omega=2.3", "--set", "q0=0.1", "--set", "eps1=0.1", "--axis",
             "omega=1:3", "--period", 5)
    doubled = ("branch", "--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.206", "--axis", "eps1=0:0.3",
               "--cascade", 2)
    for command, words in ((COMMAND, ("from end to event", "on the branches followed", "end of the axis", "stable",
                                      "flip", "fold", "graze, front flank")),
                           (isola, ["isola"]), (doubled, ("doubled, 32T", "ratios of intervals"))):
        text = ask(*command, code=0).stdout
        assert all(each in text for each in words)


@pytest.mark.parametrize(("arguments", "words"), [
    (("--axis", "eps1=0.2:0.3"), "must contain"), (("--axis", "eps1=0:0.3", "--start", "z"), "NAME=VALUE"),
    (("--axis", "eps1=0:0.3", "--start", "z=x"), "NAME=VALUE"), ((), "must be given once"),
    (("--axis", "eps1=0:0.3", "--axis", "q0=0:1"), "must be given once"),
    (("--axis", "eps1=0:0.3", "--plot", "b.txt"), "must end in"),
    (("--axis", "eps1=0:0.3", "--cascade", "99"), "at most"),
])
def test_bad_input_of_the_command(arguments, words):
    assert words in " ".join(ask("branch", "--set", "kind=single", *arguments, code=2).stderr.split())


@pytest.mark.parametrize(("name", "low", "high"), [
    ("zeta", 0.0, 0.1), ("contact_ratio", 1.0, 2.0), ("zeta", 0.025, 0.1), ("contact_ratio", 1.5, 1.6)])
def test_a_branch_reaches_the_limits_of_the_models_rules(name, low, high):
    model = gc.MeshModel.of(kind="single", omega=0.7, zeta=0.025, q0=0.1, eps1=0.05)
    ds = gc.branch(model, f"{name}={low}:{high}", period=1, start={"z": 1.17, "z_dot": -0.01})
    assert {(e["value"], e["why"]) for e in json.loads(ds.attrs["ends"])} == {
        (low, "end of the axis"), (high, "end of the axis")}
    assert {float(ds[name].min()), float(ds[name].max())} == {low, high}


def test_large_phases_are_followed():
    """A phase is an argument of sines: whole turns change nothing."""
    base, turns = gc.MeshModel.of(kind="single", omega=0.7, zeta=0.1, q0=0.1, eps1=0.05), 2 * math.pi * 79
    far = gc.branch(base.with_values({"theta1": 500.0}), "theta1=495:505", period=1)
    near = gc.branch(base.with_values({"theta1": 500.0 - turns}), f"theta1={495 - turns}:{505 - turns}", period=1)
    assert [e["why"] for e in json.loads(far.attrs["ends"])] == ["end of the axis"] * 2
    np.testing.assert_allclose(far["v_rms"][[0, -1]], near["v_rms"][[0, -1]], rtol=1e-9)


@pytest.mark.parametrize("axis", ["omega=0.5:1.5", "eps1=-0.3:0.3"])
def test_an_orbit_that_is_not_isolated_has_no_branch(axis):
    with pytest.raises(InputError, match="start must be an orbit from which a branch can be followed"):
        gc.branch(gc.MeshModel.of(kind="single", q0=0, eps1=0.0, omega=0.7), axis, period=1)
