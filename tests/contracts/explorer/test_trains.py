"""The explorer for a gear train, without a browser: axes, address, meshes of the map and of the motion."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.datasets import of_mesh
from gearchaos.errors import InputError
from gearchaos.explorer.jobs.map import MapGrid
from gearchaos.explorer.jobs.point import point_motion
from gearchaos.explorer.panels.map import MapFigure
from gearchaos.explorer.panels.motion import verdict_text, wheels_of
from gearchaos.explorer.panels.style import Units
from gearchaos.explorer.view.models import axis_names
from gearchaos.explorer.view.text import as_python, as_toml, from_query, to_query
from gearchaos.explorer.web.page import Page, field_values, parameter_form, plane_menus
from gearchaos.studies.zones import Zones
from gearchaos.studyfile import load_study
from tests import EXAMPLES


def opened(name):
    return _view(load_study(EXAMPLES / f"train_{name}.toml"), [], False)


IDLER = opened("idler")
SEPARATED = IDLER.moved(4756.0, 26.71)  # of whose meshes one loses contact more often


@pytest.mark.parametrize(("name", "axes", "cells"), [
    ("idler", {"speed": (1000.0, 9000.0), "torque": (5.0, 40.0)}, (100, 75)),
    ("two_stage", {"speed": (1200.0, 7500.0), "torque": (2.0, 50.0)}, (50, 37)),
    ("loose_gear", {"speed": (320.0, 2000.0), "loose.torque": (-0.125, -0.005)}, (50, 37)),
    ("planetary", {"speed": (600.0, 3750.0), "torque": (20.0, 500.0)}, (25, 18)),
])
def test_a_train_opens_over_its_speed_and_a_torque(name, axes, cells):
    view = opened(name)
    assert {axis.name: (axis.start, axis.stop) for axis in (view.x, view.y)} == axes
    assert (view.x.count, view.y.count) == cells and view.physical and view.colour == "contact"
    assert view.at == tuple(view.model.value(axis) for axis in axes)
    page = Page(view, view)
    page.show_view()
    form = parameter_form(view, (), view)
    fields = [field for group in (*form.groups, *form.folded) for field in group.fields]
    assert {field.name for field in fields} == {*axis_names(view.model)} == {*field_values(view)}
    assert all(field.low < field_values(view)[field.name] < field.high for field in fields) and not form.menus


CHANGES = {
    "none": lambda view: view,
    "point": lambda view: view.moved(4000.0, 12.0),
    "load": lambda view: view.moved(4000.0, 12.0).with_axis("y", "idler_pump.backlash"),
    "part": lambda view: view.with_value("idler.inertia", 5e-4),
    "mesh": lambda view: replace(view, mesh="idler/pump", colour="dynamic_factor", line="y"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_address_study_file_and_script_give_the_point_of_a_train(change, tmp_path):
    view, path, names = CHANGES[change](IDLER), tmp_path / "train.toml", {}
    again = from_query(to_query(view, IDLER), IDLER)
    assert again.point == view.point and to_query(again, IDLER) == to_query(view, IDLER)
    assert replace(again, model=view.model) == view
    path.write_text(as_toml(view), encoding="utf-8")
    assert load_study(path).model.parameters() == view.point.parameters()
    exec(as_python(view).partition("verdict = ")[0], names)
    assert names["model"].parameters() == view.point.parameters()


@pytest.mark.parametrize(("query", "field"), [
    ("kind=full", "kind"), ("omega=1", "parameter"), ("mesh=third", "mesh"), ("speed=0", "speed"),
    ("motor.torque=30", "body pump: torque"), ("idler.inertia=-1", "body idler: inertia"),
    ("x=motor.torque=1:2&y=speed=1000:2000", "motor.torque"),
])
def test_what_a_train_does_not_have_is_refused_in_words(query, field):
    with pytest.raises(InputError) as caught:
        from_query(query, IDLER)
    assert caught.value.field.startswith(field), caught.value
    for change in (lambda view: view.with_kind("full"), lambda view: view.with_stiffness("steps")):
        with pytest.raises(InputError, match="must be a single pair"):
            change(IDLER)


def test_the_menu_of_meshes_changes_the_colours_of_the_map_to_those_of_a_mesh():
    x, y = gc.Axis("speed", 4000.0, 6000.0, 4), gc.Axis("torque", 10.0, 30.0, 3)
    study, grid, cells = Zones(IDLER.model, x, y), MapGrid(4, 3), np.arange(12)
    grid.put(study.compute(cells), cells)
    grid.show(cells, 1)
    found, put = grid.map(study, 1), {}
    figure = MapFigure(lambda model, **attributes: put.setdefault(model.id, {}).update(attributes))
    colours = {}
    for mesh in ("", *IDLER.model.mesh_names):
        expected = of_mesh(found.dataset, mesh) if mesh else found.dataset
        for colour in ("contact", "dynamic_factor", "contact_fraction"):
            figure.show(found.of_mesh(mesh), colour, Units(IDLER.gears, True))
            image = put[figure.image.id]["data"]["image"][0]
            assert image == pytest.approx(expected[colour].values.astype(image.dtype))
            colours[mesh, colour] = image.tolist()
        figure.show(found.of_mesh(mesh), "v_rms", Units(IDLER.gears, True))
    assert colours["", "dynamic_factor"] != colours["motor/idler", "dynamic_factor"] != (
        colours["idler/pump", "dynamic_factor"])
    *_, menu = plane_menus(IDLER, Units(IDLER.gears, True))
    assert [value for value, _ in menu.options] == ["", "motor/idler", "idler/pump"]


def test_a_click_gives_the_values_of_each_mesh_and_draws_that_chosen():
    found = list(point_motion(SEPARATED.point))[-1]
    text = verdict_text(found, SEPARATED, Units(SEPARATED.gears, True))
    for (name, contact, front, back, peak, impacts, factor), (mesh, known) in zip(
            text.meshes, found.verdict.meshes.items(), strict=True):
        assert (name, contact, front) == (mesh, known["contact"], f"{known['front_share']:.1%}") and back == "0.0%"
        assert [float(n) for n in (peak, impacts, factor)] == pytest.approx(
            [known[n] for n in ("force_peak", "impacts_per_second", "dynamic_factor")], rel=1e-3)
    assert text.drawn == "motor/idler" and not {"contact", "dynamic factor"} & {name for name, _ in text.rows}
    drawn = {}
    for mesh in SEPARATED.model.mesh_names:
        view = replace(SEPARATED, mesh=mesh)
        drawn[mesh] = found.of_mesh(mesh, wheels_of(view).half_backlash).trajectory
        known, peak = found.verdict.meshes[mesh], abs(drawn[mesh]["mesh_force"]).max() * view.model.units.force
        assert peak == pytest.approx(known["force_peak"], rel=2e-2)
        apart = abs(drawn[mesh]["z"]) < wheels_of(view).half_backlash
        assert 1 - apart.mean() == pytest.approx(known["front_share"], abs=0.02)
        page = Page(IDLER, view)
        page.show_point_motion(found)
        assert f"The figures of the motion are those of {mesh}" in page.messages._html["verdict"]
    assert drawn["motor/idler"]["z"].values == pytest.approx(found.trajectory["z"].values)
