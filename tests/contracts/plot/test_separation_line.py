"""The overlay of the line where permanent contact ends: against its closed form, and as part of a map."""

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.gears.io.units import RPM
from tests.branches import axes
from tests.contracts.plot.figures import cut
from tests.contracts.plot.test_pictures import zones_map

GEARS = {"teeth": (50, 50), "module": "3 mm", "face_width": "20 mm", "bore": "30 mm", "damping_ratio": 0.05}


def made(folder, micrometres=3.0, **options) -> gc.GearDesign:
    (orders := folder / "te.csv").write_text(f"order,peak [um],phase [deg]\n1,{micrometres},40\n")
    return gc.GearDesign(**GEARS, transmission_error={"orders": str(orders)}, **options)


@pytest.fixture
def design(tmp_path) -> gc.GearDesign:
    """One whose stiffness does not depend on the load."""
    return made(tmp_path, stiffness="potential energy")


def closed_form(design, rpm, error=3e-6):
    """T1 = r_b1 c0 e1 ω²/√((1 − ω²)² + 4 ζ² ω²) in N m."""
    c0 = design.mesh_stiffness.reference
    ratio = rpm * RPM * design.teeth[0] / np.sqrt(c0 / design.equivalent_mass)
    response = ratio**2 / np.sqrt((1 - ratio**2) ** 2 + 4 * 0.05**2 * ratio**2)
    return design.geometry.base_diameter[0] / 2 * c0 * error * response


def drawn(ax) -> np.ndarray:
    return np.concatenate([np.asarray(line.get_data()).T for line in ax.lines])


def test_the_line_is_that_of_the_closed_form(design):
    ax = plot.separation_line(design, axes(), speed="500:4000:2", torque="1:6000:2")
    points = drawn(ax)
    assert points[:, 1] == pytest.approx(closed_form(design, points[:, 0]), rel=2e-3)
    assert np.ptp(points[:, 0]) > 3000 and ax.get_xlim() == (500, 4000) and ax.get_ylim() == (1, 6000)


def test_at_low_loads_the_stiffness_by_iso_is_that_of_each_torque(tmp_path):
    iso = made(tmp_path, 0.5)
    for speed, torque in drawn(plot.separation_line(iso, axes(), speed="500:4000:2", torque="1:150:2"))[::40].tolist():
        expected = closed_form(iso.at(speed=speed, torque=torque), speed, 0.5e-6)
        assert torque == pytest.approx(expected, rel=0.01, abs=0.05)
    low, high = (iso.at(speed=1.0, torque=t).mesh_stiffness.reference for t in (20.0, 150.0))
    assert high > 1.3 * low


def a_map() -> xr.Dataset:
    ds = zones_map().rename(omega="speed", eps1="torque").assign_coords(
        speed=("speed", [500.0, 2150.0, 3800.0], {"units": "rpm"}), torque=("torque", [50.0, 1950.0], {"units": "N*m"}))
    ds["label"][:], ds["period"][:] = 1, 1
    return ds


@pytest.mark.parametrize("size", [(6.4, 4.8), (3.4, 2.8)], ids=str)
def test_over_a_map_it_keeps_limits_legend_and_labels(design, size):
    ax = plot.zones(a_map(), axes(*size))
    limits, legend = (ax.get_xlim(), ax.get_ylim()), ax.get_legend()
    assert plot.separation_line(design, ax) is ax
    assert (ax.get_xlim(), ax.get_ylim()) == limits and ax.get_legend() is legend
    assert ax.get_xlabel().startswith("speed") and "permanent contact ends" in ax.get_xlabel().replace("\n", " ")
    points = drawn(ax)
    assert points[:, 1] == pytest.approx(closed_form(design, points[:, 0]), rel=2e-3)
    assert cut(ax.figure) == []


@pytest.mark.parametrize(("arguments", "field"), [
    ({}, "speed"), ({"speed": "1:2:3"}, "torque"), ({"speed": "omega=1:2:3", "torque": "1:2:3"}, "speed"),
    ({"design": gc.MeshModel()}, "design"),
    ({"design": gc.GearDesign(**{**GEARS, "damping_ratio": None}), "speed": "1:2:3", "torque": "1:2:3"},
     "damping_ratio")])
def test_what_cannot_be_drawn_is_refused(design, arguments, field):
    with pytest.raises(InputError) as error:
        plot.separation_line(**{"design": design, "ax": axes(), **arguments})
    assert error.value.field == field
