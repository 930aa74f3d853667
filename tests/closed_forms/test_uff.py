"""The Universal File Format: what pyuff writes is read, what is saved pyuff reads, and files that are refused."""

import sys
import warnings

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics.time_series import evenly
from gearchaos.gears.io.order_spectrum import read_order_spectrum
from gearchaos.sound import check_sound
from gearchaos.studies.runup.measured_runup import MeasuredOrders, read_measured_runup
from gearchaos.studyfile import load_study
from gearchaos.uff_files import even_rate
from tests import EXAMPLES
from tests.closed_forms.linear_gears import LINEAR, PAIR_FILE
from tests.commands import ask

pyuff = pytest.importorskip("pyuff")
RATE, Z = 20_000.0, 50
TIME = np.arange(int(2 * RATE)) / RATE
TURNED = (520 * TIME + 160 * TIME**2 / 4) / 60
UNITS = {"type": 164, "units_code": 1, "units_description": "SI", "temp_mode": 1, "length": 1.0, "force": 1.0,
         "temp": 1.0, "temp_offset": 273.15}
FORCE = 250 * np.cos(2 * np.pi * Z * TURNED)


def function(x, data, label, unit, kind, of="time", even=1, **fields):
    """A dataset 58."""
    abscissa = {"time": (17, "s"), "order": (20, ""), "frequency": (18, "Hz")}[of]
    return {
        "type": 58, "func_type": 1, "rsp_node": 1, "rsp_dir": 1, "ref_node": 0, "ref_dir": 0, "id1": "bench", "x": x,
        "data": data, "abscissa_spacing": even, "abscissa_spec_data_type": abscissa[0],
        "abscissa_axis_units_lab": abscissa[1], "abscissa_axis_lab": of, "ordinate_spec_data_type": kind,
        "ordinate_axis_lab": label, "ordinate_axis_units_lab": unit, "orddenom_spec_data_type": 0, **fields}


def force(**fields):
    return function(TIME, FORCE, "CH 1", "N", 9, **{"binary": 1, **fields})


def tacho(every=400, **fields):
    """The speed from 520 rpm, 80 rpm/s, much more seldom than the force."""
    return function(TIME[::every], 520 + 80 * TIME[::every], "Tacho", "RPM", 19, **fields)


def spectrum(speed, orders, data, id1="bench", **fields):
    z = {"z_axis_value": speed, "z_axis_spec_data_type": 19, "z_axis_axis_lab": "Tacho", "z_axis_axis_units_lab": "rpm"}
    return function(orders, data, "Force", "N", 9, of="order", func_type=0, id1=id1, **{**z, **fields})


def written(folder, *sets):
    with warnings.catch_warnings(action="ignore", category=ResourceWarning):  # pyuff leaves files to Python
        pyuff.UFF(str(folder / "bench.uff")).write_sets([UNITS, *sets], mode="overwrite")
    return folder / "bench.uff"


@pytest.mark.slow
@pytest.mark.parametrize(("fields", "of_tacho"), [
    ({}, {}), ({"binary": 0}, {"ordinate_spec_data_type": 1}), ({"even": 0}, {"ordinate_axis_units_lab": "1/min"})])
def test_a_signal_and_its_tacho_are_those_written(tmp_path, fields, of_tacho):
    """The tacho has one value per 20 ms: of a linear speed all others follow."""
    found = read_measured_runup(written(tmp_path, tacho(**of_tacho), force(**fields)), Z, (500, 700))
    count = len(TIME) - 399  # up to the last instant of the tacho
    assert found.rate == pytest.approx(RATE, rel=1e-4) and len(found.force) == count
    np.testing.assert_allclose(found.force, FORCE[:count], atol=1e-9)
    np.testing.assert_allclose(found.speed, 520 + 80 * TIME[:count], rtol=1e-6)
    (note,) = found.notes
    unit = of_tacho.get("ordinate_axis_units_lab", "RPM")
    assert note.endswith(
        f"as a table: time is 'time [s]', speed is 'speed, Tacho [{unit}]', force is 'force, CH 1 [N]'")


@pytest.mark.slow
def test_mesh_forces_of_a_simulated_train_are_signals_from_its_first_instant(tmp_path):
    study, out = EXAMPLES / "train_two_stage.toml", tmp_path / "motion.uff"
    asked = "--transient", 3, "--periods", 2, "--samples", 8
    assert ask("simulate", study, *asked, "--out", out).exit_code == 0
    _, first, second = pyuff.UFF(str(out)).read_sets()
    expected = gc.physical(gc.simulate(gc.open(study), 2, 3, 8))
    for found, name in ((first, "first"), (second, "second")):
        assert found["id1"].endswith(f", {name}") and found["ordinate_axis_units_lab"] == "N"
        np.testing.assert_allclose(found["x"], np.arange(16) / 8 * 2e-3, rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found["data"], expected.mesh_force.sel(mesh=name), rtol=1e-12)
    assert "simulate with samples" in ask("simulate", study, "--periods", 2, "--out", out, code=2).stderr


@pytest.mark.slow
def test_the_force_is_in_the_unit_of_its_label_and_may_be_chosen(tmp_path):
    path = written(tmp_path, tacho(), force(id1="left"), function(TIME, FORCE, "CH 1", "kN", 9, id1="right"))
    with pytest.raises(gc.InputError, match="must have exactly one column for force"):
        read_measured_runup(path, Z, (500, 700))
    found = read_measured_runup(path, Z, (500, 700), {"force": "force, CH 1 right"})
    np.testing.assert_allclose(found.force, 1000 * FORCE[: len(found.force)], rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize(("id1", "factor"), [
    ("bench", 1), ("RMS spectrum", 2**0.5), ("pk-pk", 0.5), ("Peak to peak", 0.5)])
@pytest.mark.parametrize("phase", [1.0, np.exp(0.7j)])
def test_spectra_over_the_order_are_amplitudes_at_their_speeds(tmp_path, id1, factor, phase):
    """Lines each third of an order, of which the header has the distance in six digits."""
    orders = np.arange(301) / 3
    sizes = [np.where(np.isin(orders, (50, 100)), size, 0.1) for size in (30.0, 20.0)]
    path = written(tmp_path, *(spectrum(speed, orders, size * phase, id1) for speed, size in zip(
        (600.0, 550.0), sizes, strict=True)))
    found = read_order_spectrum(path, "mesh force", Z)
    assert found.speeds.tolist() == [550, 600] and (found.unit, found.size) == ("N", 1)
    assert sorted(zip(found.at.tolist(), found.harmonic.tolist(), found.amplitude.tolist(), strict=True)) == [
        (at, k, pytest.approx(size * factor, rel=1e-4)) for at, size in ((0, 20), (1, 30)) for k in (1, 2)]
    assert found.ignored == 2 * 298 and isinstance(read_measured_runup(path, Z, (500, 700)), MeasuredOrders)


@pytest.mark.slow
def test_the_commands_take_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, tacho(), force())

    def row(order, *options):
        said = ask("runup", PAIR_FILE, "--speed", "500:700", "--duration", "1 s", *options, code=0).stdout
        return next((line.split() for line in said.splitlines() if line.split()[:1] == [order]), None)

    assert float(row("50", "--against", "bench.uff", "--uff", "own.uff")[1]) == pytest.approx(250, rel=0.01)
    own = row("100", "--against", "own.uff")
    assert float(own[1]) == pytest.approx(float(own[3]), rel=0.03)
    written(tmp_path, spectrum(550.0, np.arange(101.0), np.full(101, 200.0)))
    refused = ask("fit", PAIR_FILE, "bench.uff", "--vary", "damping_ratio=0.1", code=2)
    assert "two speeds or more; got [550.0]" in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("sets", "words"), [
    ([tacho(), force(), spectrum(550.0, np.arange(101.0), np.ones(101))], "over the order; got .* It has both"),
    ([function(TIME, FORCE, "Force", "N", 9, of="frequency")], "over the order; got .* It has neither"),
    ([force()], r"bench\.uff, as a table, line 1, must have the column speed"),
    ([tacho(), force(), function(TIME[::2], FORCE[::2], "Accel", "m/s2", 12)],
     r"at the same instants; got .* acceleration, Accel \[m/s2\] has others than force, CH 1: speeds alone may"),
    ([tacho(), function(TIME, FORCE, "Force", "", 9)], "must say the unit of force"),
    ([spectrum(5.0, np.arange(101.0), np.ones(101), z_axis_spec_data_type=17, z_axis_axis_units_lab="s")],
     "must have the speed of each spectrum on its z axis, in rpm"),
    ([spectrum(550.0, np.arange(101.0), np.ones(101)), spectrum(560.0, np.arange(101.0), np.ones(101), "rms")],
     r"must have spectra of one quantity in one unit; got .* It has Force  \[N\], Force rms \[N\]")])
def test_a_file_that_is_not_one_measurement_is_refused(tmp_path, sets, words):
    with pytest.raises(gc.InputError, match=words):
        read_measured_runup(written(tmp_path, *sets), Z, (500, 700))


def test_a_damaged_file_and_a_missing_package_are_said(tmp_path, monkeypatch):
    path = written(tmp_path, tacho(), force(binary=0))
    content = path.read_bytes()
    path.write_bytes(content.replace(content[-60:-40], b" " * 7 + b"nothing here!"))
    with pytest.raises(gc.InputError, match="must be a file in the Universal File Format that can be read"):
        read_measured_runup(path, Z, (500, 700))
    path.write_bytes(content[: content.index(b"    58")])
    with pytest.raises(gc.InputError, match="neither"):
        read_measured_runup(path, Z, (500, 700))
    monkeypatch.setitem(sys.modules, "pyuff", None)
    with pytest.raises(gc.InputError, match=r'needs the package pyuff; .*pip install "gearchaos\[uff\]"'):
        read_measured_runup(path, Z, (500, 700))


@pytest.mark.parametrize(("quantity", "name", "unit", "number", "kind"), [
    ("mesh force", "order_force", "N", 1.0, (9, 0, 1)),
    ("transmission error", "order_transmission_error", "m", 1e6, (8, 1, 0)),
    ("acceleration", "order_acceleration", "m/s^2", 1.0, (12, 1, 0))])
def test_a_spectrum_is_read_back_with_its_numbers_units_and_labels(tmp_path, quantity, name, unit, number, kind):
    found = gc.physical(gc.orders(LINEAR, quantity=quantity, rms=True))
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


@pytest.fixture(scope="module")
def found():
    """A run up and down from 500 to 700 rpm, in the units of the gears."""
    return gc.physical(gc.runup(load_study(PAIR_FILE).model, "speed=500:700", 0.5, down=True, signal=True))


def test_the_signals_of_a_run_up_have_the_force_and_the_speed_at_even_instants(tmp_path, found):
    path, orders = tmp_path / "r.uff", tmp_path / "orders.unv"
    ask("runup", PAIR_FILE, "--speed", "500:700", "--duration", "0.5 s", "--down", "--uff", path, "--out", orders,
        code=0)
    _, *signals = pyuff.UFF(str(path)).read_sets()
    labels = [(s["ordinate_axis_lab"].strip(), s["ordinate_axis_units_lab"].strip(), s["id1"]) for s in signals]
    assert labels == [(name, unit, f"{what}, speed {way}") for way in ("rising", "falling") for name, unit, what in (
        ("force", "N", "mesh force"), ("speed", "rpm", "speed of wheel 1"))]
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
    _, *spectra = pyuff.UFF(str(orders)).read_sets()
    plain = found.order_force.sel(direction="down")
    one = [s for s in spectra if s["id1"].endswith("speed falling")][3]
    assert one["z_axis_value"] == pytest.approx(float(plain.speed[3]), rel=1e-5) and one["z_axis_spec_data_type"] == 19
    np.testing.assert_allclose(one["data"], plain[3], rtol=1e-6)


def test_a_direction_that_never_came_has_no_signal(tmp_path, found):
    broken = found.drop_vars("order_force").copy(deep=True)
    broken["signal_force"][1] = np.nan  # as after a divergence
    gc.save(broken, tmp_path / "r.uff")
    _, *signals = pyuff.UFF(str(tmp_path / "r.uff")).read_sets()
    assert len(signals) == 2 and all(one["id1"].endswith("speed rising") for one in signals)


@pytest.mark.parametrize("options", [("--out", "x.uff", "--uff", "x.uff"), ("--against", "./b.uff", "--uff", "b.uff")])
def test_no_file_is_written_over_another(tmp_path, monkeypatch, options):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.uff").write_text("measured")
    assert "--uff must be a file of its own" in ask("runup", PAIR_FILE, "--speed", "500:700", *options, code=2).stderr
    assert (tmp_path / "b.uff").read_text() == "measured" and not (tmp_path / "x.uff").exists()


def test_a_sound_that_does_not_fit_in_the_memory_is_refused_before_the_run(monkeypatch):
    monkeypatch.setattr("gearchaos.execute.machine.memory", lambda: 1 << 32)
    refused = ask("runup", PAIR_FILE, "--speed", "20:30", "--wav", "r.wav", "--duration", "3600 s", code=2)
    assert "samples of the sound must be at most" in refused.stderr
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
    monkeypatch.chdir(tmp_path)
    motion = gc.simulate(gc.MeshModel.of(q0=0.1), periods=4)
    for result, words in ((motion, r"must end in \.nc or \.csv for a result without order spectrum or signal"),
                          (gc.orders(LINEAR), "must be in the units of the gears; got .*physical")):
        with pytest.raises(gc.InputError, match=words):
            gc.save(result, tmp_path / "m.uff")
    monkeypatch.setattr("gearchaos.uff_files.find_spec", lambda name: None)
    for option in ("--uff", "--out"):
        words = " ".join(ask("runup", PAIR_FILE, "--speed", "500:700", option, "r.uff", code=2).stderr.split())
        assert f'{option} needs the package pyuff; got \'no such package\'. Run: pip install "gearchaos[uff]"' in words
    assert "must end in" in ask("zones", PAIR_FILE, "--out", "z.uff", code=2).stderr
    assert not list(tmp_path.iterdir())
