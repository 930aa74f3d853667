"""Pictures at every size and of every result: nothing is cut or magnified, and what does not fit is refused."""

from __future__ import annotations

import re

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.pictures import legend_words

pytestmark = pytest.mark.slow

PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"],
)
SINGLE = gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1)


def _studies() -> dict[str, xr.Dataset]:
    full = gc.MeshModel.of(kind="full", omega=1.05)
    omega, eps1 = gc.Axis("omega", 0.2, 2.0, 24), gc.Axis("eps1", 0.0, 0.3, 18)
    return {
        "simulate": gc.simulate(gc.MeshModel.of(omega=1.0, eps1=0.23), 60, 40, samples=32),
        "section": gc.simulate(SINGLE, 60, 40),
        "zones": gc.zones(gc.MeshModel(), omega, eps1, starts=2),
        "bifurcation": gc.bifurcation(full, gc.Axis("eps1", 0, 0.25, 24), points=16),
        "basins": gc.basins(SINGLE, gc.Axis("z", -3, 3, 16), gc.Axis("z_dot", -2, 2, 16)),
        "attractors": gc.attractors(SINGLE, 64),
    }


@pytest.fixture(scope="module")
def results() -> dict[str, tuple[xr.Dataset, xr.Dataset]]:
    return {name: (ds, gc.physical(ds, PAIR)) for name, ds in _studies().items()}


PICTURES = {
    "history": ("simulate", lambda ds, ax: plot.history(ds, "mesh_force", ax)),
    "spectrum": ("simulate", lambda ds, ax: plot.spectrum(ds, "z_dot", ax)),
    "phase": ("simulate", lambda ds, ax: plot.phase(ds, "z", ax=ax)),
    "portrait": ("section", lambda ds, ax: plot.portrait(ds, "z", ax=ax)),
    "zones": ("zones", lambda ds, ax: plot.zones(ds, ax)),
    "level": ("zones", lambda ds, ax: plot.level(ds, "v_rms_most", ax)),
    "contact": ("zones", lambda ds, ax: plot.level(ds, "contact", ax)),
    "hysteresis": ("zones", lambda ds, ax: plot.level(ds, "hysteresis", ax)),
    "reasons": ("zones", lambda ds, ax: plot.level(ds, "reason", ax)),
    "periods": ("zones", lambda ds, ax: plot.level(ds, "period", ax)),
    "bifurcation": ("bifurcation", lambda ds, ax: plot.bifurcation(ds, ax=ax)),
    "lyapunov": ("bifurcation", lambda ds, ax: plot.lyapunov(ds, ax)),
    "response": ("bifurcation", lambda ds, ax: plot.response(ds, "v_rms", ax)),
    "contact along": ("bifurcation", lambda ds, ax: plot.response(ds, "contact", ax)),
    "basins": ("basins", lambda ds, ax: plot.basins(ds, ax)),
    "attractors": ("attractors", lambda ds, ax: plot.attractors(ds, ax)),
    "stiffness": ("simulate", lambda ds, ax: plot.stiffness(None, ax)),
    "backlash": ("simulate", lambda ds, ax: plot.backlash(ax)),
    "schematic": ("simulate", lambda ds, ax: plot.schematic(ax)),
}


def fresh(width: float = 6.4, height: float = 4.8) -> Figure:
    """An empty figure that can be drawn."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def cut(figure: Figure) -> list[str]:
    """The sides of a figure over which something it draws reaches, by more than a pixel."""
    figure.canvas.draw()
    drawn, (width, height), pixel = figure.get_tightbbox(), figure.get_size_inches(), 1 / figure.dpi
    over = {"left": -drawn.x0, "right": drawn.x1 - width, "below": -drawn.y0, "above": drawn.y1 - height}
    return [side for side, inches in over.items() if inches > pixel]


@pytest.fixture
def narrow():
    """Figures of one column of a journal, as pyplot makes them."""
    with matplotlib.rc_context({"figure.figsize": (3.4, 2.8), "figure.constrained_layout.use": False}):
        plt.switch_backend("agg")
        yield
        plt.close("all")


@pytest.mark.parametrize("units", [
    pytest.param(0, marks=pytest.mark.exhaustive, id="dimensionless"), pytest.param(1, id="physical")])
@pytest.mark.parametrize("name", PICTURES)
def test_no_text_is_cut_in_a_narrow_figure(results, narrow, name, units):
    result, draw = PICTURES[name]
    ax = draw(results[result][units], None)
    assert cut(ax.figure) == []
    assert ax.get_window_extent().width > 0.4 * ax.figure.bbox.width, "what is drawn still has most of the room"


@pytest.mark.parametrize("style", ["slides", *(
    pytest.param(style, marks=pytest.mark.exhaustive) for style in ("paper", "dark"))])  # it has the largest letters
@pytest.mark.parametrize("name", PICTURES)
def test_no_text_is_cut_in_a_column_of_any_style(results, narrow, name, style):
    result, draw = PICTURES[name]
    with plot.style(style, width="column"):
        assert cut(draw(results[result][0], None).figure) == []


@pytest.mark.parametrize("units", [0, 1], ids=["dimensionless", "physical"])
def test_four_views_in_a_narrow_figure_have_smaller_letters(results, units):
    figure = plot.motion(results["simulate"][units], title="chaotic", figure=fresh(3.4, 3.0))
    assert cut(figure) == []
    boxes = [ax.get_tightbbox() for ax in figure.axes]
    pairs = [(a, b) for i, a in enumerate(boxes) for b in boxes[:i]]
    assert not any(a.padded(-1).overlaps(b.padded(-1)) for a, b in pairs), "no label lies over another view"


@pytest.mark.parametrize("name", ["zones", "contact", "reasons", "basins", "attractors", "bifurcation"])
def test_no_legend_is_cut_in_a_figure_without_a_layout(results, narrow, name):
    result, draw = PICTURES[name]
    ax = draw(results[result][0], plt.subplots()[1])
    ax.figure.canvas.draw()
    legends = [a.get_legend() for a in (ax, *ax.child_axes) if a.get_legend()]
    (extent,) = (made.get_window_extent() for made in legends)
    assert extent.x1 <= ax.figure.bbox.x1 + 1 and extent.y1 <= ax.figure.bbox.y1 + 1


def test_a_wide_figure_has_its_classes_side_by_side(results):
    figure = fresh(7.2, 4)
    made = plot.basins(results["basins"][0], figure.subplots()).get_legend()
    figure.canvas.draw()
    heights = {round(t.get_window_extent().y0) for t in made.get_texts()}
    assert len(heights) == 1


# --- what does not differ ------------------------------------------------------------------------------------------


def offsets(ax) -> list[str]:
    ax.figure.canvas.draw()
    return [axis.get_offset_text().get_text() for axis in (ax.xaxis, ax.yaxis) if axis.get_offset_text().get_text()]


@pytest.fixture(scope="module")
def at_rest() -> xr.Dataset:
    """A 1T motion with samples: its section is one point, but for what is left of the transient."""
    ds = gc.simulate(gc.MeshModel.of(omega=0.6, eps1=0.02), 40, 2000, samples=16)
    left = 1e-13 * np.cos(np.arange(40))
    for name in ("z", "z_dot", "x1", "x1_dot"):
        ds[name] = ds[name] + np.repeat(left, 16)
        ds[f"section_{name}"] = ds[f"section_{name}"] + left
    return ds


@pytest.mark.parametrize("units", ["dimensionless", "physical"])
@pytest.mark.parametrize("draw", [
    lambda ds, ax: plot.portrait(ds, "x1", ax=ax), lambda ds, ax: plot.portrait(ds, "z", ax=ax),
    lambda ds, ax: plot.phase(ds.isel(tau=slice(None, None, 16)), "z", ax=ax),
    lambda ds, ax: plot.history(ds.isel(tau=slice(None, None, 16)), "z", ax),
])
def test_one_point_is_not_magnified_to_rounding(at_rest, units, draw):
    ds = at_rest if units == "dimensionless" else gc.physical(at_rest, PAIR)
    assert np.ptp(at_rest["section_z"].values) < 1e-10
    ax = draw(ds, fresh().subplots())
    assert offsets(ax) == []
    x, y = ax.lines[0].get_xdata(), ax.lines[0].get_ydata()
    low, high = ax.get_ylim()
    assert low < y.min() and y.max() < high and x.size


def test_levels_and_diagrams_that_do_not_differ_are_not_magnified():
    model, omega, eps1 = gc.MeshModel.of(omega=0.6), gc.Axis("omega", 0.55, 0.65, 3), gc.Axis("eps1", 0.01, 0.02, 3)
    ds = gc.zones(model, omega, eps1)
    ds["v_rms"] = ds["v_rms"] * 0 + 0.27 + 1e-13 * np.arange(9).reshape(3, 3)
    figure = plot.level(ds, "v_rms", fresh().subplots()).figure
    assert [t for ax in figure.axes for t in offsets(ax)] == []
    line = gc.bifurcation(model, eps1, points=4)
    line["section_x1"] = line["section_x1"] * 0 + 0.27 + 1e-13 * np.arange(12).reshape(3, 4)
    assert offsets(plot.bifurcation(line, "x1", fresh().subplots())) == []
    line["lyapunov"] = line["lyapunov_lo"] = line["lyapunov_hi"] = xr.zeros_like(line["lyapunov"])
    assert offsets(plot.lyapunov(line, fresh().subplots())) == []


def test_a_map_without_a_single_value_is_grey(results):
    ds = results["zones"][0].copy(deep=True)
    ds["dynamic_factor"][:] = np.nan
    ax = plot.level(ds, "dynamic_factor", fresh().subplots())
    ax.figure.canvas.draw()
    assert np.isnan(ax.images[0].get_array().filled(np.nan)).all()


def test_motion_that_diverged_is_drawn_as_far_as_it_goes():
    ds = gc.simulate(gc.MeshModel.of(kind="single", zeta=0.0, q0=1e7, chi0=0.5), 12, samples=16)
    assert ds.attrs["status"] == "diverged" and np.isfinite(ds["z"][20]) and np.isnan(ds["z"][-1])
    figure = plot.motion(ds, figure=fresh())
    figure.canvas.draw()


# --- classes by name -----------------------------------------------------------------------------------------------


def test_contact_is_drawn_as_named_classes():
    ds = xr.Dataset(
        {"contact": (("y", "x"), np.array([[0, 1, 2], [3, 3, -1]], np.int8), {"long_name": "contact state"}),
         "label": (("y", "x"), np.array([[1, 1, 3], [1, 5, 0]], np.int8), {
             "flag_values": np.arange(1, 6), "flag_meanings": "periodic quasi-periodic chaotic undecided diverged"}),
         "period": (("y", "x"), np.array([[1, 2, 0], [1, 0, 0]]))},
        {"x": [1.0, 2.0, 3.0], "y": [0.0, 1.0]},
    )
    ax = plot.level(ds, "contact", fresh().subplots())
    assert legend_words(ax) == ["in contact", "separation", "both flanks", "no contact", "diverged", "not computed"]
    assert ax.get_legend().get_title().get_text() == "contact state of one motion per cell"
    image = ax.images[0]
    colours = [matplotlib.colors.to_hex(c) for c in image.cmap(image.norm(image.get_array().compressed()))]
    assert colours == [*[c.colour for c in plot.CONTACT_CLASSES], "#111111"]
    assert len(ax.figure.axes) == 1, "there is no colour bar"


def test_the_colour_scale_of_a_share_ends_at_1():
    share = xr.DataArray(np.ones((2, 3)), dims=("y", "x"), attrs={"long_name": "share of the time in contact"})
    ds = xr.Dataset(
        {"contact_fraction": share, "dynamic_factor": share, "period": share.astype(int),
         "label": (("y", "x"), np.ones((2, 3), np.int8), {
             "flag_values": np.arange(1, 6), "flag_meanings": "periodic quasi-periodic chaotic undecided diverged"})},
        {"x": [1.0, 2.0, 3.0], "y": [0.0, 1.0]},
    )
    image = plot.level(ds, "contact_fraction", fresh().subplots()).images[0]
    assert image.norm.vmin < image.norm.vmax == 1
    other = plot.level(ds, "dynamic_factor", fresh().subplots()).images[0]
    assert other.norm.vmin < 1 < other.norm.vmax


def test_a_legend_of_two_rows_is_read_row_by_row():
    ax = fresh().subplots()
    class_number = np.arange(len(plot.MOTION_CLASSES))[None]
    plot.class_legend(ax, class_number, ncols=4)
    assert legend_words(ax) == [one.name for one in plot.MOTION_CLASSES]


def test_answers_and_small_numbers_are_named_and_many_numbers_shaded(results):
    ds = results["zones"][0]
    axes = {n: plot.level(ds, n, fresh().subplots()) for n in ("hysteresis", "attractors")}
    assert set(legend_words(axes["hysteresis"])) <= {"no", "yes"}
    assert legend_words(axes["attractors"]) == [str(n) for n in np.unique(ds["attractors"])]
    many = ds.assign(period=ds["period"] * 0 + np.arange(ds["period"].size).reshape(ds["period"].shape))
    assert plot.level(many, "period", fresh().subplots()).get_legend() is None


def test_level_of_the_label_is_the_zones_map(results):
    ds = results["zones"][0]
    one, other = plot.zones(ds, fresh().subplots()), plot.level(ds, "label", fresh().subplots())
    assert legend_words(one) == legend_words(other)
    assert np.array_equal(one.images[0].get_array(), other.images[0].get_array())


# --- a result of another study -------------------------------------------------------------------------------------

TAKES = {
    "zones": {"zones"}, "level": {"zones"}, "bifurcation": {"bifurcation"}, "lyapunov": {"bifurcation"},
    "response": {"bifurcation"}, "basins": {"basins"}, "attractors": {"attractors"}, "history": {"simulate"},
    "spectrum": {"simulate"},
    "phase": {"simulate"}, "motion": {"simulate"}, "portrait": {"simulate", "section"},
}


def _drawn(name: str, ds) -> object:
    return getattr(plot, name)(ds, **({"figure": fresh()} if name == "motion" else {"ax": fresh().subplots()}))


@pytest.mark.parametrize("result", ["simulate", "section", "zones", "bifurcation", "basins", "attractors"])
@pytest.mark.parametrize("name", TAKES)
def test_results_of_other_studies_are_refused_in_words(results, name, result):
    if result in TAKES[name]:
        _drawn(name, results[result][0])
        return
    with pytest.raises(InputError, match="dataset must be a result of") as error:
        _drawn(name, results[result][0])
    assert re.search(r"gearchaos\.plot\.\w+|Call simulate with samples", error.value.advice)


@pytest.mark.parametrize("name", [*TAKES, "result"])
@pytest.mark.parametrize("value", [None, "zones.nc", gc.MeshModel(), xr.DataArray([1.0]), xr.Dataset()], ids=str)
def test_what_is_no_result_at_all_is_refused_in_words(name, value):
    with pytest.raises(InputError, match="dataset must be"):
        plot.result(value) if name == "result" else _drawn(name, value)


@pytest.mark.parametrize(("name", "result", "arguments", "field"), [
    ("level", "zones", {"name": "v_rsm"}, "name"), ("bifurcation", "bifurcation", {"name": "x3"}, "name"),
    ("history", "simulate", {"name": "zdot"}, "name"), ("spectrum", "simulate", {"name": "tau"}, "name"),
    ("phase", "simulate", {"x": "w"}, "x"), ("phase", "simulate", {"x": "z", "y": "w"}, "y"),
    ("portrait", "section", {"x": "x1"}, "x"), ("portrait", "simulate", {"x": "z", "y": "w"}, "y"),
])
def test_names_that_are_not_there_are_refused_with_those_that_are(results, name, result, arguments, field):
    with pytest.raises(InputError, match=f"^{field} must be one of .*z") as error:
        getattr(plot, name)(results[result][0], ax=fresh().subplots(), **arguments)
    assert error.value.value == arguments[field]


def test_nothing_is_opened_for_what_is_refused(narrow):
    with pytest.raises(InputError):
        plot.zones(xr.Dataset())
    assert plt.get_fignums() == []


def test_too_few_samples_have_no_spectrum():
    for periods, samples in ((1, 1), (5, 1)):
        with pytest.raises(InputError, match="two samples per mesh period"):
            plot.spectrum(gc.simulate(gc.MeshModel(), periods, samples=samples), ax=fresh().subplots())


def test_lost_attributes_are_told(results):
    with pytest.raises(InputError, match="must carry the attributes of its study"):
        plot.history(results["simulate"][0].drop_attrs(), ax=fresh().subplots())


def test_characteristics_take_a_pair_and_refuse_the_rest():
    assert plot.stiffness(PAIR, fresh().subplots()).patches
    for bad in (1.0, "paper", xr.Dataset()):
        with pytest.raises(InputError, match="model must be a MeshModel, a GearPair, a GearDesign or a Train"):
            plot.stiffness(bad, fresh().subplots())


# --- any result ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("result", ["simulate", "section", "zones", "bifurcation", "basins", "attractors"])
def test_every_result_has_a_picture(results, narrow, result):
    figure = plot.result(results[result][0])
    assert cut(figure) == []
    assert len(figure.axes) == (4 if result == "simulate" else 1)


def test_a_diagram_without_points_is_drawn_by_its_exponents(narrow):
    ds = gc.bifurcation(gc.MeshModel(), gc.Axis("eps1", 0.0, 0.1, 3), points=0)
    assert "exponent" in plot.result(ds).axes[0].get_ylabel()
    with pytest.raises(InputError, match="must have stroboscopic points"):
        plot.bifurcation(ds)


def test_maps_are_coloured_by_what_is_asked(results, narrow):
    ds = results["zones"][0]
    for colour in ("motion", "contact", "dynamic_factor", "v_rms", "hysteresis", "attractors"):
        assert plot.result(ds, colour).axes[0].images
    with pytest.raises(InputError, match=r"colour must be one of .*contact.*Did you mean 'v_rms'"):
        plot.result(ds, "v_rsm")
    with pytest.raises(InputError, match="colour must be left out"):
        plot.result(results["basins"][0], "contact")
