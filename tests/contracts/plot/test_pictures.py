"""Pictures: what they show of small synthetic Datasets, drawn without pyplot state."""

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

from gearchaos import plot
from gearchaos.datasets import model_json
from gearchaos.errors import InputError
from gearchaos.model import HarmonicStiffness, MeshModel
from gearchaos.plot.axes import axis_label, cell_extent, symbol
from gearchaos.plot.diagrams import density
from gearchaos.plot.motions import amplitudes
from gearchaos.plot.states import attractor_colours
from tests.branches import axes
from tests.pictures import legend_words

FLAGS = {
    "flag_values": np.arange(1, 6, dtype=np.int8),
    "flag_meanings": "periodic quasi-periodic chaotic undecided diverged"}
OMEGA = 2.0


def is_drawn(ax: matplotlib.axes.Axes) -> bool:
    """Whether the inside of the Axes holds more than one colour, frame and labels aside."""
    ax.figure.canvas.draw()
    image = np.asarray(ax.figure.canvas.buffer_rgba())[::-1, :, :3]
    box = ax.get_window_extent()
    inside = image[int(box.y0) + 3 : int(box.y1) - 3, int(box.x0) + 3 : int(box.x1) - 3]
    return bool(inside.reshape(-1, 3).std(axis=0).max() > 1)


def zones_map() -> xr.Dataset:
    label = np.array([[1, 1, 1], [2, 3, 1]], dtype=np.int8)
    period = np.array([[1, 2, 7], [0, 0, 4]], dtype=np.int32)
    return xr.Dataset(
        {"label": (("eps1", "omega"), label, FLAGS), "period": (("eps1", "omega"), period),
         "v_rms": (("eps1", "omega"), np.arange(6.0).reshape(2, 3), {"long_name": "rms velocity", "units": "1"})},
        {"omega": ("omega", [1.0, 2.0, 3.0], {"units": "omega0"}), "eps1": ("eps1", [0.1, 0.2])})


def diagram(columns: int = 60, points: int = 40) -> xr.Dataset:
    x = np.linspace(0, 1, columns)
    section = np.where(x[:, None] < 0.5, 1.0, np.random.default_rng(0).random((columns, points)))
    exponent = np.where(x < 0.5, -0.1, 0.2)
    return xr.Dataset(
        {"section_x1": (("q0", "point"), section), "label": ("q0", np.where(x < 0.5, 1, 3).astype(np.int8), FLAGS),
         "period": ("q0", np.where(x < 0.5, 1, 0)), "lyapunov": ("q0", exponent),
         "lyapunov_lo": ("q0", exponent - 0.05), "lyapunov_hi": ("q0", exponent + 0.05)},
        {"q0": x})


def motion(periods: int = 8, samples: int = 32) -> xr.Dataset:
    """A pure tone of amplitude 0.5 at order 1 and one of 0.1 at order 1/2 about z = 0.9."""
    period = 2 * np.pi / OMEGA
    tau = np.arange(periods * samples) * period / samples
    z = 0.9 + 0.5 * np.cos(OMEGA * tau) + 0.1 * np.cos(OMEGA * tau / 2)
    z_dot = np.gradient(z, tau)
    return xr.Dataset(
        {"z": ("tau", z), "z_dot": ("tau", z_dot), "section_z": ("period", z[::samples]),
         "section_z_dot": ("period", z_dot[::samples])},
        {"tau": tau, "period": np.arange(1, periods + 1)}, {"model": model_json(MeshModel(omega=OMEGA))})


def starts() -> xr.Dataset:
    index = np.array([[0, 1, 2], [2, 1, -1]], dtype=np.int16)
    points = np.array([[0.1, np.nan], [-0.2, 0.3], [0.4, -0.4]])
    return xr.Dataset(
        {"attractor": (("z_dot", "z"), index), "attractor_label": ("number", np.ones(3, np.int8), FLAGS),
         "attractor_period": ("number", [1, 4, 4]), "attractor_fraction": ("number", [1 / 6, 2 / 6, 2 / 6]),
         "attractor_section_z": (("number", "point"), points),
         "attractor_section_z_dot": (("number", "point"), points / 2)},
        {"z": [-1.0, 0.0, 1.0], "z_dot": [-0.5, 0.5]})


PICTURES = {
    "zones": lambda ax: plot.zones(zones_map(), ax), "level": lambda ax: plot.level(zones_map(), "v_rms", ax),
    "bifurcation": lambda ax: plot.bifurcation(diagram(), "x1", ax),
    "lyapunov": lambda ax: plot.lyapunov(diagram(), ax),
    "response": lambda ax: plot.response(diagram(), "lyapunov", ax), "basins": lambda ax: plot.basins(starts(), ax),
    "phase": lambda ax: plot.phase(motion(), "z", ax=ax), "history": lambda ax: plot.history(motion(), "z_dot", ax),
    "portrait": lambda ax: plot.portrait(motion(), "z", ax=ax), "spectrum": lambda ax: plot.spectrum(motion(), "z", ax),
    "stiffness": lambda ax: plot.stiffness(ax=ax), "backlash": lambda ax: plot.backlash(ax),
    "schematic": lambda ax: plot.schematic(ax)}


@pytest.mark.parametrize("name", PICTURES)
def test_draws_on_the_given_axes_and_returns_it_without_pyplot(name):
    ax = axes()
    assert PICTURES[name](ax) is ax
    assert is_drawn(ax)
    assert plt.get_fignums() == []


def test_zones_span_the_ranges_of_the_study_and_the_legend_names_only_the_classes_present():
    ax = plot.zones(zones_map(), axes())
    assert legend_words(ax) == ["1T", "2T", "4T", "other sub-harmonic", "quasi-periodic", "chaotic"]
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.0, 3.0), (0.1, 0.2))
    assert "omega" in ax.get_xlabel() and "varepsilon" in ax.get_ylabel()


def test_level_has_a_colour_bar_with_the_name_of_the_variable():
    ax = plot.level(zones_map(), "v_rms", axes())
    assert any("RMS" in other.get_ylabel() for other in ax.figure.axes if other is not ax)


def test_density_is_the_share_of_points_in_each_pixel():
    values = np.array([[0.1, 0.1, 0.9, np.nan], [0.5, 0.5, 0.5, 0.5]])
    assert np.allclose(density(values, 0.0, 1.0, 2), [[2 / 3, 1 / 3], [0, 1]])


def test_bifurcation_of_many_columns_is_one_picture_not_many_markers():
    ax = plot.bifurcation(diagram(2000, 128), "x1", axes())
    assert len(ax.images) == 1 and not ax.lines and not ax.collections
    assert ax.images[0].get_array().shape[1] == 2000


def test_bifurcation_strip_names_the_verdicts_and_a_single_value_is_drawn():
    (strip,) = plot.bifurcation(diagram(), "x1", axes()).child_axes
    assert legend_words(strip) == ["1T", "chaotic"]
    assert plot.bifurcation(diagram().isel(q0=slice(0, 1)), "x1", axes()).images


def test_lyapunov_shows_the_zero_line_and_the_interval():
    ax = plot.lyapunov(diagram(), axes())
    assert any(np.allclose(line.get_ydata(), 0) for line in ax.lines)
    assert "99 % confidence interval" in legend_words(ax)


def test_basins_name_each_attractor_with_its_share_and_those_of_one_period_have_different_colours():
    assert legend_words(plot.basins(starts(), axes())) == ["1T (17 %)", "4T (33 %)", "4T′ (33 %)", "undecided (17 %)"]
    assert len(set(attractor_colours(starts()))) == 3


def test_phase_marks_the_backlash_only_where_z_is_shown():
    other = {"z": "x1", "z_dot": "x1_dot", "section_z": "section_x1", "section_z_dot": "section_x1_dot"}
    for ds, name, expected in ((motion(), "z", [-1.0, 1.0]), (motion().rename(other), "x1", [])):
        dashed = [line for line in plot.phase(ds, name, ax=axes()).lines if line.get_linestyle() == "--"]
        assert sorted(float(np.ravel(line.get_xdata())[0]) for line in dashed) == expected


def test_a_response_along_a_parameter_has_its_values_and_gaps_where_there_is_none():
    ds = diagram(5).assign(v_rms=("q0", [1.0, 2.0, np.nan, 4.0, 3.0]), contact=("q0", np.array([0, 1, 2, 1, 0], "i1")))
    (line,) = plot.response(ds, "v_rms", axes()).lines
    assert np.array_equal(line.get_ydata(), ds["v_rms"], equal_nan=True)
    assert np.array_equal(line.get_xdata(), ds["q0"])
    ax = plot.response(ds, "contact", axes(), strip=False)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["in contact", "separation", "both flanks"]
    assert ax.lines[0].get_ydata().tolist() == [0, 1, 2, 1, 0] and not ax.child_axes
    with pytest.raises(InputError, match=r"^name must be one of .*'v_rms'"):
        plot.response(ds, "v_rsm", axes())


def test_the_variables_of_diagrams_and_maps_are_drawn_by_name():
    ds = diagram().assign_attrs(study="bifurcation")
    assert plot.result(ds, "lyapunov").axes[0].get_ylabel() == plot.response(ds, "lyapunov", axes()).get_ylabel()
    assert plot.result(ds.assign_attrs(study="dynamic_factor"), "lyapunov").axes[0].lines
    with pytest.raises(InputError, match=r"^colour must be one of .*lyapunov"):
        plot.result(ds, "section_x1")
    with pytest.raises(InputError, match=r"^colour must be left out for a result that is not of zones, bifurcation"):
        plot.result(starts().assign_attrs(study="basins"), "attractor")


def test_history_counts_mesh_periods():
    ax = plot.history(motion(periods=8), "z", axes(), periods=5)
    assert ax.get_xlim() == (0, 5)
    assert np.isclose(ax.lines[0].get_xdata()[32], 1.0)


@pytest.mark.parametrize("orders", [6, 46])
def test_a_spectrum_marks_whole_orders_without_crowding(orders):
    ticks = plot.spectrum(motion(), "z", axes(), orders=orders).get_xticks()
    assert 6 <= len(ticks) <= 13
    assert all(tick == int(tick) for tick in ticks)


def test_spectrum_finds_the_amplitudes_of_pure_tones_without_leakage():
    order, size = amplitudes(motion(), "z")
    found = {o: s for o, s in zip(order, size, strict=True) if s > 1e-9}
    assert found == pytest.approx({0.0: 0.9, 0.5: 0.1, 1.0: 0.5})


def test_stiffness_of_a_series_follows_the_series():
    line = plot.stiffness(MeshModel(stiffness=HarmonicStiffness((0.3,), (0.0,))), axes()).lines[0]
    assert np.allclose(line.get_ydata(), 1 + 0.3 * np.cos(2 * np.pi * line.get_xdata()))


def test_backlash_is_flat_between_the_flanks():
    line = max(plot.backlash(axes()).lines, key=lambda line: len(line.get_xdata()))
    assert np.allclose(np.interp([-2, -1, 0, 1, 2], *line.get_data()), [-1, 0, 0, 0, 1])


def test_cells_reach_half_a_step_beyond_their_centres():
    assert cell_extent(np.array([0.0, 1.0, 2.0]), np.array([5.0])) == (-0.5, 2.5, 4.5, 5.5)


def test_symbols_are_those_of_the_paper():
    names = {"omega": r"$\omega$", "eps1": r"$\varepsilon_{1}$", "x1_dot": r"$\dot{x}_{1}$", "kappa2": r"$\kappa_{2}$",
             "contact_fraction": "contact fraction"}
    assert {name: symbol(name) for name in names} == names


def test_labels_show_physical_units_and_leave_out_dimensionless_scales():
    assert axis_label(xr.DataArray(0.0, attrs={"units": "delta*omega0"}), "z_dot") == r"velocity $\dot{z}$"
    assert axis_label(xr.DataArray(0.0, attrs={"units": "um"}), "z") == "displacement $z$ [um]"


def test_what_a_run_has_not_come_to_is_hatched():
    half = zones_map()
    assert not plot.zones(half, axes()).patch.get_hatch()
    half["label"][:2] = 0
    ax = plot.zones(half, axes())
    assert ax.patch.get_hatch() and "not computed" in legend_words(ax)
    assert np.ma.count_masked(ax.images[0].get_array()) == half["label"][:2].size
