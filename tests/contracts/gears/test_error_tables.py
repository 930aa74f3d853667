"""Transmission errors from files: what is read, and what is refused with the number of its line."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operating import as_model
from gearchaos.gears.transmission_error.tables import fit_harmonics, from_orders, from_table


def written(folder: Path, text: str) -> Path:
    """A file with this text."""
    path = folder / "te.csv"
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize("text", [
    "order,peak [um],phase [deg]\n1,3.5,30\n3,0.25,-90\n",
    "order;peak to peak [um];phase [deg]\r\n3;0,5;-90\r\n1;7,0;30\r\n",
    "\ufefforder\tpeak (mm)\tphase (rad)\n1\t0.0035\t0.5235987755982988\n3\t0.00025\t-1.5707963267948966\n",
    "# measured without load\nphase [deg] peak [um] order\n\n30 3.5 1\n-90 0.25 3\n",
])
def test_orders(tmp_path: Path, text: str):
    found = from_orders(written(tmp_path, text))
    assert found.amplitudes == pytest.approx((3.5e-6, 0.0, 0.25e-6), rel=1e-12)
    assert found.phases == pytest.approx((math.pi / 6, 0.0, -math.pi / 2), rel=1e-12)
    assert found.residual_rms == 0 and "te.csv" in found.source
    # (2.4): e(t) = Σ e_j cos(jω_z t − θ_j)
    assert float(found.at(0.0)) == pytest.approx(3.5e-6 * math.cos(math.pi / 6), rel=1e-12)


@pytest.mark.parametrize(("rows", "line", "rule"), [
    ("1,1,0\n0.5,1,0", 3, "positive whole number"), ("0,1,0", 2, "positive whole number"),
    ("1,1,0\n-2,1,0", 3, "positive whole number"), ("65,1,0", 2, "order of at most 64"),
    ("2,1,0\n1,1,0\n2,3,0", 4, "not repeat the order of line 2"), ("1,1,0\n2,-1,0", 3, "negative amplitude"),
    ("1,nan,0", 2, "finite numbers"), ("1,1", 2, "3 cells"), ("1,1,0\n2,x,0", 3, "finite numbers"),
])
def test_wrong_orders_are_refused_with_their_line(tmp_path: Path, rows: str, line: int, rule: str):
    with pytest.raises(InputError, match=rule) as error:
        from_orders(written(tmp_path, f"order,peak [um],phase [deg]\n{rows}\n"))
    assert f"line {line}," in error.value.field


@pytest.mark.parametrize(("orders", "teeth", "wheel"), [
    ((40,), (40, 40), 1), ((20, 40), (20, 30), 1), ((30, 60), (20, 30), 2), ((1, 20, 40), (20, 30), 1),
    ((2, 3), (20, 30), 0), ((1, 2, 24, 48), (24, 36), 1), ((1, 2, 36), (24, 36), 2), ((1, 12), (24, 36), 0),
])
def test_orders_of_a_shaft_have_a_warning(tmp_path: Path, orders, teeth, wheel):
    rows = "\n".join(f"{order},3,17" for order in orders)
    path = written(tmp_path, f"order,peak [um],phase [deg]\n{rows}\n")
    design = GearDesign(teeth=teeth, module="3 mm", face_width="20 mm", transmission_error={"orders": str(path)})
    found = [text for text in design.warnings if "of te.csv" in text]
    assert len(found) == bool(wheel)
    for text in found:
        some = all(order % teeth[wheel - 1] == 0 for order in orders)
        assert text.startswith("All orders of te.csv are" if some else "Orders of te.csv, ")
        assert f"multiples of z{wheel} = {teeth[wheel - 1]}: are they" in text and "Order 1 is the mesh freq" in text


def test_a_study_warns_of_runout_in_a_curve_over_a_whole_turn(tmp_path: Path):
    angle = np.linspace(0, 360, 1441)
    error = np.cos(np.radians(40 * angle)) + 6 * np.cos(np.radians(angle))
    rows = "\n".join(f"{a},{e}" for a, e in zip(angle, error, strict=True))
    path = written(tmp_path, f"roll angle [deg],error [um]\n{rows}\n")
    design = GearDesign(
        teeth=(40, 40), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, speed="3000 rpm",
        torque=100, backlash={"value": "0.1 mm", "of": "line of action"}, transmission_error={"table": str(path)})
    with pytest.warns(DesignWarning, match="8 harmonics leave 99% of the error's rms value out"):
        model = as_model(design)
    assert design.error_harmonics.amplitudes == pytest.approx((1e-6, *[0] * 7), abs=1e-15)
    assert model.error == design.to_model().error


def test_too_high_an_order_may_be_one_of_a_shaft(tmp_path: Path):
    with pytest.raises(InputError, match=r"at most 64; got 80.* divide the orders of a shaft by the number of teeth"):
        from_orders(written(tmp_path, "order,peak [um],phase [deg]\n40,3,0\n80,1,0\n"))


@pytest.mark.parametrize("header", [
    "order,phase [deg]", "order,peak [um],peak to peak [um],phase [deg]", "order,rms [um],phase [deg]",
    "order,um,phase [deg]", "order,peak,phase [deg]", "order,peak [um]", "order,peak [um],phase",
    "order,peak [N],phase [deg]",
])
def test_headers_that_leave_a_question_are_refused(tmp_path: Path, header: str):
    with pytest.raises(InputError):
        from_orders(written(tmp_path, f"{header}\n{','.join('1' * len(header.split(',')))}\n"))


@pytest.mark.parametrize(("header", "radius", "words", "without"), [
    ("order,rms [um],phase [deg]", None, "its rms value multiplied by 1.41421", "columns ="),
    ("order,peak [um],phase [deg]", 0.03, "leave out wheel beside the file", "For an angle"),
    ("order,peak [mrad],phase [deg]", None, "For an angle write wheel = 1", "leave out"),
])
def test_the_advice_on_an_amplitude_is_the_one_that_is_true(tmp_path: Path, header, radius, words, without):
    with pytest.raises(InputError) as error:
        from_orders(written(tmp_path, f"{header}\n1,3,0\n"), radius=radius)
    assert words in error.value.advice and without not in error.value.advice


def test_the_angle_of_the_other_wheel_is_not_advised(tmp_path: Path):
    with pytest.raises(InputError, match=r"must have the column roll angle \[deg\].*that of wheel 1") as error:
        from_table(written(tmp_path, "wheel angle [deg],error [um]\n0,0\n5,3\n10,0\n"), 24)
    assert "columns =" not in error.value.advice


def test_a_constant_error_is_no_other_number_of_teeth(tmp_path: Path):
    for level, count in itertools.product(range(1, 20), (20, 32, 40, 41)):
        rows = "".join(f"{i * 15 / count!r},{level}.7\n" for i in range(count + 1))
        assert max(from_table(written(tmp_path, f"roll angle [deg],error [um]\n{rows}"), 24).amplitudes) < 1e-18


def curve_text(count: int, teeth: int, periods: float = 1.0) -> str:
    """A table of an error in µm over the roll angle in degrees."""
    tau = np.arange(count) / count * periods
    error = 7 + 3 * np.cos(2 * np.pi * tau - 0.4) + 0.5 * np.cos(6 * np.pi * tau + 1.0)
    rows = (f"{t * 360 / teeth!r},{e!r}" for t, e in zip(tau.tolist(), error.tolist(), strict=True))
    return "roll angle [deg],error [um]\n" + "\n".join(rows) + "\n"


def test_curve_over_the_roll_angle(tmp_path: Path):
    for count, periods in ((40, 1.0), (41, 1.0), (200, 3.0), (50, 1.3)):
        found = from_table(written(tmp_path, curve_text(count, 17, periods)), 17, 5)
        assert found.amplitudes == pytest.approx((3e-6, 0, 0.5e-6, 0, 0), abs=1e-15)
        assert (found.phases[0], found.phases[2]) == pytest.approx((0.4, -1.0), abs=1e-9)
        assert found.residual_peak < 1e-15 and found.warnings == ()


def test_the_rest_of_a_curve_is_reported(tmp_path: Path):
    found = from_table(written(tmp_path, curve_text(60, 17)), 17, 2)
    assert found.residual_rms == pytest.approx(0.5e-6 / math.sqrt(2), rel=1e-9)
    assert found.residual_peak == pytest.approx(0.5e-6, rel=1e-2)
    assert "16% of the error's rms" in found.warnings[0]


def test_shaft_orders_in_a_curve_go_into_the_residual():
    tau = np.arange(17 * 40) / 40
    error = 3e-6 * np.cos(2 * np.pi * tau - 0.4) + 20e-6 * np.cos(2 * np.pi * tau / 17)
    found = fit_harmonics(tau, error, 4)
    assert found.amplitudes[0] == pytest.approx(3e-6, rel=1e-9)
    assert found.residual_rms == pytest.approx(20e-6 / math.sqrt(2), rel=1e-9)
    assert found.warnings


@pytest.mark.parametrize(("tau", "orders"), [
    (np.arange(16) / 16, 8), (np.arange(30) / 40, 3), (np.arange(7) / 7, 4), (np.array([0.0]), 1),
    (np.array([0.0, 1.0, 2.0, 3.0]), 1),
])
def test_samples_that_do_not_determine_the_harmonics_are_refused(tau: np.ndarray, orders: int):
    with pytest.raises(InputError, match="mesh periods") as error:
        fit_harmonics(tau, np.cos(tau), orders)
    assert error.value.field == "orders"


def test_the_number_of_harmonics_in_the_refusal_is_accepted():
    for count in (7, 16, 17):
        tau = np.arange(count) / count
        with pytest.raises(InputError) as error:
            fit_harmonics(tau, np.cos(2 * np.pi * tau), 40)
        most = int(error.value.rule.split("at most ")[1].split()[0])
        assert most == (count - 1) // 2
        assert fit_harmonics(tau, np.cos(2 * np.pi * tau), most).amplitudes[0] == pytest.approx(1, rel=1e-12)


def test_samples_of_several_mesh_periods_fill_the_gaps_of_one():
    tau = 0.4 * np.arange(10)
    assert fit_harmonics(tau, np.cos(4 * np.pi * tau), 2).amplitudes == pytest.approx((0, 1), abs=1e-12)


def test_unequal_steps(tmp_path: Path):
    tau = np.sort(np.random.default_rng(3).uniform(0, 1, 60))
    error = 2e-6 * np.cos(2 * np.pi * tau - 1.0)
    assert fit_harmonics(tau, error, 2).amplitudes == pytest.approx((2e-6, 0), abs=1e-15)
    falling = written(tmp_path, "roll angle [deg],error [um]\n1,0\n0,1\n")
    with pytest.raises(InputError, match="greater roll angle"):
        from_table(falling, 17)


@pytest.mark.parametrize("ends", [0.9, 0.975, 1.0, 1.0005])
def test_an_error_of_one_mesh_period_that_does_not_return_is_refused(tmp_path: Path, ends: float):
    tau = np.linspace(0, ends, 41)
    wave = np.cos(2 * np.pi * tau)
    for error, closed in ((tau, False), (wave, True), *([(wave + tau, False)] if ends >= 1 else [])):
        rows = "".join(f"{t * 360 / 17!r},{e!r}\n" for t, e in zip(tau.tolist(), error.tolist(), strict=True))
        path = written(tmp_path, f"roll angle [deg],error [um]\n{rows}")
        if closed:
            assert from_table(path, 17, 1).amplitudes[0] == pytest.approx(1e-6, rel=0.01)
        else:
            with pytest.raises(InputError, match=r"line 42, must return to the error of line 2, .* µm, with which"):
                from_table(path, 17, 1)


def test_few_samples_and_several_periods_need_not_close(tmp_path: Path):
    for phase in np.linspace(0, 2 * np.pi, 37):
        for count in (3, 4, 5):
            rows = "".join(f"{i / count * 360 / 17!r},{math.cos(2 * math.pi * i / count - phase)!r}\n"
                           for i in range(count))
            found = from_table(written(tmp_path, f"roll angle [deg],error [um]\n{rows}"), 17, 1)
            assert found.amplitudes[0] == pytest.approx(1e-6, rel=1e-9)
    rows = "".join(f"{t * 360 / 17!r},{math.cos(2 * math.pi * t) + t!r}\n" for t in (np.arange(81) / 40).tolist())
    assert from_table(written(tmp_path, f"roll angle [deg],error [um]\n{rows}"), 17, 2).warnings


def test_amplitudes_in_a_wrong_unit_are_refused_with_their_line(tmp_path: Path):
    orders = "order,peak [m],phase [deg]\n1,1e-6,0\n2,3.5,0\n"
    curve = "roll angle [deg],error [mm]\n" + "".join(
        f"{i / 40 * 18!r},{3.5 * math.cos(2 * math.pi * i / 40)!r}\n" for i in range(41))
    for text, key, line, shown in ((orders, "orders", 3, "3500 mm"), (curve, "table", 2, "3.")):
        path = str(written(tmp_path, text))
        design = GearDesign(teeth=(20, 40), module="3 mm", face_width="30 mm", transmission_error={key: path})
        with pytest.raises(InputError, match="Check the unit in the header") as error:
            _ = design.error_harmonics
        assert f"line {line}," in error.value.field and error.value.rule.endswith("at most 1.5 mm")
        assert f"got {shown}" in str(error.value)
        assert from_orders(path) if key == "orders" else from_table(path, 20)


def test_gear_warns_of_a_file_that_it_cannot_use(tmp_path):
    """Its datasheet has all that does not need the transmission error."""
    file = tmp_path / "te.csv"
    file.write_text("Ordnung;Amplitude [um]\n1;3\n")
    design = gc.GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm", transmission_error={"orders": str(file)})
    study = tmp_path / "design.toml"
    study.write_text('[design]\nteeth = [50, 50]\nmodule = "3 mm"\nface_width = "20 mm"\n'
                     f'transmission_error = {{ orders = "{file}" }}\n')
    (warning,) = [text for text in design.warnings if "cannot be used" in text]
    result = CliRunner().invoke(app, ["gear", str(study), "--all"])
    assert f"{file}, line 1, must" in warning and f"error: {file}, line 1, must" in result.stderr
    assert result.exit_code == 2 and "contact_ratio" in result.stdout


TURN = np.arange(17 * 40 + 1) / 40
"""A turn of 17 teeth in mesh periods."""


@pytest.mark.parametrize(("tau", "error", "words"), [
    (np.arange(41) * 0.98 / 40, np.cos(2 * np.pi * np.arange(41) / 40), "between two ends of mesh periods; got '0.98"),
    (np.arange(50) * 0.026, np.cos(np.arange(50) * np.pi / 25), "got '1.274 mesh periods, in which the error does"),
    (TURN, np.cos(2 * np.pi * TURN * 23 / 17) + 5 * np.cos(2 * np.pi * TURN / 17), "repeats itself 23 times, not 17"),
    (TURN, np.cos(4 * np.pi * TURN) + 5 * np.cos(2 * np.pi * TURN / 17), "repeats itself 34 times, not 17"),
    (np.arange(41) / 40, 3 * np.cos(4 * np.pi * np.arange(41) / 40), "in each of which the error has 2 periods"),
    (np.arange(41) / 80, np.cos(2 * np.pi * np.arange(41) / 80), "got '0.5 mesh periods'. orders must be at most 0"),
], ids=["closed elsewhere", "no whole periods", "another wheel", "half the teeth", "half in a period",
        "half a period"])
def test_an_error_that_contradicts_the_number_of_teeth_is_refused(tmp_path: Path, tau, error, words):
    error = np.append(error[:-1], error[0]) if "0.98" in words else error
    rows = "".join(f"{t * 360 / 17!r},{e!r}\n" for t, e in zip(tau.tolist(), error.tolist(), strict=True))
    with pytest.raises(InputError) as found:
        from_table(written(tmp_path, f"roll angle [deg],error [um]\n{rows}"), 17)
    assert words in str(found.value) and f"line {len(tau) + 1}," in found.value.field
