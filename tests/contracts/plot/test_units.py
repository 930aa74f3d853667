"""Pictures of results in physical units: the same as of dimensionless ones, but for the scales of their axes."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.plot.motions import amplitudes
from gearchaos.quantities import quantity
from tests.branches import PAIR, axes
from tests.contracts.plot.figures import LENGTH, PICTURES, STUDIES, VELOCITY, result

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", STUDIES)
def test_every_variable_of_every_study_is_in_the_table_of_quantities(name):
    ds, scaled = result(name)
    for variable in map(str, ds.variables):
        found = quantity(ds[variable].attrs.get("quantity", variable))
        unit = found.physical.unit if found.physical else ds[variable].attrs["units"]
        assert scaled[variable].attrs["units"] == unit, variable


def lines(ax) -> list[tuple[np.ndarray, np.ndarray, bool, bool]]:
    """Data of every line, and whether x and y are in data units (and not shares of the Axes, as of guide lines)."""
    free = [line.get_transform().contains_branch_seperately(ax.transData) for line in ax.lines]
    return [(*map(np.asarray, line.get_data()), *ok) for line, ok in zip(ax.lines, free, strict=True)]


def close(found, expected) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.nanmax(np.abs(expected), initial=1e-300))


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_the_same_but_for_its_scales(name):
    study, draw, x, y, colour = PICTURES[name]
    plain, scaled = (draw(ds, axes()) for ds in result(study))
    close(scaled.get_xlim(), np.array(plain.get_xlim()) * x)
    close(scaled.get_ylim(), np.array(plain.get_ylim()) * y)
    assert len(plain.lines) == len(scaled.lines) and len(plain.images) == len(scaled.images)
    for (u, v, free_x, free_y), (a, b, *_) in zip(lines(plain), lines(scaled), strict=True):
        close(a, u * (x if free_x else 1))
        close(b, v * (y if free_y else 1))
    assert [line.get_markersize() for line in plain.lines] == [line.get_markersize() for line in scaled.lines]
    for one, other in zip(plain.images, scaled.images, strict=True):
        close(other.get_extent(), np.array(one.get_extent()) * [x, x, y, y])
        close(np.ma.filled(other.get_array(), -9.0), np.ma.filled(one.get_array() * colour, -9.0))
    for one, other in zip(plain.collections, scaled.collections, strict=True):
        assert isinstance(one, PolyCollection)
        for path, twin in zip(one.get_paths(), other.get_paths(), strict=True):
            close(twin.vertices, path.vertices * [x, y])


def test_every_picture_of_a_result_is_compared():
    of_none = {"backlash", "schematic", "stiffness", "motion", "result"}  # of a model, or made of the others
    of_none |= {"skeleton", "manifolds", "agreement"}  # compared in test_curve.py and its neighbours
    of_none |= {"contact_pattern", "dynamic_factor", "gear_pair", "harris_map", "mesh_stiffness", "separation_line",
                "transmission_error", "runup", "orders", "fit", "scatter", "assessment"}  # always in units
    of_none |= {"train", "modes", "campbell", "flanks"}  # in SI, or over the time alone
    of_none |= {"motion_strip", "class_legend", "attractor_legend"}  # beside others
    of_none |= {"attractor_names", "motion_class", "save_with_data", "style"}  # no pictures
    functions = {n for n in plot.__all__ if callable(getattr(plot, n)) and n[0].islower()}
    assert functions - of_none <= {*PICTURES, "level"}


def test_two_hundred_periods_are_two_hundred_in_milliseconds_too():
    pair = replace(PAIR, damping_law="always")
    ds = gc.physical(gc.simulate(pair.to_model(), 200, 600, samples=8), pair)
    assert plot.history(ds, "z", axes()).get_xlim()[1] == pytest.approx(200, abs=0.2)
    order, size = amplitudes(ds, "z")
    assert order[1] == pytest.approx(1 / 200)
    assert order[size > 1e-6 * size.max()] * 4 == pytest.approx(np.arange(17))  # a 4T motion: lines at quarters


def test_four_views_show_the_same_motion_in_both():
    plain, scaled = (plot.motion(ds, figure=Figure()).axes for ds in result("simulate"))
    factors = ((1, LENGTH), (LENGTH, VELOCITY), (LENGTH, VELOCITY), (1, VELOCITY))
    for one, other, (x, y) in zip(plain, scaled, factors, strict=True):
        close(other.lines[0].get_xdata(), one.lines[0].get_xdata() * x)
        close(other.lines[0].get_ydata(), one.lines[0].get_ydata() * y)


def test_labels_of_physical_axes_say_what_is_measured():
    ax = plot.zones(result("torques")[1], axes())
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("mesh frequency $f_z$ [Hz]", "driving torque $M_{1}$ [N m]")
    assert plot.zones(result("zones")[1], axes()).get_ylabel() == "error amplitude $e_{1}$ [µm]"


def test_rounding_errors_of_an_orbit_make_no_points_of_their_own_in_any_units():
    left = 1e-12 * np.cos(np.arange(300.0))
    ds = gc.simulate(PAIR.to_model(), 300)
    ds = ds.assign(section_z=ds["section_z"] * 0 + 0.3 + left, section_z_dot=ds["section_z_dot"] * 0 + left)
    sizes = {plot.portrait(found, "z", ax=axes()).lines[0].get_markersize() for found in (ds, gc.physical(ds, PAIR))}
    assert sizes == {3.5}
