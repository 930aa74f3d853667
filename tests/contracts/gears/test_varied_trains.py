"""Trains at other values are the trains with these values; results of trains as those of one of their meshes."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.summaries import map_document, print_map
from gearchaos.datasets import of_mesh
from gearchaos.errors import InputError
from gearchaos.explorer.core.models import limits
from gearchaos.gears.operation.operating import as_model, gears_from_json, gears_json, gears_of, model_of_gears
from gearchaos.model import has_effect, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.operation.factor_context import words_beside
from gearchaos.studyfile import load_study
from tests import ROOT
from tests.contracts.gears.test_operating import SHORT
from tests.oracles.random_trains import SHAPES, random_train

ARRAYS = ("pushes", "damping", "stiffness", "offset", "f_cos", "f_sin", "rows", "rates")


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_every_parameter_varies_as_a_train_with_its_value(shape):
    model = as_model(random_train(shape, np.random.default_rng([1, SHAPES.index(shape)])))
    for name, value in model.parameters().items():
        if name.endswith("torque") or value == 0:
            continue
        batch, own = vary(model, {name: [value, 1.1 * value]}), vary(model.with_values({name: 1.1 * value}), {})
        found, expected = switched_system(batch), switched_system(own)
        of = {n: (getattr(found, n)[1], getattr(expected, n)[0]) for n in ("A", "f0", "static_force")}
        of["start"] = initial_state(batch, found)[1], initial_state(own, expected)[0]
        for array in ARRAYS:
            one, other = getattr(found.contacts, array), getattr(expected.contacts, array)
            of[array] = (one, other) if array in ("rows", "rates") else (one[1], other[0])
        for array, (one, other) in of.items():
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13 * np.abs(other).max(initial=1.0),
                                       err_msg=f"{array} over {name}")


def equations(model, values):
    """What a motion follows from: the system at the values, and the state in which it begins."""
    batch = vary(model, values)
    system = switched_system(batch)
    contacts = [] if system.contacts is None else [getattr(system.contacts, name) for name in ARRAYS]
    return [system.A, system.f0, system.static_force, initial_state(batch, system), *contacts]


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_its_own_value_changes_nothing(path):
    """Neither set nor varied: no sign, unit or reference is lost between the file, what is printed and what is set."""
    model = load_study(path).model
    own = equations(model, {})
    for name in ("speed", "torque") * (gears_of(model) is not None) + tuple(model.parameters()):
        if model.kind != "train" and not has_effect(name, model.kind):
            continue
        given = {name: model.value(name)}
        alone = not name.endswith(".torque") and given[name] != 0  # torques balance; damping alone is a coordinate
        varied = [equations(model, given)] if alone else []
        for found in (equations(model.with_values(given), {}), *varied):
            for one, other in zip(found, own, strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13 * np.abs(other).max(initial=1.0),
                                           err_msg=name)


def test_the_torque_of_a_train_has_the_sign_of_its_body():
    """A generator is braked, and driven by the back flanks: at -30 N m by 30 N m over 45 mm."""
    bodies = [gc.Body(name="generator", inertia=1e-3, torque=-30.0), gc.Body(name="turbine", inertia=2e-3, torque=45.0)]
    model = as_model(gc.Train(speed=3000.0, bodies=bodies, meshes=[mesh("generator", "turbine")]))
    assert model.value("torque") == -30 and model.with_values({"torque": "-30 N*m"}).train.bodies == model.train.bodies
    found = switched_system(vary(model, {"torque": [-30.0, -60.0, 30.0]})).static_force[:, 0]
    assert found * model.units.force == pytest.approx(np.array([-30.0, -60.0, 30.0]) / 0.03)
    run = gc.RunUp(model.train, "speed=3000:3100", 1.0, torque={"time": [0, 1], "torque": [-10, -60]})
    assert run.model.value("torque") == -60
    assert limits(model, "torque") == (-1e6, -0.03)


DRIVER = gc.Body(name="driver", motion=[{"order": 2, "acceleration": 300.0}])


def mesh(*between: str) -> gc.Mesh:
    return gc.Mesh(between=between, teeth=(20, 30), base_radii=(0.03, 0.045), stiffness=2e8, damping=60, backlash=1e-4)


def two_wheels(**shaft: float) -> gc.Train:
    bodies = [gc.Body(name=name, inertia=1e-3) for name in ("a", "b", "c")]
    return gc.Train(speed=600, bodies=bodies, meshes=[mesh("a", "b")], shafts=[gc.Shaft(
        between=("b", "c"), **{"stop": 0.01, "stop_stiffness": 1e3, "stop_damping": 0.1, **shaft})])


@pytest.mark.parametrize(("name", "rule"), [
    ("a.damping", "must be varied where a body has damping"), ("b-c.stiffness", "must be one of"),
    ("b-c.damping", "must be one of")])
def test_what_would_have_no_effect_or_half_of_it_cannot_be_varied(name, rule):
    with pytest.raises(InputError, match=re.escape(rule)):
        vary(as_model(two_wheels()), {name: [1.0, 2.0]})
    assert vary(as_model(two_wheels(stiffness=1e3, damping=0.1)), {"b-c.damping": [0.0, 1.0]}).size == 2


DESIGN = gc.GearDesign(
    teeth=(20, 30), module="3 mm", face_width="20 mm", quality={"standard": "ISO 1328-1:1995", "grade": 6},
    transmission_error="from quality (typical)", damping_ratio=0.05, bore="10 mm", speed=600, torque=50,
    backlash={"value": "0.1 mm", "of": "line of action"})


def designed(**given: Any) -> gc.Train:
    bodies = [gc.Body(name="a", inertia=1e-3, torque=50), gc.Body(name="b", inertia=1e-3, torque=-75)]
    return gc.Train(speed=600, bodies=bodies, meshes=[gc.Mesh(between=("a", "b"), design=DESIGN, **given)])


STIFFNESS, ERROR, RATIO = "stiffness by ISO 6336-1", "error from quality (typical)", "ζ 0.05"


@pytest.mark.parametrize(("given", "words"), [
    ({}, [STIFFNESS, ERROR, RATIO]), ({"damping": 600}, [STIFFNESS, ERROR]), ({"stiffness": 3e8}, [ERROR, RATIO]),
    ({"error_amplitudes": ["3 um"], "error_phases": [0]}, [STIFFNESS, RATIO]),
    ({"assumed": {"damping": "c guessed"}}, ["c guessed"])])
def test_what_a_mesh_takes_from_a_design_is_assumed_unless_it_is_given(given, words):
    train = designed(**given)
    assert train.assumptions == (f"{', '.join(words)}: a/b",)
    assert gears_from_json(gears_json(train)).assumptions == train.assumptions
    assert replace(train, speed=700).assumptions == train.assumptions


def test_a_value_that_is_set_is_no_longer_assumed():
    model = as_model(designed())
    assert model.with_values({"a/b.damping": 700.0}).assumptions == (f"{STIFFNESS}, {ERROR}: a/b",)
    assert model.with_values({"a/b.stiffness": 3e8}).assumptions == (f"{ERROR}, {RATIO}: a/b",)
    assert model.with_values({"a/b.backlash": 2e-4}).assumptions == model.assumptions


def test_a_speed_that_is_set_may_be_that_of_another_body():
    model = as_model(designed())
    assert model.with_values({"speed": {"b": "300 rpm"}}).train.speed == pytest.approx(450, rel=1e-14)
    for value, message in (({"c": 1}, "must be one of a, b"), ({"a": 1, "b": 2}, "must be that of one body")):
        with pytest.raises(InputError, match=message):
            model.with_values({"speed": value})
    with pytest.raises(InputError, match="torque must be a torque"):
        model.with_values({"torque": {"b": 3}})


def test_what_is_left_open_without_a_design_is_said():
    three = two_wheels(stiffness=1e3)
    assert three.assumptions == ("no transmission error: a/b", "no damping: b-c")
    names = list("abcdef")
    chain = gc.Train(speed=600, bodies=[gc.Body(name=n, inertia=1e-3) for n in names], meshes=[
        replace(mesh(*ends), teeth=(20, 20), base_radii=(0.03, 0.03), error_amplitudes=["1 um"])
        for ends in pairwise(names)])
    assert chain.assumptions == ("phase 0: a/b, b/c, c/d and 2 others",)
    with pytest.raises(InputError, match="assumed must be a table of texts"):
        designed(assumed="grade 6")


def test_a_damping_of_0_that_is_given_is_not_assumed():
    stop = {"between": ("b", "c"), "stop": 0.01, "stop_stiffness": 1e3}
    bodies = [gc.Body(name=name, inertia=1e-3) for name in "abc"]
    for shaft, pair, words in (
            ({}, {}, ("no damping: a/b, b-c",)), ({"stop_damping": 0}, {}, ("no damping: a/b",)),
            ({"stiffness": 1e3, "damping": 0}, {"damping": "0 N*s/m"}, ()), ({}, {"damping": 5}, ("no damping: b-c",))):
        train = gc.Train(speed=600, bodies=bodies, shafts=[gc.Shaft(**stop, **shaft)], meshes=[
            gc.Mesh(between=("a", "b"), teeth=(20, 20), base_radii=(0.03, 0.03), stiffness=1e8, backlash=1e-4,
                    error_amplitudes=["1 um"], **pair)])
        assert train.assumptions == words
        assert gears_from_json(gears_json(train)).assumptions == replace(train, speed=700).assumptions == words
        given = model_of_gears(train).with_values({"a/b.damping": 0.0})
        assert "a/b" not in "".join(given.assumptions)


def test_the_ring_of_a_set_with_a_design_says_what_it_takes_from_the_sun():
    held = gc.PlanetarySet(count=4, teeth=(20, 30, 80), design=DESIGN, sun={"inertia": 1e-3}, carrier={"inertia": 1e-2},
                           ring={"fixed": True}, planet={"inertia": 1e-3, "mass": 0.5, "pin": {"stiffness": 1e8}},
                           ring_mesh={"backlash": 1e-4})
    assert list(held.meshes[1].assumed.values()) == [
        "stiffness by ISO 6336-1, the ring as a rack, in jumps as tooth pairs come and go",
        "damping of the sun mesh", "no transmission error"]


TABLE = {"speed": ["200 rpm", "600 rpm", "1000 rpm"], "torque": ["-0.05 N*m", "-0.1 N*m", "-0.3 N*m"]}


def loose(**torque):
    bodies = [DRIVER, gc.Body(name="loose", inertia=5e-4, **torque)]
    return gc.Train(speed=600.0, bodies=bodies, meshes=[mesh("driver", "loose")])


@pytest.mark.slow
def test_a_drag_over_the_speed_is_that_of_the_body_at_each_speed():
    """The wheel turns at two thirds of the speed: 400, 600 and 800 rpm."""
    model = as_model(loose(torque_over_speed=TABLE))
    found = switched_system(vary(model, {"speed": [600.0, 900.0, 1200.0]}))
    forces = np.array([0.075, 0.1, 0.2]) / 0.045 / model.units.force
    assert found.static_force[:, 0] == pytest.approx(forces, rel=1e-13)
    assert model.train.torque == pytest.approx(-0.075)
    assert model.with_values({"speed": 1200.0}).train.torque == pytest.approx(-0.2)
    scan = gc.rattle(model.train, "speed=1200:1200:1")  # the table has no torque at other speeds
    assert gc.physical(scan).mesh_peak_force.shape == (3, 1, 1)


def test_a_free_train_whose_load_does_not_balance_at_a_speed_is_refused():
    load = {"speed": ["300 rpm", "900 rpm"], "torque": ["-15 N*m", "-45 N*m"]}
    bodies = [gc.Body(name="motor", inertia=1e-3, torque=20.0),
              gc.Body(name="pump", inertia=1e-3, torque_over_speed=load)]
    train = gc.Train(speed=900.0, bodies=bodies, meshes=[mesh("motor", "pump")])
    vary(as_model(train), {"speed": [900.0]})
    with pytest.raises(gc.InputError, match="balance at each speed; got 'torques that do not at 1200 rpm'"):
        vary(as_model(train), {"speed": [900.0, 1200.0]})


@pytest.mark.parametrize(("given", "words"), [
    (lambda: loose(torque=-0.1, torque_over_speed=TABLE), "torque must be left out beside torque_over_speed"),
    (lambda: loose(torque_over_speed={**TABLE, "torque": [1.0]}), r"torque_over_speed.torque must have 3 values"),
    (lambda: loose(torque_over_speed={**TABLE, "speed": [1.0, 3.0, 2.0]}), "must be two or more rising values"),
    (lambda: loose(torque_over_speed=TABLE).at(speed=1600.0), "must have the speed 1066.67 rpm .* '200 to 1000 rpm'"),
    (lambda: vary(as_model(loose(torque_over_speed=TABLE)), {"torque": [0.1]}), "torque must be left out where"),
])
def test_a_table_of_drag_that_does_not_do_is_refused(given, words):
    with pytest.raises(gc.InputError, match=words):
        given()


@pytest.fixture(scope="module")
def found():
    loads = {"one": -0.3, "other": -0.08}
    bodies = [DRIVER, *(gc.Body(name=name, inertia=5e-4, torque=torque) for name, torque in loads.items())]
    train = gc.Train(speed=800.0, bodies=bodies, meshes=[mesh("driver", name) for name in loads])
    return gc.zones(train, "speed=790:800:2", "one.torque=-0.3:-0.29:2", settings=SHORT)


@pytest.mark.slow
def test_the_measures_are_those_of_the_mesh(found):
    first, second = (of_mesh(found, name) for name in ("driver/one", "driver/other"))
    assert not first.contact.any() and second.contact.values.all()
    assert np.array_equal(second.contact, found.contact)
    assert np.array_equal(second.dynamic_factor, found.mesh_dynamic_factor.sel(mesh="driver/other"))
    assert "v_rms" not in second and "v_rms" in found


def test_what_is_drawn_and_printed_says_of_which_mesh_it_is(found, capsys):
    legends = [gc.plot.level(ds, "contact").get_legend() for ds in (found, of_mesh(found, "driver/one"))]
    titles = [legend.get_title().get_text().replace("\n", " ") for legend in legends]
    assert titles[0].endswith("of the worst mesh") and titles[1].endswith("of driver/one")
    assert words_beside(found, "z_rms") == ["of driver/one"] and words_beside(found, "switches") == ["of all meshes"]
    document = map_document(found)
    assert document["largest"]["mesh"] == "driver/other" and document["contact"] == {"two-sided": 4}
    print_map(document, found)
    assert capsys.readouterr().out.startswith("worst mesh, one motion each: hit both flanks 100 % of the cells\n")


def test_a_mesh_that_is_not_there_is_refused(found):
    with pytest.raises(InputError, match="must be one of driver/one, driver/other"):
        of_mesh(found, "third")
    with pytest.raises(InputError, match="must be left out for a result without meshes"):
        of_mesh(gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1:2", "eps1=0:0.1:2"), "third")
