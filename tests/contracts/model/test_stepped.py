"""A stepped stiffness everywhere that a model goes: bad input, names, files, stores, pictures and the explorer."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos import plot
from gearchaos.datasets import model_from_json, model_json
from gearchaos.errors import InputError
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.core.text import as_python, as_toml, from_query, pair_at, to_query
from gearchaos.explorer.web.form import field_values, parameter_form, plane_menus
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, SteppedStiffness, TwoLevelStiffness, mesh_stiffness, vary
from gearchaos.model.switched import switched_system
from gearchaos.plot.axes import new_axes
from gearchaos.store.record import from_record, to_record
from gearchaos.studies.core.cost import estimate
from gearchaos.studyfile import load_study
from tests import EXAMPLES

STEPS = SteppedStiffness((1.2, 0.7, 1.05, 0.9), (0.1, 0.3, 1 / 3, 0.8))
MODEL = MeshModel.of(omega=0.9, eps1=0.1, stiffness=STEPS)
SHORT = gc.Classification(longest_transient=400, doublings=1, averaging_periods=16)


@pytest.mark.parametrize(("levels", "starts", "message"), [
    ((), (), "stiffness.levels must have 1 to 64 levels; got 0"),
    ((1.0,) * 65, tuple(np.arange(65) / 65), "stiffness.levels must have at most 64 levels; got 65"),
    ((1.0, 0.5), (0.0,), r"stiffness.starts must have as many values as levels \(2\); got 1"),
    ((1.0, 0.0), (0.0, 0.5), "stiffness.levels must be greater than 0; got 0.0"),
    ((1.0, np.nan), (0.0, 0.5), "stiffness.levels must be a finite number; got nan"),
    ((1.0, 1e13), (0.0, 0.5), "stiffness.levels must be at most 1e"),
    ((1.0, "2"), (0.0, 0.5), "stiffness.levels must be a number"),
    (1.0, (0.0,), "stiffness.levels must be a list of numbers"),
    ((1.0, 0.5), (0.0, 1.0), r"stiffness.starts must lie in \[0, 1\); got 1.0"),
    ((1.0, 0.5), (-0.1, 0.5), r"stiffness.starts must lie in \[0, 1\); got -0.1"),
    ((1.0, 0.5), (0.5, 0.5), r"stiffness.starts must increase strictly; got \(0.5, 0.5\)"),
    ((1.0, 0.5), (0.5, 0.2), "stiffness.starts must increase strictly.*Sort the levels"),
])
def test_bad_steps_are_refused(levels, starts, message):
    with pytest.raises(InputError, match=message):
        SteppedStiffness(levels, starts)


def test_steps_are_values_and_may_be_lists_and_arrays():
    assert SteppedStiffness(np.array(STEPS.levels), list(STEPS.starts)) == STEPS
    assert SteppedStiffness([2], [0]).levels == (2.0,)
    again = MeshModel.of(omega=0.9, eps1=0.1, stiffness=SteppedStiffness(STEPS.levels, STEPS.starts))
    assert again == MODEL and hash(again) == hash(MODEL)
    assert MODEL.with_values({"stiffness": replace(STEPS, levels=(1.2, 0.7, 1.05, 0.8))}) != MODEL
    assert pickle.loads(pickle.dumps(MODEL)) == eval(repr(MODEL), vars(gc.model)) == MODEL


def test_steps_are_set_as_a_whole_and_have_no_names():
    assert MeshModel.of().with_values({"stiffness": STEPS}).stiffness == STEPS
    assert MODEL.with_values({"omega": 2.0, "kind": "full", "kappa": 0.7}).stiffness == STEPS
    assert MODEL.with_values({"stiffness": TwoLevelStiffness()}).stiffness == TwoLevelStiffness()
    assert not {"chi1", "chi2", "contact_ratio", "c1", "levels", "starts"} & MODEL.parameters().keys()


@pytest.mark.parametrize(("name", "rule", "advice"), [
    ("chi1", "must be a parameter of a two-level stiffness", "has steps: set stiffness=TwoLevelStiffness"),
    ("chi0", "must be a parameter of a two-level stiffness", "has steps"),
    ("c1", "must be a parameter of a Fourier stiffness", "has steps. Begin with MeshModel.of"),
    ("levels", "must be one of", ""),
])
def test_names_of_other_stiffnesses_are_refused(name, rule, advice):
    for refuse in (lambda: MODEL.with_values({name: 0.1}), lambda: vary(MODEL, {name: [0.1]})):
        with pytest.raises(InputError) as caught:
            refuse()
        assert name in str(caught.value) and rule in str(caught.value) and advice in str(caught.value)


def test_files_and_stores_keep_the_steps(tmp_path):
    assert model_from_json(model_json(MODEL)) == MODEL
    with pytest.raises(InputError, match=r"stiffness\.kind must be one of"):
        model_from_json(model_json(MODEL).replace('"steps"', '"stairs"'))
    gc.save(gc.simulate(MODEL, 3, samples=8), tmp_path / "motion.nc")
    assert model_from_json(gc.load(tmp_path / "motion.nc").attrs["model"]) == MODEL
    study = gc.Zones(MODEL, gc.Axis("omega", 0.8, 1.0, 4), gc.Axis("eps1", 0.0, 0.2, 3), settings=SHORT)
    assert from_record(json.loads(json.dumps(to_record(study)))) == study
    gc.run(study, out=tmp_path / "map.zarr", tile=4)
    stored = xr.open_zarr(tmp_path / "map.zarr")
    np.testing.assert_array_equal(stored.label, gc.zones(MODEL, study.x, study.y, settings=SHORT).label)


@pytest.mark.parametrize(("table", "message"), [
    ('kind = "steps"\nlevels = [1.2]', "stiffness.starts must have as many values"),
    ('kind = "steps"\nlevels = [1.2]\nstarts = [0.0]\nchi1 = 0.1', "chi1 must be left out for kind 'steps'"),
    ('kind = "steps"\nlevels = [1.2]\nstarts = [0.0]\nphases = [0.1]', "phases must be left out for kind 'steps'"),
    ('levels = [1.2]\nstarts = [0.0]', "levels must be left out for kind 'two-level'.*steps takes levels and starts"),
    ('kind = "steps"\nlevels = 1.2\nstarts = [0.0]', "model.stiffness.levels must be a valid list"),
    ('kind = "steps"\nlevels = ["1"]\nstarts = [0.0]', r"model.stiffness.levels\[0\] must be a valid number"),
])
def test_a_study_file_has_steps_and_bad_ones_are_refused(table, message, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text('[model.stiffness]\nkind = "steps"\nlevels = [1.2, 0.7]\nstarts = [0, 0.25]\n')
    assert load_study(path).model.stiffness == SteppedStiffness((1.2, 0.7), (0.0, 0.25))
    path.write_text(f"[model.stiffness]\n{table}\n")
    with pytest.raises(InputError, match=message):
        load_study(path)


def test_the_picture_has_the_steps():
    ax = plot.stiffness(MODEL, new_axes(None), periods=2)
    values, edges, _ = ax.patches[0].get_data()
    tau = np.linspace(0, 2, 401)[:-1] + 0.0025 / 7
    drawn = values[np.searchsorted(edges, tau, side="right") - 1]
    np.testing.assert_array_equal(drawn, mesh_stiffness(MODEL, tau * MODEL.period))
    assert edges[0] <= 0 and edges[-1] >= 2 and ax.get_xlim() == (0, 2)


def test_the_explorer_shows_and_keeps_steps(tmp_path):
    view = view_of(MODEL, gc.Axis("omega", 0.5, 2.0, 3), gc.Axis("eps1", 0.0, 0.2, 3))
    assert from_query(to_query(view), presets()["2"].view) == view
    assert not {"chi1", "c1"} & field_values(view).keys()
    menus = (*parameter_form(view, (), view).menus, *plane_menus(view, Units(marked=False)))
    assert "steps" in dict({menu.name: menu for menu in menus}["stiffness"].options)
    path = tmp_path / "copied.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    assert load_study(path).model == view.point
    names: dict = {}
    exec(as_python(view).split("verdict")[0], names)
    assert names["model"] == view.point


def test_the_explorer_changes_to_steps_and_back():
    start = presets()["2"].view
    stepped = start.with_stiffness("steps")
    assert stepped.model.stiffness == SteppedStiffness((1.25, 0.75), (0.0, 0.5))
    assert stepped.with_stiffness("two-level").point == start.point
    assert stepped.with_stiffness("harmonics").with_stiffness("steps") == stepped
    many = SteppedStiffness(tuple(1 + np.sin(np.arange(64)) / 3), tuple(np.arange(64) / 64 + 1e-3 / 3))
    view = view_of(MeshModel.of(kind="full", stiffness=many, eps1=1 / 3, zeta=1 / 30, J1=1 / 0.7, kappa=1 / 3))
    assert from_query(to_query(view), start) == view, "64 levels fit into the address bar"


@pytest.mark.parametrize("query", [
    "stiffness=steps", "stiffness=steps&levels=1&starts=x", "stiffness=steps&levels=1,2&starts=0",
    "stiffness=steps&levels=30&starts=0", "levels=1&starts=0",
])
def test_absurd_steps_in_the_address_are_refused(query):
    with pytest.raises(InputError):
        from_query(query, presets()["2"].view)


def test_a_gear_pair_has_steps():
    pair = load_study(EXAMPLES / "physical_pair.toml").pair
    found = pair_at(pair, pair.to_model("torsional").with_values({"stiffness": STEPS}))
    assert found.stiffness_starts == STEPS.starts
    assert np.allclose(found.stiffness_levels, np.array(STEPS.levels) * pair.c0, rtol=1e-14)


def test_the_estimated_steps_are_an_upper_bound():
    for count in (1, 3, 64):
        stiffness = SteppedStiffness(tuple(np.linspace(0.8, 1.2, count)), tuple(np.arange(count) / count))
        system = switched_system(vary(MODEL.with_values({"stiffness": stiffness}), {"omega": np.linspace(0.2, 3, 50)}))
        flow = ExactFlow(system)
        for i in range(50):
            assert flow.step_count[i] <= 1.125 * estimate(system.take(np.array([i])), 1, 1).steps + 2
