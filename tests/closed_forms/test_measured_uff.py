"""Measured signals and spectra in the Universal File Format, as pyuff writes them, and files that are refused."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.gears.order_spectrum import read_order_spectrum
from gearchaos.studies.measured_runup import MeasuredOrders, read_measured_runup
from tests import EXAMPLES

pyuff = pytest.importorskip("pyuff")
PAIR_FILE = EXAMPLES / "spur_50_50.toml"
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
    z = {"z_axis_value": speed, "z_axis_spec_data_type": 19, "z_axis_axis_lab": "Tacho",
         "z_axis_axis_units_lab": "rpm"}
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
    assert found.ignored == 2 * 298
    assert isinstance(read_measured_runup(path, Z, (500, 700)), MeasuredOrders)


@pytest.mark.slow
def test_the_commands_take_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, tacho(), force())
    arguments = ["runup", str(PAIR_FILE), "--speed", "500:700", "--duration", "2 s"]
    result = CliRunner().invoke(app, [*arguments, "--against", "bench.uff"])
    assert result.exit_code == 0, result.stderr
    row = next(line for line in result.stdout.splitlines() if line.split()[:1] == ["50"]).split()
    assert float(row[1]) == pytest.approx(250, rel=0.01)
    assert CliRunner().invoke(app, [*arguments, "--uff", "own.uff"]).exit_code == 0
    result = CliRunner().invoke(app, [*arguments, "--against", "own.uff"])
    assert result.exit_code == 0, result.stderr
    row = next(line for line in result.stdout.splitlines() if line.split()[:1] == ["100"]).split()
    assert float(row[1]) == pytest.approx(float(row[3]), rel=0.03)
    written(tmp_path, spectrum(550.0, np.arange(101.0), np.full(101, 200.0)))
    result = CliRunner().invoke(app, ["fit", str(PAIR_FILE), "bench.uff", "--vary", "damping_ratio=0.1"])
    assert result.exit_code == 2 and "two speeds or more; got [550.0]" in result.stderr


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
