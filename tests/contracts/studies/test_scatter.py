"""Scatters from outside: inputs, bad input, designs that are not possible, records, stores, command, picture."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.scatter import print_scatter
from gearchaos.datasheet.scatter import _force_over, _most, answer, scatter_document
from gearchaos.dynamics.response import CONTACTS
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import operating_model
from gearchaos.store.record import from_record, to_record
from gearchaos.studies.core.operating_ranges import torques_of
from gearchaos.studies.uncertainty.distributions import Scattered
from gearchaos.studies.uncertainty.scatter_results import OUTPUTS
from tests import ONE_SPRING
from tests.commands import ask
from tests.contracts.studies.test_fit import PAIR

DESIGN = gc.GearDesign(
    teeth=(25, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque=100,
    backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    load_sharing="prescribed", quality={"standard": "ISO 1328-1:1995", "grade": 6})
MODEL = gc.MeshModel.of(kind="single", omega=0.8, q0=0.1, chi0=0, zeta=0.05, eps1=0.045)
OF_MODEL = {"model": MODEL, "speed": "omega=0.7:0.9:2"}
VARY, SPEED, WITHIN = ["damping_ratio=0.03:0.1"], "speed=1000:3000:2", "quality.deviations=within the grade"


def study(vary=VARY, speed=SPEED, torque=None, model=DESIGN, **options) -> gc.Scatter:
    return gc.Scatter(model, vary, speed, torque, **{"samples": 32, "indices": False, **options})


@pytest.mark.parametrize(("text", "expected"), [
    ("x=0.1:0.25 mm", Scattered("x", "mm", 0.1, 0.25)), ("x = 0.1 mm : 0.25 mm", Scattered("x", "mm", 0.1, 0.25)),
    ("x=-1e-3:2E-3", Scattered("x", "", -1e-3, 2e-3)), ("x=5±1 N*s/m", Scattered("x", "N*s/m", mean=5, sd=1)),
    ("x=5 +- .5", Scattered("x", mean=5, sd=0.5)), ("x=5+/-1 um", Scattered("x", "um", mean=5, sd=1)),
    ("x=normal(5, 1) um", Scattered("x", "um", mean=5, sd=1)),
    ("x=normal(5, 1, 3, inf) um", Scattered("x", "um", 3, mean=5, sd=1)),
    ("a.b=1,2.5,4 mm", Scattered("a.b", "mm", items=(1.0, 2.5, 4.0))),
    ("stiffness=ISO 6336-1,potential energy", Scattered("stiffness", items=("ISO 6336-1", "potential energy")))])
def test_distributions_are_read_as_engineers_write_them(text, expected):
    found = Scattered.parse(text)
    assert found == expected and Scattered.parse(f"{found.name}={found.words}") == expected


@pytest.mark.parametrize(("table", "text"), [
    ({"name": "backlash", "low": 0.1, "high": 0.2, "unit": "mm"}, "backlash=0.1:0.2 mm"),
    ({"name": "damping_ratio", "distribution": "normal", "mean": 0.05, "sd": 0.005, "low": 0.01},
     "damping_ratio=normal(0.05, 0.005, 0.01, inf)"),
    ({"name": "quality.grade", "distribution": "list", "values": [5, 7]}, "quality.grade=5,7"),
    ({"name": "quality.deviations", "distribution": "within the grade"}, "quality.deviations = within  the grade")])
def test_tables_are_distributions_too(table, text):
    assert study([table]).inputs == study([text]).inputs


def test_inputs_set_what_their_names_say():
    made = study(["backlash=0.1:0.2 mm", "quality.grade=5:7", "face_width.1=18:20 mm", "bore=30,40 mm"])
    assert [each.path or each.name for each in made.inputs] == [
        "backlash.value", "quality.grade", "face_width.1", "bore"]
    assert made.inputs[1].items == (5, 6, 7)
    (model,) = made.models.models((0.15, 2.0, 19.0, 1.0))
    expected = replace(DESIGN, backlash={"value": "0.15 mm", "of": "line of action, total"}, bore="40 mm", speed=1000,
                       quality={"standard": "ISO 1328-1:1995", "grade": 7}, face_width=["19 mm", "20 mm"])
    assert model == expected.to_model()
    assert torques_of("1,2 kN*m") == (1000, 2000)  # one unit holds for all
    two = study(["k=1000:3000 N*s/m", "error_amplitudes.1=1:3 um"], model=PAIR, torque="60,85")
    light, heavy = two.models.models((2000.0, 1.5))
    assert heavy == replace(PAIR, k=2000, error_amplitudes=["1.5 um"], speed=1000).to_model()
    assert light.q1 == pytest.approx(heavy.q1 * 60 / 85)
    assert gc.Scatter(MODEL, ["q0=0.1:0.2"], "omega=0.7:0.9:2", samples=32).models.models((0.15,))[0].q2 == 0.15


@pytest.mark.parametrize(("field", "rule", "vary"), [
    ("vary", "must read name=low:high", "bore=30 mm"), ("vary", "must read name=low:high", "bore=within the grade"),
    ("vary: damping_ratio", "must be a number", "damping_ratio=0,05:0,1"),
    ("bore", "must have finite limits", "bore=0:inf mm"), ("bore", "must have a lower limit below", "bore=30:30 mm"),
    ("damping_ratio", "must have a standard deviation greater than 0", "damping_ratio=0.05±0"),
    ("damping_ratio", "must have limits that keep 1 %", "damping_ratio=normal(0.05, 0.001, 0.5, 0.6)"),
    ("bore", "must have each value once", "bore=30,30 mm"), ("bore", "must have one unit", "bore=30 mm,3 in"),
    ("backlash", "must have one unit", "backlash=0.1 um:0.2 mm"),
    ("vary: backlash.value", "must be greater than 0", "backlash=-0.1:0.2 mm"),
    ("vary: backlash.value", "must be a length", "backlash=0.1:0.2 N"),
    ("vary: backlash", "must be one of of, value", "backlash.width=0.1:0.2 mm"),
    ("vary", "must name one value of quality", "quality=5:7"),
    ("quality.grade", "must be a range or a list of whole numbers", "quality.grade=6±1"),
    ("quality.grade", "must hold at least two whole numbers", "quality.grade=5.5:6.5"),
    ("vary: quality.grade", "must be a whole number from 0 to 12", "quality.grade=6:14"),
    ("vary: quality.deviations", "must be a list of two", "quality.deviations=-1:1"),
    ("vary: quality.deviations.2", "must be varied too, or be given", "quality.deviations.1=-1:1"),
    ("vary: stiffness", "must be one of", "stiffness=ISO 6336-1,finite elements"),
    ("vary", "must be one of application_factor", "damping=0.05:0.1"),
    ("vary", "must name a value: module has no x", "module.x=1:2 mm"),
    ("vary", "must not name the speed or the torque", "torque=90:110"),
    ("vary: ", "", "centre_distance=200:300 mm"),  # impossible in the middle
    ("vary.sd", "must be left out for", {"name": "quality.deviations", "distribution": "within the grade", "sd": 1}),
    ("distribution", "must be one of list, normal, uniform, within", {"name": "bore", "distribution": "beta"}),
    ("key of vary", "must be one of distribution", {"name": "bore", "a": 1}),
    ("vary.name", "must be given for normal", {"distribution": "normal", "mean": 1, "sd": 1}),
    ("vary.mean", "must be left out for uniform", {"name": "bore", "low": 1, "high": 2, "mean": 3}),
    ("vary", "must have a list of values", {"name": "bore", "distribution": "list"})])
def test_a_distribution_that_is_none_is_named(field, rule, vary):
    test_bad_input_is_named({"vary": [vary]}, field, rule)


def correlated(*correlations, vary=VARY):
    return {"vary": vary, "correlations": [list(each) for each in correlations]}


@pytest.mark.parametrize(("changes", "field", "rule"), [
    ({**OF_MODEL, "vary": []}, "vary", "must name one input or more"),
    ({"vary": [*VARY, *VARY]}, "vary", "must name one input"),
    ({"vary": ["quality.deviations.1=-1:1.5", "quality.deviations.2=-1:1"]}, "vary: quality.deviations[0]",
     "must lie in [-1, 1]"),
    ({**OF_MODEL, "vary": [WITHIN]}, "parameter", ""),
    ({"vary": [WITHIN], "model": replace(DESIGN, quality=None, transmission_error="none")}, "vary", "must"),
    ({"speed": "omega=0.5:1:3"}, "speed", "must be an axis of speed"), ({"speed": "speed=5"}, "speed", "must read"),
    ({"torque": "50,50"}, "torque", "must rise from"), ({"torque": "0"}, "torque", "must be greater than 0"),
    ({"torque": "5 mm"}, "torque", "must be a torque"), ({"factor": 0}, "factor", "must be greater than 0"),
    ({"samples": 48}, "samples", "must be 16 times"), ({"samples": 16}, "samples", "must be a whole number"),
    ({"start": "anywhere"}, "start", "must be one of rest"),
    ({"budget": 50}, "budget", "must be at least 64, the motions of 32 designs at 2 points"),
    ({"correlations": ["damping_ratio"]}, "correlations", "must be a list of"),
    (correlated(("damping_ratio", "backlash", 0.5)), "correlations", "must be one of damping_ratio"),
    (correlated(("damping_ratio", "damping_ratio", 0.5)), "correlations", "must name two different inputs"),
    (correlated(("damping_ratio", "bore", 1.0), vary=[*VARY, "bore=20:30 mm"]), "correlations", "must be more than -1"),
    (correlated(("damping_ratio", "bore", 0.5), vary=[*VARY, "bore=20,30 mm"]), "correlations",
     "must be of inputs with a range"),
    (correlated(("damping_ratio", "bore", 0.9), ("bore", "face_width", 0.9), ("damping_ratio", "face_width", -0.9),
                vary=[*VARY, "bore=20:30 mm", "face_width=15:20 mm"]), "correlations", "must be positive definite"),
    ({"model": replace(DESIGN, faults=[{"wheel": 1, "tooth": 1, "stiffness_loss": 0.3}], speed=1000)}, "model",
     "must be a single pair"),
    ({"load_change": 4}, "load_change", "must be greater than -1"),
    ({"load_change": 0.5, "wide": True}, "load_change", "must be left out with wide"),
    ({"model": MODEL}, "speed", "must be an axis of omega"), ({**OF_MODEL, "torque": 5}, "torque", "must be left out"),
    ({**OF_MODEL, "vary": ["omega=1:2"]}, "vary", "must name parameters other than"),
    ({**OF_MODEL, "vary": ["zeta=0.1:0.2 mm"]}, "zeta", "must have numbers without"),
    ({**OF_MODEL, "vary": ["zeta=-0.1:0.2"]}, "zeta", "must not be negative")])
def test_bad_input_is_named(changes, field, rule):
    with pytest.raises(InputError) as error:
        study(**changes)
    assert error.value.field.startswith(field) and rule in error.value.rule


def test_a_price_too_high_is_named_with_smaller_choices():
    with pytest.raises(InputError) as error:
        study(samples=1024, indices=True, budget=2500)
    assert "at least 3,072, the motions of 1,536 designs at 2 points" in error.value.rule
    assert error.value.advice == "Or choose --samples 512 (1,536 motions) or --no-indices (2,048) or fewer speeds."


def test_impossible_values_of_a_normal_distribution_say_their_share():
    with pytest.raises(InputError, match=r"About [45]\.?\d* % of 0\.1±0\.06 mm are impossible\. Give limits"):
        study(["backlash=0.1±0.06 mm"], samples=256)
    assert study(["backlash=normal(0.1, 0.06, 0.02, 0.3) mm"], samples=256).values.min() >= 0.02


def test_designs_that_are_not_possible_are_counted():
    found = gc.scatter(DESIGN, ["bore=30:80 mm"], SPEED, samples=64)
    share = float(found.impossible)
    assert 0.1 < share < 0.9 and "bore" in found.attrs["impossible_because"]
    none = found.sample_possible.values == 0
    assert np.array_equal(none, np.isnan(found.sample_factor[0])) and share == pytest.approx(none.mean())
    assert (found.sample_contact.values[0][none] == CONTACTS.index("none")).all()
    lost = found.sample_share_lost.values[0][~none] > 0
    assert float(found.anywhere.sel(outcome="contact loss")[0]) == pytest.approx(lost.mean(), abs=0.02)
    assert np.isnan(found.total_index).all() and "not possible" in found.attrs["indices_refused"]


def test_samples_say_what_probabilities_say():
    vary = ["damping_ratio=0.03:0.1", "quality.grade=5:8"]
    found = gc.scatter(DESIGN, vary, "speed=1500:5500:3", "60,150", samples=64)
    lost = found.probability.sel(outcome="contact loss")
    np.testing.assert_allclose(lost.mean("speed"), found.sample_share_lost.mean("sample"), atol=1e-12)
    largest = found.sample_factor.values
    np.testing.assert_allclose(
        found.anywhere.sel(outcome="force over limit"), np.mean(largest > 1.5, axis=1), atol=1e-12)
    contact = found.sample_contact.values
    np.testing.assert_array_equal(contact > CONTACTS.index("permanent"), found.sample_share_lost.values > 0)
    np.testing.assert_allclose(found.anywhere.sel(outcome="both flanks hit"),
                               np.mean(contact == CONTACTS.index("two-sided"), axis=1), atol=1e-12)
    i = 5
    damping, grade = found.sample_value.values[:, i]
    own = replace(DESIGN, damping_ratio=damping, quality={"standard": "ISO 1328-1:1995", "grade": 5 + int(grade)})
    beside = gc.dynamic_factor(own, "speed=1500:5500:3", 150)
    ratio = float(beside.quasi_static_ratio)
    assert largest[1, i] == pytest.approx(float(beside.dynamic_factor.max()) / ratio, rel=1e-6)
    assert found.sample_share_lost.values[1, i] == pytest.approx(float((beside.contact != 0).mean()))
    assert found.first_index.sel(output="share of speeds with contact loss", varied="quality.grade").max() > 0.4
    assert found.attrs["indices_refused"] == "" and found.cut_share.values.tolist() == [0, 0]


def test_deviations_within_the_grade_are_inputs_as_others(tmp_path):
    """One of each wheel: in results, records and stores, from a design, a model of one, and a known other wheel."""
    options = {"vary": [WITHIN, "quality.grade=6:8"], "speed": "speed=3000:5000:2", "indices": True}
    made = study(**options)
    assert [each.name for each in made.inputs] == ["quality.deviations.1", "quality.deviations.2", "quality.grade"]
    assert from_record(to_record(made)) == made and gc.run(made, tmp_path / "s.zarr", threads=1).finished
    found = gc.load(tmp_path / "s.zarr")
    assert found.identical(made.run()) and found.total_index.varied.values.tolist() == [
        each.name for each in made.inputs]
    own = replace(DESIGN, quality={"standard": "ISO 1328-1:1995", "grade": 7, "deviations": (0.2, -0.6)})
    assert made.models.models((0.2, -0.6, 1)) == [replace(own, speed=3000).to_model()]
    of_model = study(**options, model=operating_model(replace(DESIGN, speed=3000)))
    assert of_model.models.models((0.2, -0.6, 1)) == made.models.models((0.2, -0.6, 1))
    known = study(["quality.deviations.1=-1:1"], model=own)
    assert known.models.models((0.2,)) == [replace(own, speed=1000).to_model()]


def test_other_items_change_no_bit():
    made = study([*VARY, "stiffness=ISO 6336-1,potential energy"], torque=[60.0, 150.0])
    whole = made.compute(np.arange(made.count), threads=1)
    for name, values in made.compute(np.arange(8, 20), threads=1).items():
        np.testing.assert_array_equal(values, whole[name][8:20])


def test_records_and_stores_hold_what_the_study_finds(tmp_path):
    made = study(["backlash=0.1:0.2 mm", "damping_ratio=0.05±0.01"], torque=[60.0],
                 correlations=[["backlash", "damping_ratio", 0.5]])
    assert from_record(to_record(made)) == made
    assert gc.run(made, tmp_path / "s.zarr", threads=1, tile=16).finished
    found = gc.load(tmp_path / "s.zarr")
    assert found.identical(made.run()) and found.if_best.isnull().all()
    assert "correlated" in found.attrs["indices_refused"]


TOML = re.sub(r"centre.*\n", "", ONE_SPRING.read_text()).replace("[50, 50]", "[25, 50]") + """
[study]
kind = "scatter"
vary = ["quality.grade=5:8", { name = "damping_ratio", distribution = "normal", mean = 0.05, sd = 0.01, low = 0.02 }]
speed = "speed=1500:5500:3"
torque = [60, "150 N*m"]
samples = 32
correlations = []
"""


@pytest.fixture
def command(tmp_path):
    """Calls of a command with the file of the study, and what they print."""
    path = tmp_path / "design.toml"
    path.write_text(TOML)

    def call(name, *arguments, code=0):
        done = ask(name, path, *arguments, code=code)
        assert "--json" in arguments or max(map(len, done.stdout.splitlines()), default=0) <= 80
        return done.stderr if code else done.stdout

    call.path = path
    return call


@pytest.mark.slow
def test_the_command_says_what_the_function_finds(command, tmp_path):
    said = command("scatter", "--plot", tmp_path / "s.png", "--out", tmp_path / "s.nc")
    assert (tmp_path / "s.png").stat().st_size > 0
    found = gc.load(tmp_path / "s.nc")
    value = float(found.anywhere.sel(outcome="contact loss", torque=60))
    assert said.startswith(f"60 N m: contact is lost in operation with probability {value:.2f} (")
    assert "0.13 % cut off" in said and "150 N m: which input matters" in said
    assert "which the grade permits" not in " ".join(said.split())
    document = json.loads(command("scatter", "--json"))
    assert document["torques"][0]["anywhere"]["contact loss"]["value"] == value
    assert document["inputs"]["quality.grade"]["items"] == ["5", "6", "7", "8"]
    assert document["speed"] == [1500, 3500, 5500]
    command("run", "--threads", 1, "--out", tmp_path / "s.zarr")
    assert gc.load(tmp_path / "s.zarr").identical(found)


@pytest.mark.slow
def test_options_of_the_command_take_the_place_of_the_study(command):
    few = ("--samples", 32, "--no-indices")
    other = command("scatter", *few, "--vary", "backlash=0.1:0.2 mm", "--vary", VARY[0], "--speed", "1000:2000:2",
                    "--torque", 80, "--correlation", "backlash,damping_ratio=0.5", "--start", "steady contact")
    assert other.startswith("80 N m: contact is lost in operation from steady contact with")
    drawn = command("scatter", *few, "--vary", WITHIN, "--speed", "1000:2000:2")
    assert "0.27 % cut off" in drawn and "over that which the grade permits" in " ".join(drawn.split())
    words = " ".join(command("scatter", *few, "--speed", "2000:2000:1", "--torque", 80).split())
    assert ") at 2000 rpm after a reversal" in words and ") there: both flanks hit" in words
    assert "one or more" not in words
    never = command("scatter", *few, "--speed", "2000:2000:1", "--torque", 80, "--load-change", "none")
    assert "contact is lost in operation" in never and "after a reversal" not in " ".join(never.split())
    for missing in (["--speed", ""], ["--correlation", "a=b"]):
        command("scatter", *missing, code=2)
    command.path.write_text(TOML.partition("[study]")[0])
    assert "speed must be given" in command("scatter", "--vary", VARY[0], code=2)


@pytest.mark.parametrize(("options", "over"), [
    ({}, "quasi-static peak"), ({"vary": ["load_sharing=prescribed,tooth pairs"]}, "quasi-static peak"),
    ({"vary": ["eps1=0.04:0.05"], **OF_MODEL}, "static force")], ids=["design", "some of them", "constant stiffness"])
def test_the_limit_of_the_force_is_over_the_quasi_static_peak_where_there_is_one(options, over):
    content = scatter_document(study(**options).run())
    assert content["force_over"] == over
    assert any(f"force over 1.5 times the {over}" in text for text in answer(content, content["torques"][0]))


def test_inputs_that_may_make_the_stiffness_jump_are_known_by_their_names():
    found = study(["eps1=0.04:0.05"], **OF_MODEL).run()  # of a stiffness without jumps
    for name, over in (("stiffness", "quasi-static peak"), ("design.load_sharing", "quasi-static peak"),
                       ("backlash", "static force")):
        assert _force_over(found.assign_coords(varied=[name])) == over


def test_the_picture_has_probabilities_and_indices():
    found = gc.scatter(MODEL, ["eps1=0.045±0.005", "zeta=0.04:0.06"], "omega=0.7:0.9:4", samples=64)
    above, below = gc.plot.scatter(found).axes
    np.testing.assert_array_equal(above.lines[0].get_ydata(), found.probability.sel(outcome="contact loss")[0])
    expected = [found[n].sel(output="share of speeds with contact loss")[0] for n in ("first_index", "total_index")]
    np.testing.assert_array_equal([bar.get_height() for bar in below.patches], np.concatenate(expected))
    assert len(gc.plot.scatter(study().run()).axes) == 1
    with pytest.raises(InputError, match=r"must be a result of scatter"):
        gc.plot.scatter(found.drop_vars("probability"))


def test_scatter_without_a_possible_design_is_refused_with_the_reason():
    square = replace(DESIGN, teeth=(50, 50), centre_distance="150 mm")
    with pytest.raises(InputError, match=r"^vary must leave some designs possible; got 'module'.*"
                                         "profile_shift must be given with this centre distance"):
        gc.scatter(square, ["module=2.9:3.1 mm"], "speed=1000:1100:2", samples=32, indices=False)


def test_inputs_that_the_indices_do_not_tell_apart_are_both_named():
    total = {"a": (0.5, 0.4, 0.6), "b": (0.45, 0.3, 0.55), "c": (0.1, 0.0, 0.2)}
    one = {"indices": {OUTPUTS[0]: {
        name: {"total": dict(zip(("value", "low", "high"), values, strict=True))} for name, values in total.items()}}}
    assert _most(one) == "; most by a or b (S_T 0.50)"


DRAWN = {"vary": ["damping_ratio=0.03:0.05", "quality.grade=5:8"], "speed": "speed=2600:3600:9", "torque": [100.0]}


@pytest.fixture(scope="module")
def carried():
    return study(**DRAWN).run()


@pytest.mark.parametrize(("wide", "head"), [(False, "after load change"), (True, "from wide states")])
def test_of_many_speeds_the_rows_of_the_largest_probabilities_are_printed(carried, wide, head, capsys):
    content = scatter_document(carried) | {"speed": [1000.0 + n for n in range(100)], "wide": wide}
    (one,) = content["torques"]
    for own in (one, one["probability_after_load_change"]):
        own["along"] = {name: {n: [0.0] * 100 for n in each} for name, each in own["along"].items()}
    one["along"]["contact loss"]["value"][47] = 0.3
    one["probability_after_load_change"]["along"]["contact loss"]["value"][61] = 0.2
    print_scatter(content)
    said = capsys.readouterr().out
    assert "speeds from 1000 to 1099 rpm, 1 apart" in " ".join(said.split())
    assert "14 of 100 rows" in said and head in said
    shown = [line.split()[0] for line in said.splitlines() if re.match(r" ?1\d\d\d ", line)]
    assert len(shown) == 14 and {"1047", "1061"} <= {*shown}


@pytest.mark.slow
def test_operation_is_that_of_rising_and_falling_speed():
    """Of designs contact is lost at the speeds at which `speeds_to_avoid` finds a motion of operation without it."""
    own = replace(DESIGN, teeth=(50, 50), load_sharing="tooth pairs", torque=300)
    found = study(["quality.grade=4,5"], "speed=2000:2250:11", model=own).run()
    share, falling = found.sample_share_lost.values[0], []
    for item, grade in enumerate((4, 5)):
        design = replace(own, quality={"standard": "ISO 1328-1:1995", "grade": grade})
        avoided = gc.speeds_to_avoid(design, "2000:2250:11", starts=0, knocks=False)
        met = np.mean([any(w.start <= s <= w.stop for w in avoided.windows if w.operation) for s in found.speed.values])
        assert np.unique(share[found.sample_value.values[0] == item]) == pytest.approx(met)
        falling.append(met - float((gc.dynamic_factor(design, "speed=2000:2250:11", 300).contact != 0).mean()))
    assert min(falling) > 0.4  # of the speeds: motions that have lost contact are carried down


def test_load_changes_have_their_own_probabilities(carried):
    after = carried.probability_after_load_change.sel(outcome="contact loss")[0].values
    low = carried.probability_after_load_change_lo.sel(outcome="contact loss")[0].values
    assert (low <= after).all() and not np.allclose(after, carried.probability.sel(outcome="contact loss")[0])
    none, wide = (study(**DRAWN, **options).run() for options in ({"load_change": "none"}, {"wide": True}))
    assert "probability_after_load_change" not in none and none.probability.equals(carried.probability)
    assert scatter_document(none)["torques"][0]["probability_after_load_change"] is None
    assert wide.probability.equals(carried.probability)
    assert float(wide.probability_after_load_change[0].mean()) > after.mean()  # they hold more energy
    assert "from wide ranges of states with" in " ".join(
        answer(scatter_document(wide), scatter_document(wide)["torques"][0]))
    fall = study(**DRAWN, load_change=-0.99).run()  # next to no change: the motion from rest
    assert fall.probability_after_load_change.sel(outcome="contact loss").mean() < after.mean()


def test_what_is_beyond_the_teeth_is_named_without_a_factor():
    soft = replace(DESIGN, material=replace(DESIGN.material[0], root_strength="150 N/mm^2"))
    plain, found = (study(["damping_ratio=0.03:0.05"], "speed=3000:3000:1", [100.0], model=each).run()
                    for each in (DESIGN, soft))
    assert float(plain.anywhere.sel(outcome="beyond the teeth")[0]) == 0
    beyond = np.isnan(found.sample_factor.values[0])
    assert beyond.mean() == pytest.approx(float(found.anywhere.sel(outcome="beyond the teeth")[0])) and beyond.any()
    content = scatter_document(found)
    assert any("beyond the teeth 1.00" in text or "beyond the teeth 0." in text
               for text in answer(content, content["torques"][0]))
    assert not any("beyond" in text for text in answer(*(lambda c: (c, c["torques"][0]))(scatter_document(plain))))


def test_a_varied_centre_distance_asks_once_for_all_that_moves_with_it():
    with pytest.raises(InputError) as error:
        study(["centre_distance=112.49:112.51 mm"], model=replace(DESIGN, centre_distance="112.5 mm"))
    text, = re.findall(r"tooth_thickness_allowances = \[('-[\d.]+ um'), \1\]", str(error.value))
    assert '--set "design.profile_shift=[0, 0]"' in str(error.value)
    held = replace(DESIGN, centre_distance="112.5 mm", profile_shift=[0, 0], backlash={
        "tooth_thickness_allowances": [text.strip("'")] * 2})
    assert held.backlash_line_of_action == pytest.approx(0.12e-3, rel=1e-4)
    wider = replace(held, centre_distance="112.51 mm").backlash_line_of_action - held.backlash_line_of_action
    assert wider == pytest.approx(2e-5 * np.sin(np.radians(20)), rel=1e-3)
    assert study(["centre_distance=112.49:112.51 mm"], model=held).count
    given = replace(DESIGN, centre_distance="112.5 mm", profile_shift=[0, 0])
    assert study(["centre_distance=112.49:112.51 mm", "backlash=0.1:0.2 mm"], model=given).count


def test_without_inputs_what_every_drawing_leaves_uncertain_is_varied():
    typical = replace(DESIGN, transmission_error="from quality (typical)")
    for model in (DESIGN, typical):
        made = study([], model=model)
        assert made.vary == study([WITHIN, "damping_ratio=0.035:0.065", "backlash=0.084:0.156 mm"]).vary
        assert made.model.gears.transmission_error == "from quality"
    assert study([], model=PAIR).vary == ("k=1400:2600 N*s/m", "backlash=0.084:0.156 mm")


@pytest.mark.slow
def test_the_command_says_what_it_varies():
    said = ask("scatter", ONE_SPRING, "--speed", "2000:2100:2", "--samples", 32, "--no-indices", code=0)
    assert "varied, since --vary is left out: quality.deviations.1=normal" in said.stderr
