"""The explorer without a browser: its state, its bounds, its maps, and what it listens to."""

import asyncio
import contextlib
import pickle
import signal
import socket
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from bokeh.models import DataRange1d
from tornado.ioloop import IOLoop

import gearchaos as gc
from gearchaos.cli import explore
from gearchaos.dynamics import Label
from gearchaos.errors import InputError
from gearchaos.explorer.core import bounds, models
from gearchaos.explorer.core.models import axis_names
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import hint, motion_hint, plain, title
from gearchaos.explorer.features.map import job as maps
from gearchaos.explorer.features.map.job import MapGrid
from gearchaos.explorer.features.map.panel import choices
from gearchaos.explorer.features.motion import point as point_studies
from gearchaos.explorer.features.motion.panel import HINTS
from gearchaos.explorer.features.motion.point import final_verdict, point_motion
from gearchaos.explorer.web import server
from gearchaos.explorer.web.application import own_host
from gearchaos.explorer.web.form import parameter_form
from gearchaos.explorer.web.page import Page
from gearchaos.explorer.web.server import address, check_port
from gearchaos.model import COORDINATES, KINDS
from gearchaos.paper.settings import all_figures
from gearchaos.plot import CONTACT_CLASSES, MOTION_CLASSES
from tests.contracts.explorer.test_computations import PAPER


def test_every_figure_has_a_preset_with_its_own_model():
    assert {int("".join(c for c in key if c.isdigit())) for key in presets()} == set(all_figures())
    assert presets()["6"].view.y.name == "q0" and presets()["6"].view.line == "y"
    assert presets()["13b"].view.point == all_figures()[13].studies["b"].mesh_model
    assert presets()["10"].view.y == gc.Axis("kappa", 0.2, 10.0, bounds.MAP_CELLS[1])


@pytest.mark.parametrize("kind", KINDS)
def test_every_parameter_on_offer_can_be_an_axis_and_absurd_numbers_are_refused_in_every_field(kind):
    view = PAPER.with_kind(kind)
    for name in {*axis_names(view.model)} - {"omega"}:
        low, high, _, _ = bounds.value_range(name)
        assert view.with_axes(view.x, gc.Axis(name, low, high, 300)).y.name == name
    for name in [*axis_names(view.model), *COORDINATES[kind]]:
        for value in ("", "abc", "nan", "-inf", "1e400", "1e300", "-1e300", None):
            with pytest.raises(InputError) as caught:
                view.with_value(name, value)
            assert caught.value.field == name


def test_a_value_of_an_axis_moves_the_point_and_others_change_the_model():
    assert PAPER.with_value("omega", 1.25).at == (1.25, PAPER.at[1])
    assert PAPER.with_value("zeta", 0.05).model.zeta == 0.05
    loaded = PAPER.with_axes(PAPER.x, gc.Axis("q0", 0.0, 0.3, 300))
    assert loaded.with_value("q0", 0.2).point.q2 == 0.2
    with pytest.raises(InputError, match="axis q0"):
        loaded.with_value("q1", 0.2)


def test_kinds_and_stiffnesses_change_and_change_back():
    assert PAPER.with_kind("full").with_kind("torsional").point == PAPER.point
    assert PAPER.with_kind("single").model.beta1 == 0.0
    wavy = PAPER.with_stiffness("harmonics")
    assert wavy.model.stiffness.kind == "harmonics" and wavy.with_stiffness("two-level").point == PAPER.point
    over = PAPER.with_axes(PAPER.x, gc.Axis("chi1", 0.0, 0.5, 300)).with_stiffness("harmonics")
    assert over.y.name == "eps1"
    both = wavy.with_axis("y", "omega").with_axis("x", "c1").with_stiffness("two-level")  # ω cannot be both
    assert (both.x.name, both.y.name) == ("omega", "eps1")


def test_keys_move_the_point_by_cells_and_stop_at_what_a_parameter_may_be():
    moved = PAPER.stepped(1, -1)
    assert moved.at == pytest.approx((1.6 + 2.8 / 399, 0.15 - 0.3 / 299), abs=1e-4)
    assert PAPER.stepped(-10**6, 0).at[0] == bounds.value_range("omega").least


def test_a_view_names_no_file_and_one_beyond_the_bounds_of_the_explorer_is_refused():
    assert not {"path", "file", "study"} & set(PAPER.__dataclass_fields__)
    with pytest.raises(InputError, match="count"):
        replace(PAPER, x=gc.Axis("omega", 0.2, 3.0, 4000))
    with pytest.raises(InputError, match="harmonic"):
        view_of(gc.MeshModel.of(eps12=0.1))


@pytest.mark.parametrize(("text", "shown"), [
    (r"frequency $\omega$", "frequency ω"), (r"$\varepsilon_{1}$", "ε₁"), ("$q_0$", "q₀"), (r"$\dot{z}$", "z′"),
    (r"$\dot{x}_{1}$", "x₁′"), (r"$\zeta_{1,2}$", "ζ₁,₂"), ("z", "z")])
def test_symbols_become_plain_text(text, shown):
    assert plain(text) == shown


@pytest.mark.parametrize("model", [
    gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.23),
    gc.MeshModel.of(kind="full", omega=1.05, kappa=0.5, q0=0.1, eps1=0.04)])
def test_the_last_verdict_at_a_point_is_that_of_regime(model):
    found = list(point_motion(model))
    assert found[1].trajectory is not None
    found += [] if found[-1].final else list(final_verdict(model, found[-1].verdict.label))
    for i, later in enumerate(found[1:], start=1):
        found[i] = later.with_trajectory_of(found[i - 1])
    assert found[-1].final and found[-1].verdict == gc.regime(model) and found[-1].trajectory is found[1].trajectory
    assert (found[-1].portrait is None) == (found[-1].verdict.period is not None)
    assert all(f.verdict.period is None for f in found if not f.final)


def test_the_words_of_a_first_verdict_come_before_the_figures():
    """Every figure that changes is painted before the next frame, with the verdict in it."""
    view = view_of(gc.MeshModel.of(omega=0.8, q0=0.1, eps1=0.1))
    page, shown = Page(Opened(view), view), []
    for name in ("portrait", "phase", "history", "spectrum"):
        getattr(page, name).show = lambda *_, name=name: shown.append(name)
    verdict, then = point_motion(view.point)
    page.show_point_motion(verdict)
    assert not shown and verdict.verdict.label in page.messages._html["verdict"]
    page.show_point_motion(then)
    assert sorted(shown) == ["history", "phase", "portrait", "spectrum"]


def test_chaos_that_was_a_transient_gets_the_motion_it_came_to_and_a_motion_sent_once_stays_with_its_point():
    model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    (found,), (first, then) = final_verdict(model, "chaotic"), point_motion(model)
    assert found.final and found.portrait is None and found.trajectory.identical(then.trajectory)
    (other,) = point_motion(gc.MeshModel.of(kind="single", omega=2.0, z=30.0))
    assert first.with_trajectory_of(then).trajectory is then.trajectory and then.with_trajectory_of(first) is then
    assert first.with_trajectory_of(None).trajectory is None and first.with_trajectory_of(other).trajectory is None
    assert other.with_trajectory_of(then).trajectory is None
    assert other.verdict.label == "diverged" and other.final


def test_a_map_is_coarse_first_and_every_cell_is_in_the_end_that_of_zones(small):
    found = list(maps.successive_maps(small))
    assert found[0].stride == maps.COARSE[0] and found[-1].share == 1.0
    shares = [m.share for m in found if m.stride > 1]
    assert shares == sorted(shares)
    whole = gc.zones(small.model, small.x, small.y)
    for name in ("label", "period"):
        assert np.array_equal(found[-1].shown(found[-1].dataset[name].values, 0), whole[name].values)
    assert found[-1].measure("v_rms").values == pytest.approx(whole["v_rms"].values, rel=1e-9)
    for shown in (found[0], found[-1]):  # sent without the cells that are not known, it arrives whole
        arrived = pickle.loads(pickle.dumps(shown))
        assert arrived.dataset.identical(shown.dataset) and list(arrived.dataset) == list(shown.dataset)
        assert all(arrived.dataset[n].dtype == v.dtype for n, v in shown.dataset.items())
        assert np.array_equal(arrived.source, shown.source) and arrived.share == shown.share
    assert len(pickle.dumps(found[0])) < 0.5 * len(pickle.dumps(found[-1]))


def test_chaos_shows_before_it_is_outlasted_and_every_cell_is_judged_in_the_end(monkeypatch):
    monkeypatch.setattr(models, "MAP_CELLS", (40, 30))
    monkeypatch.setattr(maps, "_FIRST_INTERVAL", 0.0)
    view = replace(PAPER, x=gc.Axis("omega", 1.2, 1.5, 40), y=gc.Axis("eps1", 0.18, 0.24, 30), at=(1.3, 0.2))
    found = list(maps.successive_maps(view))
    waiting = max(found, key=lambda m: m.chaotic_so_far.sum())
    chaotic = waiting.chaotic_so_far
    assert chaotic.sum() > 100 and np.any(waiting.dataset["label"].values.ravel()[chaotic] == 0)
    assert np.all(waiting.labels().values.ravel()[chaotic] == Label.CHAOTIC)
    assert np.isfinite(waiting.measure("v_rms").values).all()  # each shows that of the nearest cell that has one
    assert not found[-1].chaotic_so_far.any() and np.all(found[-1].dataset["label"] != 0)
    whole = gc.zones(view.model, view.x, view.y, settings=maps.FULL)
    assert found[-1].dataset["label"].identical(whole["label"])
    assert found[-1].measure("v_rms").values == pytest.approx(whole["v_rms"].values, rel=1e-8, nan_ok=True)


def test_every_cell_of_a_coarse_map_shows_the_nearest_one_computed():
    grid = MapGrid(11, 9)
    grid.put({"label": np.ones(9, np.int8)}, cells := grid.request(4))
    grid.show(cells, 4)
    row, column = np.divmod(grid.source, 11)
    at = np.mgrid[0:9, 0:11]
    assert np.all(np.abs(row - at[0]) <= 2) and np.all(np.abs(column - at[1]) <= 2)
    assert set(grid.source.ravel()) == set(cells)


def test_the_map_of_attractors_counts_them():
    view = replace(presets()["3c"].view, colour="attractors", x=gc.Axis("omega", 2.2, 2.4, 400),
                   y=gc.Axis("eps1", 0.04, 0.06, 300))
    first = next(iter(maps.successive_maps(view)))
    assert "attractors" in first.dataset and np.nanmax(first.measure("attractors").values) >= 2
    rows = (first.dataset["label"].values > 0).all(axis=1)
    assert rows[::4].all() and rows.sum() == 9  # rows that are not computed yet show one that is
    shown = first.measure("attractors").values
    np.testing.assert_array_equal(shown, np.repeat(shown[::4], 4, axis=0))


def test_a_diagram_is_coarse_first_and_lies_along_the_line():
    view = replace(PAPER, line="y", x=gc.Axis("omega", 0.5, 1.5, 400), at=(1.0, 0.1))
    found = [d for d in point_studies.bifurcation(view, 4, 1) if d]
    assert [d.sizes["eps1"] for d in found] == [bounds.DIAGRAM_COLUMNS // 4, bounds.DIAGRAM_COLUMNS]


@pytest.mark.parametrize("chosen", [False, True])
@pytest.mark.parametrize(("kind", "given", "kept"), [
    ("full", {"x1": 0.5, "y1": 0.3, "y2_dot": -0.2}, {"y1": 0.3, "y2_dot": -0.2}),
    ("full", {"y1": 0.3, "y2": -0.4}, {"y1": 0.3, "y2": -0.4}),
    ("torsional", {"x2": 0.7, "x1_dot": 0.1}, {"x2": 0.7}), ("single", {"x1": 0.5}, {}), ("single", {"z": 0.5}, {})])
def test_basins_start_from_the_point_s_other_initial_values(monkeypatch, kind, given, kept, chosen):
    """Whether they are the model's own, or those of a motion chosen at the point."""
    asked = []
    monkeypatch.setattr(point_studies, "Basins", lambda model, x, y, **_: asked.append((model, x, y)))
    monkeypatch.setattr(point_studies, "_in_parts", lambda *_: iter(()))
    view = view_of(gc.MeshModel.of(kind=kind, omega=1.0, q0=0.1, eps1=0.1, **({} if chosen else given)))
    view = replace(view, initial=tuple(given.items()) if chosen else ())
    assert list(point_studies.basins(view)) == [] and len(asked) == 2
    for model, x, y in asked:
        assert {n: v for n, v in model.initial.items() if n not in (x.name, y.name)} == kept


def test_a_start_in_the_plane_of_basins_keeps_the_other_initial_values_of_the_motion_chosen():
    view = replace(view_of(gc.MeshModel.of(kind="full", y2=0.1)), initial=(("x1", 2.0), ("y1", 0.3)))
    changed = view.with_changed_initial({"x1": -1.0, "x1_dot": 0.5})
    assert dict(changed.initial) == {"x1": -1.0, "x1_dot": 0.5, "y1": 0.3}
    assert dict(changed.point.initial) == {"x1": -1.0, "x1_dot": 0.5, "y1": 0.3, "y2": 0.1}
    assert dict(replace(view, initial=()).with_changed_initial({"x1": -1.0}).initial) == {"x1": -1.0}
    at = [view.with_axes(view.x, gc.Axis(name, -3.0, 3.0, 300)).at[1] for name in ("x1_dot", "y1", "y2")]
    assert at == [0.0, 0.0, 0.1]  # where the point of such an axis begins: at the model's own
    relative = replace(view_of(gc.MeshModel(kind="single")), initial=(("x1", 2.0),))
    assert dict(relative.with_changed_initial({"z": 0.5, "z_dot": 0.0}).initial) == {"z": 0.5, "z_dot": 0.0}


def test_the_motions_of_a_point_come_with_a_start_that_leads_to_each():
    (found,) = point_studies.attractors(presets()["4"].view)
    for choice in choices(found):
        view = replace(presets()["4"].view, initial=choice.initial)
        assert choice.name.startswith(gc.regime(view.point).label)


def test_only_names_of_the_server_itself_are_answered():
    assert all(own_host(name, "127.0.0.1") for name in ("127.0.0.1:5006", "localhost", "LocalHost:80", "[::1]:5006"))
    foreign = ("10.0.0.1", "evil.example", "", "[::1", "localhost.", "a b")
    assert not any(own_host(name, "127.0.0.1") for name in foreign)
    for host in ("0.0.0.0", "10.0.0.1"):
        assert all(own_host(name, host) for name in ("10.0.0.1:80", "[fe80::1]:80", "localhost", socket.gethostname()))
        assert not any(own_host(name, host) for name in ("evil.example:80", "10.0.0.1.evil.example", "999.0.0.1"))
    assert own_host("gears.example:80", "gears.example")
    assert address("::1", 5006) == "http://[::1]:5006/"


def test_an_impossible_place_to_listen_and_a_port_in_use_are_refused():
    for host, port in (("127.0.0.1", -1), ("127.0.0.1", 99999), ("203.0.113.1", 0)):
        with pytest.raises(InputError, match="--port"):
            check_port(host, port)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="must be free"):
            check_port("127.0.0.1", taken.getsockname()[1])


def test_a_server_that_cannot_start_or_lacks_its_libraries_is_an_error_and_not_a_wait(monkeypatch):
    def broken(*_, **__):
        raise OSError("no more sockets")

    monkeypatch.setattr(server, "server", broken)
    with pytest.raises(OSError, match="no more sockets"):
        gc.explore()
    monkeypatch.setattr(server, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'explore needs the package bokeh; .* Run: pip install "gearchaos\[app\]"'):
        gc.explore()


def test_ctrl_c_ends_the_explorer_also_where_python_ignores_exceptions(monkeypatch):
    """As in a callback of a weak reference, in which KeyboardInterrupt is lost."""
    monkeypatch.setattr(asyncio.events, "_get_running_loop", lambda: None)  # that of a browser that other tests opened
    loop, stopped = IOLoop(make_current=False), []

    def interrupted():
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)

    loop.add_callback(interrupted)
    late = loop.call_later(20, loop.stop)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    begin = time.monotonic()
    try:
        explore._serve(SimpleNamespace(io_loop=loop, stop=lambda: stopped.append(True)), None)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
        loop.remove_timeout(late)
        loop.close()
    assert stopped and time.monotonic() < begin + 10


def test_everything_on_the_page_is_explained_in_words():
    for kind in ("full", "torsional", "single"):
        for stiffness in ("two-level", "harmonics"):
            view = view_of(gc.MeshModel(kind=kind)).with_stiffness(stiffness)
            form = parameter_form(view, ("q0", "J"), view)
            for field in (f for group in form.groups for f in group.fields):
                assert len(field.hint.split()) >= 4 and field.hint not in (title(field.name), field.name), field
    assert hint("x2_dot") == f"Velocity of: {hint('x1')}" and hint("eps3") == hint("eps") and hint("J2") == hint("J")
    assert motion_hint("1T") == "Repeats with every mesh period T" and "7 mesh periods" in motion_hint("7T")
    assert all(motion_hint(c.name) for c in (*MOTION_CLASSES, *CONTACT_CLASSES))
    assert "root mean square of the velocity" in HINTS[gc.quantities.quantity("v_rms").title] and len(HINTS) >= 8


def test_ends_of_axes_that_the_browser_finds_are_not_sent_to_the_server():
    figures = Page(Opened(PAPER), PAPER).roots()
    found = [ends for figure in figures.values() for ends in (figure.x_range, figure.y_range)]
    assert {isinstance(ends, DataRange1d) for ends in found if not ends.syncable} == {True}
    assert {isinstance(ends, DataRange1d) for ends in found if ends.syncable} == {False}
