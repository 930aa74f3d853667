"""`gearchaos.skeleton` and `agreement`: variables, journals, processes, bad input, pictures."""

from __future__ import annotations

import itertools
import json
from concurrent.futures import BrokenExecutor
from contextlib import nullcontext
from unittest.mock import Mock

import numpy as np
import pytest
from bokeh.core.enums import MarkerType
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import gearchaos as gc
from gearchaos import plot
from gearchaos.continuation import skeleton as algorithm
from gearchaos.errors import InputError
from gearchaos.studies.orbits import skeleton as skeletons
from gearchaos.studyfile import load_design
from tests import EXAMPLES
from tests.branches import EVENT_COLOURS, LOOKS, cascade
from tests.colour_vision import VISION, lab, linear
from tests.commands import ask, run_json
from tests.event_curves import QUICK, SINGLE, SMALL, WINDOW, axes, folds, manifolds, quick, small, zones
from tests.pictures import legend_words


def test_a_skeleton_has_all_its_curves_one_after_another():
    ds = small()
    numbers = ds["curve"].values
    assert numbers.tolist() == sorted(numbers.tolist()) and set(numbers) == set(range(ds.sizes["number"]))
    assert ds["curve_kind"].dims == ds["curve_period"].dims == ds["curve_closed"].dims == ("number",)
    assert ds["special_curve"].dims == ("special",) and "flip" in ds["curve_kind"].values
    assert {*ds["curve_boundary"].values[ds["curve_kind"].values == "graze"]} <= {1, -1}
    assert {end["curve"] for end in json.loads(ds.attrs["ends"])} <= set(numbers)
    assert np.abs(np.isfinite(ds["section_x1"]).sum("cycle") - ds["curve_period"].values[numbers]).max() == 0


@pytest.mark.parametrize("make", [
    lambda: gc.branch(SINGLE, "omega=0.99:1.01"), lambda: gc.agreement(small(), zones()), cascade, folds, manifolds,
    small], ids=["branch without events", "agreement", "branches", "curve", "manifolds", "skeleton"])
def test_results_can_be_saved(make, tmp_path):
    ds = make()
    gc.save(ds, tmp_path / "file.nc")
    assert gc.load(tmp_path / "file.nc").identical(ds)
    assert all("long_name" in variable.attrs and "units" in variable.attrs for variable in ds.data_vars.values())


def test_curves_of_a_skeleton_are_those_that_curve_follows():
    ds = small()
    number = int(np.flatnonzero((ds["curve_kind"] == "flip") & (ds["curve_period"] == 1))[0])
    own = ds.isel(point=np.flatnonzero(ds["curve"].values == number))
    middle = own.isel(point=own.sizes["point"] // 2)
    start = {str(n)[8:]: float(middle[n][0]) for n in own.data_vars if str(n).startswith("section_")}
    model = SMALL.with_values({n: float(middle[n]) for n in ("omega", "eps1")})
    found = gc.curve(model, "flip", "omega=1.7:2.3", "eps1=0.03:0.09", period=1, start=start)
    ends = [(e["omega"], e["eps1"]) for e in json.loads(ds.attrs["ends"]) if e["curve"] == number]
    again = [(e["omega"], e["eps1"]) for e in json.loads(found.attrs["ends"])]
    np.testing.assert_allclose(sorted(ends), sorted(again), atol=1e-7)


@pytest.mark.slow
def test_an_interrupted_skeleton_goes_on_from_its_journal(tmp_path, monkeypatch):
    journal = tmp_path / "s.nc.part"
    assert gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal).identical(quick())
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-2]) + lines[-2][:100])  # killed while it wrote the last line but one
    followed = []
    monkeypatch.setattr(algorithm, "line_seeds", lambda line: pytest.fail("all lines are finished"))
    follow = algorithm.follow_curve
    monkeypatch.setattr(algorithm, "follow_curve", lambda *a: followed.append(a) or follow(*a))
    assert gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal).identical(quick())
    assert len(followed) == 2 and journal.read_bytes().splitlines(keepends=True)[:-2] == lines[:-2]


def test_a_journal_of_another_skeleton_is_refused(tmp_path):
    journal = tmp_path / "s.nc.part"
    gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal)
    with pytest.raises(InputError, match="same model, axes, settings and versions"):
        gc.skeleton(SMALL, **WINDOW, **{**QUICK, "starts": 1}, journal=journal)
    journal.write_text("no journal\n")
    for path, words in ((journal, "must be a journal of a skeleton"),
                        (tmp_path / "none" / "s.part", "must be a file that can be written")):
        with pytest.raises(InputError, match=words):
            gc.skeleton(SMALL, **WINDOW, **QUICK, journal=path)


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing():
    assert gc.skeleton(SMALL, **WINDOW, **{**QUICK, "workers": 2}).identical(quick())


def test_an_interrupted_command_goes_on_and_removes_its_journal(tmp_path, monkeypatch):
    """What is finished is in the file before the next curve is followed, even where the process is killed then."""
    out, kept, found, whole = tmp_path / "s.nc", tmp_path / "s.nc.part", [], quick()
    command = ["skeleton", "--set", "q0=0.1", "--axis", WINDOW["x"], "--axis", WINDOW["y"], "--period", 1, "--lines", 1,
               1, "--starts", 0, "--workers", 1, "--out", out]

    def interrupted(*_):
        found[:] = [json.loads(line)[0] for line in kept.read_text().splitlines()[1:]]
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(algorithm, "follow_curve", interrupted)
        assert ask(*command).exit_code != 0
    assert sorted(found) == ["line 0 0", "line 1 0"] and kept.exists() and not out.exists()
    monkeypatch.setattr(algorithm, "line_seeds", lambda line: pytest.fail("all lines are finished"))
    curves = run_json(*command)["curves"]
    assert gc.load(out).identical(whole) and not kept.exists()
    assert sum(each["count"] for each in curves) == whole.sizes["number"]


def test_agreement_names_the_cause_of_every_side():
    found = gc.agreement(small(), zones())
    assert found["cause"].attrs["flag_meanings"] == "curve basin_boundary unexplained"
    at_curve = found["cause"].values == 1
    assert np.array_equal(at_curve, found["curve"].values >= 0)
    assert found["orbit_sides"].sum() == found.sizes["side"] and found["orbit_period"].values.tolist() == [1, 2]
    steps = np.hypot((found["cell_omega"] - found["neighbour_omega"]) / 0.6 * 11,
                     (found["cell_eps1"] - found["neighbour_eps1"]) / 0.06 * 7)
    np.testing.assert_allclose(steps, 1, atol=1e-9)
    assert found["curve_seen"].values[np.unique(found["curve"].values[at_curve])].all()
    table = found["orbit_sides"].to_pandas()
    assert table.index.tolist() == [1, 2] and table.index.name == "orbit_period"
    assert table.columns.tolist() == ["curve", "basin boundary", "unexplained"]


def test_agreement_is_found_in_the_window_that_map_and_skeleton_have_in_common():
    wide = gc.zones(SMALL, "omega=1.4:2.6:23", "eps1=0.01:0.11:11")
    found = gc.agreement(small(), wide)
    assert found.attrs["explained"] == 1 and found.attrs["cells_left_out"] == 23 * 11 - 11 * 7
    assert json.loads(found.attrs["window"]) == {
        "omega": pytest.approx([1.727, 2.273], abs=1e-3), "eps1": pytest.approx([0.03, 0.09], abs=1e-12)}
    inner = wide.isel(omega=slice(6, 17), eps1=slice(2, 9))
    assert found["cause"].equals(gc.agreement(small(), inner)["cause"])
    assert gc.agreement(small(), zones()).attrs["cells_left_out"] == 0


def test_agreement_over_the_speed_is_of_the_whole_model_with_its_supports():
    """The gears alone have none, and so make a torsional model."""
    design = load_design(EXAMPLES / "spur_50_50.toml").at(speed=5000.0)
    model = gc.Regime(design).model.with_values({"kind": "full", "kappa": 0.3, "zeta_support": 0.1, "mu": 1.0})
    window = "speed=5000:5200:2", "torque=100:120:2"
    curves = gc.skeleton(model, *window, period=1, lines=(1, 0), starts=0, workers=1)
    assert json.loads(gc.agreement(curves, gc.zones(model, *window)).attrs["model"])["kind"] == "full"


@pytest.mark.parametrize(("model", "x", "y", "words"), [
    (SMALL.with_values({"zeta": 0.3}), "omega=1.7:2.3:3", "eps1=0.03:0.09:3", "must be of the model of the skeleton"),
    (SMALL, "omega=1.7:2.3:3", "q0=0.03:0.09:3", "must be over the parameters of the skeleton"),
    (SMALL, "omega=1.7:2.3:3", "eps1=0.03:0.09:1", "at least two values of eps1"),
    (SMALL, "omega=2.4:2.6:3", "eps1=0.03:0.09:3", "values of omega in the window of the skeleton, from 1.7 to 2.3")])
def test_agreement_needs_a_map_of_the_same_window(model, x, y, words):
    with pytest.raises(InputError, match=words):
        gc.agreement(small(), gc.zones(model, x, y))


def test_results_of_other_kinds_are_refused():
    with pytest.raises(InputError, match=r"must be a result of gearchaos.skeleton"):
        gc.agreement(zones(), small())
    for draw, ds, function in ((plot.skeleton, zones(), "zones"), (plot.manifolds, zones(), "zones"),
                               (plot.skeleton, gc.agreement(small(), zones()), "agreement")):
        with pytest.raises(InputError, match=rf"drawn by gearchaos.plot.{function}"):
            draw(ds, ax=axes())


def test_without_events_there_are_no_curves(tmp_path):
    model = gc.MeshModel.of(kind="single", zeta=0.5, q0=0.5)
    ds = gc.skeleton(model, "omega=4:5:2", "eps1=0:0.001:2", lines=(1, 1), starts=0, period=1, workers=1)
    assert ds.sizes["point"] == ds.sizes["number"] == 0
    gc.save(ds, tmp_path / "none.nc")
    plot.skeleton(gc.load(tmp_path / "none.nc"), ax=axes())


def test_a_picture_of_a_skeleton_has_a_line_for_every_curve_in_the_style_of_its_period():
    ds, ax = small(), plot.skeleton(small(), ax=axes())
    assert len(ax.lines) == ds.sizes["number"]
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), ds["omega"].values[ds["curve"].values == 0])
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.7, 2.3), (0.03, 0.09))
    without = plot.skeleton(ds, ax=axes(), grazes=False)
    assert len(without.lines) == (ds["curve_kind"] != "graze").sum()
    words = legend_words(without)
    assert "graze" not in words and {"flip", "1T", "2T"} <= set(words)
    styles = {}
    for line, kind, period in zip(ax.lines, ds["curve_kind"].values, ds["curve_period"].values, strict=True):
        if kind == "flip":
            styles.setdefault(int(period), set()).add((line.get_linewidth(), line.get_linestyle()))
    ((width, style),), ((second_width, second_style),) = styles[1], styles[2]
    assert width > second_width and style == "-" != second_style


def test_points_of_codimension_2_have_a_marker_for_each_kind():
    ds = small()
    ax, kinds = plot.skeleton(ds, ax=axes(), special=True), set(ds["special_kind"].values.tolist())
    assert len(kinds) > 1
    marked = {line.get_label(): line for line in ax.lines if line.get_marker() != "None"}
    assert set(marked) == kinds and len({line.get_marker() for line in marked.values()}) == len(kinds)
    assert sum(len(line.get_xdata()) for line in marked.values()) == ds.sizes["special"]
    assert kinds <= set(legend_words(ax)) and len(plot.result(ds).axes[0].lines) == len(ax.lines)


@pytest.mark.parametrize("eye", VISION)
def test_kinds_of_events_stay_apart_in_every_kind_of_colour_vision(eye):
    seen = [lab(np.clip(np.array(VISION[eye]) @ linear(colour), 0, 1)) for colour in EVENT_COLOURS]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 25


def test_every_kind_of_event_has_marks_of_its_own_that_matplotlib_and_bokeh_know():
    for marks, known in zip(zip(*(kind.marks for kind in LOOKS), strict=True),
                            (Line2D.markers, set(MarkerType), None), strict=True):
        assert len(set(marks)) == len(LOOKS) and (known is None or set(marks) <= set(known))


@pytest.mark.parametrize(("width", "columns"), [(3.4, 1), (6.4, 2)])
def test_legends_beside_own_axes_are_not_cut_off(width, columns):
    figure = Figure(figsize=(width * columns, 3.0))
    FigureCanvasAgg(figure)
    for ax in np.ravel(figure.subplots(1, columns)):
        plot.skeleton(small(), ax=ax, special=True)
    figure.canvas.draw()
    for ax in figure.axes:
        legend = ax.get_legend().get_window_extent()
        assert legend.x0 >= 0 and legend.x1 <= figure.bbox.x1 and legend.y0 >= 0
        assert not any(legend.overlaps(other.bbox) for other in figure.axes if other is not ax)


def test_a_picture_of_agreement_has_a_line_for_every_side(tmp_path):
    found = gc.agreement(small(), zones())
    for over in (None, plot.zones(zones(), ax=axes())):
        ax = plot.agreement(found, ax=over or axes())
        lines = {c.get_color().tobytes(): c.get_segments() for c in ax.collections if isinstance(c, LineCollection)}
        assert sum(map(len, lines.values())) == found.sizes["side"]
        counts = [int((found["cause"] == code).sum()) for code in (1, 2)]
        assert legend_words(ax) == [f"curve ({counts[0]})", f"basin boundary ({counts[1]})"]
    middle = np.array([np.mean(segment, axis=0) for group in lines.values() for segment in group])
    own, beyond = (np.column_stack([found[f"{which}_{name}"] for name in ("omega", "eps1")])
                   for which in ("cell", "neighbour"))
    between = own + 0.38 * (beyond - own)
    assert sorted(map(tuple, middle.round(9))) == sorted(map(tuple, between.round(9)))
    gc.save(found, tmp_path / "found.nc")
    ask("plot", tmp_path / "found.nc", code=0)
    assert (tmp_path / "found.png").stat().st_size > 5000


def test_curves_over_a_map_keep_its_limits_and_its_legend():
    ax = plot.zones(zones(), ax=axes())
    limits, before = (ax.get_xlim(), ax.get_ylim()), ax.get_legend()
    plot.skeleton(small(), ax=ax)
    ax.figure.canvas.draw()
    assert (ax.get_xlim(), ax.get_ylim()) == limits
    assert before in ax.get_children() and ax.get_legend() is not before
    after = ax.get_legend().get_window_extent()
    assert not after.overlaps(before.get_window_extent()) and not after.overlaps(ax.get_window_extent())


def test_a_dead_worker_is_an_error_with_advice(tmp_path, monkeypatch):
    monkeypatch.setattr(skeletons, "find_curves", Mock(side_effect=BrokenExecutor))
    with pytest.raises(OSError, match=r"a worker process died.*the same command goes on"):
        gc.skeleton(SMALL, **WINDOW, **QUICK, journal=tmp_path / "s.part")


def test_several_workers_are_processes_unless_threads_are_given(monkeypatch):
    asked = []
    for kind in ("process_pool", "thread_pool"):
        monkeypatch.setattr(skeletons, kind, lambda count, kind=kind: asked.append((kind, count)) or nullcontext)
    monkeypatch.setattr(skeletons, "find_curves", lambda *_, **__: ([], []))
    for options in ({"workers": 2}, {"workers": 1}, {"workers": 2, "threads": 3}):
        gc.Skeleton(SMALL, **WINDOW).dataset(**options)
    assert asked == [("process_pool", 2), ("thread_pool", 1), ("thread_pool", 3)]


@pytest.mark.parametrize(("changes", "words"), [
    ({"lines": 3}, "must be two numbers"), ({"lines": (1, -1)}, "lines"), ({"period": 65}, "period"),
    ({"lines": (0, 0)}, "at least one line"),
    ({"starts": -1}, "starts"), ({"workers": 0}, "workers"), ({"x": "z=1:2"}, "x1"), ({"x": "eps1=0:0.1"}, "different"),
])
def test_bad_input_of_a_skeleton(changes, words):
    with pytest.raises(InputError, match=words):
        gc.skeleton(SMALL, **{**WINDOW, **QUICK, **changes})


def test_motions_that_are_not_isolated_are_passed_over():
    ds = gc.skeleton(gc.MeshModel.of(kind="single", q0=0.0, eps1=0.1, omega=0.7), "omega=0.6:0.9:4", "q0=0:0.1:3",
                     period=1, lines=(1, 2), workers=1)
    assert ds.attrs["study"] == "skeleton"
