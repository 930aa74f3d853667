"""Fits from outside: what may be measured and how, bad input, what the command prints, records, picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.cli.fit import fit_document, print_fit
from gearchaos.errors import InputError
from gearchaos.store.record import from_record, to_record
from gearchaos.studies.fit.fitted_motions import PairsAtSpeeds
from gearchaos.studyfile import load_design
from tests import ONE_SPRING
from tests.commands import ask, run_json

KEYS = {"n1": 25, "n2": 40, "I1": 4.88e-4, "I2": 3.2e-3, "R1": "35.24 mm", "R2": "56.38 mm", "c0": "400 N/um",
        "chi1": 0, "chi2": 0, "k": "2000 N*s/m", "backlash": "0.12 mm", "M10": "85 N*m", "speed": 4000,
        "error_amplitudes": ["2 um"]}
PAIR = gc.GearPair(**KEYS)
TABLE = "speed [rpm],order,amplitude [N]\n4000,25,68\n6000,25,166\n9000,25,464\n"
VARY = ["error1=0.5:5 um"]


def study(folder: Path, text: str = TABLE, vary=VARY, model=PAIR, **options) -> gc.Fit:
    (folder / "orders.csv").write_text(text)
    return gc.Fit(model, folder / "orders.csv", vary, **{"starts": 1, **options})


@pytest.mark.parametrize(("text", "columns", "expected"), [
    (TABLE.replace(",", ";").replace("68", "68,5"), None, [68.5, 166, 464]),
    ("Drehzahl [1/min];Ordnung;Kraft eff [kN]\n4000;25;0,068\n6000;25;0,166\n9000;25;0,464\n", None,
     1e3 * np.sqrt(2) * np.array([0.068, 0.166, 0.464])),
    ("speed [1/s]\torder\tforce peak-to-peak [N]\n60\t25\t68\n100\t25\t166\n150\t25\t464\n".replace("1/s", "turn/s"),
     None, [34, 83, 232]),
    (TABLE.replace(" [rpm]", "").replace("amplitude [N]", "f"), {"speed": "speed [rpm]", "amplitude": "f [kN]"},
     [68e3, 166e3, 464e3]),
    (TABLE + "9000,26,7\n9000,12.5,7\n", None, [68, 166, 464])])
def test_tables_are_read_as_programs_write_them(tmp_path, text, columns, expected):
    found = study(tmp_path, text, columns=columns).spectrum
    np.testing.assert_allclose(found.amplitude, expected, rtol=1e-12)
    assert found.harmonic.tolist() == [1, 1, 1] and found.ignored == text.count(",7\n")


def test_an_amplitude_of_another_quantity_is_answered_by_the_option_that_says_so(tmp_path):
    with pytest.raises(InputError, match="--of 'acceleration'") as error:
        study(tmp_path, TABLE.replace("[N]", "[m/s2]"))
    assert "must have the unit of a force for amplitude" in error.value.rule


@pytest.mark.parametrize(("changes", "field", "rule"), [
    ({"text": TABLE.replace(" [N]", "")}, "orders.csv, line 1,", "must say the unit of amplitude"),
    ({"text": TABLE.replace(" [rpm]", "")}, "orders.csv, line 1,", "must say the unit of speed"),
    ({"quantity": "deflection"}, "orders.csv, line 1,", "must have the unit of a length for amplitude"),
    ({"quantity": "force"}, "quantity", "must be one of acceleration, deflection"),
    ({"text": TABLE.replace("9000", "9e9")}, "orders.csv, line 4,", "must have a speed from 1 to 200000 rpm"),
    ({"text": TABLE.replace("9000", "6000")}, "orders.csv, line 4,", "must not repeat the speed and the order"),
    ({"text": TABLE.replace("68", "-68")}, "orders.csv, line 2,", "must not have a negative amplitude"),
    ({"text": TABLE.replace(",25,", ",1,")}, "orders.csv, line 2,", "must have orders that are multiples of z1 = 25"),
    ({"text": TABLE.replace("4000,25", "4000,0")}, "orders.csv, line 2,", "must have an order greater than 0"),
    ({"text": TABLE.replace("6000,25", "4000,50").replace("9000,25", "4000,75")}, "measured",
     "must have two speeds or more"),
    ({"vary": [*VARY, "damping_ratio=0.01:0.1", "backlash=0.1:0.2 mm"]}, "measured",
     "must have more amplitudes than the 3 parameters"),
    ({"vary": ["error1=5:5 um"]}, "error1", "must have a lower bound below the upper one"),
    ({"vary": ["error1=0.5:5"]}, "error1", "must be a length"),
    ({"vary": ["error1=0,5:5 um"]}, "vary", "must read name=low:high with a unit"),
    ({"vary": ["backlash=0:5 um"]}, "backlash", "must be greater than 0"),
    ({"vary": ["damping_ratio=2:15"]}, "damping_ratio", "must be greater than 0 and less than 1"),
    ({"vary": ["stiffness=1:2 um"]}, "vary", "must be one of backlash, damping_ratio, error1"),
    ({"vary": []}, "vary", "must name one parameter or more, each once"),
    ({"uncertainty": "5"}, "uncertainty", "must be a percentage, or a positive value"),
    ({"uncertainty": "120 %"}, "uncertainty", "must be more than 0 % and less than 100 %"),
    ({"model": gc.MeshModel.of(zeta=0.1)}, "model", "must be a GearPair or a GearDesign, or the model of one")])
def test_bad_input_is_named(tmp_path, changes, field, rule):
    with pytest.raises(InputError) as error:
        study(tmp_path, **changes)
    assert error.value.field.endswith(field) and rule in error.value.rule


def test_a_value_that_the_gears_do_not_have_is_refused(tmp_path):
    model = study(tmp_path).model
    with pytest.raises(InputError, match="zeta must be that of the gears"):
        study(tmp_path, model=model.with_values({"zeta": 0.2}))
    assert study(tmp_path, model=model.with_values({"torque": 100.0})).search.pair.M10 == 100.0


def test_a_record_has_all_of_a_fit(tmp_path):
    made = study(tmp_path, uncertainty="5 %", columns={"amplitude": "amplitude [kN]"})
    assert from_record(to_record(made)) == made


DESIGN = ONE_SPRING.read_text().replace('speed = "3000 rpm"\n', "")  # those measured count


def measured_of(design: gc.GearDesign, error1: float) -> str:
    """A table of the mesh force of a design with another first harmonic of its error, in permanent contact."""
    pair, speeds = design.to_pair(), np.array([500.0, 700.0, 900.0, 1000.0])
    pairs = PairsAtSpeeds([replace(pair, error_amplitudes=(error1, *pair.error_amplitudes[1:]))], speeds, "torsional")
    force = pairs.harmonics(pairs.by_history().take(pairs.points), pairs.points, 1)[0]["mesh force"][:, 0]
    rows = [f"{speed},50,{amplitude:.5g}\n" for speed, amplitude in zip(speeds, force, strict=True)]
    return "".join(["speed [rpm],order,amplitude [N]\n", *rows, "1000,1,5\n"])


@pytest.mark.slow
def test_the_command_says_what_the_function_finds(tmp_path, capsys):
    (tmp_path / "design.toml").write_text(DESIGN)
    (tmp_path / "orders.csv").write_text(measured_of(load_design(tmp_path / "design.toml").at(speed=1000.0), 6e-6))
    arguments = ["fit", tmp_path / "design.toml", tmp_path / "orders.csv", "--vary", "error1=1:20 um", "--vary",
                 "backlash=0.1:0.2 mm", "--starts", 1]
    said = ask(*arguments, "--plot", tmp_path / "f.png", "--out", tmp_path / "f.nc", code=0)
    assert (tmp_path / "f.png").stat().st_size > 0 and max(map(len, said.stdout.splitlines())) <= 80
    found = gc.load(tmp_path / "f.nc")
    document = fit_document(found)
    value = document["estimates"]["error1"]
    assert said.stdout.startswith("error1: 6 um (") and value["value"] == pytest.approx(6, rel=1e-4)
    assert value["low"] < value["value"] < value["high"] and list(document["not_identified"]) == ["backlash"]
    assert value["value"] == found.estimate.values[0] and document["ignored"] == 1
    rms = np.sqrt(np.mean((found.computed_amplitude - found.measured_amplitude) ** 2))
    assert document["residual_rms"] == pytest.approx(float(rms)) and document["over_measured"] < 1e-3
    assert "N rms, 4 amplitudes at 4 speeds" in said.stdout and document["unit"] == "N"
    right = {"searches": 9, "searches_there": 9, "over_uncertainty": 1.0}
    for changed, wrong in (({}, False), ({"searches": 90}, True), ({"over_uncertainty": 1.5}, True)):
        print_fit(found, {**document, **right, **changed})
        assert ("A wrong minimum is likely" in capsys.readouterr().out) is wrong
    assert "--vary" in ask(*arguments[:3], code=2).stderr


@pytest.mark.slow
def test_a_fit_that_explains_nothing_says_so_first(tmp_path, capsys):
    (tmp_path / "orders.csv").write_text(TABLE.replace("464", "9").replace("166", "3000"))
    (tmp_path / "pair.toml").write_text("[gearpair]\n" + "".join(f"{n} = {value!r}\n" for n, value in KEYS.items()))
    document = run_json("fit", tmp_path / "pair.toml", tmp_path / "orders.csv", "--vary", *VARY, "--starts", 1, "--out",
                        tmp_path / "f.nc")
    assert 0.9 < document["over_measured"] < 1
    print_fit(gc.load(tmp_path / "f.nc"), document)
    assert " ".join(capsys.readouterr().out.split()).startswith(
        "The model does not explain these amplitudes: the residual is 9")


def test_the_picture_has_each_order_with_its_points_and_its_line(tmp_path):
    text = TABLE + "4000,50,1.5\n9000,50,2.5\n"
    found = gc.fit(PAIR, study(tmp_path, text).measured, VARY, starts=1)
    found["history"][0] = "falling"
    first, second = gc.plot.fit(found).axes
    computed, measured, other = first.lines
    np.testing.assert_array_equal(measured.get_ydata(), [68, 166, 464])
    np.testing.assert_array_equal(computed.get_ydata(), found.computed_amplitude[found.order == 25])
    assert other.get_xdata().tolist() == [4000] and second.lines[1].get_ydata().tolist() == [1.5, 2.5]
    assert "[N]" in first.get_ylabel() and [each.get_text() for each in first.get_legend().get_texts()] == [
        "computed", "measured mesh force", "not the motion from rest"]
