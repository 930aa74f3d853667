"""Pictures at every size and of every result: nothing is cut or magnified, and what does not fit is refused."""

import re
from contextlib import nullcontext
from itertools import combinations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests.branches import PAIR, axes
from tests.contracts.plot.figures import PICTURES, STUDIES, cut, result
from tests.contracts.plot.test_pictures import diagram, zones_map
from tests.pictures import legend_words

pytestmark = pytest.mark.slow

ALL = {name: picture[:2] for name, picture in PICTURES.items()} | {
    "stiffness": ("simulate", lambda _, ax: plot.stiffness(None, ax)),
    "backlash": ("simulate", lambda _, ax: plot.backlash(ax)),
    "schematic": ("simulate", lambda _, ax: plot.schematic(ax))}


@pytest.fixture
def narrow():
    """Figures of one column of a journal, as pyplot makes them."""
    with matplotlib.rc_context({"figure.figsize": (3.4, 2.8), "figure.constrained_layout.use": False}):
        plt.switch_backend("agg")
        yield


WIDE = {"zones", "spectrum", "bifurcation", "basins", "response_curve", "v_rms_most", "contact", "reason", "schematic"}


@pytest.mark.parametrize(("name", "style", "units"), [
    pytest.param(name, style, units, marks=[] if units or (style == "slides" and name in WIDE) else [
        pytest.mark.exhaustive]) for name in ALL  # with units, and with the largest letters
    for style, units in ((None, 1), (None, 0), ("slides", 0), ("paper", 0), ("dark", 0))])
def test_no_text_is_cut_in_a_narrow_figure(narrow, name, style, units):
    study, draw = ALL[name]
    with plot.style(style, width="column") if style else nullcontext():
        ax = draw(result(study)[units], None)
        assert cut(ax.figure) == []
    assert style or ax.get_window_extent().width > 0.4 * ax.figure.bbox.width, "what is drawn has most of the room"


@pytest.mark.parametrize("units", [0, 1], ids=["dimensionless", "physical"])
def test_four_views_in_a_narrow_figure_have_smaller_letters(units):
    figure = Figure(figsize=(3.4, 3.0), layout="constrained")
    plot.motion(result("simulate")[units], title="chaotic", figure=figure)
    assert cut(figure) == []
    pairs = combinations([ax.get_tightbbox().padded(-1) for ax in figure.axes], 2)
    assert not any(a.overlaps(b) for a, b in pairs), "no label lies over another view"


@pytest.mark.parametrize("name", ["zones", "contact", "reason", "basins", "attractors", "bifurcation"])
def test_no_legend_is_cut_in_a_figure_without_a_layout(narrow, name):
    study, draw = ALL[name]
    ax = draw(result(study)[0], plt.subplots()[1])
    ax.figure.draw_without_rendering()
    (extent,) = (a.get_legend().get_window_extent() for a in (ax, *ax.child_axes) if a.get_legend())
    assert extent.x1 <= ax.figure.bbox.x1 + 1 and extent.y1 <= ax.figure.bbox.y1 + 1


def test_a_wide_figure_has_its_classes_side_by_side():
    ax = plot.basins(result("basins")[0], axes(7.2, 4))
    ax.figure.draw_without_rendering()
    assert len({round(t.get_window_extent().y0) for t in ax.get_legend().get_texts()}) == 1


def offsets(ax) -> list[str]:
    ax.figure.draw_without_rendering()
    return [axis.get_offset_text().get_text() for axis in (ax.xaxis, ax.yaxis) if axis.get_offset_text().get_text()]


@pytest.fixture(scope="module")
def at_rest() -> xr.Dataset:
    """A 1T motion with samples: its section is one point, but for what is left of the transient."""
    ds = gc.simulate(gc.MeshModel.of(omega=0.6, eps1=0.02), 40, 1000, samples=16)
    left = 1e-13 * np.cos(np.arange(40))
    for name in ("z", "z_dot", "x1", "x1_dot"):
        ds[name] = ds[name] + np.repeat(left, 16)
        ds[f"section_{name}"] = ds[f"section_{name}"] + left
    return ds


@pytest.mark.parametrize("units", ["dimensionless", "physical"])
@pytest.mark.parametrize("draw", [
    lambda ds, ax: plot.portrait(ds, "x1", ax=ax), lambda ds, ax: plot.portrait(ds, "z", ax=ax),
    lambda ds, ax: plot.phase(ds.isel(tau=slice(None, None, 16)), "z", ax=ax),
    lambda ds, ax: plot.history(ds.isel(tau=slice(None, None, 16)), "z", ax)])
def test_one_point_is_not_magnified_to_rounding(at_rest, units, draw):
    assert np.ptp(at_rest["section_z"].values) < 1e-10
    ax = draw(at_rest if units == "dimensionless" else gc.physical(at_rest, PAIR), axes())
    assert offsets(ax) == []
    (low, high), y = ax.get_ylim(), ax.lines[0].get_ydata()
    assert low < y.min() and y.max() < high


def test_levels_and_diagrams_that_do_not_differ_are_not_magnified():
    ds = zones_map()
    ds["v_rms"] = ds["v_rms"] * 1e-13 + 0.27
    figure = plot.level(ds, "v_rms", axes()).figure
    assert [t for ax in figure.axes for t in offsets(ax)] == []
    line = diagram(3, 4)
    line["section_x1"] = line["section_x1"] * 1e-13 + 0.27
    assert offsets(plot.bifurcation(line, "x1", axes())) == []
    line["lyapunov"] = line["lyapunov_lo"] = line["lyapunov_hi"] = xr.zeros_like(line["lyapunov"])
    assert offsets(plot.lyapunov(line, axes())) == []


def test_a_map_without_a_single_value_is_grey():
    ax = plot.level(zones_map().assign(v_rms=zones_map()["v_rms"] * np.nan), "v_rms", axes())
    ax.figure.canvas.draw()
    assert np.isnan(ax.images[0].get_array().filled(np.nan)).all()


def test_motion_that_diverged_is_drawn_as_far_as_it_goes():
    ds = gc.simulate(gc.MeshModel.of(kind="single", zeta=0.0, q0=1e7, chi0=0.5), 12, samples=16)
    assert ds.attrs["status"] == "diverged" and np.isfinite(ds["z"][20]) and np.isnan(ds["z"][-1])
    plot.motion(ds, figure=Figure()).draw_without_rendering()


def test_contact_is_drawn_as_named_classes():
    ds = zones_map()
    ds["label"][:] = [[1, 1, 3], [1, 5, 0]]
    ds["contact"] = ds["label"].dims, np.array([[0, 1, 2], [3, 3, -1]], np.int8), {"long_name": "contact state"}
    ax = plot.level(ds, "contact", axes())
    assert legend_words(ax) == ["in contact", "separation", "both flanks", "no contact", "diverged", "not computed"]
    assert ax.get_legend().get_title().get_text() == "contact state of one motion per cell"
    image = ax.images[0]
    colours = [matplotlib.colors.to_hex(c) for c in image.cmap(image.norm(image.get_array().compressed()))]
    assert colours == [*[c.colour for c in plot.CONTACT_CLASSES], "#111111"]
    assert len(ax.figure.axes) == 1, "there is no colour bar"


def test_the_colour_scale_of_a_share_ends_at_1():
    ds = zones_map()
    for name in ("contact_fraction", "dynamic_factor"):
        ds[name] = ds["v_rms"] * 0 + 1
    share, other = (plot.level(ds, name, axes()).images[0].norm for name in ("contact_fraction", "dynamic_factor"))
    assert share.vmin < share.vmax == 1 and other.vmin < 1 < other.vmax


def test_a_legend_of_two_rows_is_read_row_by_row():
    plot.class_legend(ax := axes(), np.arange(len(plot.MOTION_CLASSES))[None], ncols=4)
    assert legend_words(ax) == [one.name for one in plot.MOTION_CLASSES]


def test_answers_and_small_numbers_are_named_and_many_numbers_shaded():
    ds = result("zones")[0]
    assert legend_words(plot.level(ds, "hysteresis", axes())) == ["no", "yes"]
    numbers = legend_words(plot.level(ds, "attractors", axes()))
    assert numbers == [str(n) for n in np.unique(ds["attractors"])] and len(numbers) > 1
    many = ds.assign(period=ds["period"] * 0 + np.arange(ds["period"].size).reshape(ds["period"].shape))
    assert plot.level(many, "period", axes()).get_legend() is None


def test_level_of_the_label_is_the_zones_map():
    ds = result("zones")[0]
    one, other = plot.zones(ds, axes()), plot.level(ds, "label", axes())
    assert legend_words(one) == legend_words(other)
    assert np.array_equal(one.images[0].get_array(), other.images[0].get_array())


TAKES = {
    "zones": {"zones"}, "level": {"zones"}, "bifurcation": {"bifurcation"}, "lyapunov": {"bifurcation"},
    "response": {"bifurcation"}, "basins": {"basins"}, "attractors": {"attractors"}, "history": {"simulate"},
    "spectrum": {"simulate"}, "phase": {"simulate"}, "motion": {"simulate"}, "portrait": {"simulate", "section"}}


def drawn(name: str, ds) -> object:
    return getattr(plot, name)(ds, **({"figure": Figure()} if name == "motion" else {"ax": axes()}))


@pytest.mark.parametrize("name", TAKES)
def test_results_of_other_studies_and_what_is_no_result_are_refused_in_words(name):
    for study in STUDIES.keys() - TAKES[name] - {"torques"}:
        with pytest.raises(InputError, match="dataset must be a result of") as error:
            drawn(name, result(study)[0])
        assert re.search(r"gearchaos\.plot\.\w+|Call simulate with samples", error.value.advice)
    for value in (None, "zones.nc", gc.MeshModel(), xr.DataArray([1.0]), xr.Dataset()):
        for draw in (drawn, lambda _, ds: plot.result(ds)):
            with pytest.raises(InputError, match="dataset must be"):
                draw(name, value)


@pytest.mark.parametrize(("name", "study", "arguments", "field"), [
    ("level", "zones", {"name": "v_rsm"}, "name"), ("bifurcation", "bifurcation", {"name": "x3"}, "name"),
    ("history", "simulate", {"name": "zdot"}, "name"), ("spectrum", "simulate", {"name": "tau"}, "name"),
    ("phase", "simulate", {"x": "w"}, "x"), ("phase", "simulate", {"x": "z", "y": "w"}, "y"),
    ("portrait", "section", {"x": "x3"}, "x"), ("portrait", "simulate", {"x": "z", "y": "w"}, "y")])
def test_names_that_are_not_there_are_refused_with_those_that_are(name, study, arguments, field):
    with pytest.raises(InputError, match=f"^{field} must be one of .*z") as error:
        getattr(plot, name)(result(study)[0], ax=axes(), **arguments)
    assert error.value.value == arguments[field]


def test_nothing_is_opened_for_what_is_refused(narrow):
    with pytest.raises(InputError):
        plot.zones(xr.Dataset())
    assert plt.get_fignums() == []


def test_too_few_samples_have_no_spectrum():
    for periods, samples in ((1, 1), (5, 1)):
        with pytest.raises(InputError, match="two samples per mesh period"):
            plot.spectrum(gc.simulate(gc.MeshModel(), periods, samples=samples), ax=axes())


def test_lost_attributes_are_told():
    with pytest.raises(InputError, match="must carry the attributes of its study"):
        plot.history(result("simulate")[0].drop_attrs(), ax=axes())


def test_characteristics_take_a_pair_and_refuse_the_rest():
    assert plot.stiffness(PAIR, axes()).patches
    for bad in (1.0, "paper", xr.Dataset()):
        with pytest.raises(InputError, match="model must be a MeshModel, a GearPair, a GearDesign or a Train"):
            plot.stiffness(bad, axes())


@pytest.mark.parametrize("study", STUDIES)
def test_every_result_has_a_picture(narrow, study):
    figure = plot.result(result(study)[0])
    assert cut(figure) == []
    assert len(figure.axes) == (4 if study == "simulate" else 1)


def test_a_diagram_without_points_is_drawn_by_its_exponents(narrow):
    ds = gc.bifurcation(gc.MeshModel(), gc.Axis("eps1", 0.0, 0.1, 3), points=0)
    assert "exponent" in plot.result(ds).axes[0].get_ylabel()
    with pytest.raises(InputError, match="must have stroboscopic points"):
        plot.bifurcation(ds)


def test_maps_are_coloured_by_what_is_asked(narrow):
    ds = result("zones")[0]
    for colour in ("motion", "contact", "dynamic_factor"):
        assert plot.result(ds, colour).axes[0].images
    with pytest.raises(InputError, match=r"colour must be one of .*contact.*Did you mean 'v_rms'"):
        plot.result(ds, "v_rsm")
    with pytest.raises(InputError, match="colour must be one of contact, contact_fraction, dynamic_factor"):
        plot.result(result("bifurcation")[0], "hysteresis")
    with pytest.raises(InputError, match=r"colour must be left out.* It is of basins"):
        plot.result(result("basins")[0], "contact")
