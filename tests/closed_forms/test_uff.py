"""Files in the Universal File Format, read by pyuff: numbers, units and labels of spectra and signals."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.dynamics.time_series import evenly
from gearchaos.sound import check_sound
from gearchaos.studyfile import load_study
from gearchaos.uff_files import even_rate
from tests import EXAMPLES

PAIR_FILE = EXAMPLES / "spur_50_50.toml"
PAIR = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.056384, c0=4e8, k=2000.0, backlash=1.2e-4,
                   M10=85.0, speed=4000.0, error_amplitudes=[2e-7], chi1=0.0, chi2=0.0)


@pytest.mark.parametrize(("quantity", "name", "unit", "number", "kind"), [
    ("mesh force", "order_force", "N", 1.0, (9, 0, 1)),
    ("transmission error", "order_transmission_error", "m", 1e6, (8, 1, 0)),
    ("acceleration", "order_acceleration", "m/s^2", 1.0, (12, 1, 0))])
def test_a_spectrum_is_read_back_with_its_numbers_units_and_labels(tmp_path, quantity, name, unit, number, kind):
    pyuff = pytest.importorskip("pyuff")
    found = gc.physical(gc.orders(PAIR, quantity=quantity, rms=True))
    gc.save(found, tmp_path / "o.uff")
    units, read = pyuff.UFF(str(tmp_path / "o.uff")).read_sets()
    assert (units["type"], units["units_code"], units["length"], units["force"]) == (164, 1, 1.0, 1.0)
    np.testing.assert_allclose(read["data"], found[name] / number, rtol=1e-11)
    np.testing.assert_allclose(read["x"], found.order, rtol=1e-12)
    assert (read["abscissa_axis_lab"].strip(), read["abscissa_spec_data_type"]) == ("order", 20)
    assert (read["ordinate_axis_units_lab"].strip(), read["ordinate_axis_lab"].strip()) == (
        unit, quantity.removeprefix("mesh "))
    assert tuple(read[f"ordinate_{n}"] for n in ("spec_data_type", "len_unit_exp", "force_unit_exp")) == kind
    assert read["id1"] == f"{found[name].attrs['long_name']}, rms, 1T" and read["binary"] == 0


def test_the_signals_of_a_run_up_have_the_force_and_the_speed_at_even_instants(tmp_path, monkeypatch):
    pyuff = pytest.importorskip("pyuff")
    monkeypatch.chdir(tmp_path)
    arguments = ["runup", str(PAIR_FILE), "--speed", "500:700", "--duration", "0.5 s", "--down"]
    result = CliRunner().invoke(app, [*arguments, "--uff", "r.uff", "--out", "orders.unv"])
    assert result.exit_code == 0, result.stderr
    _, *signals = pyuff.UFF("r.uff").read_sets()
    labels = [(s["ordinate_axis_lab"].strip(), s["ordinate_axis_units_lab"].strip(), s["id1"]) for s in signals]
    assert labels == [(name, unit, f"{what}, speed {way}") for way in ("rising", "falling") for name, unit, what in (
        ("force", "N", "mesh force"), ("speed", "rpm", "speed of wheel 1"))]
    design = gc.runup(load_study(PAIR_FILE).model, "speed=500:700", 0.5, down=True, signal=True)
    found = gc.physical(design)
    force, speed = signals[0], signals[1]
    rate = 1 / force["abscissa_inc"]
    assert rate == even_rate(6 * 50 * 700 / 60) == 10_000 and force["abscissa_axis_units_lab"].strip() == "s"
    assert (force["func_type"], force["binary"], force["abscissa_spacing"]) == (1, 1, 1)
    middle = slice(100, -100)
    np.testing.assert_allclose(speed["data"][middle], (500 + 400 * speed["x"])[middle], rtol=2e-3)
    finer = np.interp(force["x"][0] + np.arange(20 * len(force["x"])) / (20 * rate), found.signal_time[0],
                      found.signal_force[0])
    ours, read = (np.fft.rfft(each * np.hanning(len(each)))[: int(0.35 * len(force["x"]))] / len(each)
                  for each in (finer, force["data"]))  # up to 3.5 kHz; both have 5 kHz
    assert np.abs(ours - read).max() < 0.03 * np.abs(ours[50:]).max()
    _, *spectra = pyuff.UFF("orders.unv").read_sets()
    plain = found.order_force.sel(direction="down")
    one = [s for s in spectra if s["id1"].endswith("speed falling")][3]
    assert one["z_axis_value"] == pytest.approx(float(plain.speed[3]), rel=1e-5) and one["z_axis_spec_data_type"] == 19
    np.testing.assert_allclose(one["data"], plain[3], rtol=1e-6)


def test_a_direction_that_never_came_has_no_signal(tmp_path):
    pyuff = pytest.importorskip("pyuff")
    model = load_study(PAIR_FILE).model
    found = gc.physical(gc.runup(model, "speed=500:700", 0.2, down=True, signal=True))
    found["signal_force"][1] = np.nan  # as after a divergence
    gc.save(found.drop_vars("order_force"), tmp_path / "r.uff")
    _, *signals = pyuff.UFF(str(tmp_path / "r.uff")).read_sets()
    assert len(signals) == 2 and all(one["id1"].endswith("speed rising") for one in signals)


@pytest.mark.parametrize("options", [("--out", "x.uff", "--uff", "x.uff"), ("--against", "b.csv", "--uff", "b.uff")])
def test_no_file_is_written_over_another(tmp_path, monkeypatch, options):
    pytest.importorskip("pyuff")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.uff").write_text("measured")
    options = tuple(each.replace("b.csv", "./b.uff") for each in options)
    result = CliRunner().invoke(app, ["runup", str(PAIR_FILE), "--speed", "500:700", *options])
    assert result.exit_code == 2 and "--uff must be a file of its own" in result.stderr
    assert (tmp_path / "b.uff").read_text() == "measured" and not (tmp_path / "x.uff").exists()


def test_a_sound_that_does_not_fit_in_the_memory_is_refused_before_the_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gearchaos.execute.machine.memory", lambda: 1 << 32)
    arguments = ["runup", str(PAIR_FILE), "--speed", "20:30", "--wav", "r.wav", "--duration"]
    result = CliRunner().invoke(app, [*arguments, "3600 s"])
    assert result.exit_code == 2 and "samples of the sound must be at most" in result.stderr
    check_sound(60.0)


def test_a_sine_at_uneven_instants_is_the_same_at_even_ones():
    time = np.cumsum(np.linspace(2e-5, 1e-5, 40_000))
    instants, values = evenly(time, 3 + 2 * np.sin(2 * np.pi * 440 * time), 44_100)
    inside = slice(200, -200)
    np.testing.assert_allclose(np.diff(instants), 1 / 44_100)
    np.testing.assert_allclose(values[inside], (3 + 2 * np.sin(2 * np.pi * 440 * instants))[inside], atol=4e-3)


def test_the_inverse_of_a_rate_is_written_exactly():
    for highest in np.geomspace(3, 3e5, 40):
        rate = even_rate(highest)
        assert 2.56 * highest <= rate <= 2 * 2.56 * highest and float(f"{1 / rate:.5e}") == 1 / rate


def test_what_cannot_be_written_is_refused_before_the_work(tmp_path, monkeypatch):
    pytest.importorskip("pyuff")
    monkeypatch.chdir(tmp_path)
    motion = gc.simulate(gc.MeshModel.of(q0=0.1), periods=4)
    for result, words in ((motion, r"must end in \.nc or \.csv for a result without order spectrum or signal"),
                          (gc.orders(PAIR), "must be in the units of the gears; got .*physical")):
        with pytest.raises(gc.InputError, match=words):
            gc.save(result, tmp_path / "m.uff")
    monkeypatch.setattr("gearchaos.uff_files.find_spec", lambda name: None)
    for option in ("--uff", "--out"):
        result = CliRunner().invoke(app, ["runup", str(PAIR_FILE), "--speed", "500:700", option, "r.uff"])
        assert result.exit_code == 2
        words = " ".join(result.stderr.split())
        assert f'{option} needs the package pyuff; got \'no such package\'. Run: pip install "gearchaos[uff]"' in words
    assert "must end in" in CliRunner().invoke(app, ["zones", str(PAIR_FILE), "--out", "z.uff"]).stderr
    assert not list(tmp_path.iterdir())
