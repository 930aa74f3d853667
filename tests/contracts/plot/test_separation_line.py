"""The overlay of the line where permanent contact ends: against its closed form, and as part of a map."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.gears.separation import separation_margin
from gearchaos.gears.units import RPM

GEARS = {"teeth": (50, 50), "module": "3 mm", "face_width": "20 mm", "bore": "30 mm", "damping_ratio": 0.05}


def fresh(width: float = 6.4, height: float = 4.8):
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()


@pytest.fixture
def design(tmp_path) -> gc.GearDesign:
    """A design whose error has one harmonic, of 3 µm, and whose stiffness does not depend on the load."""
    orders = tmp_path / "te.csv"
    orders.write_text("order,peak [um],phase [deg]\n1,3,40\n")
    return gc.GearDesign(**GEARS, stiffness="potential energy", transmission_error={"orders": str(orders)})


def closed_form(design: gc.GearDesign, rpm: np.ndarray) -> np.ndarray:
    """T1 = r_b1 c0 e1 ω²/√((1 − ω²)² + 4 ζ² ω²) in N m."""
    c0 = design.mesh_stiffness.reference
    ratio = rpm * RPM * design.teeth[0] / np.sqrt(c0 / design.equivalent_mass)
    response = ratio**2 / np.sqrt((1 - ratio**2) ** 2 + 4 * 0.05**2 * ratio**2)
    return design.geometry.base_diameter[0] / 2 * c0 * 3e-6 * response


def drawn(ax) -> np.ndarray:
    return np.concatenate([np.asarray(line.get_data()).T for line in ax.lines])


def test_the_line_is_that_of_the_closed_form(design):
    ax = plot.separation_line(design, fresh(), speed="500:4000:2", torque="1:6000:2")
    points = drawn(ax)
    assert points[:, 1] == pytest.approx(closed_form(design, points[:, 0]), rel=2e-3)
    assert np.ptp(points[:, 0]) > 3000 and ax.get_xlim() == (500, 4000) and ax.get_ylim() == (1, 6000)


def test_at_low_loads_the_stiffness_by_iso_is_that_of_each_torque(tmp_path):
    orders = tmp_path / "te.csv"
    orders.write_text("order,peak [um],phase [deg]\n1,0.5,0\n")
    iso = gc.GearDesign(**GEARS, transmission_error={"orders": str(orders)})
    for speed, torque in drawn(plot.separation_line(iso, fresh(), speed="500:4000:2", torque="1:150:2"))[::40].tolist():
        there = iso.at(speed=speed, torque=torque)
        c0 = there.mesh_stiffness.reference
        ratio = speed * RPM * 50 / np.sqrt(c0 / there.equivalent_mass)
        response = ratio**2 / np.sqrt((1 - ratio**2) ** 2 + 4 * 0.05**2 * ratio**2)
        assert torque == pytest.approx(iso.geometry.base_diameter[0] / 2 * c0 * 0.5e-6 * response, rel=0.01, abs=0.05)
    low, high = (iso.at(speed=1.0, torque=t).mesh_stiffness.reference for t in (20.0, 150.0))
    assert high > 1.3 * low


def test_the_margin_is_over_torque_and_speed(design):
    speeds, torques = np.array([500.0, 1000.0, 2000.0]), np.array([10.0, 20.0])
    margin = separation_margin(design, speeds, torques)
    assert margin.shape == (2, 3)
    assert margin == pytest.approx(torques[:, None] - closed_form(design, speeds), rel=1e-9)


def a_map() -> xr.Dataset:
    label = np.ones((3, 4), np.int8)
    flags = {"flag_values": np.arange(1, 6, dtype=np.int8),
             "flag_meanings": "periodic quasi-periodic chaotic undecided diverged"}
    return xr.Dataset(
        {"label": (("torque", "speed"), label, flags), "period": (("torque", "speed"), np.ones((3, 4), int))},
        {"speed": ("speed", [500.0, 1600, 2700, 3800], {"units": "rpm"}),
         "torque": ("torque", [50.0, 1000, 1950], {"units": "N*m"})})


@pytest.mark.parametrize("size", [(6.4, 4.8), (3.4, 2.8)], ids=str)
def test_over_a_map_it_keeps_limits_legend_and_labels(design, size):
    ax = plot.zones(a_map(), fresh(*size))
    limits, legend = (ax.get_xlim(), ax.get_ylim()), ax.get_legend()
    assert plot.separation_line(design, ax) is ax
    assert (ax.get_xlim(), ax.get_ylim()) == limits and ax.get_legend() is legend
    assert ax.get_xlabel().startswith("speed") and "permanent contact ends" in ax.get_xlabel().replace("\n", " ")
    points = drawn(ax)
    assert points[:, 1] == pytest.approx(closed_form(design, points[:, 0]), rel=2e-3)
    ax.figure.canvas.draw()
    box, (width, height) = ax.figure.get_tightbbox(), ax.figure.get_size_inches()
    assert box.x0 > -0.01 and box.y0 > -0.01 and box.x1 < width + 0.01 and box.y1 < height + 0.01


@pytest.mark.parametrize(("arguments", "field"), [
    ({}, "speed"), ({"speed": "1:2:3"}, "torque"), ({"speed": "omega=1:2:3", "torque": "1:2:3"}, "speed"),
    ({"design": gc.MeshModel()}, "design"),
    ({"design": gc.GearDesign(**{**GEARS, "damping_ratio": None}), "speed": "1:2:3", "torque": "1:2:3"},
     "damping_ratio"),
])
def test_what_cannot_be_drawn_is_refused(design, arguments, field):
    with pytest.raises(InputError) as error:
        plot.separation_line(**{"design": design, "ax": fresh(), **arguments})
    assert error.value.field == field
