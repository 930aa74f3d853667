"""The run-up that the explorer plays, without a browser: its address, its job, what is sent, what is refused."""

import base64
import contextvars
import io
import threading
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.io import wavfile

import gearchaos as gc
from gearchaos.datasets import from_netcdf_bytes
from gearchaos.errors import InputError
from gearchaos.execute.progress import on_progress
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.run import Run
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.features.runup.job import RunUpResult, _wav, run_up
from gearchaos.explorer.features.runup.panel import played, run_up_text
from gearchaos.explorer.web.export import exported
from gearchaos.explorer.web.page import Page
from gearchaos.flow import StoppedError, cancel_event
from gearchaos.sound import write_wav
from tests.contracts.explorer.test_computations import GEARS, RUN

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found():
    """The run-up of `RUN`, which jumps both ways, and the shares that were reported before."""
    *progress, last = run_up(RUN.operating_point, RUN.run, "")
    return [each.share for each in progress], last


def test_the_first_run_is_over_the_axis_of_the_speed_or_over_its_slider():
    assert GEARS.run == Run(GEARS.x.start, GEARS.x.stop) and not GEARS.run.sound
    torque = gc.Axis("torque", 50.0, 90.0, 2)
    own = view_of(GEARS.model, gc.Axis("speed", 900.0, 1700.0, 2), torque)
    other = view_of(GEARS.model, gc.Axis("zeta", 0.01, 0.1, 2), torque)
    assert own.run == Run(900.0, 1700.0) and other.run == GEARS.run


def test_the_run_is_that_of_runup_and_sounds_like_it(found, tmp_path):
    shares, last = found
    model = RUN.operating_point.with_values({"speed": 1000.0})
    expected = gc.runup(model, "speed=1000:2000", 0.8, down=True, signal=True)
    assert last.dataset.equals(expected.drop_dims("instant"))
    write_wav(expected, tmp_path / "run.wav")
    assert last.sound == (tmp_path / "run.wav").read_bytes()
    assert shares == sorted(shares) and all(0 <= share <= 1 for share in shares)


def test_progress_goes_up_over_both_ways_and_a_run_can_be_stopped():
    stop = threading.Event()

    def stopped():
        cancel_event.set(stop)
        steps = run_up(GEARS.operating_point, Run(3000.0, 6000.0, 15.0, "down"), "")
        shares = [next(steps).share]
        while len(shares) < 40 and shares[-1] < 0.01:
            shares.append(next(steps).share)
        stop.set()
        with pytest.raises(StoppedError):
            list(steps)
        return shares

    shares = contextvars.copy_context().run(stopped)
    assert shares[-1] >= 0.01 and shares == sorted(shares) and shares[-1] < 0.5
    done = []

    def run():
        on_progress.set(done.append)
        gc.RunUp(GEARS.operating_point, "speed=1000:1100", 0.2, down=True).run(progress=True)

    contextvars.copy_context().run(run)
    assert done == sorted(done) and done[-1] == 1 and len(done) >= 2


def test_without_sound_there_is_none():
    *_, last = run_up(GEARS.operating_point, Run(1000.0, 1100.0, 0.2), "")
    assert last.sound == b"" and "signal_force" not in last.dataset and last.dataset.sizes["direction"] == 1


def test_what_the_gears_do_not_allow_is_refused_in_words():
    with pytest.raises(InputError, match="at most 5 % within a period"):
        next(run_up(GEARS.operating_point, Run(100.0, 7000.0, 1.0), ""))


def test_a_force_that_does_not_vary_is_shown_without_sound():
    dims = ("direction", "instant")
    constant = xr.Dataset({"signal_time": (dims, [[0.0, 0.5, 1.0]]), "signal_force": (dims, [[1.0, 1.0, 1.0]])})
    assert _wav(constant) == b""


def sent(found, view):
    page, out = Page(Opened(GEARS), view), []
    page.messages.set_run_up = out.append
    page.show_run_up(found)
    return out[0]


def test_the_browser_gets_lines_in_the_order_of_time_images_and_sound(found):
    _, last = found
    run, ds = sent(last, RUN), last.dataset
    assert sent(last, RUN.with_axis("x", "zeta"))["axis"] == ""  # the speed is not on the map: nothing is marked there
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
    page, later, seen = Page(Opened(GEARS), RUN), [], []
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
    run, text = sent(last, RUN), run_up_text(last.dataset, "dynamic_factor")
    for (speeds, factors), way in zip(run["jumps"], ("up", "down"), strict=True):
        own = ds.isel(jump=ds["direction_of_jump"].values == way)
        assert len(speeds) > 0 and speeds == sorted(own["speed_of_jump"].values, reverse=way == "down")
        assert sorted(factors) == sorted(own["factor_after_jump"].values)
        assert any(f"{speeds[0]:.0f}" in sentence for sentence in text.sentences)
    assert "mesh damping in contact alone" in text.sentences  # stands beside every dynamic factor


def test_the_longest_run_that_can_be_asked_for_is_a_few_megabytes(found):
    sizes = {"direction": 2, "speed": 400, "order": 5000}
    names = {"dynamic_factor": ("direction", "speed"), "order_force": ("direction", "speed", "order")}
    ds, page = found[1].dataset, Page(Opened(GEARS), RUN)
    axes = {n: (n, values, ds[n].attrs) for n, values in (
        ("speed", np.linspace(500.0, 6000.0, 400)), ("order", np.arange(5000.0)))}
    large = ds.drop_vars([n for n, v in ds.variables.items() if {"speed", "order"} & {*v.dims}]).assign_coords(axes)
    large = large.assign({n: (over, np.ones([sizes[d] for d in over], np.float32), ds[n].attrs)
                          for n, over in names.items()})
    run = played(RunUpResult(large, bytes(44 + 2 * 44_100 * 30)), large, RUN, "dynamic_factor",
                 page.waterfall.show(large, page.units(RUN)), {})
    total = len(run["sound"]) + sum(each["image"][0].nbytes for each in run["images"])
    assert 3.5e6 < total < 4.5e6


@pytest.mark.parametrize("suffix", ["png", "nc"])
def test_a_run_is_saved_as_picture_and_data(found, suffix):
    _, last = found
    (content, _, name), = exported("runup", suffix, last.dataset, "", "", GEARS.gears)
    assert name == f"gearchaos-runup.{suffix}"
    if suffix == "png":
        assert content.startswith(b"\x89PNG")
    else:
        assert from_netcdf_bytes(content)["order_force"].attrs["units"] == "N"
