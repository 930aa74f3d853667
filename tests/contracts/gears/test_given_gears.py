"""Slips in the inputs and results of given gears that must not lead to silently wrong numbers."""

import math

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears import operating, units
from gearchaos.gears.design import drawing
from gearchaos.gears.operating import operating_model
from gearchaos.gears.transmission_error.tables import fit_harmonics
from gearchaos.store.store import open_store


def spur(**changes):
    """A spur gear pair of 18 and 26 teeth whose stiffness by ISO 6336-1 depends on the torque below 100 N/mm."""
    values = {"teeth": (18, 26), "module": "3 mm", "face_width": "20 mm", "bore": "15 mm", "damping_ratio": 0.05,
              "backlash": {"value": "0.1 mm", "of": "line of action, total"}, "speed": "2000 rpm", "torque": "30 N*m"}
    return gc.GearDesign(**{**values, **changes})


def test_units_of_a_dropped_torque():
    zones = gc.zones(spur(), "speed=1000:3000:2", "torque=3:60:3")
    kept = gc.physical(zones.isel(torque=2))
    assert kept["v_rms"].identical(gc.physical(zones)["v_rms"].isel(torque=2))
    for dropped in (zones.isel(torque=2, drop=True), zones[["v_rms"]].mean("torque", keep_attrs=True)):
        with pytest.raises(InputError, match="must have the coordinate torque"):
            gc.physical(dropped)


def test_supports_at_another_torque():
    supports = {"stiffness": "200 N/um", "damping_ratio": 0.02}
    model = operating_model(spur(supports=supports), "torsional")
    at_once = model.with_values({"kind": "full", "torque": 3})
    assert at_once == model.with_values({"torque": 3}).with_values({"kind": "full"})
    assert at_once == model.with_values({"kind": "full"}).with_values({"torque": 3})


@pytest.mark.parametrize(("field", "key"), [("stiffness", "table"), ("transmission_error", "table"),
                                            ("transmission_error", "orders")])
def test_table_that_does_not_exist_yet(field, key, tmp_path):
    with pytest.raises(InputError, match=rf"{field}\.{key} must be a file that can be read.*late\.csv"):
        spur(**{field: {key: str(tmp_path / "late.csv")}})


def test_harmonics_of_a_turn_with_its_closing_row():
    teeth, count = 17, 17 * 20
    tau = np.linspace(0, teeth, count + 1)
    error = 5e-6 * np.cos(2 * np.pi * tau) + 3e-5 * np.cos(2 * np.pi * tau / teeth)
    closed, opened = fit_harmonics(tau, error, 8), fit_harmonics(tau[:-1], error[:-1], 8)
    for found in (closed, opened):
        assert found.amplitudes == pytest.approx((5e-6, *[0] * 7), abs=1e-17)
        assert found.residual_rms == pytest.approx(3e-5 / math.sqrt(2), rel=1e-12)


def test_harmonics_of_rows_closer_together_in_one_quarter():
    tau = np.concatenate([np.arange(200) / 800, 0.25 + 0.75 * np.arange(80) / 80])
    found = fit_harmonics(tau, 1 - 4 * np.abs(tau - 0.5), 8)
    expected = [8 / (math.pi * j) ** 2 * (j % 2) for j in range(1, 9)]
    assert found.amplitudes == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("value", ["0.45", "45000"])
def test_stiffness_far_from_iso_6336(value, tmp_path):
    path = tmp_path / "stiffness.csv"
    path.write_text(f"fraction,stiffness [N/um]\n0,{value}\n0.5,{value}\n1,{value}\n")
    assert any("by ISO 6336-1" in text for text in spur(stiffness={"table": str(path)}).warnings)
    path.write_text("fraction,stiffness [N/um]\n0,200\n0.5,300\n1,200\n")
    assert not any("by ISO 6336-1" in text for text in spur(stiffness={"table": str(path)}).warnings)


def test_mass_in_grams():
    assert any("mass[0] is" in text and "is it in kg?" in text for text in spur(mass=700).warnings)
    assert not any("mass" in text for text in spur(mass=("0.3 kg", "0.7 kg")).warnings)


@pytest.mark.parametrize("text", ["20 %", "0.3", "20 deg^2", "5 deg*rad"])
def test_angle_without_its_unit(text):
    with pytest.raises(InputError, match="helix_angle must be an angle"):
        spur(helix_angle=text)


@pytest.mark.parametrize(("field", "text"), [("torque", "100 N*m/deg"), ("speed", "50 deg*rpm")])
def test_units_of_angles_that_do_not_belong(field, text):
    with pytest.raises(InputError, match=f"{field} must be"):
        spur(**{field: text})


def test_units_of_angles_that_belong():
    assert units.to_si("f", "1 N*m/rad", units.TORQUE) == 1
    assert units.to_si("f", "1 N*m*s/rad", units.BEARING_FRICTION) == units.to_si("f", "1 Nms", units.BEARING_FRICTION)
    for text in ("1 deg", "60 arcmin", "1 °"):
        assert units.to_si("f", text, units.ANGLE) == pytest.approx(math.pi / 180)


def test_last_speed_of_an_axis():
    for study in (lambda: gc.operating_map(spur(), "1000:200000:3", "20:60:2"),
                  lambda: gc.zones(spur(), "speed=1000:200000:3", "torque=20:60:2"),
                  lambda: gc.bifurcation(spur(), "speed=1000:200000:3")):
        with pytest.raises(InputError, match="must keep the pitch line velocity below 300 m/s; got 200000"):
            study()


def test_store_with_a_table_that_changed(tmp_path):
    path = tmp_path / "te.csv"
    path.write_text("order,peak [um],phase [deg]\n1,5,0\n")
    design = spur(transmission_error={"orders": str(path)})
    gc.run(gc.Zones(design, "speed=1000:3000:2", "torque=30:60:2"), out=tmp_path / "store")
    path.write_text("order,peak [um],phase [deg]\n1,6,0\n")
    for cached in (drawing._file_error, operating._point):  # as in a new process
        cached.cache_clear()
    with pytest.raises(InputError, match=r"te\.csv changed since") as caught:
        open_store(tmp_path / "store")
    assert "damaged" not in str(caught.value)
