"""The explorer without a browser: its state, its bounds, its worker, its maps, and what it hands out."""

import io
import subprocess
import sys
import threading
import time
import tomllib
from dataclasses import replace
from functools import partial

import numpy as np
import psutil
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.app import bounds, export, lines, maps, state, words
from gearchaos.app.dossier import dossier, followed
from gearchaos.app.elsewhere import Elsewhere
from gearchaos.app.figures.style import plain
from gearchaos.app.presets import presets
from gearchaos.app.serve import address, check_port, origins
from gearchaos.app.state import View, axis_names, first_view, from_query, standard, stiffness_name
from gearchaos.app.worker import Job, Worker
from gearchaos.errors import InputError
from gearchaos.flow.stop import StoppedError
from gearchaos.model import COORDINATES, KINDS
from gearchaos.motion import Label
from gearchaos.paper.settings import all_figures
from gearchaos.studyfile import load_study

START = presets()["2"].view


# --- state ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", presets())
def test_every_preset_survives_the_address_bar(key):
    view = presets()[key].view
    assert from_query(view.query(), START) == view
    assert from_query("?" + view.query(), START).point == view.point


def test_every_figure_has_a_preset_with_its_own_model():
    assert {int("".join(c for c in key if c.isdigit())) for key in presets()} == set(all_figures())
    assert presets()["6"].view.y.name == "q0" and presets()["6"].view.line == "y"
    assert presets()["13b"].view.point == all_figures()[13].studies["b"].mesh_model
    assert presets()["10"].view.y == gc.Axis("kappa", 0.2, 10.0, bounds.CELLS[1])


def test_a_view_with_everything_changed_survives_the_address_bar():
    model = gc.MeshModel(
        kind="full", zeta=0.03, J1=1.5, J2=2.5, q1=0.1, q2=0.12, beta1=0.02, beta2=0.0, mu1=3.0, kappa2=1 / 3,
        zeta_support1=0.02, error=gc.TransmissionError((0.1, 0.02), (0.3, -0.1)),
        stiffness=gc.HarmonicStiffness((0.2, 0.05), (0.1,)), initial={"x1": 0.5, "y2_dot": -0.25},
    )
    view = replace(
        standard(model), y=gc.Axis("c2", 0.0, 0.1, 300), at=(1.1, 0.07), colour="v_rms", line="y",
        start=(("x1", 2.0), ("x1_dot", 1e-17)), physical=True,
    )
    again = from_query(view.query(), START)
    assert again == view and again.point == view.point


def test_an_empty_address_shows_what_the_server_was_started_with():
    assert from_query("", START) is START


@pytest.mark.parametrize(("query", "field"), [
    ("kind=cubic", "kind"), ("omega=fast", "omega"), ("omega=nan", "omega"), ("omega=1e9", "omega"),
    ("omega=-1", "omega"), ("q0=1e300", "q0"), ("J1=0", "J1"), ("chi1=-1", "chi1"),
    ("contact_ratio=7", "contact_ratio"),
    ("eps9=0.1", "eps9"), ("eps99=0.1", "eps99"), ("wobble=1", "parameter"), ("colour=red", "colour"),
    ("line=z", "line"), ("x=omega", "x"), ("x=omega:3:1", "axis omega"), ("x=omega:0:1", "omega"),
    ("x=eps1:0:1&y=eps1:0:1", "axes"), ("x=kappa:1:2", "kappa1"), ("at=1", "at"), ("at=1,x", "at"),
    ("at=inf,0", "omega"),
    ("start=w:1", "start"), ("start=x1:1e9", "x1"), ("units=furlongs", "units"), ("x1=1e99", "x1"),
    ("kind=single&beta=0.1", "beta"), ("stiffness=wobbly", "stiffness"),
    ("stiffness=harmonics&c1=0.9&c2=0.9", "stiff"),
    ("omega=" + "1" * 5000, "address"),
])
def test_an_absurd_address_is_refused_by_its_field(query, field):
    with pytest.raises(InputError) as caught:
        from_query(query, START)
    assert caught.value.field.startswith(field)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("value", ["", "abc", "nan", "inf", "-inf", "1e400", "1e300", "-1e300", "0x10", None, "1,5"])
def test_absurd_numbers_are_refused_in_every_field(kind, value):
    view = START.with_kind(kind)
    for name in [*axis_names(view.model), *COORDINATES[kind]]:
        with pytest.raises(InputError) as caught:
            view.with_value(name, value)
        assert caught.value.field == name


def test_a_value_of_an_axis_moves_the_point_and_others_change_the_model():
    assert START.with_value("omega", 1.25).at == (1.25, START.at[1])
    assert START.with_value("zeta", 0.05).model.zeta == 0.05
    loaded = START.with_axes(START.x, gc.Axis("q0", 0.0, 0.3, 300))
    assert loaded.with_value("q0", 0.2).point.q2 == 0.2
    with pytest.raises(InputError, match="axis q0"):
        loaded.with_value("q1", 0.2)


@pytest.mark.parametrize("kind", KINDS)
def test_every_axis_on_offer_can_be_an_axis(kind):
    view = START.with_kind(kind)
    for name in axis_names(view.model):
        if name != "omega":
            low, high, _, _ = bounds.span(name)
            assert view.with_axes(view.x, gc.Axis(name, low, high, 300)).y.name == name


def test_kinds_and_stiffnesses_change_and_change_back():
    assert START.with_kind("full").with_kind("torsional").point == START.point
    assert START.with_kind("single").model.beta1 == 0.0
    wavy = START.with_stiffness("harmonics")
    assert stiffness_name(wavy.model) == "harmonics" and wavy.with_stiffness("two-level").point == START.point
    over = START.with_axes(START.x, gc.Axis("chi1", 0.0, 0.5, 300)).with_stiffness("harmonics")
    assert over.y.name == "eps1"


def test_keys_move_the_point_by_cells_and_stop_at_what_a_parameter_may_be():
    moved = START.stepped(1, -1)
    assert moved.at == pytest.approx((1.6 + 2.8 / 399, 0.15 - 0.3 / 299), abs=1e-4)
    assert START.stepped(-10**6, 0).at[0] == bounds.span("omega").least


def test_a_view_beyond_the_bounds_of_the_explorer_is_refused():
    with pytest.raises(InputError, match="count"):
        replace(START, x=gc.Axis("omega", 0.2, 3.0, 4000))
    with pytest.raises(InputError, match="harmonic"):
        first_view(gc.MeshModel.of(eps12=0.1))


@pytest.mark.parametrize(("text", "shown"), [
    (r"frequency $\omega$", "frequency ω"), (r"$\varepsilon_{1}$", "ε₁"), ("$q_0$", "q₀"), (r"$\dot{z}$", "z′"),
    (r"$\dot{x}_{1}$", "x₁′"), (r"$\zeta_{1,2}$", "ζ_1,2"), ("z", "z"),
])
def test_symbols_become_plain_text(text, shown):
    assert plain(text) == shown


# --- dossier and maps ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", [
    gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.23),
    gc.MeshModel.of(kind="full", omega=1.05, kappa=0.5, q0=0.1, eps1=0.04),
])
def test_the_last_verdict_of_a_dossier_is_that_of_regime(model):
    found = list(dossier(model))
    assert found[1].motion is not None
    found += [] if found[-1].final else list(followed(model, found[-1].verdict.label))
    for i, later in enumerate(found[1:], start=1):
        found[i] = later.after(found[i - 1])
    assert found[-1].final and found[-1].verdict == gc.regime(model) and found[-1].motion is found[1].motion
    assert (found[-1].portrait is None) == (found[-1].verdict.period is not None)
    assert all(f.verdict.period is None for f in found if not f.final)


def test_chaos_that_was_a_transient_gets_the_motion_it_came_to():
    model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    (found,) = followed(model, "chaotic")
    assert found.final and found.portrait is None and found.motion.identical(list(dossier(model))[-1].motion)


def test_a_motion_sent_once_stays_with_its_point():
    first, then = dossier(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206))
    (other,) = dossier(gc.MeshModel.of(kind="single", omega=2.0, z=30.0))
    assert first.after(then).motion is then.motion and then.after(first) is then
    assert first.after(None).motion is None and first.after(other).motion is None and other.after(then).motion is None


def test_a_motion_that_diverges_has_a_dossier_too():
    (found,) = dossier(gc.MeshModel.of(kind="single", omega=2.0, z=30.0))
    assert found.verdict.label == "diverged" and found.final


@pytest.fixture
def small(monkeypatch):
    """A view of few cells, all of them 1T."""
    monkeypatch.setattr(state, "CELLS", (56, 40))
    return replace(START, x=gc.Axis("omega", 0.9, 1.1, 56), y=gc.Axis("eps1", 0.0, 0.02, 40), at=(1.0, 0.01))


def test_a_map_is_coarse_first_and_every_cell_is_in_the_end_that_of_zones(small):
    found = list(maps.sharpened(small))
    assert found[0].stride == maps.COARSE[0] and found[-1].share == 1.0
    shares = [m.share for m in found if m.stride > 1]
    assert shares == sorted(shares)
    whole = gc.zones(small.model, small.x, small.y)
    for name in ("label", "period"):
        assert np.array_equal(found[-1].values(name), whole[name].values)
    assert found[-1].values("v_rms") == pytest.approx(whole["v_rms"].values, rel=1e-9)


def test_chaos_shows_before_it_is_outlasted_and_every_cell_is_judged_in_the_end(monkeypatch):
    monkeypatch.setattr(state, "CELLS", (40, 30))
    monkeypatch.setattr(maps, "_PACE", 0.0)
    view = replace(START, x=gc.Axis("omega", 1.2, 1.5, 40), y=gc.Axis("eps1", 0.18, 0.24, 30), at=(1.3, 0.2))
    found = list(maps.sharpened(view))
    waiting = max(found, key=lambda m: m.wild.sum())
    assert waiting.wild.sum() > 100 and np.any(waiting.dataset["label"].values.ravel()[waiting.wild] == 0)
    assert np.all(waiting.labels().values.ravel()[waiting.wild] == Label.CHAOTIC)
    assert not found[-1].wild.any() and np.all(found[-1].dataset["label"] != 0)
    whole = gc.zones(view.model, view.x, view.y, budget=maps.STEADY)
    assert found[-1].dataset["label"].identical(whole["label"])
    assert found[-1].values("v_rms") == pytest.approx(whole["v_rms"].values, rel=1e-8, nan_ok=True)


def test_every_cell_of_a_coarse_map_shows_the_nearest_one_computed():
    grid = maps._Grid(11, 9)
    grid.put({"label": np.ones(9, np.int8)}, cells := grid.fresh(4))
    grid.show(cells, 4)
    row, column = np.divmod(grid.source, 11)
    at = np.mgrid[0:9, 0:11]
    assert np.all(np.abs(row - at[0]) <= 2) and np.all(np.abs(column - at[1]) <= 2)
    assert set(grid.source.ravel()) == set(cells)


def test_the_map_of_attractors_counts_them():
    view = replace(presets()["3c"].view, colour="attractors", x=gc.Axis("omega", 2.2, 2.4, 400),
                   y=gc.Axis("eps1", 0.04, 0.06, 300))
    first = next(iter(maps.sharpened(view)))
    assert "attractors" in first.dataset and np.nanmax(first.values("attractors")) >= 2


def test_a_diagram_is_coarse_first_and_lies_along_the_line():
    view = replace(START, line="y", x=gc.Axis("omega", 0.5, 1.5, 400), at=(1.0, 0.1))
    found = [d for d in lines.bifurcation(view, 4, 1) if d]
    assert [d.sizes["eps1"] for d in found] == [bounds.COLUMNS // 4, bounds.COLUMNS]


def test_the_motions_of_a_point_come_with_a_start_that_leads_to_each():
    (found,) = lines.attractors(presets()["4"].view)
    for choice in words.attractor_choices(found):
        view = replace(presets()["4"].view, start=choice["start"])
        assert choice["name"].startswith(gc.regime(view.point).label)


# --- worker --------------------------------------------------------------------------------------------------------


class Recorder:
    """A job that counts, and what was shown of it."""

    def __init__(self, steps=3, gate=None, fails=None):
        self.shown, self.taken, self.message = [], 0, "not ended"
        self.over = threading.Event()
        self._steps, self._gate, self._fails = steps, gate, fails

    def work(self):
        for i in range(self._steps):
            if self._gate:
                assert self._gate.wait(10)
            if self._fails:
                raise self._fails
            self.taken += 1
            yield i

    def end(self, message):
        self.message = message
        self.over.set()

    def job(self, delay=0.0):
        return Job(self.work, self.shown.append, self.end, delay)


def test_a_job_is_shown_step_by_step_and_ends():
    worker, one = Worker("test"), Recorder()
    worker.submit("a", "map", one.job())
    assert one.over.wait(10) and one.shown == [0, 1, 2] and one.message is None


def test_the_newest_request_of_a_panel_wins_and_the_older_is_left_between_steps():
    worker, gate = Worker("test"), threading.Event()
    old, new = Recorder(1000, gate), Recorder(2)
    worker.submit("a", "map", old.job())
    worker.submit("a", "map", new.job())
    gate.set()
    assert new.over.wait(10) and new.shown == [0, 1]
    assert old.taken <= 1 and old.shown == [] and not old.over.is_set()


def test_sessions_take_turns():
    worker, gate, order = Worker("test"), threading.Event(), []
    jobs = {}
    for name in ("a", "b"):
        jobs[name] = Recorder(4, gate)
        job = jobs[name].job()
        job.show = lambda _, name=name: order.append(name)
        worker.submit(name, "map", job)
    gate.set()
    assert all(j.over.wait(10) for j in jobs.values())
    assert max(len(run) for run in "".join(order).replace("ab", "-").split("-")) <= 1


def test_a_page_that_was_closed_is_forgotten():
    worker, gate = Worker("test"), threading.Event()
    gone, other = Recorder(1000, gate), Recorder(1)
    worker.submit("a", "map", gone.job())
    worker.submit("b", "map", other.job())
    worker.drop("a")
    gate.set()
    assert other.over.wait(10)
    assert gone.taken <= 1 and gone.shown == []


@pytest.mark.parametrize(("error", "message"), [
    (InputError("omega", "must be greater than 0", -1), "omega must be greater than 0"),
    (RuntimeError("secret"), "went wrong"),
])
def test_what_goes_wrong_becomes_a_message_and_the_worker_goes_on(error, message, caplog):
    worker, bad, good = Worker("test"), Recorder(fails=error), Recorder(1)
    worker.submit("a", "map", bad.job())
    assert bad.over.wait(10) and message in bad.message and "secret" not in bad.message
    worker.submit("a", "map", good.job())
    assert good.over.wait(10) and good.message is None


def test_what_is_left_is_closed_by_the_thread_that_ran_it_and_errors_there_do_not_end_it():
    closed = []

    def work():
        try:
            yield 1
            yield 2
        finally:
            closed.append(threading.current_thread().name)
            raise RuntimeError("on the way out")

    worker, begun, last = Worker("test"), threading.Event(), Recorder(1)
    worker.submit("a", "map", Job(work, lambda _: (begun.set(), worker.drop("a", "map")), lambda _: None))
    assert begun.wait(10)
    worker.submit("a", "map", last.job())
    assert last.over.wait(10) and closed == ["test"]


def test_a_page_that_fails_does_not_end_the_thread(caplog):
    worker, good = Worker("test"), Recorder(1)
    worker.submit("a", "map", Job(Recorder().work, lambda _: 1 / 0, lambda _: None))
    worker.submit("b", "map", good.job())
    assert good.over.wait(10)


# --- a process of its own ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def place():
    place = Elsewhere(polite=True)
    yield place
    place.end()


def test_another_process_finds_the_same(place):
    model = gc.MeshModel.of(omega=1.0, eps1=0.05)
    here, there = list(dossier(model)), list(place.run(partial(dossier, model)))
    assert [d.verdict for d in here] == [d.verdict for d in there] and len(here) == len(there)
    assert here[1].motion.identical(there[1].motion)


def test_works_there_take_turns_and_the_one_closed_is_forgotten(place):
    model = gc.MeshModel.of(omega=1.0, eps1=0.05)
    first, second = place.run(partial(dossier, model)), place.run(partial(dossier, model))
    assert next(first).motion is None and next(second).motion is None
    first.close()
    assert next(first, None) is None and next(second).motion is not None


def test_a_step_under_way_there_is_left_at_once(place):
    work = place.run(partial(maps.sharpened, START))
    next(work)
    threading.Timer(0.1, work.leave).start()
    began = time.monotonic()
    with pytest.raises(StoppedError):
        for _ in work:
            pass
    assert time.monotonic() - began < 5  # all of it takes twenty seconds or more
    work.close()


def test_a_work_left_before_it_begins_does_nothing_there(place):
    work = place.run(partial(maps.sharpened, START))
    work.leave()
    with pytest.raises(StoppedError):
        next(work)


def test_what_is_wrong_there_is_told_here(place):
    with pytest.raises(InputError, match="omega"):
        list(place.run(partial(gc.MeshModel.of, omega=-1.0)))


def test_compiling_there_is_told_before_the_answer(place):
    told = []
    answers = "(f(2) for f in [__import__('numba').njit(lambda x: 2 * x)])"
    assert list(place.run(partial(eval, answers), lambda: told.append(True))) == [4]
    assert told
    assert list(place.run(partial(iter, [4]), lambda: told.clear())) == [4] and told


def test_the_page_says_that_kernels_are_compiled_first():
    assert "once after an install" in words.busy_html(["motion"], True)
    assert "once" not in words.busy_html(["motion"], False) and "ready" in words.busy_html([], True)


def test_a_process_that_dies_costs_the_visitor_one_message(caplog):
    place = Elsewhere()
    worker, hurt, well = Worker("test", place), Recorder(), Recorder()
    model = gc.MeshModel.of(omega=1.0, eps1=0.05)
    worker.submit("a", "map", Job(partial(maps.sharpened, START), lambda _: place._process.kill(), hurt.end))
    assert hurt.over.wait(60) and "went wrong" in hurt.message
    worker.submit("a", "motion", Job(partial(dossier, model), well.shown.append, well.end))
    assert well.over.wait(60) and well.message is None and well.shown[-1].verdict.label == "1T"
    worker.stop()
    place._process.wait(10)


def test_a_process_ends_with_the_one_that_began_it(tmp_path):
    code = "from gearchaos.app.elsewhere import Elsewhere; print(Elsewhere()._process.pid, flush=True); input()"
    parent = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    child = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.wait()
    for pipe in (parent.stdin, parent.stdout):
        pipe.close()
    gone, _ = psutil.wait_procs([child], timeout=20)
    assert gone


# --- what a visitor takes along ------------------------------------------------------------------------------------


@pytest.mark.parametrize("key", ["2", "3c", "11"])
def test_copied_python_builds_the_same_model(key):
    view = presets()[key].view.with_value("zeta", 1 / 30)
    head = export.as_python(view).split("verdict")[0]
    names: dict = {}
    exec(head, names)
    assert names["model"] == view.point
    compile(export.as_python(view), "copied", "exec")


@pytest.mark.parametrize("stiffness", ["two-level", "harmonics"])
def test_copied_toml_is_a_study_file_of_the_same_model(tmp_path, stiffness):
    view = replace(presets()["3c"].view.with_stiffness(stiffness), start=(("z", 0.3), ("z_dot", -0.1)))
    path = tmp_path / "study.toml"
    path.write_text(export.as_toml(view), encoding="utf-8")
    study = load_study(path)
    assert study.model == view.point
    assert study.settings_for("zones").axes == (view.x, view.y)
    tomllib.loads(path.read_text(encoding="utf-8"))


def test_pictures_and_data_of_a_map_half_done(small):
    half = next(iter(maps.sharpened(small)))
    for suffix, begins in (("png", b"\x89PNG"), ("svg", b"<?xml")):
        content, _, name = next(export.exported("map", suffix, half.dataset, "motion", ""))
        assert content.startswith(begins) and name == f"gearchaos-map.{suffix}"
    content, _, _ = next(export.exported("map", "nc", half.dataset, "motion", ""))
    again = xr.load_dataset(io.BytesIO(content), engine="h5netcdf")
    assert again["label"].equals(half.dataset["label"]) and (again["label"] == 0).any()
    assert again["label"].encoding["fletcher32"]


def test_pictures_and_data_of_a_motion():
    motion = list(dossier(START.point))[-1].motion
    for suffix in ("png", "svg", "nc"):
        content, media, _ = next(export.exported("motion", suffix, motion, "motion", "chaotic"))
        assert len(content) > 10_000 and "/" in media


# --- safety --------------------------------------------------------------------------------------------------------


def test_only_pages_of_the_server_itself_may_connect():
    assert origins("127.0.0.1", 5006) == ["127.0.0.1:5006", "localhost:5006"]
    assert origins("10.0.0.1", 80) == ["10.0.0.1:80"]
    assert address("::1", 5006) == "http://[::1]:5006/"


@pytest.mark.parametrize(("host", "port"), [("127.0.0.1", -1), ("127.0.0.1", 99999), ("203.0.113.1", 0)])
def test_an_impossible_place_to_listen_is_refused(host, port):
    with pytest.raises(InputError, match="--port"):
        check_port(host, port)


def test_a_port_in_use_is_refused():
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="must be free"):
            check_port("127.0.0.1", taken.getsockname()[1])


def test_without_its_libraries_the_explorer_says_what_to_install(monkeypatch):
    from gearchaos.app import serve

    monkeypatch.setattr(serve, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install gearchaos\[app\]"):
        gc.explore()


def test_a_server_that_cannot_start_is_an_error_and_not_a_wait(monkeypatch):
    from gearchaos.app import notebook

    def broken(*_, **__):
        raise OSError("no more sockets")

    monkeypatch.setattr(notebook, "server", broken)
    with pytest.raises(OSError, match="no more sockets"):
        gc.explore()


def test_a_view_names_no_file():
    assert not {"path", "file", "study"} & set(View.__dataclass_fields__)
