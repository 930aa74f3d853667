"""The run-up that the explorer plays, without a browser: its address, its job, what is sent, what is refused."""

import base64
import contextvars
import io
import re
import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.io import wavfile

import gearchaos as gc
from gearchaos.datasets import from_netcdf_bytes
from gearchaos.errors import InputError
from gearchaos.execute.progress import on_progress
from gearchaos.explorer.jobs.export import exported
from gearchaos.explorer.jobs.runup import RunUpResult, _wav, run_up
from gearchaos.explorer.panels.runup import played, run_up_text
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.run import Run
from gearchaos.explorer.view.state import view_of
from gearchaos.explorer.view.text import from_query, to_query
from gearchaos.explorer.web.page import Page
from gearchaos.flow import StoppedError, cancel_event
from gearchaos.sound import write_wav
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import Page as Computed

pytestmark = pytest.mark.slow

FIRST = view_of(load_study(EXAMPLES / "spur_50_50.toml").model)
VIEW = FIRST.with_run(start=1000.0, stop=2000.0, duration=0.8, way="down", sound=True)


@pytest.fixture(scope="module")
def found():
    """The run-up of `VIEW`, which jumps both ways, and the shares that were reported before."""
    *shares, last = run_up(VIEW.operating_point, VIEW.run, "")
    return shares, last


# --- state ---------------------------------------------------------------------------------------------------------


def test_the_first_run_is_over_the_axis_of_the_speed_or_over_its_slider():
    assert FIRST.run == Run(FIRST.x.start, FIRST.x.stop) and not FIRST.run.sound
    model = load_study(EXAMPLES / "spur_50_50.toml").model
    own = view_of(model, gc.Axis("speed", 900.0, 1700.0, 2), gc.Axis("torque", 50.0, 90.0, 2))
    other = view_of(model, gc.Axis("zeta", 0.01, 0.1, 2), gc.Axis("torque", 50.0, 90.0, 2))
    assert own.run == Run(900.0, 1700.0) and other.run == FIRST.run


@pytest.mark.parametrize("values", [{"start": 512.3}, {"way": "down", "sound": True}, {"duration": 1 / 3}])
def test_the_address_has_the_run_once_it_is_set(values):
    view = FIRST.with_run(**values)
    assert "run=" in to_query(view, FIRST) and "run=" not in to_query(FIRST, FIRST)
    assert from_query(to_query(view, FIRST), FIRST).run == view.run
    assert from_query(to_query(FIRST, FIRST), FIRST).run == FIRST.run


@pytest.mark.parametrize(("text", "words"), [
    ("500:6000", "must read"), ("500,10,up", "must read"), ("500:6000,10,up,loud", "must read"),
    ("500:6000,10,left", "left"), ("6000:500,10,up", "to a higher speed"),
    ("0:500,10,up", "must lie in"), ("500:6000,0,up", "must lie in"),
    ("500:6000,nan,up", "finite"), ("500:6000,30.1,up", "must lie in (0, 30]"),
    ("500:6000,15.1,down", "must lie in (0, 15]"),
    ("500:1e99,10,up", "must lie in"), ("x:6000,10,up", "number"),
])
def test_an_absurd_run_is_refused(text, words):
    with pytest.raises(InputError, match=re.escape(words)):
        from_query(f"run={text}&speed=3000", FIRST)


def test_a_dimensionless_model_has_no_run():
    assert presets()["2"].view.run is None and from_query("q0=0.1", FIRST).run is None
    with pytest.raises(InputError, match="needs gears"):
        from_query("q0=0.1&run=500:6000,10,up", FIRST)


# --- computed ------------------------------------------------------------------------------------------------------


def test_the_run_is_that_of_runup_and_sounds_like_it(found, tmp_path):
    shares, last = found
    model = VIEW.operating_point.with_values({"speed": 1000.0})
    expected = gc.runup(model, "speed=1000:2000", 0.8, down=True, signal=True)
    assert last.dataset.equals(expected.drop_dims("instant"))
    write_wav(expected, tmp_path / "run.wav")
    assert last.sound == (tmp_path / "run.wav").read_bytes()
    assert shares == sorted(shares) and all(0 <= share <= 1 for share in shares)


def test_progress_goes_up_and_a_run_can_be_stopped():
    run = Run(3000.0, 6000.0, 15.0, "down")
    stop = threading.Event()

    def stopped():
        cancel_event.set(stop)
        steps = run_up(FIRST.operating_point, run, "")
        shares = [next(steps)]
        while len(shares) < 40 and shares[-1] < 0.05:
            shares.append(next(steps))
        stop.set()
        with pytest.raises(StoppedError):
            list(steps)
        return shares

    shares = contextvars.copy_context().run(stopped)
    assert shares[-1] >= 0.05 and shares == sorted(shares) and shares[-1] < 0.5  # two runs


def test_the_whole_way_is_the_run_up_and_its_run_down():
    done = []

    def run():
        on_progress.set(done.append)
        gc.RunUp(VIEW.operating_point, "speed=1000:2000", 0.8, down=True).run(progress=True)

    contextvars.copy_context().run(run)
    assert done == sorted(done) and done[-1] == 1 and len(done) >= 2


def test_without_sound_there_is_none():
    *_, last = run_up(VIEW.operating_point, replace(VIEW.run, sound=False, way="up"), "")
    assert last.sound == b"" and "signal_force" not in last.dataset and last.dataset.sizes["direction"] == 1


def test_what_the_gears_do_not_allow_is_refused_in_words():
    with pytest.raises(InputError, match="at most 5 % within a period"):
        next(run_up(FIRST.operating_point, Run(100.0, 7000.0, 1.0), ""))


@pytest.fixture
def page():
    """A page that asks for its run-up."""
    one = Computed(VIEW)
    one.computations.ask_run_up()
    return one


def test_play_computes_the_run_and_shows_how_far_it_is(page):
    job = page.branches.jobs["run-up"]
    assert job.function.args == (VIEW.operating_point, VIEW.run, "")
    job.show(0.42)
    assert "run-up 42 %" in page.display.shown["show_busy"][-1][0]
    result = RunUpResult(VIEW, b"")
    job.show(result)
    job.end(None)
    assert page.display.shown["show_run_up"] == [(result,)] and "clear_run_up" not in page.display.shown
    page.computations.ask_run_up()  # it is there
    assert page.branches.asked == ["run-up"]


def test_a_second_press_cancels_it_and_a_third_asks_anew(page):
    page.computations.ask_run_up()
    assert page.branches.jobs == {} and len(page.display.shown["clear_run_up"]) == 1
    page.computations.ask_run_up()
    assert "run-up" in page.branches.jobs


def test_a_refusal_is_a_message_and_ends_the_wait(page):
    page.branches.jobs["run-up"].end("duration must be longer")
    assert page.display.shown["show_message"][-1] == ("run-up: duration must be longer",)
    assert len(page.display.shown["clear_run_up"]) == 1
    one = Computed(presets()["2"].view)
    one.computations.ask_run_up()
    assert one.branches.asked == [] and "menu of presets" in one.display.shown["show_message"][-1][0]
    assert len(one.display.shown["clear_run_up"]) == 1


@pytest.mark.parametrize(("change", "goes"), [
    (lambda view: view.with_value("torque", 120.0), True), (lambda view: view.with_value("zeta", 0.08), True),
    (lambda view: view.with_run(stop=2100.0), True), (lambda view: view.with_axis("x", "zeta"), True),
    (lambda view: presets()["2"].view, True), (lambda view: view.with_value("speed", 2000.0), False),
    (lambda view: view.zoomed((900.0, 1500.0), (50.0, 150.0)), False), (lambda view: view.with_other_units(), False),
    (lambda view: view.with_run(sound=False), False),
])
def test_a_run_goes_with_what_it_depends_on(page, change, goes):
    page.branches.jobs["run-up"].show(RunUpResult(VIEW, b""))
    page.move(change(VIEW))
    assert (page.computations.run_up is None) == goes and ("clear_run_up" in page.display.shown) == goes


def test_a_run_without_sound_goes_when_sound_is_asked_for():
    silent = VIEW.with_run(sound=False)
    page = Computed(silent)
    page.computations.ask_run_up()
    page.branches.jobs["run-up"].show(RunUpResult(silent, b""))
    page.move(VIEW)
    assert page.computations.run_up is None


def test_a_run_with_its_sound_stays_when_this_is_switched_off_and_on():
    page = Computed(VIEW)
    page.computations.ask_run_up()
    page.branches.jobs["run-up"].show(RunUpResult(VIEW, b"RIFF"))
    for view in (VIEW.with_run(sound=False), VIEW):
        page.move(view)
    assert page.computations.run_up is not None and "clear_run_up" not in page.display.shown


def test_a_force_that_does_not_vary_is_shown_without_sound():
    dims = ("direction", "instant")
    constant = xr.Dataset({"signal_time": (dims, [[0.0, 0.5, 1.0]]), "signal_force": (dims, [[1.0, 1.0, 1.0]])})
    assert _wav(constant) == b""


@pytest.mark.parametrize("late", [lambda job: job.show(RunUpResult(VIEW, b"")), lambda job: job.end(None)])
def test_what_comes_from_a_stopped_run_does_not_touch_the_one_begun_after_it(late):
    page = Computed(VIEW)
    page.computations.ask_run_up()
    stopped = page.branches.jobs["run-up"]
    page.computations.ask_run_up()
    page.computations.ask_run_up()
    cleared = len(page.display.shown["clear_run_up"])
    late(stopped)
    assert page.computations.run_up is None and "show_run_up" not in page.display.shown
    assert len(page.display.shown["clear_run_up"]) == cleared
    page.computations.ask_run_up()  # stops the second, which is still being computed
    assert len(page.display.shown["clear_run_up"]) == cleared + 1


# --- sent and saved ------------------------------------------------------------------------------------------------


def sent(found, view):
    """What the page sends to play a run-up."""
    page, out = Page(FIRST, view), []
    page.messages.set_run_up = out.append
    page.show_run_up(found)
    return out[0]


def test_the_browser_gets_lines_in_the_order_of_time_images_and_sound(found):
    _, last = found
    run, ds = sent(last, VIEW), last.dataset
    (up, up_factor), (down, down_factor) = run["lines"]
    assert up == ds["speed"].values.tolist() and down == up[::-1]
    assert up_factor == ds["dynamic_factor"].sel(direction="up").values.tolist()
    assert down_factor[::-1] == ds["dynamic_factor"].sel(direction="down").values.tolist()
    assert (run["measure"], run["unit"], run["axis"], run["at"]) == ("dynamic factor", "", "x", [3000.0, 100.0])
    rate, signal = wavfile.read(io.BytesIO(base64.b64decode(run["sound"].removeprefix("data:audio/wav;base64,"))))
    assert len(signal) / rate == pytest.approx(1.6, abs=2 * 60 / (1000 * 50) + 1e-3)  # but for parts of a period
    image = run["images"][0]["image"][0]
    assert image.dtype == np.float32 and image.shape[1] == len(up) and image.shape[0] <= 151


def test_a_run_is_played_after_its_figures_are_set_up(found):
    page, later, seen = Page(FIRST, VIEW), [], []
    page.messages.attach(SimpleNamespace(js_on_event=lambda *_: None, add_next_tick_callback=later.append),
                         page.map.figure)
    _, updates, _, run_up_source, requests = page.map.figure.tags
    requests.data = {"action": ["ready"], "value": [None], "number": [1]}
    updates.on_change("data", lambda _, __, data: seen.append(
        ("axes", page.run.figure.x_range.id in data["models"][0])))
    run_up_source.on_change("data", lambda _, __, data: seen.append(("run", bool(data["run"][0]))))
    page.show_run_up(found[1])
    for send in later:
        send()
    assert seen == [("axes", True), ("run", True)] and "Jumps" in updates.data["html"][0]["run-text"]
    page.clear_run_up()
    later[-1]()
    assert seen[2:] == [("axes", False), ("run", False)] and updates.data["html"][0]["run-text"] == ""


def test_jumps_are_dots_in_the_order_of_time_and_in_words(found):
    _, last = found
    ds = last.dataset
    run, text = sent(last, VIEW), run_up_text(last.dataset, "dynamic_factor")
    for (speeds, factors), way in zip(run["jumps"], ("up", "down"), strict=True):
        own = ds.isel(jump=ds["direction_of_jump"].values == way)
        assert len(speeds) > 0 and speeds == sorted(own["speed_of_jump"].values, reverse=way == "down")
        assert sorted(factors) == sorted(own["factor_after_jump"].values)
        assert any(f"{speeds[0]:.0f}" in sentence for sentence in text.sentences)
    assert "mesh damping in contact alone" in text.sentences  # stands beside every dynamic factor


def test_without_the_speed_on_the_map_nothing_is_marked_there(found):
    _, last = found
    assert sent(last, VIEW.with_axis("x", "zeta"))["axis"] == ""
    assert sent(last, VIEW.with_axis("x", "torque"))["axis"] == "y"


def test_the_longest_run_that_can_be_asked_for_is_a_few_megabytes():
    speeds, orders = np.linspace(500.0, 6000.0, 400), np.arange(5000.0)
    names = {"dynamic_factor": ("direction", "speed"), "order_force": ("direction", "speed", "order")}
    ds = gc.runup(VIEW.operating_point.with_values({"speed": 1000.0}), "speed=1000:2000", 0.8, down=True)
    sizes = {"direction": 2, "speed": 400, "order": 5000}
    large = ds.drop_vars([*names, "mesh_force_peak", "contact", "z_peak_to_peak"]).drop_dims(["speed", "order"])
    large = large.assign_coords(speed=("speed", speeds, ds["speed"].attrs), order=("order", orders, ds["order"].attrs))
    large = large.assign({n: (over, np.ones([sizes[d] for d in over], np.float32), ds[n].attrs)
                          for n, over in names.items()})
    run = played(RunUpResult(large, bytes(44 + 2 * 44_100 * 30)), large, VIEW, "dynamic_factor",
                 Page(FIRST, VIEW).waterfall.show(large, Page(FIRST, VIEW).units(VIEW)), {})
    total = len(run["sound"]) + sum(each["image"][0].nbytes for each in run["images"])
    assert 3.5e6 < total < 4.5e6


@pytest.mark.parametrize("suffix", ["png", "nc"])
def test_a_run_is_saved_as_picture_and_data(found, suffix):
    _, last = found
    (content, _, name), = exported("runup", suffix, last.dataset, "", "", FIRST.gears)
    assert name == f"gearchaos-runup.{suffix}"
    if suffix == "png":
        assert content.startswith(b"\x89PNG")
    else:
        assert from_netcdf_bytes(content)["order_force"].attrs["units"] == "N"
