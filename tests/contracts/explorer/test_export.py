"""What a visitor of the explorer takes along, and the units it is in."""

import io
import tomllib
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.explorer.jobs import export
from gearchaos.explorer.jobs import map as maps
from gearchaos.explorer.jobs.point import point_motion
from gearchaos.explorer.panels.motion import SpectrumFigure, Wheels
from gearchaos.explorer.panels.style import Units
from gearchaos.explorer.view.models import are_alike
from gearchaos.explorer.view.presets import preset_of, presets
from gearchaos.explorer.view.state import view_of
from gearchaos.explorer.view.text import as_python, as_toml, pair_at
from gearchaos.studyfile import load_study
from tests import EXAMPLES

pytestmark = pytest.mark.slow

START = presets()["2"].view


def axes_of(study):
    """The axes of the map that a study file describes."""
    options = study.options_for("zones")
    return options["x"], options["y"]


@pytest.mark.parametrize("key", ["2", "3c", "11"])
def test_copied_python_builds_the_same_model(key):
    view = presets()[key].view.with_value("zeta", 1 / 30)
    head = as_python(view).split("verdict")[0]
    names: dict = {}
    exec(head, names)
    assert names["model"] == view.point
    compile(as_python(view), "copied", "exec")


@pytest.mark.parametrize("stiffness", ["two-level", "harmonics"])
def test_copied_toml_is_a_study_file_of_the_same_model(tmp_path, stiffness):
    view = replace(presets()["3c"].view.with_stiffness(stiffness), initial=(("z", 0.3), ("z_dot", -0.1)))
    path = tmp_path / "study.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    study = load_study(path)
    assert study.model == view.point
    assert axes_of(study) == (view.x, view.y)
    tomllib.loads(path.read_text(encoding="utf-8"))


PAIR = load_study(EXAMPLES / "physical_pair.toml")


@pytest.mark.parametrize("change", [
    lambda view: view, lambda view: view.moved(1.05, 0.21), lambda view: view.with_value("zeta", 0.06),
    lambda view: view.with_value("eps2", 0.0), lambda view: view.with_value("theta1", 1.0),
    lambda view: view.with_value("kappa1", 2.0), lambda view: view.with_value("mu2", 3.0),
    lambda view: view.with_value("beta", 0.01), lambda view: view.with_value("chi1", 0.3),
    lambda view: view.with_value("y1", 0.4), lambda view: view.with_stiffness("harmonics"),
])
def test_a_copied_study_file_keeps_the_pair_at_the_point(tmp_path, change):
    view = change(view_of(PAIR.model, *axes_of(PAIR)))
    path = tmp_path / "pair.toml"
    path.write_text(as_toml(view), encoding="utf-8")
    study = load_study(path)
    found, wanted = study.model.parameters(), view.point.parameters()
    assert found == pytest.approx(wanted, rel=1e-13) and study.model.initial == view.point.initial
    assert study.pair.scales == PAIR.pair.scales and study.model.kind == view.point.kind
    assert axes_of(study) == (view.x, view.y)


def test_other_kinds_of_a_pair_keep_it_and_what_no_pair_has_is_a_model(tmp_path):
    view, path = view_of(PAIR.model), tmp_path / "pair.toml"
    for changed, kept in (
        (view.with_kind("torsional"), True), (view.with_kind("single"), True), (view.with_value("J1", 3.0), False),
    ):
        path.write_text(as_toml(changed), encoding="utf-8")
        study = load_study(path)
        assert (study.pair is not None) == kept and study.model.kind == changed.model.kind
        assert gc.regime(study.model).v_rms == pytest.approx(gc.regime(changed.point).v_rms, rel=1e-6)
    rigid = replace(PAIR.pair, **dict.fromkeys(("c1", "c2", "m1", "m2")), k1=0.0, k2=0.0)
    assert pair_at(rigid, view.point) is None


def test_copied_python_scales_to_the_units_on_show():
    view = view_of(PAIR.model)
    names: dict = {}
    exec(as_python(view).partition("verdict = ")[0], names)
    assert names["gears"] == PAIR.pair and names["model"] == view.point
    assert "physical" in as_python(view) and "physical" not in as_python(replace(view, physical=False))


@pytest.mark.parametrize("key", presets())
def test_a_preset_is_found_again_until_another_model_is_set(key):
    view = presets()[key].view
    assert presets()[preset_of(view)].view == view
    assert preset_of(view.moved(1.2, view.at[1]), key) == key
    assert preset_of(replace(view, colour="v_rms", line="y", physical=True), key) == key
    assert preset_of(view.with_value("zeta", 0.071), key) == ""
    assert not presets()[key].view.physical
    assert presets()[key].basins == (key in ("3a", "3b", "3c"))


def test_wheels_are_alike_only_if_all_their_values_are():
    view = view_of(PAIR.model)
    assert are_alike(START.operating_point) and not are_alike(view.operating_point)
    alike = view.with_alike_wheels().operating_point
    assert are_alike(alike) and alike.J2 == view.operating_point.J1
    assert START.with_alike_wheels() == START


def test_pictures_and_data_of_a_map_half_done(small):
    half = next(iter(maps.successive_maps(small)))
    for suffix, begins in (("png", b"\x89PNG"), ("svg", b"<?xml")):
        content, _, name = next(export.exported("map", suffix, half.dataset, "motion", ""))
        assert content.startswith(begins) and name == f"gearchaos-map.{suffix}"
    content, _, _ = next(export.exported("map", "nc", half.dataset, "motion", ""))
    again = xr.load_dataset(io.BytesIO(content), engine="h5netcdf")
    assert again["label"].equals(half.dataset["label"]) and (again["label"] == 0).any()
    assert again["label"].encoding["fletcher32"]


def test_pictures_and_data_of_a_motion():
    motion = list(point_motion(START.point))[-1].trajectory
    for suffix in ("png", "svg", "nc"):
        content, media, _ = next(export.exported("motion", suffix, motion, "motion", "chaotic"))
        assert len(content) > 10_000 and "/" in media


def test_the_spectrum_of_the_page_has_the_unit_of_the_velocity_and_the_same_orders():
    put = {}
    figure = SpectrumFigure(lambda model, **attributes: put.setdefault(model.id, {}).update(attributes))
    motion = list(point_motion(PAIR.model))[-1].trajectory
    drawn = []
    for velocity in (motion["z_dot"], gc.physical(motion, PAIR.pair)["z_dot"]):
        figure.show(motion, velocity, Units(), Wheels())
        drawn.append((put[figure.source.id]["data"], put[figure.figure.yaxis[0].id]["axis_label"]))
    (plain, words), (scaled, unit) = drawn
    assert words == "amplitude" and unit == "amplitude [mm/s]"
    assert np.array_equal(plain["x"], scaled["x"])
    assert scaled["y"] == pytest.approx(plain["y"] * PAIR.pair.scales.velocity * 1e3, rel=1e-5)
