"""What a visitor of the explorer takes along, and the units it is in."""

import io
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.explorer.core.models import are_alike
from gearchaos.explorer.core.presets import preset_of, presets
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.features.map import job as maps
from gearchaos.explorer.features.motion.panel import SpectrumFigure, Wheels
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web import export
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import PAPER, Put

pytestmark = pytest.mark.slow

PAIR = load_study(EXAMPLES / "physical_pair.toml")


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
    assert are_alike(PAPER.operating_point) and not are_alike(view.operating_point)
    alike = view.with_alike_wheels().operating_point
    assert are_alike(alike) and alike.J2 == view.operating_point.J1
    assert PAPER.with_alike_wheels() == PAPER


def test_pictures_and_data_of_a_map_half_done(small):
    half = next(iter(maps.successive_maps(small)))
    for suffix, colour, begins in (("png", "motion", b"\x89PNG"), ("svg", "v_rms", b"<?xml")):
        content, _, name = next(export.exported("map", suffix, half.dataset, colour, ""))
        assert content.startswith(begins) and name == f"gearchaos-map.{suffix}"
    content, _, _ = next(export.exported("map", "nc", half.dataset, "motion", ""))
    again = xr.load_dataset(io.BytesIO(content), engine="h5netcdf")
    assert again["label"].equals(half.dataset["label"]) and (again["label"] == 0).any()
    assert again["label"].encoding["fletcher32"]


def test_the_spectrum_of_the_page_has_the_unit_of_the_velocity_and_the_same_orders():
    figure = SpectrumFigure(put := Put())
    motion = list(point_motion(PAIR.model))[-1].trajectory
    drawn = []
    for velocity in (motion["z_dot"], gc.physical(motion, PAIR.pair)["z_dot"]):
        figure.show(motion, velocity, Units(), Wheels())
        drawn.append((put[figure.source.id]["data"], put[figure.figure.yaxis[0].id]["axis_label"]))
    (plain, words), (scaled, unit) = drawn
    assert words == "amplitude" and unit == "amplitude [mm/s]"
    assert np.array_equal(plain["x"], scaled["x"])
    assert scaled["y"] == pytest.approx(plain["y"] * PAIR.pair.scales.velocity * 1e3, rel=1e-5)
