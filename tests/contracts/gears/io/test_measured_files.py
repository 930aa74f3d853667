"""Measured files, as data sets and programs have them: each is read to its truth, or refused with the way on, which
leads there."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

import gearchaos as gc
from gearchaos.gears.io.order_spectrum import read_order_spectrum
from gearchaos.studies.runup.measured_runup import read_measured_runup
from gearchaos.studyfile import load_study
from tests.commands import ask
from tests.contracts.gears.io.exports import workbook

RATE, ORDER, ROWS = 20_000.0, 20.0, 400
TIME = np.arange(ROWS) / RATE
SPEED = 900 + 5000 * TIME
FORCE = np.round(500 + 90 * np.cos(2 * np.pi * 300 * TIME), 6)
SPEEDS = (800.0, 1100.0)


def lines(columns: list[np.ndarray], separator: str, form: str = "{:.9g}") -> list[str]:
    return [separator.join(map(form.format, row)) for row in np.stack(columns, axis=1).tolist()]


def mat(**variables: Any) -> bytes:
    buffer = io.BytesIO()
    savemat(buffer, variables)
    return buffer.getvalue()


WAVE = [FORCE / 50, FORCE / 60, FORCE / 70]
# public data sets of gearbox vibration by their layouts: content, what the refusal says, and the options of its way on
LAYOUTS: dict[str, tuple[Any, list[str], dict[str, Any]]] = {
    "speed, torque and sensors without time and units": (
        ["speed,torque,motor_vibration_x,gearbox_vibration_x", *lines([SPEED, 0 * SPEED, WAVE[0], FORCE], ",")],
        ["columns time [s] and force [N]", '--sampling-rate "25.6 kHz"', "got ['speed', 'torque', 'motor_vibration_x"],
        {"sampling_rate": "20 kHz", "columns": {"speed": "speed [rpm]", "force": "gearbox_vibration_x [N]"}}),
    "titles, then channels without names": (
        ["Title:\tChipped_20_0", "Number of channels\t4", "Sampling rate\t20000\tHz", "", "Data", *lines(
            [SPEED, FORCE, *WAVE[:2]], "\t")],
        ["must be a header with names and units", '--column time="column 1 [s]"'],
        {"sampling_rate": "20 kHz", "columns": {"speed": "column 1 [rpm]", "force": "column 2 [N]"}}),
    "numbers alone between spaces": (
        lines([*WAVE[:1], FORCE, SPEED], " "), ["got ['11.8', '590', '900']", '--sampling-rate "25.6 kHz"'],
        {"sampling_rate": 20000, "columns": {"speed": "column 3 [rpm]", "force": "column 2 [N]"}}),
    "sensors, a set speed and words": (
        ["sensor1,sensor2,speedSet,load_value,gear_fault_desc", *(
            row + ",eccentricity" for row in lines([FORCE, *WAVE[:1], SPEED, 0 * SPEED], ","))],
        ["columns time [s] and speed [rpm] and force [N]", "The speed is that of wheel 1"],
        {"sampling_rate": "20 kHz", "columns": {"speed": "speedSet [rpm]", "force": "sensor1 [N]"}}),
    "variables of a MAT-file": (
        mat(X097_DE_time=FORCE, X097_FE_time=WAVE[0], X097RPM=950.0, note="made up"),
        ["as a table, line 1, ", "got ['X097_DE_time', 'X097_FE_time', 'X097RPM']"],
        {"sampling_rate": "20 kHz", "columns": {"speed": "X097RPM [rpm]", "force": "X097_DE_time [N]"}}),
    "structures and a matrix in a MAT-file": (
        mat(test={"t": TIME, "signals": {"a": np.stack([WAVE[0], FORCE]), "n": SPEED}}, fs=RATE),
        ["got ['test.t', 'test.signals.a 1', 'test.signals.a 2', 'test.signals.n', 'fs']"],
        {"columns": {"time": "test.t [s]", "speed": "test.signals.n [rpm]", "force": "test.signals.a 2 [N]"}}),
    "accelerations where forces are asked for": (
        ["time [s],speed [rpm],housing acceleration [g]", *lines([TIME, SPEED, FORCE], ",")],
        ["'housing acceleration [g]': A run-up has orders of the mesh force, and no acceleration. gearchaos fit --of "
         "'acceleration'"], {"columns": {"force": "housing acceleration [N]"}}),
    "several sensors": (
        ["time [s],speed [rpm],force A [N],force B [N]", *lines([TIME, SPEED, FORCE, WAVE[0]], ",")],
        ["exactly one column for force", '--column force="force A [N]", in Python columns={"force": "force A [N]"}'],
        {"columns": {"force": "force A"}}),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_files_of_public_data_sets_are_refused_with_a_way_on_that_reads_them(tmp_path, name):
    content, words, options = LAYOUTS[name]
    path = tmp_path / "measured.dat"
    path.write_bytes(content if isinstance(content, bytes) else "\n".join(content).encode())
    with pytest.raises(gc.InputError) as refusal:
        read_measured_runup(path, ORDER, SPEEDS)
    for each in words:
        assert each in str(refusal.value)
    found = read_measured_runup(path, ORDER, SPEEDS, **options)
    np.testing.assert_allclose(found.force, FORCE, rtol=1e-8)
    np.testing.assert_allclose(found.speed, 950.0 if "RPM" in str(options) else SPEED, rtol=1e-8)
    assert found.rate == pytest.approx(RATE, rel=1e-6)


def test_a_fit_says_what_to_do_with_a_signal_and_with_another_quantity(tmp_path):
    path = tmp_path / "signal.csv"
    for text, words in (
            ("time [s],speed [rpm],force [N]\n0,900,1\n1,900,2\n", "'time [s]': This is a signal over the time. "
             "gearchaos runup --against compares it"),
            ("speed [rpm],order,acceleration [m/s2]\n900,20,1\n", "--of 'acceleration', in Python quantity="),
            ("speed [rpm],order,TE [um]\n900,20,1\n", "'TE [um]': Say what was measured: --of 'deflection'")):
        path.write_text(text)
        with pytest.raises(gc.InputError) as refusal:
            read_order_spectrum(path, "mesh force", ORDER)
        assert words in str(refusal.value)


def test_orders_in_a_workbook_are_told_from_signals_whose_title_has_that_word(tmp_path):
    path = tmp_path / "measured.dat"
    path.write_bytes(workbook("xlsx", [["speed [rpm]", "order", "amplitude [N]"], [900, 20, 5]]))
    assert read_measured_runup(path, ORDER, SPEEDS).spectrum.amplitude.tolist() == [5]
    path.write_text("\n".join(["Order 4711", "time [s],speed [rpm],force [N]", *lines([TIME, SPEED, FORCE], ",")]))
    np.testing.assert_allclose(read_measured_runup(path, ORDER, SPEEDS).force, FORCE)


@pytest.mark.parametrize(("content", "words"), [
    (b"%PDF-1.7\n" + bytes(5_000_000), "It is a PDF. Ask for the table itself"), (b"TDSm" + bytes(9), "TDMS file"),
    (b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(600), "It is a MAT-file of version 7.3. In MATLAB: save("),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file"), (b"\x1f\x8b\x08", "compressed file. Unpack it"), (b"PAR1", "Parquet"),
    (b"\x89PNG\r\n", "a picture"), (b"RIFF\0\0\0\0WAVE", "a sound file"), (b"<!DOCTYPE html>", "a page of HTML"),
    (b"MDF     4.10", "ASAM MDF"), (b"\x93NUMPY\1\0", "numpy.savetxt")])
def test_a_file_that_is_no_table_is_called_what_it_is(tmp_path, content, words):
    path = tmp_path / "file.csv"
    path.write_bytes(content)
    with pytest.raises(gc.InputError, match=r"must be a table: text, a workbook, \.uff or \.mat; got") as refusal:
        read_measured_runup(path, ORDER, SPEEDS)
    assert words in str(refusal.value)
    with pytest.raises(gc.InputError, match=r"must be TOML; got .* It is a"):
        load_study(path)


def test_the_lines_of_a_file_that_is_no_table_are_not_told(tmp_path):
    path = tmp_path / "secret.csv"
    path.write_text("root:x:0:0:root:/root:/bin/sh\nuser:x:9:9:Another Secret Name:/:/bin/no\n")
    with pytest.raises(gc.InputError, match=r"line 2, must have 1 cells, as the header has; got '3 cells'") as refusal:
        read_measured_runup(path, ORDER, SPEEDS)
    assert "Secret" not in str(refusal.value)


def test_a_mat_file_that_is_damaged_or_has_no_columns_is_refused(tmp_path):
    path = tmp_path / "file.mat"
    for content, words in ((mat(t=TIME)[:300], "a MAT-file that can be read"), (mat(a=1.0), "two numbers or more")):
        path.write_bytes(content)
        with pytest.raises(gc.InputError, match=f"against must (be|have) .*{words}"):
            read_measured_runup(path, ORDER, SPEEDS)


def test_the_sampling_rate_is_an_option_of_a_run_up(tmp_path):
    example = "examples/spur_50_50.toml"
    arguments = ["runup", example, "--speed", "900:1000", "--sampling-rate"]
    assert "--sampling-rate needs --against" in ask(*arguments, "25 kHz", code=2).stderr
    (tmp_path / "a.csv").write_text("speed [rpm],force [N]\n900,1\n910,2\n")
    refused = ask(*arguments, "9 m", "--against", tmp_path / "a.csv", code=2).stderr
    assert "sampling_rate must be a frequency; got '9 m'" in refused


_UNITS = {"time": {"s": 1.0, "ms": 1e3}, "speed": {"rpm": 1.0, "1/min": 1.0, "U/min": 1.0, "min-1": 1.0},
          "force": {"N": 1.0, "kN": 1e-3}}
_NAMES = {"time": ("time", "Zeit", "t", "X_Value"), "speed": ("speed", "Drehzahl", "n1", "Tacho 1"),
          "force": ("mesh force", "Kraft", "Force tangential", "CH3")}
_TITLES = ("Bench 7, order 4711", "Sampling rate;20000;Hz", "Channels\t1\t2\t3", "Date: 2026-11-24 10:31:07",
           "# exported", "Operator,Smith", "", "Gains,1,2,1,1")
_SENSORS = ("acc housing [g]", "T oil [°C]", "noise (Pa)", "Torque [Nm]", "acc bearing / m/s²")


def measured_file(seed: int) -> tuple[bytes, dict[str, Any]]:
    """A random file with a signal, and the options with which it is read if it cannot be without."""
    draw = np.random.default_rng(seed)

    def pick(choices: Any) -> Any:
        return list(choices)[draw.integers(len(choices))]

    options: dict[str, Any] = {"columns": {}}
    separator, kind = pick((";", ",", "\t", " ")), pick(("text",) * 5 + ("xlsx", "mat"))
    comma = kind == "text" and separator in ";\t" and draw.random() < 0.5
    has_units, has_time = kind != "mat" and draw.random() < 0.7, draw.random() < 0.7
    form = pick(("{} [{}]", "{} ({})", "{} / {}", "{} in {}") if separator != " " else ("{} [{}]",))
    heads, values = [], []
    for name, column in (("time", TIME), ("speed", SPEED), ("force", FORCE)):
        if name == "time" and not has_time:
            options["sampling_rate"] = pick((RATE, "20 kHz"))
            continue
        unit, head = pick(_UNITS[name]), pick(_NAMES[name])
        heads.append(form.format(head, unit) if has_units else head)
        values.append(column * _UNITS[name][unit])
        options["columns"][name] = f"{head} [{unit}]"
    for sensor in draw.choice(_SENSORS, int(draw.integers(0, 3)), replace=False).tolist() if separator != " " else ():
        at = int(draw.integers(len(heads) + 1))
        heads.insert(at, sensor)
        values.insert(at, draw.normal(0, 9, ROWS))
    if kind == "mat":
        options["columns"] = {n: re.sub(r"[^\w\[\]/ -]|(?<=\w) (?!\[)", "_", text)
                              for n, text in options["columns"].items()}
        keys = [re.sub(r"\W", "_", head) for head in heads]
        return mat(**dict(zip(keys, values, strict=True))), options
    if kind == "xlsx":
        return workbook("xlsx", [["Report"], heads, *np.stack(values, axis=1).tolist()]), options
    rows = lines(values, separator, "{:.12g}")
    rows = [row.replace(".", ",") for row in rows] if comma else rows
    titles = [pick(_TITLES) for _ in range(int(draw.integers(0, 4)))]
    text = pick(("\n", "\r\n")).join([*titles, separator.join(heads) if separator != " " else "   ".join(heads), *rows])
    return text.encode(pick(("utf-8", "utf-8-sig", "cp1252", "utf-16"))), options


@pytest.mark.parametrize(
    "seed", [*range(40), *(pytest.param(n, marks=pytest.mark.exhaustive) for n in range(40, 1000))])
def test_random_measured_files_are_read_rightly_or_refused_with_the_way_on(tmp_path, seed):
    content, options = measured_file(seed)
    path = tmp_path / "measured.dat"
    path.write_bytes(content)
    try:
        found = read_measured_runup(path, ORDER, SPEEDS)
    except gc.InputError as error:
        assert "--column" in str(error) or ("sampling_rate" in options and "--sampling-rate" in str(error)), str(error)
        found = read_measured_runup(path, ORDER, SPEEDS, **options)
    np.testing.assert_allclose(found.force, FORCE, rtol=1e-9)
    np.testing.assert_allclose(found.speed, SPEED, rtol=1e-9)
    assert found.rate == pytest.approx(RATE, rel=1e-6)
