"""Speed and torque of given gears as parameters: of a model, on the axes of studies, in stores, in physical units."""

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.gears import operating
from gearchaos.gears.operating import OperatingModel, operating_model
from gearchaos.gears.units import RPM, SPEED, to_si
from gearchaos.model import vary
from gearchaos.store.record import from_record, to_record
from gearchaos.store.store import open_store
from gearchaos.studies import motions
from gearchaos.studyfile import load_study
from tests import EXAMPLES

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
EXAMPLE = EXAMPLES / "physical_pair.toml"


@pytest.fixture(scope="module")
def pair():
    return load_study(EXAMPLE).pair


@pytest.fixture(scope="module")
def model(pair):
    return operating_model(pair)


def test_a_speed_in_rpm_is_the_same_float_from_a_text_and_from_an_axis():
    for speed in np.random.default_rng(0).uniform(1, 20_000, 300).tolist():
        assert to_si("speed", f"{speed!r} rpm", SPEED) == speed
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


def test_of_a_long_axis_of_torques_few_gears_are_made_before_any_work(pair, monkeypatch):
    made = []
    point = operating._point
    monkeypatch.setattr(operating, "_point", lambda gears, torque: made.append(torque) or point(gears, torque))
    gc.Zones(pair, "speed=500:8000:4", "torque=20:400:31623")
    torques = set(made) - {None}
    assert 100 < len(torques) < 300 and {20.0, 400.0} < torques


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
    assert gc.load(tmp_path / "s.zarr").identical(study.run())
    other = gc.Zones(pair.at(torque=1.0), "speed=3000:23000:4", "torque=20:250:3", settings=SHORT)
    with pytest.raises(InputError, match=r"gears\.pair\.M10"):
        gc.run(other, out=tmp_path / "s.zarr")


@pytest.mark.slow
def test_plot_and_export_take_the_units_of_the_gears(pair, tmp_path):
    store = tmp_path / "s.zarr"
    gc.run(gc.Zones(pair, "speed=3000:23000:4", "torque=20:250:3", settings=SHORT), out=store)
    for command in (("export", store, "--out", tmp_path / "s.nc"), ("plot", store, "--out", tmp_path / "s.png")):
        plain = CliRunner().invoke(app, [*map(str, command)])
        assert plain.exit_code == 0 and plain.stderr.count("dimensionless; --physical gives them in µm, mm/s, N") == 1
        result = CliRunner().invoke(app, [*map(str, command), "--physical"])
        assert result.exit_code == 0 and "dimensionless" not in result.stderr, result.stderr
    assert gc.load(tmp_path / "s.nc")["v_rms"].attrs["units"] == "mm/s"
    assert "dimensionless" not in CliRunner().invoke(app, ["plot", str(tmp_path / "s.nc")]).stderr
    gc.save(gc.zones(gc.MeshModel(), "omega=1:2:2", "q0=0:0.1:2", settings=SHORT), tmp_path / "z.nc")
    assert "dimensionless" not in CliRunner().invoke(app, ["plot", str(tmp_path / "z.nc")]).stderr
    result = CliRunner().invoke(app, ["plot", str(tmp_path / "z.nc"), "--physical"])
    assert result.exit_code == 2 and "--physical needs the result of a study of gears" in result.stderr


def test_the_record_of_a_study_over_other_axes_is_as_before(pair):
    assert "gears" not in to_record(gc.Zones(pair, "omega=1:2:3", "q0=0:0.1:3"))


def test_speed_and_torque_follow_omega_and_q1(pair, model):
    changed = model.with_values({"omega": 1.5, "q0": 0.05})
    assert changed.value("speed") * RPM * pair.n1 / pair.omega0 == pytest.approx(1.5, rel=1e-14)
    assert changed.value("torque") / pair.scales.torque1 == pytest.approx(0.05, rel=1e-14)
    assert (changed.omega, changed.q1, changed.gears) == (1.5, 0.05, pair)
    there = changed.operating_gears
    assert there.speed == pytest.approx(changed.value("speed"), rel=1e-14)
    assert (there.M10, there.scales) == (changed.value("torque"), pair.scales)
    assert model.operating_gears is pair and model.value("speed") == pair.speed
    alone = model.with_values({"q1": 0.05})  # a resisting torque that is not in balance
    assert alone.value("torque") == changed.value("torque") and alone.operating_gears == pair


def test_the_torque_of_gears_whose_stiffness_depends_on_it_stays_theirs():
    design = gc.GearDesign(
        teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, speed="3000 rpm",
        torque="50 N*m", backlash={"value": "0.12 mm", "of": "line of action, total"})
    model = operating_model(design)
    changed = model.with_values({"omega": 2 * model.omega, "q0": 2 * model.q1})
    assert changed.value("speed") == pytest.approx(6000, rel=1e-13)
    assert changed.value("torque") == pytest.approx(100, rel=1e-13)
    there = changed.operating_gears
    assert there.torque == 50 and there.speed == pytest.approx(6000, rel=1e-13)
    assert there.to_pair().scales == design.to_pair().scales != design.at(torque=100).to_pair().scales
    stiff = operating_model(replace(design, stiffness="potential energy"))
    assert stiff.with_values({"q0": 2 * stiff.q1}).operating_gears.torque == pytest.approx(100, rel=1e-13)
    for torque in (0.0, -stiff.q1):
        assert stiff.with_values({"q0": torque}).value("torque") == pytest.approx(50 * torque / stiff.q1, abs=1e-12)
    assert stiff.with_values({"q0": -stiff.q1}).operating_gears.torque == 50


def test_a_sweep_of_the_speed_ends_at_the_omega_that_was_set(model):
    changed = model.with_values({"omega": 0.5})
    speed = changed.value("speed")
    found = gc.attractors(changed, 2, sweep=gc.Axis("speed", 0.9 * speed, 1.1 * speed, 3), settings=SHORT)
    assert int(found["attractor_up"]) >= -1
    with pytest.raises(InputError, match="must run from below to above the model's value"):
        gc.attractors(changed, 2, sweep=gc.Axis("speed", 0.9 * 14000, 1.1 * 14000, 3), settings=SHORT)


def test_a_full_model_of_a_rigid_pair_needs_its_supports(pair):
    values = {"n1": 25, "n2": 50, "I1": 5e-4, "I2": 8e-3, "R1": 0.035, "R2": 0.07, "c0": 4e8, "k": 500.0,
              "backlash": 1.2e-4, "M10": 85.0, "speed": 1466.0}
    rigid = operating_model(gc.GearPair(**values))
    assert rigid.kind == "torsional"
    with pytest.raises(InputError, match="kind must be torsional or single where the supports are rigid") as refusal:
        rigid.with_values({"kind": "full"})
    assert "supports to a GearDesign" in refusal.value.advice
    with pytest.raises(InputError, match="kind"):
        rigid.with_values({"kind": "full", "mu": 4.0, "kappa1": 0.5, "zeta_support": 0.01})
    assert rigid.with_values({"kind": "full", "mu": 4.0, "kappa": 0.5, "zeta_support": 0.01}).kappa2 == 0.5
    supported = operating_model(pair, "torsional").with_values({"kind": "full"})
    assert supported.parameters() == operating_model(pair).parameters() and supported.mu1 == pair.m1 / pair.mass


STUDIES = {
    "regime": lambda pair: gc.Regime(pair, settings=SHORT),
    "simulate": lambda pair: gc.Simulate(pair, 3, samples=4),
    "attractors": lambda pair: gc.Attractors(pair, 3, settings=SHORT),
    "bifurcation": lambda pair: gc.Bifurcation(pair, "eps1=0.1:0.2:3", points=2, settings=SHORT),
    "zones": lambda pair: gc.Zones(pair, "omega=1:2:2", "eps1=0:0.1:2", settings=SHORT),
    "basins": lambda pair: gc.Basins(
        operating_model(pair, "torsional"), "x1=-1:1:3", "x1_dot=-1:1:3", settings=SHORT),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_results_carry_their_gears_and_are_scaled_by_them(pair, tmp_path, name):
    study = STUDIES[name](pair)
    found = study.run()
    scaled = gc.physical(found)
    assert scaled.identical(gc.physical(found, pair)) and "mm/s" in {v.attrs.get("units") for v in scaled.values()}
    with pytest.raises(InputError, match="pair must be the gears of the result"):
        gc.physical(found, replace(pair, backlash=2 * pair.backlash))
    gc.save(found, tmp_path / "f.nc")
    assert gc.physical(gc.load(tmp_path / "f.nc")).identical(scaled)
    gc.run(study, out=tmp_path / "s.zarr")
    assert gc.load(tmp_path / "s.zarr").identical(found)


def test_a_verdict_carries_its_gears(pair):
    changed = operating_model(pair).with_values({"omega": 1.5})
    verdict = gc.regime(changed, settings=SHORT)
    scaled, scales = gc.physical(verdict.to_dataset()), pair.scales
    assert float(scaled["v_rms"]) == pytest.approx(verdict.v_rms * scales.velocity * 1e3, rel=1e-14)
    recorded = json.loads(scaled.attrs["gears"])["pair"]["speed"]
    assert recorded * RPM * pair.n1 / pair.omega0 == pytest.approx(1.5, rel=1e-14)
    assert gc.Regime(changed, settings=SHORT).run().identical(verdict.to_dataset())
    with pytest.raises(InputError, match="pair must be a GearPair, a GearDesign or a Train"):
        gc.physical(gc.regime(gc.MeshModel(), settings=SHORT).to_dataset())


def test_gears_whose_torque_cannot_be_varied_scale_their_results(pair):
    idle = replace(pair, M10=0.0, M20=3.0)
    found = gc.simulate(operating_model(idle).with_values({"omega": 1.5}), 2)
    assert gc.physical(found, idle).identical(gc.physical(found))
    soft = gc.GearDesign(
        teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, speed="3000 rpm",
        torque="50 N*m", backlash={"value": "0.12 mm", "of": "line of action, total"})
    found = gc.simulate(soft, 2)
    assert gc.physical(found, soft.at(torque=100.0)).identical(gc.physical(found))  # in the units of its own torque


def test_the_gears_of_a_store_are_compared_where_it_has_them(pair, tmp_path):
    study = STUDIES["zones"](pair)
    gc.run(study, out=tmp_path / "s.zarr")
    scaled_alike = replace(pair, R1=2 * pair.R1, R2=2 * pair.R2, I1=4 * pair.I1, I2=4 * pair.I2, M10=2 * pair.M10,
                           M20=2 * pair.M20, b1=4 * pair.b1, b2=4 * pair.b2)
    assert operating_model(scaled_alike).parameters() == study.model.parameters()
    with pytest.raises(InputError, match=r"carried_gears\.pair\.R1"):
        gc.run(STUDIES["zones"](scaled_alike), out=tmp_path / "s.zarr")
    gc.run(study, out=tmp_path / "s.zarr")
    assert open_store(tmp_path / "s.zarr").study == study


def test_results_record_their_classification_settings(pair):
    for name, make in STUDIES.items():
        settings = json.loads(make(pair).provenance().get("settings"))
        if name == "simulate":
            assert "classification" not in settings
            continue
        given = settings["classification"]
        assert Classification(**given | {"transient_lengths": tuple(given["transient_lengths"])}) == SHORT
    found = gc.regime(gc.MeshModel(), settings=SHORT).to_dataset()
    assert json.loads(found.attrs["settings"])["classification"]["longest_transient"] == 800
    basins = json.loads(STUDIES["basins"](pair).run().attrs["settings"])
    assert basins["classification"]["doublings"] == 1
    default = json.loads(gc.Regime(gc.MeshModel()).provenance()["settings"])["classification"]
    assert default["longest_transient"] == 20_000


def test_sweeps_and_diagrams_over_speed_and_torque(pair):
    swept = gc.bifurcation(pair, "speed=9000:9600:3", points=2, mode="up", settings=SHORT)
    assert swept["speed"].attrs["units"] == "rpm" and "pair" in json.loads(swept.attrs["gears"])
    found = gc.attractors(pair, 2, sweep="torque=60:110:3", settings=SHORT)
    assert int(found["attractor_up"]) >= -1
    with pytest.raises(InputError, match=r"sweep torque must run from below to above the model's value 85"):
        gc.attractors(pair, 2, sweep="torque=90:110:3")
