"""Study files: what they say, what is set over them, and what is refused."""

import numpy as np
import pytest

from gearchaos.datasets import model_json
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import operating_model
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import HarmonicStiffness, MeshModel, TransmissionError, TwoLevelStiffness
from gearchaos.studies.core.axis import Axis, parse_axis
from gearchaos.studies.core.registry import STUDIES, study_class
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.maps.zones import Zones
from gearchaos.studyfile import load_design, load_study, parse_set
from tests import EXAMPLES
from tests.commands import refused

DESIGNS = {"spur_50_50.toml", "spur_27_35.toml", "iso_tr_6336_30_example_1.toml", "fzg_type_c.toml"}
TRAINS = {"train_idler.toml": 4, "train_loose_gear.toml": 2, "train_two_stage.toml": 6, "train_planetary.toml": 28,
          "train_wind_turbine.toml": 50}
PAIR = """
[gearpair]
n1 = 25\nn2 = 40\nR1 = "35.24 mm"\nR2 = "56.38 mm"\nI1 = "4.88e-4 kg*m^2"\nI2 = "3.20e-3 kg*m^2"
c0 = "400 N/um"\nk = "530 N*s/m"\nbacklash = "0.12 mm"\nM10 = "85 N*m"\nspeed = "14000 rpm"
"""


@pytest.fixture
def study(tmp_path):
    def load(text, **values):
        path = tmp_path / "study.toml"
        path.write_text(text, encoding="utf-8")
        return load_study(path, values)

    return load


def test_every_table_reaches_the_model(study):
    found = study("""
[model]
kind = "full"
omega = 1.05
q1 = 0.1
q2 = 0.12
zeta = 0.03
kappa = 0.5
mu2 = 5
[model.error]
amplitudes = [0.04, 0.01]
phases = [0.5]
[model.stiffness]
kind = "two-level"
chi1 = 0.2
contact_ratio = 1.7
[initial]
x1 = 1.5
y2_dot = -0.1
""")
    assert found.model == MeshModel(
        kind="full", omega=1.05, q1=0.1, q2=0.12, zeta=0.03, kappa1=0.5, kappa2=0.5, mu2=5.0,
        error=TransmissionError((0.04, 0.01), (0.5, 0.0)), stiffness=TwoLevelStiffness(0.2, 0.25, 1.7),
        initial={"x1": 1.5, "y2_dot": -0.1})
    assert found.pair is None and found.kind is None and found.options == {}
    assert load_study().model == study("").model == MeshModel()


@pytest.mark.parametrize(("text", "stiffness"), [
    ('kind = "harmonics"\namplitudes = [0.3, 0.1]\nphases = [0.0, 1.5]', HarmonicStiffness((0.3, 0.1), (0.0, 1.5))),
    ("chi0 = 0.1", TwoLevelStiffness(0.1, 0.1))])
def test_stiffness(study, text, stiffness):
    assert study(f"[model.stiffness]\n{text}").model.stiffness == stiffness


def test_values_are_set_over_the_file(study):
    text = '[model]\nomega = 1\nq0 = 0.2\n[model.error]\namplitudes = [0.1]\n[initial]\nx1 = 2'
    model = study(text, omega=2, eps1=0.05, theta1=0.3, kind="single", z=0.5).model
    assert (model.kind, model.omega, model.q1, model.q2) == ("single", 2.0, 0.2, 0.2)
    assert model.error == TransmissionError((0.05,), (0.3,))
    assert dict(model.initial) == {"z": 0.5}


def test_settings(study):
    found = study('[study]\nkind = "bifurcation"\naxis = "eps1=0:0.3:7"\npoints = 32\nmode = "up"')
    assert found.kind == "bifurcation"
    assert found.options == {"axis": Axis("eps1", 0.0, 0.3, 7), "points": 32, "mode": "up"}
    assert found.options_for("zones") == {}
    assert found.study(Bifurcation) == Bifurcation(found.model, Axis("eps1", 0.0, 0.3, 7), points=32, mode="up")
    zones = study('[study]\ny = "eps1=0:0.3:7"\nx = "omega=0.2:3:5"\nkind = "zones"').study(Zones)
    assert (zones.x.name, zones.y.name) == ("omega", "eps1")


def test_physical_pair(study):
    found = study(PAIR)
    assert found.model == operating_model(found.pair) and found.model.kind == "torsional"
    assert model_json(found.model) == model_json(found.pair.to_model())
    slow = study(PAIR, **{"gearpair.speed": "7000 rpm", "gearpair.n1": 25, "kind": "single", "eps1": 0.1}).model
    assert slow.omega == pytest.approx(found.model.omega / 2)
    assert slow.kind == "single" and slow.error.amplitudes == (0.1,)


BAD = [
    ("[model]\nomega = -1", "omega must be greater than 0; got -1.0"),
    ('[model]\nomega = "1"', "model.omega must be a valid number; got '1'"),
    ("[model]\nomega = true", "model.omega must be a valid number; got True"),
    ("[model]\nomga = 1", "Did you mean 'omega'?"), ("[modle]\nomega = 1", "Did you mean 'model'?"),
    ("[model]\neps1 = 0.1", "Write it in [model.error]"), ("[model]\nchi0 = 0.1", "Write it in [model.stiffness]"),
    ("[model]\nx1 = 0.1", "Write it in [initial]"),
    ("[model]\nq0 = 0.1\nq2 = 0.2", "model.q0 must not be given beside model.q2"),
    ('[model]\nkind = "ful"', "Did you mean 'full'?"),
    ('[model]\nkind = "single"\nbeta = 0.01', "beta must be 0 in the single model"),
    ("[model.error]\namplitudes = 0.1", "model.error.amplitudes must be a valid list; got 0.1"),
    ('[model.error]\namplitudes = ["a"]', "model.error.amplitudes[0] must be a valid number; got 'a'"),
    ("[model.error]\namplitudes = [0.1]\nphases = [0, 1]", "error.phases must not be longer than amplitudes"),
    ("[model.error]\namplitude = [0.1]", "Did you mean 'amplitudes'?"),
    ('[model.stiffness]\nkind = "sine"', "two-level; got 'sine'. No installed package offers it"),
    ("[model.stiffness]\nchi2 = 1", "chi2 must be less than 1; got 1.0"),
    ("[model.stiffness]\nchi0 = 0.1\nchi1 = 0.2", "must not be given beside model.stiffness.chi1"),
    ("[model.stiffness]\namplitudes = [0.1]", "amplitudes must be left out for kind 'two-level'"),
    ('[model.stiffness]\nkind = "harmonics"\nchi1 = 0.1', "chi1 must be left out for kind 'harmonics'"),
    ('[model.stiffness]\nkind = "harmonics"\namplitudes = [1.1]', "must keep the mesh stiffness above 0"),
    ("[initial]\ny1 = 1", "initial value of a torsional model must be one of"),
    ('[study]\nx = "omega=0.2:3:5"', "study.kind must be given"),
    ('[study]\nkind = "zone"', "got 'zone'. Did you mean 'zones'?"),
    ('[study]\nkind = "zones"\naxis = "eps1=0:1:3"', "study.axis must be left out for kind 'zones'"),
    ('[study]\nkind = "zones"\nperiods = 3', "study.periods must be left out for kind 'zones'"),
    ('[study]\nkind = "bifurcation"\naxis = "eps1=0:1"', "study.axis must read name=start:stop:count"),
    ('[study]\nkind = "bifurcation"\nmode = "sideways"', "study.mode must be 'fixed', 'up' or 'down'"),
    ('[study]\nkind = "simulate"\nperiods = 0', "study.periods must be greater than or equal to 1; got 0"),
    ("model = 3", "model must be a table; got 3"), ("omega = ", "study file must be valid TOML"),
    (f"[model]\nomega = {'9' * 5000}", "study file must be valid TOML"),
    ("[gearpair]\nn3 = 25", "key of [gearpair] must be one of"),
    ("[gearpair]\nn1 = 25", "gearpair.n2, I1, I2, R1, R2, c0, k, backlash, M10, speed must be given"),
    (PAIR + "[model]\nomega = 1", "[model] must be left out beside [gearpair]"),
    (PAIR.replace("35.24 mm", "3 kg"), "R1 must be a length; got '3 kg'")]


@pytest.mark.parametrize(("text", "message"), BAD, ids=range(len(BAD)))
def test_bad_files_are_refused_in_words(study, text, message):
    with pytest.raises(InputError) as error:
        study(text)
    assert message in str(error.value)


def test_unreadable_files(tmp_path):
    (tmp_path / "study.toml").write_bytes(b"\xff\xfe\x00")
    for name, message in (("study.toml", "valid TOML"), ("none.toml", "a readable file"), (".", "a readable file")):
        with pytest.raises(InputError, match=f"study file must be {message}"):
            load_study(tmp_path / name)


def test_parse_set_keeps_numbers_and_order():
    assert parse_set(["omega=1", "eps1 = 2.5e-1", "kind=single"]) == {"omega": 1, "eps1": 0.25, "kind": "single"}
    design = load_design(EXAMPLES / "spur_50_50.toml", parse_set(
        ["design.load_sharing=tooth pairs", "design.corner_contact=true"]))
    assert design.corner_contact is True and design.tooth_pairs.corner.length[0] > 0.1
    assert load_study(None, parse_set(["q0=1", "q1=2", "q0=3"])).model.q1 == 3.0
    with pytest.raises(InputError, match=r"^omega must be a number; got '0,5'. Write a decimal point"):
        load_study(None, parse_set(["omega=0,5"]))


def test_parse_set_takes_lists_and_tables():
    values = parse_set(["design.bore=['30 mm', 0.06]", "design.quality={ standard = 'ISO 1328-1:2013', grade = 5 }"])
    assert values == {"design.bore": ["30 mm", 0.06], "design.quality": {"standard": "ISO 1328-1:2013", "grade": 5}}
    design = load_design(EXAMPLES / "spur_50_50.toml", values)
    assert design.bore == (0.03, 0.06) and design.quality.grade == 5


@pytest.mark.parametrize(("text", "message"), [
    *((text, "must read name=value") for text in ("omega", "=1", "omega=", "")),
    ("design.bore=[30 mm, 60 mm]", "must give a list or table as in TOML"), ("design.bore=['30 mm'", "Unclosed array"),
    ("a=[1]\nb=2", "must give one value"), ("a={", "as in TOML"), ("a=" + "[" * 5000, "as in TOML")])
def test_parse_set_refuses(text, message):
    with pytest.raises(InputError, match=f"^--set .*{message}"):
        parse_set([text])


@pytest.mark.parametrize(("name", "value"), [("bore", ["30 mm", "60 mm"]), ("quality.grade", 8)])
def test_a_key_of_a_design_needs_the_name_of_its_table(name, value):
    for read in (load_study, load_design):
        with pytest.raises(InputError, match=rf"^{name} must be given .*Write design.{name}=VALUE"):
            read(EXAMPLES / "spur_50_50.toml", {name: value})


def test_a_field_of_a_gear_pair_needs_the_name_of_its_table():
    with pytest.raises(InputError, match=r"^R1 must be given .*Write gearpair.R1=VALUE"):
        load_study(EXAMPLES / "physical_pair.toml", {"R1": "30 mm"})
    assert load_study(EXAMPLES / "physical_pair.toml", {"chi1": 0.2, "speed": 900.0}).model.stiffness.chi1 == 0.2


@pytest.mark.parametrize(("kind", "advice"), [
    ("map", 'write kind = "zones", x = "speed=500:8000:200" and y = "torque=20:400:150"'),
    ("gear", "gearchaos gear says which speeds to avoid")])
def test_the_name_of_a_command_that_is_no_kind_of_study_is_refused_with_what_to_write(kind, advice, tmp_path):
    path, text = tmp_path / "s.toml", (EXAMPLES / "spur_50_50.toml").read_text()
    path.write_text(f'{text}\n[study]\nkind = "{kind}"\nx = "speed=500:8000:200"\n')
    with pytest.raises(InputError, match=r"^study.kind must be .*'zones'.*; got ") as error:
        load_study(path)
    assert advice in error.value.advice
    path.write_text("[study]\nkind = [1]\n")
    with pytest.raises(InputError, match=r"^study.kind must be .*; got \[1\]"):
        load_study(path)


def test_a_map_over_speed_and_torque_in_a_study_file(tmp_path):
    """What the advice for kind = "map" says works."""
    path, text = tmp_path / "s.toml", (EXAMPLES / "spur_50_50.toml").read_text().partition("[operation]")[0]
    path.write_text(f'{text}\n[study]\nkind = "zones"\nx = "speed=500:8000:200"\ny = "torque=20:400:150"\n')
    assert load_study(path).study(Zones).count == 30_000


def test_parse_axis():
    assert parse_axis("z=-3:3:2") == Axis("z", -3.0, 3.0, 2)
    np.testing.assert_allclose(parse_axis("eps1=0:0.3:4").values, [0, 0.1, 0.2, 0.3])
    for name in ("c1", "alpha1", "eps3", "y2_dot", "q0", "contact_ratio"):
        assert Axis(name, 1.0, 1.5, 3).name == name


@pytest.mark.parametrize(("text", "message"), [
    ("eps1", "must read name=start:stop:count"), ("eps1=0:1", "must read name=start:stop:count"),
    ("eps1=0:1:2:3", "must read name=start:stop:count"), ("eps1=a:1:2", "must read name=start:stop:count"),
    ("eps1=0:1:2.5", "must read name=start:stop:count"),
    ("eps1=0:1:0", "axis eps1 count must be a whole number from 1"),
    ("eps1=0:1:9999999999", "axis eps1 count must be a whole number from 1"),
    ("eps1=1:1:5", "axis eps1 must run from a smaller to a larger value"),
    ("eps1=nan:1:5", "axis eps1 start must be a finite number"),
    ("omega=0:1:5", "omega must be greater than 0; got 0.0"),
    ("kappa=-1:1:5", "kappa1 must be greater than 0; got -1.0"), ("omga=0:1:5", "Did you mean 'omega'?"),
    ("kind=0:1:5", "axis must be one of")])
def test_parse_axis_refuses(text, message):
    with pytest.raises(InputError) as error:
        parse_axis(text)
    assert message in str(error.value)


# caption: kind of model, study, axes, and the values that it or the text prints
FIGURES = {
    2: ("torsional", "zones", ("omega", "eps1"), {"q1": 0.1}),
    3: ("single", "basins", ("z", "z_dot"), {"omega": 0.8, "eps1": 0.1, "q1": 0.1}),
    4: ("single", "simulate", (), {"omega": 2.3, "eps1": 0.05, "q1": 0.1}),
    5: ("torsional", "zones", ("omega", "q0"), {"eps1": 0.1}),
    6: ("torsional", "bifurcation", ("q0",), {"eps1": 0.1, "omega": 1.0}),
    7: ("torsional", "simulate", (), {"eps1": 0.1, "omega": 1.0, "q2": 0.014}),
    8: ("torsional", "bifurcation", ("eps1",), {"q2": 0.1, "omega": 1.0}),
    9: ("torsional", "simulate", (), {"eps1": 0.23, "q2": 0.1, "omega": 1.0}),
    10: ("full", "zones", ("omega", "kappa"), {"eps1": 0.05, "q2": 0.1}),
    11: ("full", "zones", ("omega", "eps1"), {"kappa2": 0.5, "q1": 0.1}),
    12: ("full", "bifurcation", ("eps1",), {"kappa1": 0.5, "q1": 0.1, "omega": 1.05}),
    13: ("full", "simulate", (), {"kappa1": 0.5, "q1": 0.1, "omega": 1.05, "eps1": 0.04}),
    14: ("full", "bifurcation", ("q0",), {"eps1": 0.1, "kappa2": 0.5, "omega": 0.9}),
    15: ("full", "simulate", (), {"kappa2": 0.5, "omega": 0.9, "eps1": 0.1, "q2": 0.128})}


@pytest.mark.parametrize("number", FIGURES)
def test_examples_are_the_figures(number):
    kind, what, axes, values = FIGURES[number]
    found = load_study(EXAMPLES / f"fig{number:02d}.toml")
    assert (found.model.kind, found.kind) == (kind, what)
    assert tuple(found.options[name].name for name in STUDIES[what].axis_fields) == axes
    parameters = found.model.parameters()
    assert {name: parameters[name] for name in values} == values
    assert {name: parameters[name] for name in ("zeta", "chi1", "chi2", "contact_ratio", "J1", "J2")} == {
        "zeta": 0.025, "chi1": 0.25, "chi2": 0.25, "contact_ratio": 1.5, "J1": 2.0, "J2": 2.0}


def test_no_example_is_left_out_of_the_tests():
    names = {path.name for path in EXAMPLES.glob("*.toml")}
    assert names == {f"fig{n:02d}.toml" for n in FIGURES} | {"physical_pair.toml"} | DESIGNS | TRAINS.keys()


@pytest.mark.parametrize(("name", "coordinates"), TRAINS.items())
def test_example_of_a_train(name, coordinates):
    found = load_study(EXAMPLES / name)
    assert len(found.model.state_names) == coordinates and found.warnings == ()
    assert isinstance(found.study(study_class(str(found.kind))).model, TrainModel)


def test_example_of_a_physical_pair():
    found = load_study(EXAMPLES / "physical_pair.toml")
    assert found.model.kind == "full"
    assert 0.1 < found.model.omega < 3 and 0.01 < found.model.zeta < 0.1 and 0.02 < found.model.q1 < 0.5
    solid = [0.5 * found.pair.m1 * 0.0375**2, 0.5 * found.pair.m2 * 0.060**2]
    inertias = [found.pair.I1, found.pair.I2]
    assert inertias == pytest.approx(solid, rel=0.01)


@pytest.mark.parametrize(("text", "words"), [
    ("[design]\nteeth = [20, 40]", ["module and face_width must be given in [design]", "face_width = '20 mm'"]),
    ("[design]\nteeth = 0\nmodule = '3 s'\nface_width = 'x'", [
        "error: teeth must", "Also: module must be a length", "Also: face_width must be a length"]),
    ("[gearpair]\nn1 = 20\nn2 = 40", ["gearpair.I1, I2, R1, R2", "speed must be given", "I1 = '4.9e-4 kg*m^2'"]),
    ("[train]\n[[train.bodies]]\nname = 'a'\ninertia = '1 s'\ntorque = '1 N'\n[[train.bodies]]\nname = 'b'\n"
     "[[train.meshes]]\nbetween = ['a', 'b']\nteeth = [20, 40]",
     ["error: body a: inertia must be a moment of inertia", "Also: torque must be a torque; got '1 N'",
      "Also: body b: inertia must be given", "Also: mesh a/b: base_radii, backlash", "stiffness = '3e8 N/m'"]),
    ("[model]\nomega = 'a'\nq0 = 0.1\nzeta = 'b'", [
        "error: model.omega must be a valid number; got 'a'", "Also: model.zeta must be a valid number; got 'b'"]),
], ids=["design", "design's units", "gearpair", "train", "model"])
def test_all_that_is_missing_or_wrong_in_a_table_is_said_at_once(tmp_path, text, words):
    path = tmp_path / "study.toml"
    path.write_text(text)
    said = refused("regime", path)
    assert all(word in said for word in words), said
    assert all(said.count(sentence) == 1 for sentence in ("without units", "Or give a design") if sentence in said)


@pytest.mark.parametrize(("given", "words"), [
    ("stiffness.kind=tanh", "stiffness must be one of ISO 6336-1, potential energy; got 'tanh'. The backlash is"),
    ("stiffness.kind=potential energy", "Write design.stiffness=VALUE"),
    ("stiffness.table=k.csv", "Write design.stiffness.table=VALUE"),
    ("design.stiffness.kind=tanh", "stiffness must be ISO 6336-1 or potential energy or { table = '…' }; got {'kind'"),
])
def test_a_kind_of_stiffness_of_a_model_is_answered_by_what_a_design_takes(given, words):
    assert words in refused("regime", EXAMPLES / "spur_50_50.toml", "--set", given)
