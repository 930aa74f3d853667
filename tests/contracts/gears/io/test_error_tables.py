"""Transmission errors from files: what is read, and what is refused with the number of its line."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operation.operating import as_model
from gearchaos.gears.transmission_error.tables import fit_harmonics, from_orders, from_table
from tests.commands import ask


@pytest.fixture
def written(tmp_path):
    """A function that writes a text to a file."""
    path = tmp_path / "te.csv"
    return lambda text: (path.write_text(text), path)[1]


@pytest.fixture
def curve(written):
    """A function that writes a table of errors, µm, over the mesh periods of a wheel as its roll angle."""

    def curve(tau, error, teeth: int = 17) -> Path:
        rows = (f"{t * 360 / teeth!r},{e!r}\n" for t, e in zip(tau.tolist(), error.tolist(), strict=True))
        return written(f"roll angle [deg],error [um]\n{''.join(rows)}")

    return curve


def test_orders(written):
    found = from_orders(written("order;peak to peak [um];phase [deg]\n3;0,5;-90\n1;7,0;30\n"))
    assert found.amplitudes == pytest.approx((3.5e-6, 0.0, 0.25e-6), rel=1e-12)
    assert found.phases == pytest.approx((math.pi / 6, 0.0, -math.pi / 2), rel=1e-12)
    assert found.residual_rms == 0 and "te.csv" in found.source
    # (2.4): e(t) = Σ e_j cos(jω_z t − θ_j)
    assert float(found.at(0.0)) == pytest.approx(3.5e-6 * math.cos(math.pi / 6), rel=1e-12)


@pytest.mark.parametrize(("rows", "line", "rule"), [
    ("1,1,0\n0.5,1,0", 3, "positive whole number"), ("0,1,0", 2, "positive whole number"),
    ("1,1,0\n-2,1,0", 3, "positive whole number"),
    ("40,3,0\n65,1,0", 3, "at most 64; got 65.* divide the orders of a shaft by the number of teeth"),
    ("2,1,0\n1,1,0\n2,3,0", 4, "not repeat the order of line 2"), ("1,1,0\n2,-1,0", 3, "negative amplitude"),
])
def test_wrong_orders_are_refused_with_their_line(written, rows: str, line: int, rule: str):
    with pytest.raises(InputError, match=rule) as error:
        from_orders(written(f"order,peak [um],phase [deg]\n{rows}\n"))
    assert f"line {line}," in error.value.field


@pytest.mark.parametrize(("orders", "teeth", "wheel"), [
    ((40,), (40, 40), 1), ((20, 40), (20, 30), 1), ((30, 60), (20, 30), 2), ((1, 20, 40), (20, 30), 1),
    ((2, 3), (20, 30), 0), ((1, 2, 24, 48), (24, 36), 1), ((1, 2, 36), (24, 36), 2), ((1, 12), (24, 36), 0),
])
def test_orders_of_a_shaft_have_a_warning(written, orders, teeth, wheel):
    path = written("order,peak [um],phase [deg]\n" + "".join(f"{order},3,17\n" for order in orders))
    design = GearDesign(teeth=teeth, module="3 mm", face_width="20 mm", transmission_error={"orders": str(path)})
    found = [text for text in design.warnings if "of te.csv" in text]
    assert len(found) == bool(wheel)
    for text in found:
        some = all(order % teeth[wheel - 1] == 0 for order in orders)
        assert text.startswith("All orders of te.csv are" if some else "Orders of te.csv, ")
        assert f"multiples of z{wheel} = {teeth[wheel - 1]}: are they" in text and "Order 1 is the mesh freq" in text


def test_a_study_warns_of_runout_in_a_curve_over_a_whole_turn(curve):
    tau = np.linspace(0, 40, 1441)
    path = curve(tau, np.cos(2 * np.pi * tau) + 6 * np.cos(2 * np.pi * tau / 40), 40)
    design = GearDesign(
        teeth=(40, 40), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, speed="3000 rpm",
        torque=100, backlash={"value": "0.1 mm", "of": "line of action"}, transmission_error={"table": str(path)})
    with pytest.warns(DesignWarning, match="8 harmonics leave 99% of the error's rms value out"):
        model = as_model(design)
    assert design.error_harmonics.amplitudes == pytest.approx((1e-6, *[0] * 7), abs=1e-15)
    assert model.error == design.to_model().error


@pytest.mark.parametrize("header", [
    "order,phase [deg]", "order,peak [um],peak to peak [um],phase [deg]", "order,rms [um],phase [deg]",
    "order,um,phase [deg]", "order,peak,phase [deg]", "order,peak [um]", "order,peak [um],phase",
    "order,peak [N],phase [deg]",
])
def test_headers_that_leave_a_question_are_refused(written, header: str):
    with pytest.raises(InputError, match="line 1"):
        from_orders(written(f"{header}\n{','.join('1' * len(header.split(',')))}\n"))


@pytest.mark.parametrize(("header", "radius", "words", "without"), [
    ("order,rms [um],phase [deg]", None, "its rms value multiplied by 1.41421", "columns ="),
    ("order,peak [um],phase [deg]", 0.03, "leave out wheel beside the file", "For an angle"),
    ("order,peak [mrad],phase [deg]", None, "For an angle write wheel = 1", "leave out"),
])
def test_the_advice_on_an_amplitude_is_the_one_that_is_true(written, header, radius, words, without):
    with pytest.raises(InputError) as error:
        from_orders(written(f"{header}\n1,3,0\n"), radius=radius)
    assert words in error.value.advice and without not in error.value.advice


def test_the_angle_of_the_other_wheel_is_not_advised(written):
    with pytest.raises(InputError, match=r"must have the column roll angle \[deg\].*that of wheel 1") as error:
        from_table(written("wheel angle [deg],error [um]\n0,0\n5,3\n10,0\n"), 24)
    assert "columns =" not in error.value.advice


def test_a_constant_error_is_no_other_number_of_teeth(curve):
    for level, count in itertools.product(range(1, 20, 4), (20, 32, 40, 41)):
        path = curve(np.arange(count + 1) / count, np.full(count + 1, level + 0.7), 24)
        assert max(from_table(path, 24).amplitudes) < 1e-18


@pytest.mark.parametrize("tau", [np.arange(40) / 40, np.arange(41) / 41, np.arange(200) * 3 / 200,
                                 np.arange(50) * 1.3 / 50, np.sort(np.random.default_rng(3).uniform(0, 1, 60))])
def test_curve_over_the_roll_angle(curve, tau):
    path = curve(tau, 7 + 3 * np.cos(2 * np.pi * tau - 0.4) + 0.5 * np.cos(6 * np.pi * tau + 1.0))
    found = from_table(path, 17, 5)
    assert found.amplitudes == pytest.approx((3e-6, 0, 0.5e-6, 0, 0), abs=1e-15)
    assert found.phases[:3:2] == pytest.approx((0.4, -1.0), abs=1e-9)
    assert found.residual_peak < 1e-15 and found.warnings == ()
    if len(tau) == 40:
        rest = from_table(path, 17, 2)
        assert rest.residual_rms == pytest.approx(0.5e-6 / math.sqrt(2), rel=1e-9)
        assert rest.residual_peak == pytest.approx(0.5e-6, rel=1e-2)
        assert "16% of the error's rms" in rest.warnings[0]


@pytest.mark.parametrize(("tau", "orders"), [
    (np.arange(16) / 16, 8), (np.arange(30) / 40, 3), (np.arange(7) / 7, 4), (np.array([0.0]), 1),
    (np.array([0.0, 1.0, 2.0, 3.0]), 1),
])
def test_samples_that_do_not_determine_the_harmonics_are_refused(tau: np.ndarray, orders: int):
    with pytest.raises(InputError, match=r"^orders .*mesh periods"):
        fit_harmonics(tau, np.cos(tau), orders)


def test_the_number_of_harmonics_in_the_refusal_is_accepted():
    for count in (7, 16, 17):
        tau = np.arange(count) / count
        with pytest.raises(InputError) as error:
            fit_harmonics(tau, np.cos(2 * np.pi * tau), 40)
        most = int(error.value.rule.split("at most ")[1].split()[0])
        assert most == (count - 1) // 2
        assert fit_harmonics(tau, np.cos(2 * np.pi * tau), most).amplitudes[0] == pytest.approx(1, rel=1e-12)


def test_harmonics_of_a_turn_with_its_closing_row():
    teeth, count = 17, 17 * 20
    tau = np.linspace(0, teeth, count + 1)
    error = 5e-6 * np.cos(2 * np.pi * tau) + 3e-5 * np.cos(2 * np.pi * tau / teeth)
    for found in (fit_harmonics(tau, error, 8), fit_harmonics(tau[:-1], error[:-1], 8)):
        assert found.amplitudes == pytest.approx((5e-6, *[0] * 7), abs=1e-17)
        assert found.residual_rms == pytest.approx(3e-5 / math.sqrt(2), rel=1e-12) and found.warnings


def test_harmonics_of_rows_closer_together_in_one_quarter():
    tau = np.concatenate([np.arange(200) / 800, 0.25 + 0.75 * np.arange(80) / 80])
    found = fit_harmonics(tau, 1 - 4 * np.abs(tau - 0.5), 8)
    assert found.amplitudes == pytest.approx([8 / (math.pi * j) ** 2 * (j % 2) for j in range(1, 9)], abs=1e-3)


@pytest.mark.parametrize("ends", [0.9, 0.975, 1.0, 1.0005])
def test_an_error_of_one_mesh_period_that_does_not_return_is_refused(curve, ends: float):
    tau = np.linspace(0, ends, 41)
    wave = np.cos(2 * np.pi * tau)
    assert from_table(curve(tau, wave), 17, 1).amplitudes[0] == pytest.approx(1e-6, rel=0.01)
    for error in (tau, wave + tau)[: 1 + (ends >= 1)]:
        with pytest.raises(InputError, match=r"line 42, must return to the error of line 2, .* µm, with which"):
            from_table(curve(tau, error), 17, 1)


def test_few_samples_and_several_periods_need_not_close(curve):
    for phase, count in itertools.product(np.linspace(0, 2 * np.pi, 10), (3, 4, 5)):
        tau = np.arange(count) / count
        path = curve(tau, np.cos(2 * np.pi * tau - phase))
        assert from_table(path, 17, 1).amplitudes[0] == pytest.approx(1e-6, rel=1e-9)
    tau = np.arange(81) / 40
    assert from_table(curve(tau, np.cos(2 * np.pi * tau) + tau), 17, 2).warnings
    tau = 0.4 * np.arange(10)  # the samples of several periods fill the gaps of one
    assert fit_harmonics(tau, np.cos(4 * np.pi * tau), 2).amplitudes == pytest.approx((0, 1), abs=1e-12)


@pytest.mark.parametrize(("key", "read", "text", "line", "shown"), [
    ("orders", from_orders, "order,peak [m],phase [deg]\n1,1e-6,0\n2,3.5,0\n", 3, "3500 mm"),
    ("table", lambda path: from_table(path, 20), "roll angle [deg],error [mm]\n" + "".join(
        f"{i / 40 * 18!r},{3.5 * math.cos(2 * math.pi * i / 40)!r}\n" for i in range(41)), 2, "3."),
])
def test_amplitudes_in_a_wrong_unit_are_refused_with_their_line(written, key, read, text, line, shown):
    path = written(text)
    design = GearDesign(teeth=(20, 40), module="3 mm", face_width="30 mm", transmission_error={key: str(path)})
    with pytest.raises(InputError, match="Check the unit in the header") as error:
        _ = design.error_harmonics
    assert f"line {line}," in error.value.field and error.value.rule.endswith("at most 1.5 mm")
    assert f"got {shown}" in str(error.value) and read(path)


def test_gear_warns_of_a_file_that_it_cannot_use(written, tmp_path):
    """Its datasheet has all that does not need the transmission error."""
    file, study = written("Ordnung;Amplitude [um]\n1;3\n"), tmp_path / "design.toml"
    design = GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm", transmission_error={"orders": str(file)})
    study.write_text('[design]\nteeth = [50, 50]\nmodule = "3 mm"\nface_width = "20 mm"\n'
                     'transmission_error = { orders = "te.csv" }\n')
    (warning,) = [text for text in design.warnings if "cannot be used" in text]
    result = ask("gear", study, "--all", code=2)
    assert f"{file}, line 1, must" in warning and f"error: {file}, line 1, must" in result.stderr
    assert "contact_ratio" in result.stdout


TURN = np.arange(17 * 40 + 1) / 40
"""A turn of 17 teeth in mesh periods."""


@pytest.mark.parametrize(("tau", "error", "words"), [
    (np.arange(41) * 0.98 / 40, lambda tau: np.cos(np.pi * (np.arange(41) % 40) / 20),
     "between two ends of mesh periods; got '0.98"),
    (np.arange(50) * 0.026, lambda tau: np.cos(np.arange(50) * np.pi / 25),
     "got '1.274 mesh periods, in which the error does"),
    (TURN, lambda tau: np.cos(2 * np.pi * tau * 23 / 17) + 5 * np.cos(2 * np.pi * tau / 17),
     "repeats itself 23 times, not 17"),
    (TURN, lambda tau: np.cos(4 * np.pi * tau) + 5 * np.cos(2 * np.pi * tau / 17), "repeats itself 34 times, not 17"),
    (np.arange(41) / 40, lambda tau: 3 * np.cos(4 * np.pi * tau), "in each of which the error has 2 periods"),
    (np.arange(41) / 80, lambda tau: np.cos(2 * np.pi * tau), "got '0.5 mesh periods'. orders must be at most 0"),
], ids=["closed elsewhere", "no whole periods", "another wheel", "half the teeth", "half in a period", "half a period"])
def test_an_error_that_contradicts_the_number_of_teeth_is_refused(curve, tau, error, words):
    with pytest.raises(InputError) as found:
        from_table(curve(tau, error(tau)), 17)
    assert words in str(found.value) and f"line {len(tau) + 1}," in found.value.field
