"""Tables as programs export them: each is read to its truth, or refused with its line and the cure; none is misread."""

from __future__ import annotations

import math
import pickle
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.explorer.core.text import design_values
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.stiffness.table import read_curve
from tests.commands import ask
from tests.contracts.gears.io.exports import AT, MODULE, WIDTH, Export, exports


def read(export: Export, path: Path) -> np.ndarray:
    """What is made of an export, in the form of its truth."""
    path.write_bytes(export.content)
    if export.key == "stiffness":
        return read_curve(path, field="table", teeth=export.teeth[0], face_width=WIDTH)[0](AT)
    found = GearDesign(teeth=export.teeth, module=MODULE, face_width=WIDTH, transmission_error={
        export.key: str(path), **export.options}).error_harmonics
    values = np.array(found.amplitudes) * np.exp(-1j * np.array(found.phases))
    return np.append(values, np.zeros(8 - len(values)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.exhaustive) for seed in range(2, 10))])
def test_random_tables_are_read_rightly_or_refused_with_line_and_cure(seed, tmp_path):
    read_ones = 0
    for export in exports(seed, 40, 20):
        try:
            found = read(export, tmp_path / export.name)
        except InputError as error:
            assert export.trap, f"{export.name} must be read: {error}"
            assert f"{export.name}, line " in error.field and error.advice, str(error)
            continue
        np.testing.assert_allclose(found, export.truth, rtol=1e-9, atol=1e-9 * np.abs(export.truth).max(),
                                   err_msg=f"{export.name} is misread ({export.trap})")
        read_ones += 1
    assert read_ones >= 40


TEETH, RADIUS = (20, 30), (0.03 * math.cos(math.radians(20)), 0.045 * math.cos(math.radians(20)))
"""Numbers of teeth and base radii, m, of the design of the tests below."""

X = np.arange(41) / 40
ERROR = 4.2 * np.cos(2 * np.pi * X - 0.5) + 1.1 * np.cos(4 * np.pi * X + 1)


def design(key, value):
    """A design with a table."""
    return GearDesign(teeth=TEETH, module=MODULE, face_width=WIDTH, **{key: value})


def german(*columns):
    """Rows of columns with decimal commas and a semicolon at the end."""
    return "".join(";".join(repr(v).replace(".", ",") for v in row) + ";\r\n" for row in np.transpose(columns).tolist())


@pytest.mark.parametrize(("unit", "factor", "wheel"), [
    ("arcsec", 648000 / math.pi, 1), ('"', 648000 / math.pi, 2), ("'", 10800 / math.pi, 1), ("°", 180 / math.pi, 2),
    ("rad", 1.0, 1), ("µrad", 1e6, 2)])
def test_an_error_that_is_the_angle_of_a_wheel_is_multiplied_by_its_base_radius(unit, factor, wheel, tmp_path):
    path, scale = tmp_path / "te.csv", factor * 1e-6 / RADIUS[wheel - 1]
    for key, text in (("table", f"roll angle [deg];error [{unit}];\n" + german(X * 18, ERROR * scale)),
                      ("orders", f"order;peak [{unit}];phase [rad]\n1;{4.2 * scale!r};0.5\n2;{1.1 * scale!r};-1\n")):
        path.write_text(text)
        found = design("transmission_error", {key: str(path), "wheel": wheel})
        assert found.error_harmonics.amplitudes[:2] == pytest.approx((4.2e-6, 1.1e-6), rel=1e-12)
        assert found.error_harmonics.phases[:2] == pytest.approx((0.5, -1), rel=1e-12)
        radius = f"{RADIUS[wheel - 1] * 1e3:.6g} mm"
        assert any(f"angles of a wheel, multiplied by its base radius, {radius}" in text for text in found.assumptions)
        with pytest.raises(InputError, match=r"line 1, must have the .*For an angle write wheel = 1 or wheel = 2 bes"):
            _ = design("transmission_error", {key: str(path)}).error_harmonics
        path.write_text(text.replace(f"[{unit}]", "[um]", 1))
        with pytest.raises(InputError, match="line 1, must have the unit of an angle"):
            _ = design("transmission_error", {key: str(path), "wheel": wheel}).error_harmonics


def test_columns_are_part_of_a_design(tmp_path):
    path = tmp_path / "k.csv"
    path.write_text("phi,c1,c2\n0,300,400\n9,200,300\n18,300,400\n")
    value = {"table": str(path), "columns": {"angle": "phi [deg]", "value": "c2 [N/um]"}}
    found = design("stiffness", value)
    assert found.mesh_stiffness.reference == pytest.approx(350e6, rel=1e-12)
    assert found.assumptions == (
        "Columns of k.csv: roll angle is 'phi' in deg, stiffness is 'c2' in N/um; not used: 'c1'.",)
    copies = (GearDesign(**asdict(found)), pickle.loads(pickle.dumps(found)), GearDesign(**design_values(found)))
    assert all(copy == found and hash(copy) == hash(found) for copy in copies)
    other = design("stiffness", {**value, "columns": {"angle": "phi [deg]", "value": "c1 [N/um]"}})
    assert other != found and other.mesh_stiffness.reference == pytest.approx(250e6, rel=1e-12)
    timed = design("stiffness", {"table": str(path), "speed": "100 rpm", "columns": {"time": "phi [s]"}})
    assert GearDesign(**design_values(timed)) == timed


@pytest.mark.parametrize(("key", "value", "field", "words"), [
    ("stiffness", {"columns": "phi"}, "stiffness.columns", "must be a table of headers"),
    ("stiffness", {"columns": {"angle": 3}}, "stiffness.columns", "must be a table of headers"),
    ("stiffness", {"wheel": 1}, "stiffness", "must have no key but"),
    ("transmission_error", {"speed": "3 rpm"}, "transmission_error", "must have no key but"),
    *(("transmission_error", {"wheel": wheel}, "transmission_error.wheel", "must be 1 or 2")
      for wheel in (3, 2.0, "2", True)),
])
def test_keys_beside_a_table_that_are_wrong_or_without_effect(key, value, field, words, tmp_path):
    (tmp_path / "k.csv").write_text("")
    with pytest.raises(InputError, match=words) as error:
        design(key, {"table": str(tmp_path / "k.csv"), **value})
    assert error.value.field == field


def test_a_study_file_chooses_columns_and_the_datasheet_says_so(tmp_path):
    (tmp_path / "te.csv").write_text("Angle A [deg];Angle B [deg];TE [arcsec]\n" + german(X * 18, X * 12, ERROR))
    (tmp_path / "design.toml").write_text(
        '[design]\nteeth = [20, 30]\nmodule = "3 mm"\nface_width = "25 mm"\ntransmission_error = '
        "{ table = 'te.csv', wheel = 2, columns = { angle = 'Angle A' } }\n")
    assert "roll angle is 'Angle A [deg]', error is 'TE [arcsec]'; not used: 'Angle B [deg]'" in ask(
        "gear", tmp_path / "design.toml", "--json", code=0).stdout
