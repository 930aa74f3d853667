"""Trains as inputs: every refusal with its field and advice, `[train]` of study files, `--set`, initial values."""

import itertools
import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.train.parts import TorqueOrder
from gearchaos.gears.train.train_file import initial_of, read_train
from gearchaos.model.switched import switched_system, vary
from gearchaos.studyfile import load_study


def body(name, **given):
    moved = {} if given.keys() & {"inertia", "motion", "fixed"} else {"inertia": 1e-3}
    return {"name": name, **moved, **given}


def mesh(a, b, z1=20, z2=30, **given):
    return {"between": [a, b], "teeth": [z1, z2], "base_radii": [z1 * 1e-3, z2 * 1e-3], "stiffness": "2e8 N/m",
            "backlash": "0.1 mm", **given}


def train(*bodies, meshes=None, **given):
    return {"speed": 1000, "bodies": list(bodies or (body("a"), body("b"))),
            "meshes": [mesh("a", "b")] if meshes is None else meshes, **given}


def with_mesh(**given):
    return train(meshes=[mesh("a", "b", **given)])


def with_first(**given):
    return train(body("a", **given), body("b"))


def with_shaft(**given):
    return train(body("a"), body("b"), body("c"), shafts=[{"between": ["b", "c"], **given}])


STEEL = {"inertia": 1e-3, "mass": 0.5}
STIFF = {"stiffness": {"levels": [6e8, 4e8], "starts": [0, 0.5]}, "backlash": 1e-4}
PLANETS = {"count": 3, "teeth": [27, 36, 99], "module": "2.8 mm", "sun": {"inertia": 1e-3}, "ring": {"fixed": True},
           "carrier": {"inertia": 0.05}, "planet": STEEL, "sun_mesh": STIFF, "ring_mesh": STIFF}


def planets(**given):
    return {"speed": 1000, "planets": {**PLANETS, **given}}


PAIRS = {"stiffness": "1.5e8 N/m", "contact_ratio": 1.6, "relief": {"amount": "20 um"}}


def chain(*teeth):
    """Wheels a, b, … in a row whose meshes have these teeth and an error."""
    names = "abcdefg"
    return train(*(body(names[i]) for i in range(len(teeth) + 1)), meshes=[
        mesh(names[i], names[i + 1], *z, error_amplitudes=["1 um"]) for i, z in enumerate(teeth)])


REFUSED = [
    # what moves a body
    (train(body("a"), {"name": "b"}), "body b: inertia", "must be given, or motion, or fixed", "is uniform rotation"),
    (train(body("a"), body("b", inertia=1, motion=[])), "body b: inertia", "and only one of them", "as prescribed"),
    (with_first(fixed=True), "body a: fixed", "must be false", "The first body turns"),
    (with_first(motion=[], torque=3), "body a: torque", "where the motion is prescribed", "no effect"),
    (with_first(motion=[], damping=3), "body a: damping", "where the motion is prescribed", "no effect"),
    (train(body("a", motion=[]), body("b", motion=[])), "mesh a/b: between", "must have a body that is free to move",
     "nothing is left to compute"),
    (with_first(motion=[{"order": 2}]), "body a: motion[0].acceleration", "or angle, not both", "300 rad/s^2"),
    (with_first(motion=[{"order": 2, "accel": 3}]), "body a: motion[0]", "must have no key but", "'acceleration'"),
    (with_first(motion=[{"order": 2000.5, "angle": 1}]), "body a: motion[0].order", "1/1000 and 1000", "'7/3'."),
    (with_first(motion=[{"order": 1e-7, "angle": 1}]), "body a: motion[0].order", "between 1/1000 and 1000"),
    # names and tables
    (train(meshes=[mesh("a", "bb")]), "mesh a/bb: between", "must be one of a, b", "Did you mean 'b'?"),
    (train(body("a"), body("b", inerta=1)), "body b", "must have no key but name, inertia", "Did you mean 'inertia'?"),
    (with_mesh(backlsh=1), "mesh a/b", "must have no key but between", "Did you mean 'backlash'?"),
    # a hint names a key of the same dimension, all of whose words are alike
    (with_mesh(phases="0.3 rad"), "mesh a/b", "got 'phases'. Did you mean 'phase'?"),
    (train(sped=3), "train", "must have no key but speed", "Did you mean 'speed'?"),
    ({"bodies": [body("a")], "meshes": []}, "train.speed", "must be given"),
    ({"speed": 1, "meshes": [mesh("a", "b")]}, "train.bodies", "must be given"),
    (train(meshes=[]), "train.meshes", "must have at least one entry, or a shaft must have a stop"),
    (train(body("a"), {"inertia": 1}), "body number 2: name", "must be given"),
    (train("a"), "body number 1", "must be a Body or a table"),
    (with_mesh(design=3), "mesh a/b: design", "must be a GearDesign or a GearPair"),
    (with_first(motion={"order": 2}), "body a: motion", "must be a list of tables with order"),
    (train(meshes={"between": ["a", "b"]}), "train.meshes", "must be a list of tables", "Write [[train.meshes]]"),
    (train(meshes=[{"teeth": [20, 30]}]), "mesh number 1: between", "must be given"),
    (train(meshes=[mesh("a", "b") | {"between": ["a", "b", "c"]}]), "mesh a/b/c: between", "names of two bodies"),
    (train(meshes=[mesh("a", "b") | {"between": ["a", "a"]}]), "mesh a/a: between", "must be two different bodies"),
    (train(body("a"), body("a")), "body a: name", "must be that of no other part", "Give each a name"),
    (train(meshes=[mesh("a", "b", name="b")]), "mesh b: name", "must be that of no other part"),
    (train(body("a.b"), body("b")), "body a.b: name", "must be a text without", "E.g. 'driver'"),
    (train(body("ground"), body("b")), "body ground: name", "must be another name", "housing"),
    (with_first(inertia=1, fixed="yes"), "body a: fixed", "must be true or false"),
    (with_mesh(internal="yes"), "mesh a/b: internal", "must be true or false"),
    (with_mesh(teeth=None), "mesh a/b: teeth", "must be given", "Or give a design"),
    (with_mesh(helix_angle="20 deg"), "mesh a/b", "must have no key but", "one with design = 'pair.toml'"),
    (with_mesh(cone_angle="30 deg"), "mesh a/b", "must have no key but", "Gears on parallel axes are computed"),
    # how it turns
    (train(body("a"), body("b"), body("c"), body("d"), meshes=[
        mesh("a", "b"), mesh("b", "c", 30, 40), mesh("c", "d", 40, 20), mesh("d", "a", 21, 20)]),
     "mesh d/a: teeth", "must agree with the loop", "d turns -1 times as fast as a, by this one -0.95238"),
    (train(*map(body, "abc"), meshes=[mesh(*names, 20, 20) for names in ("ab", "bc", "ca")]),
     "mesh c/a: teeth", "must agree with the loop", "odd number of external meshes"),
    (train(body("a"), body("b", fixed=True)), "mesh a/b: teeth", "must let the parts turn", "since b is held"),
    (train(shafts=[{"between": ["a", "ground"], "stiffness": 1e4}]), "shaft a-ground: between",
     "must let the parts turn", "a could not turn"),
    (train(body("a"), body("b"), body("c")), "body c", "must be connected with a", "Leave it out"),
    (planets(ring={"inertia": 0.1}), "body carrier", "must have a speed that follows", "shaft to 'ground'"),
    # mean torques
    (train(body("a", torque=20), body("b", torque="-0.2 N*m")), "body b: torque", "must balance",
     "29.8 N m are left over; -30 N m would balance them"),
    (with_first(torque=20), "body a: torque", "must balance", "-30 N m at b would balance them"),
    # meshes
    (with_mesh(base_radii=["30 mm", "40 mm"]), "mesh a/b: base_radii", "ratio of the teeth, 20/30 = 0.666667"),
    (with_mesh(backlash=-1), "mesh a/b: backlash", "must not be negative", "length"),
    (with_mesh(stiffness=None), "mesh a/b: stiffness or tooth_pairs", "must be given", "Or give a design"),
    (with_mesh(backlash=None, stiffness=None), "mesh a/b: backlash, stiffness or tooth_pairs", "must be given"),
    (with_mesh(stiffness="2e8 N/mmm"), "mesh a/b: stiffness", "must be a stiffness", "not known"),
    (with_mesh(stiffness={"level": [1]}), "mesh a/b: stiffness", "or with mean, amplitudes and phases", "shares"),
    (with_mesh(stiffness={"levels": [2e8], "starts": [3]}), "mesh a/b: stiffness.starts", "must lie in [0, 1)"),
    (with_mesh(stiffness={"mean": 2e8, "amplitudes": [3e8]}), "mesh a/b: stiffness.amplitudes", "must leave", "falls"),
    (with_mesh(phase="90 deg"), "mesh a/b: phase", "of constant stiffness without error", "no effect"),
    (with_mesh(pressure_angle="20 deg"), "mesh a/b: pressure_angle", "without a planet", "no effect"),
    (with_mesh(line_of_action="20 deg"), "mesh a/b: line_of_action", "where both centres rest", "no effect"),
    (with_mesh(error_phases=[1.0]), "mesh a/b: error_phases", "must not be longer"),
    (with_mesh(damping_law="one-sided"), "mesh a/b: damping_law", "must be one of always, contact, unilateral"),
    (with_mesh(damping_law="unilateral", stiffness=None, tooth_pairs=PAIRS), "mesh a/b: damping_law",
     "must be always or contact where tooth pairs share the load", "load_sharing = 'prescribed'"),
    (train(damping_law="contacts"), "train.damping_law", "must be one of", "Did you mean 'contact'?"),
    # shafts and supports
    (with_shaft(), "shaft b-c: stiffness", "must be greater than 0, or stop", "For a rigid one"),
    (with_shaft(stop=0.1), "shaft b-c: stop_stiffness", "must be given with stop"),
    (with_shaft(stop=0.1, stop_stiffness=1e4, damping=1), "shaft b-c: damping", "without stiffness", "no effect"),
    (with_shaft(stiffness=1e4, stop_damping=1), "shaft b-c: stop_damping", "without stop", "no effect"),
    (with_first(mass="3 kg"), "body a: mass", "where the centre rests", "no effect"),
    (with_first(support={"stiffness": 1e8}), "body a: mass", "must be given where the centre moves"),
    (with_first(position=1), "body a: position", "without carrier", "no effect"),
    (train(body("a"), body("b", carrier="x", orbit=1, mass=1)), "body b: carrier", "must be one of a, b"),
    (train(body("a"), body("b", carrier="a", orbit=1, mass=1)), "mesh a/b: pressure_angle", "mesh with a planet"),
    (with_first(orbit=1), "body a: orbit", "must be given with carrier"),
    (train(body("a"), body("b", carrier="a", orbit=1, mass=1, support={"stiffness": 1e8})), "body b: support",
     "must be left out for a planet", "pin in its carrier"),
    (train(body("a"), body("b", carrier="b", orbit=1, mass=1)), "body b: carrier", "must be a body that is no"),
    (with_mesh(tooth_pairs={}), "mesh a/b: tooth_pairs.stiffness, contact_ratio", "must be given"),
    (with_mesh(tooth_pairs=PAIRS), "mesh a/b: stiffness", "must be left out beside tooth_pairs", "of its tooth pairs"),
    (with_mesh(stiffness={"mean": 2e8, "amplitudes": []}), "mesh a/b: stiffness.amplitudes", "at least one value"),
    (with_mesh(stiffness={"mean": 2e8, "amplitudes": [1e7], "phases": [0, 1]}), "mesh a/b: stiffness.phases",
     "must not be longer"),
    # planetary sets
    ({"speed": 1, "planets": 3}, "train.planets", "must be a table", "Write [train.planets]"),
    (planets(count=0), "planets: count", "whole number from 1 to 12"),
    (planets(teeth=[20, 30]), "planets: teeth", "list of three numbers of teeth"),
    (planets(count=4), "planets: count", "must divide z_sun + z_ring = 126", "Possible are 2, 3."),
    (planets(count=5, teeth=[20, 50, 120]), "planets: count", "tip circles of the planets apart", "30.39 mm"),
    (planets(teeth=[27, 36, 100]), "planets: teeth", "z_sun + 2 z_planet = 99", "no profile shift"),
    (planets(sun=None), "planets: sun", "must be given, a table"),
    (planets(cont=3), "train.planets", "must have no key but count", "Did you mean 'count'?"),
    (planets(planet={"inertia": 1e-3}), "planets: planet.mass", "where the centre moves"),
    (planets(sun_mesh={"stiffnes": 1}), "planets: sun_mesh", "must have no key but", "Did you mean 'stiffness'?"),
    # slips of units
    (planets(module=2.8), "planets: module", "between 0.01 and 100 mm", "Did you mean '2.8 mm'?"),
    (planets(pressure_angle=20), "planets: pressure_angle", "must lie between", "Did you mean '20 deg'?"),
    (planets(helix_angle=-15), "planets: helix_angle", "must lie between", "Did you mean '15 deg'?"),
    (with_mesh(base_radii=[20, 30]), "mesh a/b: base_radii[0]", "must lie between", "Did you mean '20 mm'?"),
    (with_mesh(pressure_angle=20), "mesh a/b: pressure_angle", "must lie between", "Did you mean '20 deg'?"),
    (with_mesh(stiffness="3e8 N/um"), "mesh a/b: stiffness", "must lie between 1e-06 and 1e+08 N/um"),
    (with_mesh(stiffness={"levels": [1e15, 1e8], "starts": [0, 0.5]}), "mesh a/b: stiffness.levels",
     "must lie between"),
    # the common period
    (with_mesh(teeth=[97, 101], base_radii=[0.0097, 0.0101], error_amplitudes=["1 um"], eccentricity=["1 um", "2 um"]),
     "common period", "at most 2000 cycles of the fastest excitation; got 9797", "1 of turn of a in a/b"),
    (train(frequency_tolerance=0.1), "train.frequency_tolerance", "must be from 0 to 0.05"),
]


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: str(case[1:])[1:60])
def test_what_does_not_fit_is_refused_with_its_field_and_what_to_do(case):
    table, field, *words = case
    if isinstance(table.get("meshes"), list):
        table = {**table, "meshes": [{k: v for k, v in m.items() if v is not None} for m in table["meshes"]]}
    with pytest.raises(InputError) as error:
        read_train(table, None)
    assert error.value.field == field and all(each in str(error.value) for each in words), str(error.value)


@pytest.mark.parametrize("given", [{"tip_diameter": 3}, {"phases": "0.1 mm"}])
def test_a_key_that_is_no_slip_of_the_pen_has_no_hint(given):
    for table in (with_mesh(**given), {"speed": 1, "planets": {**PLANETS, "sun_mesh": {**STIFF, **given}}}):
        with pytest.raises(InputError) as error:
            read_train(table, None)
        assert error.value.advice == ""


def test_python_names_parts_as_files_do():
    with pytest.raises(InputError, match="bodies must be a list of Body or tables"):
        gc.Train(**{**train(), "bodies": body("a")})
    with pytest.raises(InputError, match=re.escape("mesh a/b: backlash must not be negative")):
        gc.Train(**with_mesh(backlash=-1))


LOOSE = """
[train]
speed = "800 rpm"
[[train.bodies]]
name = "driver"
motion = [{ order = 2, acceleration = "300 rad/s^2" }]
[[train.bodies]]
name = "loose"
inertia = "5e-4 kg*m^2"
torque = "-0.1 N*m"
[[train.meshes]]
name = "z1/z2"
between = ["driver", "loose"]
teeth = [20, 30]
base_radii = ["30 mm", "45 mm"]
stiffness = "2e8 N/m"
damping = "60 N*s/m"
backlash = "0.12 mm"
"""


def load(tmp_path, text=LOOSE, design="", **values):
    (tmp_path / "train.toml").write_text(text)
    (tmp_path / "pair.toml").write_text(design)
    return load_study(tmp_path / "train.toml", values)


def test_a_file_is_the_train_of_its_tables(tmp_path):
    assert load(tmp_path).model.train == gc.Train(
        speed=800, bodies=[gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300}]),
                           gc.Body(name="loose", inertia=5e-4, torque=-0.1)],
        meshes=[gc.Mesh(name="z1/z2", between=("driver", "loose"), teeth=(20, 30), base_radii=(0.03, 0.045),
                        stiffness=2e8, damping=60, backlash=0.12e-3)])
    assert dict(load(tmp_path).model.initial) == {}


@pytest.mark.parametrize(("name", "value", "found"), [
    ("speed", 900, lambda t: t.speed), ("speed", "900 rpm", lambda t: t.speed), ("torque", 0.2, lambda t: t.torque),
    ("loose.torque", "-0.2 N*m", lambda t: t.bodies[1].torque), ("loose.inertia", 1e-3, lambda t: t.bodies[1].inertia),
    ("z1/z2.backlash", 1e-4, lambda t: t.meshes[0].backlash), ("damping_law", "always", lambda t: t.damping_law),
    ("z1/z2.stiffness", "3e8 N/m", lambda t: t.meshes[0].stiffness)])
def test_values_are_set_by_name(name, value, found, tmp_path):
    assert found(load(tmp_path, **{name: value}).model.train) == {
        "speed": 900, "loose.torque": -0.2, "z1/z2.stiffness": 3e8}.get(name, value)


SHAFT = """
[[train.bodies]]
name = "far"
inertia = 1e-3
[[train.shafts]]
between = ["loose", "far"]
stiffness = "1e4 N*m/rad"
"""


def test_deflections_begin_where_the_file_says(tmp_path):
    text = LOOSE + SHAFT + """
[initial]
deflections = { "z1/z2" = "-120 um", "loose-far" = "0.1 deg" }
deflection_rates = { "z1/z2" = "1 mm/s", "loose-far" = 0.5 }
"""
    model = load(tmp_path, text).model
    length, rate = model.units.length, model.units.rate
    assert model.initial["z"] == pytest.approx(-1.0)  # on the back flank: half the backlash from the middle
    assert model.initial["z_dot"] == pytest.approx(1e-3 / (length * rate))
    assert model.initial["loose-far.z"] == pytest.approx(math.radians(0.1) / length)
    assert model.initial["loose-far.z_dot"] == pytest.approx(0.5 / (length * rate))


def test_a_deflection_is_measured_from_the_front_flank_of_the_backlash_that_is_set(tmp_path):
    text = LOOSE + '[initial]\ndeflections = { "z1/z2" = "0 um" }\n'
    model = load(tmp_path, text, **{"z1/z2.backlash": 1e-4}).model
    assert model.initial["z"] * model.units.length == pytest.approx(0.5e-4)
    assert load(tmp_path, text, z=0.3).model.initial["z"] == 0.3


def test_what_is_left_out_begins_at_the_static_deflection_at_rest(tmp_path):
    found = gc.simulate(load(tmp_path, LOOSE.replace('acceleration = "300', 'acceleration = "0')).model, periods=1)
    deflection = found.section_deflection.values[0, 0] * load(tmp_path).model.units.length
    assert deflection == pytest.approx(0.1 / 0.045 / 2e8, rel=1e-9)


DESIGN = """
[design]
teeth = [20, 40]
module = "3 mm"
face_width = "20 mm"
bore = "20 mm"
backlash = { value = "0.1 mm", of = "line of action, total" }
stiffness = "ISO 6336-1"
"""
LOAD_FREE = DESIGN.replace("ISO 6336-1", "potential energy")
LOADED = f"{DESIGN}damping_ratio = 0.05\n[operation]\nspeed = 1000\ntorque = 50\n"
UNDAMPED = "\n".join(line for line in LOOSE.splitlines() if not line.startswith(
    ("teeth", "base_radii", "stiffness", "backlash", "damping"))) + '\ndesign = "pair.toml"\n'
OF_DESIGN = f'{UNDAMPED}damping = "60 N*s/m"\n'


def test_a_mesh_takes_the_values_of_a_design_beside_the_file(tmp_path):
    found = load(tmp_path, OF_DESIGN, LOADED.replace("damping_ratio = 0.05\n", "")).model.train
    pair = gc.GearDesign.from_tables(
        {"teeth": [20, 40], "module": "3 mm", "face_width": "20 mm", "bore": "20 mm", "damping_ratio": 0.05,
         "backlash": {"value": "0.1 mm", "of": "line of action, total"}}, {"speed": 1000, "torque": 50}).to_pair()
    (one,) = found.meshes
    assert (one.teeth, one.backlash, one.damping) == ((20, 40), pair.backlash, 60)
    assert load(tmp_path, UNDAMPED, LOADED).model.train.meshes[0].damping == pair.k
    assert one.base_radii == pytest.approx((pair.R1, pair.R2), rel=1e-12)


def test_a_design_without_load_will_do_where_its_values_do_not_depend_on_it(tmp_path):
    loaded, free = (load(tmp_path, OF_DESIGN, LOAD_FREE + operation).model.train.meshes[0]
                    for operation in ("[operation]\nspeed = 1000\ntorque = 500\n", ""))
    assert loaded == free


def test_a_mesh_that_closes_a_loop_begins_where_the_others_say():
    square = train(*map(body, "abcd"), meshes=[mesh(*names, 20, 20) for names in ("ab", "bc", "cd", "da")])
    with pytest.raises(InputError, match="follows from those of other meshes"):
        initial_of(TrainModel(read_train(square, None)), {"deflections": {"d/a": 0}})


@pytest.mark.parametrize(("text", "values", "field", "words"), [
    # another table beside the train
    (f"{LOOSE}[model]\nomega = 1", {}, "[model]", "must be left out"),
    (f"{LOOSE}[gearpair]\nn1 = 20\nn2 = 40\nI1 = 1\nI2 = 1\nR1 = 1\nR2 = 2\nc0 = 1e8\nk = 1\nbacklash = 1e-4\n"
     "M10 = 9\nspeed = 3", {}, "[gearpair]", "must be left out"),
    (f"{LOOSE}{LOADED}", {}, "[design]", "must be left out"),
    (f"{LOOSE}[operation]\nspeed = 3", {}, "[operation]", "must be left out without [design]"),
    # values that are set
    (LOOSE, {"loose.tork": 1}, "parameter", "must be one of"),
    (LOOSE, {"train.speed": 3}, "parameter", "must be one of"),
    (LOOSE, {"driver.torque": 3}, "parameter", "must be one of"),
    (LOOSE, {"kind": "single"}, "kind", "must be left out for a train"),
    (LOOSE, {"loose.inertia": -1}, "body loose: inertia", "greater than 0"),
    (LOOSE, {"damping_law": "one-sided"}, "damping_law", "must be one of"),
    # initial values
    ('deflections = { "z1/z3" = 0 }', {}, "initial.deflections: mesh or shaft", "must be one of"),
    ('deflections = { "z1/z2" = "1 N" }', {}, "initial.deflections: z1/z2", "must be a length"),
    ("deflections = 3", {}, "initial.deflections", "must be a table"),
    ("angles = { loose = 0 }", {}, "initial.angles", "must be left out"),
    ("deflection = 3", {}, "key of [initial]", "must be one of"), ("x1 = 3", {}, "key of [initial]", "must be one of"),
    # the design of a mesh
    (OF_DESIGN, {"design": DESIGN}, "mesh z1/z2: design", "[operation] with speed and torque"),
    (UNDAMPED, {"design": LOAD_FREE}, "mesh z1/z2: design: damping_ratio", "must be given"),
    (OF_DESIGN.replace("pair.toml", "no.toml"), {}, "no.toml: study file", "must be a readable file"),
], ids=lambda value: str(value)[-40:])
def test_what_is_wrong_in_a_file_with_a_train_is_named(text, values, field, words, tmp_path):
    with pytest.raises(InputError) as error:
        load(tmp_path, text if "[train]" in text else f"{LOOSE}[initial]\n{text}\n", **values)
    assert error.value.field == field and words in str(error.value)


def test_a_fourier_series_of_the_stiffness_keeps_its_mean_and_first_harmonic():
    series = {"mean": "2e8 N/m", "amplitudes": ["4e7 N/m"], "phases": ["30 deg"]}
    found = gc.Train(**with_mesh(stiffness=series))
    levels = np.array(found.meshes[0].stiffness.steps.levels)
    middles = (np.arange(len(levels)) + 0.5) / len(levels)
    assert levels.mean() == pytest.approx(2e8, rel=1e-12)
    assert np.allclose(levels, 2e8 + 4e7 * np.cos(2 * np.pi * middles - math.pi / 6), rtol=0, atol=4e7 * 1e-3)
    assert any("Fourier series" in text for text in found.warnings)


@pytest.mark.parametrize(("law", "count"), [("contact", 32), ("unilateral", 16)])
def test_there_are_as_many_contacts_as_a_whole_number_has_bits_for(law, count):
    """A flank that releases has two."""
    names = [f"b{i}" for i in range(count + 1)]
    bodies = [gc.Body(name=name, inertia=1e-3) for name in names]
    whole = gc.Train(speed=1000.0, damping_law=law, bodies=bodies, meshes=[
        gc.Mesh(**mesh(*ends, z2=20)) for ends in itertools.pairwise(names)])
    few = replace(whole, bodies=whole.bodies[:-1], meshes=whole.meshes[:-1])
    assert len(switched_system(vary(TrainModel(few), {})).contacts.sides) == 2 * count - 2
    with pytest.raises(InputError, match=r"must have at most 62 .* got 64") as refused:
        switched_system(vary(TrainModel(whole), {}))
    assert ("count twice" in refused.value.advice) == (law == "unilateral")


@pytest.mark.parametrize(("laws", "law", "words"), [
    ((None, None), "unilateral", "in contact alone, never pulling"),
    (("always", None), "contact", "also across the gap: a/b; in contact alone: b/c, c-d"),
    (("always", "always"), "unilateral", "also across the gap: a/b, b/c; in contact alone, never pulling: c-d")])
def test_damping_is_told_by_mesh_where_laws_differ(laws, law, words):
    stops = gc.Shaft(between=("c", "d"), stop=0.1, stop_stiffness=1e5)
    meshes = [gc.Mesh(**mesh(*ends, damping_law=own)) for ends, own in zip(("ab", "bc"), laws, strict=True)]
    bodies = [gc.Body(name=name, inertia=1e-3) for name in "abcd"]
    whole = gc.Train(speed=1000.0, bodies=bodies, meshes=meshes, shafts=[stops], damping_law=law)
    assert TrainModel(whole).damping_in_words == words


def test_tooth_pairs_of_a_mesh_share_its_load():
    table = with_mesh(tooth_pairs=PAIRS)
    del table["meshes"][0]["stiffness"]
    found = read_train(table, None).meshes[0]
    assert found.tooth_pairs.relief.amount == pytest.approx((20e-6, 20e-6))
    contacts = found.contacts()
    share = np.diff(contacts.edges[0], append=1.0)
    assert contacts.stiffness[0][contacts.sides > 0].sum(axis=0) @ share == pytest.approx(1.6 * 1.5e8)


def test_meshes_of_planets_are_ahead_by_their_teeth_and_positions():
    found = read_train(planets(count=3, teeth=[20, 19, 58]), None)
    for n, (sun, ring) in enumerate(zip(found.meshes[::2], found.meshes[1::2], strict=True)):
        assert sun.phase == pytest.approx(-20 * 2 * math.pi * n / 3)
        assert ring.phase == pytest.approx(58 * 2 * math.pi * n / 3 + 20 * math.pi)
    assert math.cos(read_train(planets(), None).meshes[1].phase) == pytest.approx(-1)  # half a cycle behind the sun's


def test_planets_around_a_held_sun_follow_each_other_the_other_way():
    found = read_train(planets(sun={"fixed": True}, ring={"inertia": 0.1}, teeth=[20, 19, 58]), None)
    assert [each.name for each in found.bodies][:3] == ["carrier", "ring", "sun"]
    assert found.meshes[2].phase == pytest.approx(20 * 2 * math.pi / 3)
    assert found.meshes[3].phase == pytest.approx(-58 * 2 * math.pi / 3 + 20 * math.pi)


def test_an_order_may_be_a_fraction_in_words():
    assert TorqueOrder(order="22/7", amplitude=1).ratio == Fraction(22, 7)


def driven(speed):
    """A motor whose torque falls from 25 N m at 1500 rpm to 0 at 3000, and a pump, at 2/3 of its speed, whose load
    rises from 5 N m at 100 rpm to 60 at 3000."""
    motor = gc.Body(name="motor", inertia=1e-3, torque_over_speed={"speed": [0, 1500, 3000], "torque": [40, 25, 0]})
    pump = gc.Body(name="pump", inertia=2e-3, torque_over_speed={"speed": [100, 3000], "torque": [-5, -60]})
    mesh = gc.Mesh(between=("motor", "pump"), teeth=(24, 36), base_radii=(0.02, 0.03), stiffness=3e8, backlash=1e-4)
    return gc.Train(speed=speed, bodies=[motor, pump], meshes=[mesh])


def test_the_speed_at_which_a_motor_and_its_load_balance_is_named():
    """50 - n/60 = (2/3) (5 + (55/2900) (2n/3 - 100))."""
    expected = (50 - 2 / 3 * (5 - 5500 / 2900)) / (1 / 60 + 4 / 9 * 55 / 2900)
    with pytest.raises(InputError, match="left over here; by torque_over_speed all balance at") as error:
        driven(1000)
    named = float(re.search(r"balance at ([\d.]+) rpm", str(error.value))[1])
    assert named == pytest.approx(expected, rel=1e-11) and driven(named).torque > 0
    with pytest.raises(InputError, match="balance at no speed of the tables"):
        load = gc.Body(name="pump", inertia=2e-3, torque="-61 N*m")
        gc.Train(speed=1000, bodies=[driven(named).bodies[0], load], meshes=driven(named).meshes)
