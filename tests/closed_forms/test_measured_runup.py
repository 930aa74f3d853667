"""Measured run-ups: orders of signals in closed form, of a table, of the computed signal itself, and bad input."""

import json

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos.studies.runup.measured_runup import (
    MeasuredSignal,
    compared_orders,
    measured_runup,
    order_cut,
    order_spectra,
    read_measured_runup,
)
from gearchaos.studyfile import load_study
from tests.closed_forms.linear_gears import PAIR_FILE
from tests.commands import ask

RATE, Z = 20_000.0, 50


def ramp(first, last, duration):
    """Instants, speeds and the turns of a wheel whose speed is linear in time."""
    time = np.arange(int(RATE * duration)) / RATE
    speed = first + (last - first) * time / duration
    return time, speed, (first * time + (last - first) * time**2 / (2 * duration)) / 60


@pytest.fixture(scope="module")
def computed():
    """A run up and down from 500 to 700 rpm, in the units of the gears."""
    return gc.physical(gc.runup(load_study(PAIR_FILE).model, "speed=500:700", 4.0, down=True, signal=True))


def test_the_orders_of_a_signal_over_the_angle_are_its_amplitudes():
    """2 + 5 cos(50 φ + 1) + 0.3 cos(12.5 φ) over a ramp: windows of two turns have no leakage, and all power."""
    _, speed, turned = ramp(500, 1500, 6.0)
    angle = 2 * np.pi * turned
    signal = 2 + 5 * np.cos(Z * angle + 1) + 0.3 * np.cos(12.5 * angle)
    lines, mean = order_spectra(signal, speed, RATE, 2, 2 * 6 * Z + 1)
    np.testing.assert_allclose(lines[:, [0, 25, 100]], np.broadcast_to([2.0, 0.3, 5.0], (len(lines), 3)), rtol=1e-3)
    inner = lines[2:-2]  # at the ends of a record the filter sees its extrapolation
    assert np.delete(inner, [0, 25, 100], axis=1).max() < 2e-3
    power = inner[:, 0] ** 2 + (inner[:, 1:] ** 2).sum(axis=1) / 2
    np.testing.assert_allclose(power, 4 + 25 / 2 + 0.09 / 2, rtol=1e-3)
    begin = np.sqrt(500**2 + 2 * 60 * (1000 / 6) * 2 * np.arange(len(mean) + 1))  # n² grows with the turns
    np.testing.assert_allclose(mean, (begin[1:] + begin[:-1]) / 2, rtol=1e-5)


def test_a_frequency_beyond_the_highest_order_does_not_fold_into_it():
    """8 kHz at 500 rpm is order 960, of 300 that are looked at."""
    time, speed, _ = ramp(500, 520, 2.0)
    lines, _ = order_spectra(np.cos(2 * np.pi * 8000 * time), speed, RATE, 2, 601)
    assert lines[2:-2].max() < 1e-3


@pytest.mark.slow
def test_the_signal_of_a_run_up_has_its_own_orders(computed):
    """What is computed, taken as measured, has the same orders: the angle is found anew, from the speed."""
    time, force = computed.signal_time[0].values, computed.signal_force[0].values
    even = np.arange(0, time[-1], 1 / RATE)
    speed = 500 + 200 * even / 4
    found = MeasuredSignal(np.interp(even, time, force), speed, RATE, ()).beside(computed)
    assert found.direction.values.tolist() == ["up"]
    for order in (50, 100):
        own, other = (order_cut(each.sel(direction="up"), order) for each in (computed, found))
        assert len(other) > 15 and np.isfinite(other).all()  # there is a window at each speed
        np.testing.assert_allclose(other, own.interp(speed=other.speed), rtol=0.1, atol=0.01 * float(own.max()))
    rows = compared_orders(computed, found)
    assert len(rows) == 3 and [row["order"] for row in rows] == sorted(row["order"] for row in rows)
    assert all(row["measured"] == pytest.approx(row["computed"], rel=0.1) for row in rows if row["order"] <= 100)


def test_amplitudes_are_compared_at_speeds_at_which_both_have_the_order(computed):
    speeds, orders = [500.0, 600.0, 700.0, 800.0], [50.0, 100.0]

    def made_up(values):
        return xr.Dataset({"order_force": (("direction", "speed", "order"), [values])}, {
            "direction": ["up"], "speed": speeds, "order": orders}, {"mesh_order": 50.0})

    ours = made_up([[1, 1], [1, 1], [1, 1], [1, 9]])
    theirs = made_up([[2, 1], [2, 1], [2, np.nan], [2, np.nan]])
    first, second = compared_orders(ours, theirs)
    assert (first["computed"], first["measured"]) == (1, 2)
    assert (second["computed"], second["measured"], second["computed_speed"]) == (1, 1, 500)
    assert len(compared_orders(ours, made_up([[2, np.nan]] * 4))) == 1


def test_the_windows_of_a_run_down_are_told_from_those_of_the_run_up(computed):
    """The amplitude is 3 while the speed rises, and 1 while it falls."""
    up, down = ramp(500, 700, 3.0), ramp(700, 500, 3.0)
    speed, turned = np.concatenate([up[1], down[1]]), np.concatenate([up[2], up[2][-1] + down[2]])
    size = np.repeat([3.0, 1.0], len(up[0]))
    signal = size * np.cos(2 * np.pi * Z * turned)
    found = MeasuredSignal(signal, speed, RATE, ()).beside(computed)
    for way, expected in (("up", 3.0), ("down", 1.0)):
        cut = order_cut(found.sel(direction=way), 50).dropna("speed")
        cut = cut[cut.speed < 690]  # the window of the change has both
        assert len(cut) > 10
        np.testing.assert_allclose(cut, expected, rtol=5e-3)
    only = MeasuredSignal(signal[len(up[0]):], down[1], RATE, ())
    assert only.beside(computed).direction.values.tolist() == ["down"]
    with pytest.raises(gc.InputError, match=r"a direction of the run-up; got 'down'\. Computed is up: run down"):
        only.beside(computed.isel(direction=[0]))


def signal_file(path, header="time [s];speed [rpm];force [kN]", comma=True, change=lambda rows: rows, duration=2.0):
    time, speed, turned = ramp(520, 680, duration)
    force = 0.25 * np.cos(2 * np.pi * Z * turned)
    rows = change([f"{t:.6f};{n:.5f};{f:.6f}" for t, n, f in zip(time, speed, force, strict=True)])
    text = "\n".join([header, *rows])
    path.write_text(text.replace(".", ",") if comma else text)
    return path


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return signal_file(tmp_path_factory.mktemp("bench") / "bench.csv")


@pytest.mark.slow
def test_the_command_prints_and_draws_measured_beside_computed(tmp_path, bench, computed):
    def compared(duration, *options):
        return ask("runup", PAIR_FILE, "--speed", "500:700", "--duration", duration, "--against", *options,
                   code=0).stdout

    lines = compared("4 s", bench, "--plot", tmp_path / "r.png").splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("Largest amplitudes of the mesh orders"))
    row = next(line for line in lines[first:] if line.split()[0] == "50").split()
    assert float(row[1]) == pytest.approx(250, rel=0.01) and max(map(len, lines)) <= 80
    own = order_cut(computed.sel(direction="up"), 50)
    within = own[(own.speed > 545) & (own.speed < 655)]
    assert float(row[3]) == pytest.approx(float(own.sel(speed=float(row[4]), method="nearest")), rel=1e-3)
    assert float(within.max()) <= float(row[3]) * 1.001 <= float(own.max()) * 1.002
    assert float(row[5]) == pytest.approx(20 * np.log10(float(row[1]) / float(row[3])), abs=0.1)
    (tmp_path / "table.csv").write_text("n [rpm];order;rms [kN]\n550;50;0,2\n600;50;0,1\n600;7;9,0\n")
    (only,) = json.loads(compared("1 s", tmp_path / "table.csv", "--json"))["measured"]
    assert (only["order"], only["measured_speed"]) == (50, 550)
    assert only["measured"] == pytest.approx(200 * np.sqrt(2)) and only["computed"] > 0


@pytest.mark.slow
def test_the_picture_has_the_cuts_as_lines_and_dots_and_a_waterfall_of_the_measured(bench, computed):
    panels = gc.plot.runup(computed, Figure(), against=bench).axes
    assert [ax.get_ylabel() for ax in panels[2:5]] == [
        "order, speed rising", "order, speed falling", "order, measured,\nspeed rising"]
    lines, dots = panels[1].lines[0::2], panels[1].lines[1::2]
    assert len(lines) == len(dots) == 3
    at = np.isfinite(dots[0].get_ydata())
    np.testing.assert_allclose(dots[0].get_ydata()[at], 250, rtol=0.01)
    np.testing.assert_allclose(lines[0].get_ydata(), order_cut(computed.sel(direction="up"), 50))
    assert len(gc.plot.runup(computed, Figure()).axes) == len(panels) - 2
    with pytest.raises(gc.InputError, match="must be in the units of the gears"):
        measured_runup(bench, gc.runup(load_study(PAIR_FILE).model, "speed=500:700", 0.2))


@pytest.mark.parametrize(("change", "header", "words"), [
    (lambda rows: rows[:900] + rows[950:], "", r"line 902, .*must be 5e-05 s after the line before.*got '0.00255 s'"),
    (lambda rows: rows[:900] + rows[898:], "", "line 902, .*greater time than line 901"),
    (lambda rows: rows[::20], "", "more than two samples in a mesh cycle; got '1000 samples a second'.*566 Hz"),
    (lambda rows: [row.replace(";6", ";-6") for row in rows], "", "must have a speed greater than 0; got '-6"),
    (list, "time [s];speed [rpm];force", "must say the unit of force"),
    (list, "time [s];speed [rpm];accel [m/s^2]", "must have the column force"),
    (list, "time;speed [rpm];force [N]", "must say the unit of time")])
def test_a_record_that_cannot_be_compared_is_refused(tmp_path, change, header, words):
    path = signal_file(tmp_path / "bench.csv", header or "time [s];speed [1/min];force [N]", False, change, 0.2)
    with pytest.raises(gc.InputError, match=words):
        read_measured_runup(path, 50.0, (500, 700))


def test_a_run_at_other_speeds_is_refused(tmp_path):
    path = signal_file(tmp_path / "bench.csv", "time [s];speed [1/min];force [N]", duration=0.2)
    assert read_measured_runup(path, 50.0, (500, 700)).rate == pytest.approx(RATE)
    with pytest.raises(gc.InputError, match=r"speeds of the run-up; got '520 to 67.* Computed are 900 to 1200"):
        read_measured_runup(path, 50.0, (900, 1200))
    refused = ask("runup", PAIR_FILE, "--speed", "500:700", "--column", "force=F", code=2)
    assert "--column needs --against" in refused.stderr
