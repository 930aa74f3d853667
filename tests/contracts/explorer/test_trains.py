"""The explorer for a gear train, without a browser: axes, address, meshes of the map and of the motion."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.datasets import of_mesh
from gearchaos.errors import InputError
from gearchaos.explorer.core.models import axis_names
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.features.map.job import FULL, _motion_map
from gearchaos.explorer.features.map.panel import MapFigure
from gearchaos.explorer.features.motion.panel import ForceFigure, force_unit, times, verdict_text, wheels_of
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web.form import field_values, parameter_form, plane_menus
from gearchaos.explorer.web.messages import render
from gearchaos.explorer.web.page import Page
from gearchaos.studies.maps.zones import Zones
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import Put, computed


def opened(name):
    return _view(load_study(EXAMPLES / f"train_{name}.toml"), [], False)


IDLER = opened("idler")
SEPARATED = IDLER.moved(4756.0, 26.71)  # of whose meshes one loses contact more often


@pytest.mark.parametrize(("name", "axes", "cells"), [
    ("idler", {"speed": (1000.0, 9000.0), "torque": (5.0, 40.0)}, (100, 75)),
    ("two_stage", {"speed": (1200.0, 7500.0), "torque": (2.0, 50.0)}, (50, 37)),
    ("loose_gear", {"speed": (320.0, 2000.0), "loose.torque": (-0.125, -0.005)}, (50, 37)),
    ("planetary", {"speed": (600.0, 3750.0), "torque": (20.0, 500.0)}, (25, 18))])
def test_a_train_opens_over_its_speed_and_a_torque(name, axes, cells):
    view = opened(name)
    assert {axis.name: (axis.start, axis.stop) for axis in (view.x, view.y)} == axes
    assert (view.x.count, view.y.count) == cells and view.physical and view.colour == "contact"
    assert view.at == tuple(view.model.value(axis) for axis in axes)
    page = Page(Opened(view), view)
    page.show_view()
    form = parameter_form(view, (), view)
    fields = [field for group in (*form.groups, *form.folded) for field in group.fields]
    assert {field.name for field in fields} == {*axis_names(view.model)} == {*field_values(view)}
    assert all(field.low < field_values(view)[field.name] < field.high for field in fields) and not form.menus


@pytest.mark.parametrize("change", [lambda view: view.with_kind("full"), lambda view: view.with_stiffness("steps")])
def test_what_only_a_pair_has_is_refused_in_words(change):
    with pytest.raises(InputError, match="must be a single pair"):
        change(IDLER)


def test_the_menu_of_meshes_changes_the_colours_of_the_map_to_those_of_a_mesh():
    x, y = gc.Axis("speed", 4000.0, 6000.0, 4), gc.Axis("torque", 10.0, 30.0, 3)
    found, colours = computed(Zones(IDLER.model, x, y), 12), {}
    figure = MapFigure(put := Put())
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


@pytest.mark.parametrize("count", [(1, 1), (3, 2), (1, 9)])
def test_a_map_of_few_cells_has_no_lattice_without_cells(count):
    few = SimpleNamespace(model=IDLER.model, x=replace(IDLER.x, count=count[0]), y=replace(IDLER.y, count=count[1]))
    *_, last = _motion_map(few)
    study = Zones(few.model, few.x, few.y, settings=FULL)
    assert last.share == 1 and last.labels().values.ravel().tolist() == study.compute(
        np.arange(study.count))["label"].tolist()


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
        page = Page(Opened(IDLER), view)
        page.show_point_motion(found)
        assert f"The figures of the motion are those of {mesh}" in page.messages._html["verdict"]
    assert drawn["motor/idler"]["z"].values == pytest.approx(found.trajectory["z"].values)


def test_what_is_of_the_first_mesh_is_not_shown_with_another_one():
    found = next(point_motion(SEPARATED.point))
    of_first = {name for name, _ in verdict_text(found, SEPARATED, Units(SEPARATED.gears, True)).rows}
    of_other = {name for name, _ in verdict_text(
        found, replace(SEPARATED, mesh="idler/pump"), Units(SEPARATED.gears, True)).rows}
    assert {name for name in of_first - of_other} == {name for name in of_first if name.endswith(", motor/idler")}
    assert len(of_first - of_other) == 3 and of_other < of_first


def test_large_forces_are_in_kilonewtons_with_the_loads_that_meshes_share():
    view = opened("wind_turbine")
    found = list(point_motion(view.point))[-1]
    units = Units(view.gears, True)
    text = verdict_text(found, view, units)
    known = found.verdict.meshes["low_sun/planet1"]["force_peak"]
    peak = next(row[4] for row in text.meshes if row[0] == "low_sun/planet1")
    assert text.force_unit == "kN" and float(peak) == pytest.approx(known / 1e3, rel=1e-3) and known > 1e5
    assert [row[:3] for row in text.loads] == [
        (body, "1.000", "33.3 %") for body in ("low_sun", "low_ring", "mid_sun", "mid_ring")]
    # statics: the sun of the first stage has the torque of the rotor over its ratio 1 + 56/19
    mean = 4152243.1 / (1 + 56 / 19) / 3 / (19 * 0.045 * math.cos(math.radians(20)) / 2)
    assert float(text.loads[0][3]) == pytest.approx(mean / 1e3, rel=1e-3)
    html = render("features/motion/verdict.html.j2", found=found, v=found.verdict, text=text, hints={})
    assert "peak [kN]" in html and ">Kγ</th>" in html and "low_sun/<wbr>planet1</th>" in html
    figure, put = ForceFigure(put := Put()), put
    trajectory = found.of_mesh("low_sun/planet1", wheels_of(view).half_backlash).trajectory
    figure.show(units.scaled(trajectory), *times(trajectory), units, wheels_of(view))
    assert abs(put[figure.source.id]["data"]["y"]).max() == pytest.approx(known / 1e3, rel=1e-3)
    assert put[figure.figure.yaxis[0].id]["axis_label"].endswith("[kN]")
    assert force_unit(99_999.0) == (1.0, "N")


def test_it_is_said_whether_other_motions_are_sought_or_none_was_found():
    page = Page(Opened(IDLER), IDLER)
    page.clear_point_studies()
    assert "looking for other motions" in page.messages._html["others"]
    page.show_attractors(xr.Dataset())
    assert "no motion was found here that settles" in page.messages._html["others"] and page.choices == []
