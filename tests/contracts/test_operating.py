"""Speed and torque of given gears as parameters: of a model, on the axes of studies, in stores, in physical units."""

import json
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.gears.operating import OperatingModel, operating_model
from gearchaos.gears.units import RPM, SPEED, to_si
from gearchaos.model import vary
from gearchaos.store.record import from_record, to_record
from gearchaos.store.store import open_store
from gearchaos.studies import motions
from gearchaos.studyfile import load_study

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
EXAMPLE = Path(__file__).parents[2] / "examples" / "physical_pair.toml"


@pytest.fixture(scope="module")
def pair():
    return load_study(EXAMPLE).pair


@pytest.fixture(scope="module")
def model(pair):
    return operating_model(pair)


def test_a_speed_in_rpm_is_the_same_float_from_a_text_and_from_an_axis():
    for speed in np.random.default_rng(0).uniform(1, 20_000, 300).tolist():
        assert to_si("speed", f"{speed!r} rpm", SPEED) == speed * RPM
    assert math.isclose(RPM, 2 * math.pi / 60, rel_tol=1e-15)


@pytest.mark.parametrize("kind", ["full", "torsional"])
def test_a_point_by_speed_and_torque_is_the_model_of_the_pair_there(pair, kind):
    there = gc.GearPair(**{**{f: getattr(pair, f) for f in pair.__dataclass_fields__}, "M10": 120.0, "M20": None,
                           "speed": "9000 rpm"})
    found = operating_model(pair, kind).with_values({"speed": 9000, "torque": 120})
    assert found == operating_model(there, kind) and found.value("speed") == 9000 and found.value("torque") == 120
    assert found.value("q0") == there.to_model().q1 and found.set_by("torque") == ("q1", "q2")


def test_an_unbalanced_torque_keeps_its_ratio(pair):
    braked = gc.GearPair(**{**{f: getattr(pair, f) for f in pair.__dataclass_fields__}, "M20": pair.M20 * 0.5})
    assert math.isclose(braked.at(torque=2 * braked.M10).M20, 2 * braked.M20, rel_tol=1e-15)
    idle = gc.GearPair(**{**{f: getattr(pair, f) for f in pair.__dataclass_fields__}, "M10": 0.0, "M20": 3.0})
    with pytest.raises(InputError, match="M20 must be 0 where M10 is"):
        idle.at(torque=10.0)


def test_a_value_set_by_name_stays_where_speed_and_torque_vary(model):
    changed = model.with_values({"zeta": 0.07, "eps1": 0.2})
    batch = vary(changed, {"speed": [3000.0, 6000.0], "torque": [50.0, 100.0]})
    assert batch["zeta"] == 0.07 and batch["eps1"] == 0.2
    assert batch["omega"][1] == 2 * batch["omega"][0] and batch["q1"][1] == 2 * batch["q1"][0]


def test_the_model_is_a_value(model, pair):
    assert pickle.loads(pickle.dumps(model)) == model and hash(model) == hash(operating_model(pair))
    assert model != operating_model(pair.at(torque=1.0)) and repr(model).startswith("OperatingModel(kind='full'")
    assert model.with_values({"omega": 1.5}).gears is model.gears


@pytest.mark.parametrize(("name", "value", "rule"), [
    ("speed", 0.0, "must be greater than 0"), ("speed", -5.0, "must be greater than 0"),
    ("torque", math.nan, "must be a finite number"), ("torque", 1e13, "must be at most"),
])
def test_a_speed_or_torque_that_breaks_a_rule_is_refused(model, name, value, rule):
    with pytest.raises(InputError, match=f"^{name} {rule}"):
        model.with_values({name: value})
    with pytest.raises(InputError, match=f"^{name} {rule}"):
        vary(model, {name: [value]})


def test_a_dimensionless_model_has_no_speed():
    with pytest.raises(InputError, match=r"speed"):
        gc.zones(gc.MeshModel(), "speed=500:1500:2", "q0=0:0.1:2")
    with pytest.raises(InputError, match=r"^gears must be a GearDesign or a GearPair"):
        gc.operating_map(gc.MeshModel(), "500:1500:2", "10:20:2")


@pytest.mark.parametrize(("speed", "torque", "message"), [
    ("omega=1:2:3", "1:2:3", r"^speed must be an axis of speed; got 'omega'"),
    ("500", "1:2:3", r"^speed must read start:stop:count"),
    ("1:2:3", "2:1:3", r"^axis torque must run from a smaller"), ("0:100:3", "1:2:3", r"^speed must be greater than 0"),
])
def test_axes_of_a_map_that_are_wrong_are_refused(pair, speed, torque, message):
    with pytest.raises(InputError, match=message):
        gc.operating_map(pair, speed, torque)


def test_axes_that_set_the_same_parameter_are_refused(pair):
    with pytest.raises(InputError, match="must be two different parameters"):
        gc.zones(pair, "speed=500:1500:2", "omega=1:2:2")
    with pytest.raises(InputError, match="must be two different parameters"):
        gc.zones(pair, "q0=0.1:0.2:2", "torque=1:2:2")


@pytest.fixture(scope="module")
def found(pair):
    return gc.operating_map(pair, "3000:23000:5", "20:250:4", settings=SHORT)


def test_a_cell_of_the_map_is_the_regime_there(found, model):
    for i, j in ((0, 0), (2, 3), (3, 4)):
        at = {"speed": found["speed"].values[j], "torque": found["torque"].values[i]}
        point = model.with_values(at)
        verdict, cell = gc.regime(point, settings=SHORT), found.isel(torque=i, speed=j)
        assert motions(cell["label"], cell["period"]) == [verdict.label]
        assert float(cell["lyapunov"]) == verdict.lyapunov[0] * point.gears.scales.rate
        assert float(cell["omega"]) == point.omega and float(cell["q0"]) == point.q1


def test_a_map_is_that_of_zones_in_physical_units(found, pair):
    x, y = "speed=3000:23000:5", "torque=20:250:4"
    zones = gc.zones(pair, x, y, settings=SHORT)
    scaled = gc.physical(zones)
    assert scaled.identical(gc.physical(zones, pair))
    for name in scaled.data_vars:
        assert scaled[name].identical(found[name].drop_vars(["omega", "q0", "mesh_frequency"], errors="ignore"))
    assert found["speed"].attrs["units"] == "rpm" and found["torque"].attrs["units"] == "N*m"
    assert found["v_rms"].attrs["units"] == "mm/s" and dict(found.sizes) == {"torque": 4, "speed": 5}
    assert found["mesh_frequency"].values[0] == 25 * 3000 / 60


def test_a_store_over_speed_and_torque_records_the_gears(pair, tmp_path):
    study = gc.Zones(pair, "speed=3000:23000:4", "torque=20:250:3", settings=SHORT)
    record = to_record(study)
    assert json.loads(json.dumps(record))["gears"]["pair"]["n1"] == 25
    assert from_record(record) == study and isinstance(from_record(record).model, OperatingModel)
    gc.run(study, out=tmp_path / "s.zarr", tile=4)
    assert open_store(tmp_path / "s.zarr").dataset().identical(study.run())
    other = gc.Zones(pair.at(torque=1.0), "speed=3000:23000:4", "torque=20:250:3", settings=SHORT)
    with pytest.raises(InputError, match=r"gears\.pair\.M10"):
        gc.run(other, out=tmp_path / "s.zarr")


def test_plot_and_export_take_the_units_of_the_gears(pair, tmp_path):
    store = tmp_path / "s.zarr"
    gc.run(gc.Zones(pair, "speed=3000:23000:4", "torque=20:250:3", settings=SHORT), out=store)
    for command in (("export", store, "--out", tmp_path / "s.nc"), ("plot", store, "--out", tmp_path / "s.png")):
        result = CliRunner().invoke(app, [*map(str, command), "--physical"])
        assert result.exit_code == 0, result.stderr
    assert gc.load(tmp_path / "s.nc")["v_rms"].attrs["units"] == "mm/s"
    gc.save(gc.zones(gc.MeshModel(), "omega=1:2:2", "q0=0:0.1:2", settings=SHORT), tmp_path / "z.nc")
    result = CliRunner().invoke(app, ["plot", str(tmp_path / "z.nc"), "--physical"])
    assert result.exit_code == 2 and "--physical needs a result over speed or torque" in result.stderr


def test_the_record_of_a_study_over_other_axes_is_as_before(pair):
    assert "gears" not in to_record(gc.Zones(pair, "omega=1:2:3", "q0=0:0.1:3"))


def test_sweeps_and_diagrams_over_speed_and_torque(pair):
    swept = gc.bifurcation(pair, "speed=9000:9600:3", points=2, mode="up", settings=SHORT)
    assert swept["speed"].attrs["units"] == "rpm" and "pair" in json.loads(swept.attrs["gears"])
    found = gc.attractors(pair, 2, sweep="torque=60:110:3", settings=SHORT)
    assert int(found["attractor_up"]) >= -1
    with pytest.raises(InputError, match=r"sweep torque must run from below to above the model's value 85"):
        gc.attractors(pair, 2, sweep="torque=90:110:3")
