"""Pictures of results in physical units: the same as of dimensionless ones, but for the scales of their axes."""

from __future__ import annotations

from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.plot.motions import amplitudes
from gearchaos.quantities import quantity

pytestmark = pytest.mark.slow

PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"],
)
SCALES = PAIR.scales
LENGTH, VELOCITY, FORCE = SCALES.length * 1e6, SCALES.velocity * 1e3, SCALES.force


def axes(width: float = 6.4, height: float = 4.8) -> matplotlib.axes.Axes:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()


def _studies() -> dict:
    model, single = PAIR.to_model(), PAIR.to_model("single")
    return {
        "motion": gc.simulate(model, 24, 40, samples=32),
        "section": gc.simulate(model, 24, 40),
        "zones": gc.zones(model, gc.Axis("omega", 0.3, 1.5, 4), gc.Axis("q0", 0.02, 0.2, 3), starts=2),
        "errors": gc.zones(model, gc.Axis("omega", 0.3, 1.5, 4), gc.Axis("eps1", 0.0, 0.3, 3)),
        "bifurcation": gc.bifurcation(model, gc.Axis("eps1", 0.0, 0.3, 7), points=16),
        "basins": gc.basins(single, gc.Axis("z", -3, 3, 8), gc.Axis("z_dot", -2, 2, 8)),
        "attractors": gc.attractors(single, 16),
        "branch": gc.branch(model, "eps1=0.09:0.3"),
    }


@pytest.fixture(scope="module")
def results() -> dict:
    """Each study's result in both kinds of units."""
    return {name: (ds, gc.physical(ds, PAIR)) for name, ds in _studies().items()}


# picture -> (result, how to draw it, what 1 is along x and along y, and of the colours)
PICTURES = {
    "history": ("motion", lambda ds, ax: plot.history(ds, "z_dot", ax), 1, VELOCITY, 1),
    "history of the force": ("motion", lambda ds, ax: plot.history(ds, "mesh_force", ax, periods=6), 1, FORCE, 1),
    "spectrum": ("motion", lambda ds, ax: plot.spectrum(ds, "z", ax), 1, LENGTH, 1),
    "phase": ("motion", lambda ds, ax: plot.phase(ds, "z", ax=ax), LENGTH, VELOCITY, 1),
    "phase with z upwards": ("motion", lambda ds, ax: plot.phase(ds, "z_dot", "z", ax), VELOCITY, LENGTH, 1),
    "portrait": ("motion", lambda ds, ax: plot.portrait(ds, "z", ax=ax), LENGTH, VELOCITY, 1),
    "portrait without samples": ("section", lambda ds, ax: plot.portrait(ds, "x1", ax=ax), LENGTH, VELOCITY, 1),
    "zones": ("zones", lambda ds, ax: plot.zones(ds, ax), SCALES.frequency, SCALES.torque1, 1),
    "level": ("zones", lambda ds, ax: plot.level(ds, "v_rms", ax), SCALES.frequency, SCALES.torque1, VELOCITY),
    "level after a sweep": (
        "zones", lambda ds, ax: plot.level(ds, "v_rms_up", ax), SCALES.frequency, SCALES.torque1, VELOCITY),
    "level of a ratio": ("errors", lambda ds, ax: plot.level(ds, "dynamic_factor", ax), SCALES.frequency, LENGTH, 1),
    "bifurcation": ("bifurcation", lambda ds, ax: plot.bifurcation(ds, "x1", ax), LENGTH, LENGTH, 1),
    "response": ("bifurcation", lambda ds, ax: plot.response(ds, "v_rms", ax), LENGTH, VELOCITY, 1),
    "lyapunov": ("bifurcation", lambda ds, ax: plot.lyapunov(ds, ax), LENGTH, SCALES.rate, 1),
    "basins": ("basins", lambda ds, ax: plot.basins(ds, ax), LENGTH, VELOCITY, 1),
    "attractors": ("attractors", lambda ds, ax: plot.attractors(ds, ax), LENGTH, VELOCITY, 1),
    "response_curve": ("branch", lambda ds, ax: plot.response_curve(ds, ax=ax), LENGTH, LENGTH, 1),
    "branch": ("branch", lambda ds, ax: plot.branch(ds, "x1_dot", ax), LENGTH, VELOCITY, 1),
}


def test_every_variable_of_every_study_is_in_the_table_of_quantities(results):
    for name, (ds, scaled) in results.items():
        for variable in map(str, ds.variables):
            found = quantity(ds[variable].attrs.get("quantity", variable))
            unit = found.physical.unit if found.physical else ds[variable].attrs["units"]
            assert scaled[variable].attrs["units"] == unit, (name, variable)


def lines(ax) -> list[tuple[np.ndarray, np.ndarray, bool, bool]]:
    """Data of every line, and whether x and y are in data units (and not shares of the Axes, as of guide lines)."""
    free = [line.get_transform().contains_branch_seperately(ax.transData) for line in ax.lines]
    return [(*map(np.asarray, line.get_data()), *ok) for line, ok in zip(ax.lines, free, strict=True)]


def close(found, expected) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * np.nanmax(np.abs(expected), initial=1e-300))


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_the_same_but_for_its_scales(results, name):
    result, draw, x, y, colour = PICTURES[name]
    plain, scaled = (draw(ds, axes()) for ds in results[result])
    close(scaled.get_xlim(), np.array(plain.get_xlim()) * x)
    close(scaled.get_ylim(), np.array(plain.get_ylim()) * y)
    assert len(plain.lines) == len(scaled.lines) and len(plain.images) == len(scaled.images)
    for (u, v, free_x, free_y), (a, b, *_) in zip(lines(plain), lines(scaled), strict=True):
        close(a, u * (x if free_x else 1))
        close(b, v * (y if free_y else 1))
    assert [line.get_markersize() for line in plain.lines] == [line.get_markersize() for line in scaled.lines]
    for one, other in zip(plain.images, scaled.images, strict=True):
        close(other.get_extent(), np.array(one.get_extent()) * [x, x, y, y])
        close(np.ma.filled(other.get_array(), -9.0) , np.ma.filled(one.get_array() * colour, -9.0))
    for one, other in zip(plain.collections, scaled.collections, strict=True):
        assert isinstance(one, PolyCollection)
        for path, twin in zip(one.get_paths(), other.get_paths(), strict=True):
            close(twin.vertices, path.vertices * [x, y])


def test_every_picture_of_a_result_is_compared():
    of_none = {"backlash", "schematic", "stiffness", "motion", "result"}  # of a model, or made of the others
    of_none |= {"skeleton", "manifolds", "agreement"}  # compared in test_curve.py and its neighbours
    # always in units:
    of_none |= {"dynamic_factor", "gear_pair", "harris_map", "mesh_stiffness", "separation_line", "transmission_error"}
    of_none |= {"runup", "orders", "fit", "scatter", "assessment"}
    of_none |= {"train", "modes", "campbell", "flanks"}  # in SI, or over the time alone
    of_none |= {"motion_strip", "class_legend", "attractor_legend"}  # beside others
    of_none |= {"attractor_names", "motion_class", "save_with_data", "style"}  # no pictures
    functions = {n for n in plot.__all__ if callable(getattr(plot, n)) and n[0].islower()}
    assert functions - of_none <= set(PICTURES)


def test_two_hundred_periods_are_two_hundred_in_milliseconds_too():
    pair = replace(PAIR, damping_law="always")
    ds = gc.physical(gc.simulate(pair.to_model(), 200, 600, samples=8), pair)
    assert plot.history(ds, "z", axes()).get_xlim()[1] == pytest.approx(200, abs=0.2)
    order, size = amplitudes(ds, "z")
    assert order[1] == pytest.approx(1 / 200)
    assert order[size > 1e-6 * size.max()] * 4 == pytest.approx(np.arange(17))  # a 4T motion: lines at quarters


def test_backlash_ends_at_its_measured_width(results):
    ax = plot.phase(results["motion"][1], "z", ax=axes())
    dashed = sorted(float(line.get_xdata()[0]) for line in ax.lines if line.get_linestyle() == "--")
    assert dashed == pytest.approx([-60.0, 60.0])


def test_four_views_show_the_same_motion_in_both(results):
    plain, scaled = (plot.motion(ds, figure=Figure()).axes for ds in results["motion"])
    factors = ((1, LENGTH), (LENGTH, VELOCITY), (LENGTH, VELOCITY), (1, VELOCITY))
    for one, other, (x, y) in zip(plain, scaled, factors, strict=True):
        close(other.lines[0].get_xdata(), one.lines[0].get_xdata() * x)
        close(other.lines[0].get_ydata(), one.lines[0].get_ydata() * y)


def test_labels_of_physical_axes_say_what_is_measured(results):
    ax = plot.zones(results["zones"][1], axes())
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("mesh frequency $f_z$ [Hz]", "driving torque $M_{1}$ [N m]")
    assert plot.zones(results["errors"][1], axes()).get_ylabel() == "error amplitude $e_{1}$ [µm]"


@pytest.mark.parametrize("units", [0, 1], ids=["dimensionless", "physical"])
@pytest.mark.parametrize(("kind", "result", "colour"), [
    ("motion", "motion", "motion"), ("map", "zones", "motion"), ("map", "zones", "v_rms"),
    ("map", "zones", "attractors"),
])
def test_the_explorers_pictures_are_made_in_both(results, units, kind, result, colour):
    pytest.importorskip("tomlkit")
    from gearchaos.explorer.jobs.export import picture

    content, media = picture(kind, "png", results[result][units], colour, "title")
    assert media == "image/png" and len(content) > 10_000


def test_rounding_errors_of_an_orbit_make_no_points_of_their_own_in_any_units():
    left = 1e-12 * np.cos(np.arange(300.0))
    ds = gc.simulate(PAIR.to_model(), 300)
    ds = ds.assign(section_z=ds["section_z"] * 0 + 0.3 + left, section_z_dot=ds["section_z_dot"] * 0 + left)
    sizes = {plot.portrait(found, "z", ax=axes()).lines[0].get_markersize() for found in (ds, gc.physical(ds, PAIR))}
    assert sizes == {3.5}
