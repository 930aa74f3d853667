"""The dynamic factor along the speed: the linear response in closed form, the standards at each speed, the picture."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.dynamic_factor.iso_method_b import of_design as method_b
from gearchaos.gears.io.units import RPM
from tests import ONE_SPRING
from tests.branches import axes
from tests.contracts.plot.figures import cut

GEARS = tomllib.loads(ONE_SPRING.read_text())["design"] | {"torque": "300 N*m"}
DESIGN = gc.GearDesign(**GEARS)


@pytest.fixture(scope="module")
def result():
    return gc.dynamic_factor(DESIGN, "500:8000:16")


def test_in_permanent_contact_at_constant_stiffness_it_is_that_of_the_linear_oscillator(tmp_path):
    """m δ″ + 2 ζ ω0 m δ′ + c0 δ = F − m e″ for the deflection δ; the mesh force is that of spring and damper."""
    table, orders = tmp_path / "k.csv", tmp_path / "te.csv"
    table.write_text("fraction,level [N/um]\n0,400\n0.5,400\n")
    orders.write_text("order,peak [um],phase [deg]\n1,0.5,0\n")
    design = gc.GearDesign(**{**GEARS, "stiffness": {"table": str(table)},
                              "transmission_error": {"orders": str(orders)}})
    with pytest.warns(DesignWarning, match="is constant, 400 N/µm: it excites nothing"):
        found = gc.dynamic_factor(design, "1000:5000:5")
    assert (found["contact"] == 0).all()
    pair = design.at(speed=100.0).to_pair()
    s = found["speed"].values * RPM * 50 / pair.omega0
    deflection = 0.5e-6 * s**2 / (1 - s**2 + 2j * 0.05 * s)
    force = 4e8 * np.abs(deflection * (1 + 2j * 0.05 * s))
    assert found["dynamic_factor"].values == pytest.approx(1 + force / (300 / pair.R1), rel=1e-6)


def test_standards_are_those_of_the_design_at_each_speed(result):
    for speed in result["speed"].values[::5].tolist():
        design = DESIGN.at(speed=speed)
        for standard in standards():
            expected, value = standard.factor(design).value, float(result[standard.name].sel(speed=speed))
            assert math.isnan(value) if expected is None else value == expected


def test_resonance_ratios_are_those_of_the_datasheet_by_name():
    design = replace(DESIGN, stiffness="potential energy")
    found = gc.dynamic_factor(design, "2000:3000:2")
    for speed in found["speed"].values.tolist():
        sheet = datasheet(design.at(speed=speed))
        for name in ("resonance_ratio", "resonance_ratio_ISO_B"):
            assert float(found[name].sel(speed=speed)) == pytest.approx(sheet[name].value, rel=1e-12)
    assert abs(found["resonance_ratio"][0] / found["resonance_ratio_ISO_B"][0] - 1) > 0.01


def test_refused_stretches_are_missing_with_their_reason(result):
    for name in ("Kv_ISO_C", "Kv_AGMA"):
        missing = np.isnan(result[name].values)
        assert missing.any() and not missing.all()
        assert result[name].attrs["refused"].startswith(f"{float(result['speed'].values[missing][0]):g} to ")
    assert all(words in result["Kv_ISO_C"].attrs["refused"] for words in ("fewer than 50 teeth", "10 m/s"))
    assert "refused" not in result["Kv_ISO_B"].attrs


def test_without_a_quality_the_standards_name_it():
    given = {name: value for name, value in GEARS.items() if name not in ("quality", "transmission_error")}
    found = gc.dynamic_factor(gc.GearDesign(**given), "1000:2000:2")
    for name in ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"):
        assert np.isnan(found[name]).all() and "quality" in found[name].attrs["refused"]
    assert np.isfinite(found["resonance_ratio"]).all() and np.isfinite(found["dynamic_factor"]).all()


def test_it_is_the_measure_of_the_bifurcation_at_the_same_speeds():
    found = gc.dynamic_factor(DESIGN, "2000:3000:3", "100 N*m", mode="up")
    other = gc.bifurcation(DESIGN.at(speed=2000, torque=100.0), "speed=2000:3000:3", points=0, mode="up")
    assert np.array_equal(found["dynamic_factor"], other["dynamic_factor"], equal_nan=True)
    assert found["torque"] == 100 and found["mesh_frequency"].values == pytest.approx(found["speed"].values * 50 / 60)


def test_a_saved_result_is_drawn_by_its_name(result, tmp_path):
    gc.save(result, tmp_path / "factor.nc")
    ds = gc.load(tmp_path / "factor.nc")
    assert ds.identical(result) and "dynamic factor" in plot.result(ds).axes[0].get_ylabel()


def lines(ax) -> dict[str, np.ndarray]:
    return {str(line.get_label()): np.asarray(line.get_ydata(), float) for line in ax.lines}


def test_the_picture_shows_all_factors_and_leaves_refused_stretches_out(result):
    shown = lines(plot.dynamic_factor(result, axes()))
    assert np.array_equal(shown["computed"], result["dynamic_factor"].values)
    assert np.array_equal(shown["ISO method B"], result["Kv_ISO_B"].values)
    last = float(result["speed"].values[np.isfinite(result["Kv_ISO_C"].values)][-1])
    assert np.array_equal(shown[f"ISO method C, to {last:.0f} rpm"], result["Kv_ISO_C"].values, equal_nan=True)
    separated = result["contact"].values != 0
    assert np.array_equal(shown["flanks separate"], result["dynamic_factor"].values[separated])


def test_the_quasi_static_ratio_is_a_thin_line_and_what_exceeds_it_another(result):
    ax = plot.dynamic_factor(result, axes())
    ratio, shown = float(result["quasi_static_ratio"]), lines(ax)
    assert ratio > 1.2 and shown["quasi-static ratio"].tolist() == [ratio, ratio]
    assert shown["largest over quasi-static"] == pytest.approx(result["dynamic_factor"].values / ratio)
    assert "quasi-static ratio" in [text.get_text() for text in ax.texts]
    smooth = plot.dynamic_factor(result.assign(quasi_static_ratio=1.0), axes())
    assert not any("quasi-static" in name for name in lines(smooth)) and not smooth.texts


def test_the_motions_of_speeds_to_avoid_are_lines_of_their_own(result, tmp_path):
    found = gc.speeds_to_avoid(DESIGN, "2800:3400:4").dataset
    gc.save(found, tmp_path / "avoid.nc")
    (ax,) = plot.result(gc.load(tmp_path / "avoid.nc")).axes
    shown, factors = lines(ax), found["dynamic_factor"]
    for name, label in (("rest", "computed from rest"), ("rising", "speed rising"), ("falling", "speed falling")):
        assert np.array_equal(shown[label], factors.sel(motion=name).values)
    assert ("load change" in shown) == np.isfinite(factors.sel(motion="load change").values).any()
    separated = found["contact"].values > 0
    assert np.array_equal(np.sort(shown["flanks separate"]), np.sort(factors.values[separated]), equal_nan=True)
    largest = np.nanmax(factors.values, axis=0)
    assert shown["largest over quasi-static"] == pytest.approx(largest / float(found["quasi_static_ratio"]))


def test_ranges_are_shaded_where_the_standard_puts_them(result):
    ax = plot.dynamic_factor(result, axes())
    shaded = sorted((p.get_x(), p.get_x() + p.get_width()) for p in ax.patches)
    found = method_b(DESIGN.at(speed=100.0)).resonance
    limits = [x / RPM for x in (found.main_start, found.main_end, found.supercritical_start)]
    assert [low for low, _ in shaded] == pytest.approx(limits, rel=1e-9)
    assert [high for _, high in shaded[:2]] == pytest.approx(limits[1:], rel=1e-9)
    ax.figure.canvas.draw()
    (second,) = ax.child_axes
    ratio = result["resonance_ratio"].values
    assert second.get_xlim() == pytest.approx((ratio[0], ratio[-1]), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(13.6, 6), (3.4, 2.8)], ids=str)
def test_no_text_is_cut(result, size):
    assert cut(plot.dynamic_factor(result, axes(*size)).figure) == []


@pytest.mark.parametrize("style", ["paper", "slides"])
def test_in_a_column_of_any_style_the_legend_leaves_room_for_the_curves(result, style):
    with plot.style(style, width="column"):
        ax = plot.dynamic_factor(result, Figure(layout="constrained").subplots())
        ax.figure.draw_without_rendering()
    assert ax.get_window_extent().height > 0.25 * ax.figure.bbox.height


@pytest.mark.parametrize(("arguments", "field"), [
    ({"design": gc.MeshModel()}, "design"), ({"torque": 0.0}, "torque"), ({"torque": "3 mm"}, "torque"),
    ({"speed": "1000"}, "speed"), ({"speed": "torque=1:2:3"}, "speed"), ({"mode": "sideways"}, "mode"),
    ({"design": gc.GearDesign(**{**GEARS, "torque": None})}, "torque"),
    ({"design": gc.GearDesign(**{**GEARS, "damping_ratio": None})}, "damping_ratio"),
])
def test_what_cannot_be_computed_is_refused(arguments, field):
    with pytest.raises(InputError) as error:
        gc.dynamic_factor(**{"design": DESIGN, "speed": "1000:2000:2", **arguments})
    assert error.value.field == field
