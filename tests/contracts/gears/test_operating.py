"""Speed and torque of given gears as parameters: of a model, on the axes of studies, in stores, in physical units."""

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.gears.design import drawing
from gearchaos.gears.io.units import RPM, SPEED, to_si
from gearchaos.gears.operation import operating
from gearchaos.gears.operation.operating import OperatingModel, operating_model
from gearchaos.model import vary
from gearchaos.store.record import from_record, to_record
from gearchaos.store.store import open_store
from gearchaos.studies import motions
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.commands import ask

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
    there = replace(pair, M10=120.0, M20=None, speed="9000 rpm")
    found = operating_model(pair, kind).with_values({"speed": 9000, "torque": 120})
    assert found == operating_model(there, kind) and found.value("speed") == 9000 and found.value("torque") == 120
    assert found.value("q0") == there.to_model().q1 and found.set_by("torque") == ("q1", "q2")


def test_an_unbalanced_torque_keeps_its_ratio(pair):
    braked = replace(pair, M20=pair.M20 * 0.5)
    assert math.isclose(braked.at(torque=2 * braked.M10).M20, 2 * braked.M20, rel_tol=1e-15)
    with pytest.raises(InputError, match="M20 must be 0 where M10 is"):
        replace(pair, M10=0.0, M20=3.0).at(torque=10.0)


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
    with pytest.raises(InputError, match="pair must be a GearPair, a GearDesign or a Train"):
        gc.physical(gc.regime(gc.MeshModel(), settings=SHORT).to_dataset())


@pytest.mark.parametrize(("speed", "torque", "message"), [
    ("omega=1:2:3", "1:2:3", r"^speed must be an axis of speed; got 'omega'"),
    ("500", "1:2:3", r"^speed must read start:stop:count"),
    ("1:2:3", "2:1:3", r"^torque must run from a smaller"), ("0:100:3", "1:2:3", r"^speed must be greater than 0"),
])
def test_axes_of_a_map_that_are_wrong_are_refused(pair, speed, torque, message):
    with pytest.raises(InputError, match=message):
        gc.operating_map(pair, speed, torque)


def test_of_a_long_axis_of_torques_few_gears_are_made_before_any_work(pair, monkeypatch):
    made, point = [], operating._point
    monkeypatch.setattr(operating, "_point", lambda gears, torque: made.append(torque) or point(gears, torque))
    gc.Zones(pair, "speed=500:8000:4", "torque=20:400:31623")
    torques = set(made) - {None}
    assert 100 < len(torques) < 300 and {20.0, 400.0} < torques


def test_axes_that_set_the_same_parameter_are_refused(pair):
    for axes in (("speed=500:1500:2", "omega=1:2:2"), ("q0=0.1:0.2:2", "torque=1:2:2")):
        with pytest.raises(InputError, match="must be two different parameters"):
            gc.zones(pair, *axes)


@pytest.fixture(scope="module")
def found(pair):
    return gc.operating_map(pair, "3000:23000:5", "20:250:4", settings=SHORT)


def test_a_cell_of_the_map_is_the_regime_there(found, model):
    for i, j in ((0, 0), (2, 3), (3, 4)):
        point = model.with_values({"speed": found["speed"].values[j], "torque": found["torque"].values[i]})
        verdict, cell = gc.regime(point, settings=SHORT), found.isel(torque=i, speed=j)
        assert motions(cell["label"], cell["period"]) == [verdict.label]
        assert float(cell["lyapunov"]) == verdict.lyapunov[0] * point.gears.scales.rate
        assert float(cell["v_rms"]) == pytest.approx(verdict.v_rms * point.gears.scales.velocity * 1e3, rel=1e-12)
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


@pytest.fixture(scope="module")
def stored(pair, tmp_path_factory):
    """A study over speed and torque, and its store."""
    study = gc.Zones(pair, "speed=3000:23000:4", "torque=20:250:3", settings=SHORT)
    path = tmp_path_factory.mktemp("operating") / "s.zarr"
    gc.run(study, out=path, tile=4)
    return study, path


def test_a_store_over_speed_and_torque_records_the_gears(pair, stored):
    study, path = stored
    record = to_record(study)
    assert json.loads(json.dumps(record))["gears"]["pair"]["n1"] == 25
    assert from_record(record) == study and isinstance(from_record(record).model, OperatingModel)
    assert gc.load(path).identical(study.run())
    with pytest.raises(InputError, match=r"gears\.pair\.M10"):
        gc.run(gc.Zones(pair.at(torque=1.0), study.x, study.y, settings=SHORT), out=path)
    assert "gears" not in to_record(gc.Zones(pair, "omega=1:2:3", "q0=0:0.1:3"))


@pytest.mark.slow
def test_plot_and_export_take_the_units_of_the_gears(stored, tmp_path):
    store = stored[1]
    for command in (("export", store, "--out", tmp_path / "s.nc"), ("plot", store, "--out", tmp_path / "s.png")):
        assert ask(*command, code=0).stderr.count("dimensionless; --physical gives them in µm, mm/s, N") == 1
        assert "dimensionless" not in ask(*command, "--physical", code=0).stderr
    assert gc.load(tmp_path / "s.nc")["v_rms"].attrs["units"] == "mm/s"
    gc.save(gc.zones(gc.MeshModel(), "omega=1:2:2", "q0=0:0.1:2", settings=SHORT), tmp_path / "z.nc")
    for file in ("s.nc", "z.nc"):
        assert "dimensionless" not in ask("plot", tmp_path / file).stderr
    refused = ask("plot", tmp_path / "z.nc", "--physical", code=2).stderr
    assert "--physical needs the result of a study of gears" in refused


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


SOFT = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, speed="3000 rpm",
    torque="50 N*m", backlash={"value": "0.12 mm", "of": "line of action, total"})
"""Gears whose stiffness depends on the torque."""


def test_the_torque_of_gears_whose_stiffness_depends_on_it_stays_theirs():
    model = operating_model(SOFT)
    changed = model.with_values({"omega": 2 * model.omega, "q0": 2 * model.q1})
    assert changed.value("speed") == pytest.approx(6000, rel=1e-13)
    assert changed.value("torque") == pytest.approx(100, rel=1e-13)
    there = changed.operating_gears
    assert there.torque == 50 and there.speed == pytest.approx(6000, rel=1e-13)
    assert there.to_pair().scales == SOFT.to_pair().scales != SOFT.at(torque=100).to_pair().scales
    stiff = operating_model(replace(SOFT, stiffness="potential energy"))
    assert stiff.with_values({"q0": 2 * stiff.q1}).operating_gears.torque == pytest.approx(100, rel=1e-13)
    for torque in (0.0, -stiff.q1):
        assert stiff.with_values({"q0": torque}).value("torque") == pytest.approx(50 * torque / stiff.q1, abs=1e-12)
    assert stiff.with_values({"q0": -stiff.q1}).operating_gears.torque == 50


def test_a_sweep_ends_at_the_speed_or_torque_of_the_model(model, pair):
    changed = model.with_values({"omega": 0.5})
    speed = changed.value("speed")
    for gears, inside, beside in (
            (changed, gc.Axis("speed", 0.9 * speed, 1.1 * speed, 3), gc.Axis("speed", 0.9 * 14000, 1.1 * 14000, 3)),
            (pair, "torque=60:110:3", "torque=90:110:3")):
        assert int(gc.attractors(gears, 2, sweep=inside, settings=SHORT)["attractor_up"]) >= -1
        with pytest.raises(InputError, match="must run from below to above the model's value"):
            gc.attractors(gears, 2, sweep=beside, settings=SHORT)


def test_a_full_model_of_a_rigid_pair_needs_its_supports(pair):
    rigid = operating_model(replace(pair, k1=0.0, k2=0.0, **dict.fromkeys(("m1", "m2", "c1", "c2"))))
    assert rigid.kind == "torsional"
    with pytest.raises(InputError, match="kind must be torsional or single where the supports are rigid") as refusal:
        rigid.with_values({"kind": "full"})
    assert "supports to a GearDesign" in refusal.value.advice
    values = {"kind": "full", "mu": 4.0, "zeta_support": 0.01}
    with pytest.raises(InputError, match="kind"):
        rigid.with_values({**values, "kappa1": 0.5})
    assert rigid.with_values({**values, "kappa": 0.5}).kappa2 == 0.5
    supported = operating_model(pair, "torsional").with_values({"kind": "full"})
    assert supported.parameters() == operating_model(pair).parameters() and supported.mu1 == pair.m1 / pair.mass


STUDIES = {
    "regime": lambda pair: gc.Regime(pair, settings=SHORT), "simulate": lambda pair: gc.Simulate(pair, 3, samples=4),
    "attractors": lambda pair: gc.Attractors(pair, 3, settings=SHORT),
    "bifurcation": lambda pair: gc.Bifurcation(pair, "speed=9000:9600:3", points=2, mode="up", settings=SHORT),
    "zones": lambda pair: gc.Zones(pair, "omega=1:2:2", "eps1=0:0.1:2", settings=SHORT),
    "basins": lambda pair: gc.Basins(operating_model(pair, "torsional"), "x1=-1:1:3", "x1_dot=-1:1:3", settings=SHORT),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_results_carry_their_gears_and_are_scaled_by_them(pair, tmp_path, name):
    gc.run(STUDIES[name](pair), out=tmp_path / "s.zarr")
    found = gc.load(tmp_path / "s.zarr")
    scaled = gc.physical(found)
    assert scaled.identical(gc.physical(found, pair)) and "mm/s" in {v.attrs.get("units") for v in scaled.values()}
    assert name != "bifurcation" or scaled["speed"].attrs["units"] == "rpm"
    with pytest.raises(InputError, match="pair must be the gears of the result"):
        gc.physical(found, replace(pair, backlash=2 * pair.backlash))
    gc.save(found, tmp_path / "f.nc")
    assert gc.physical(gc.load(tmp_path / "f.nc")).identical(scaled)


def test_a_verdict_carries_its_gears(pair):
    changed = operating_model(pair).with_values({"omega": 1.5})
    verdict = gc.regime(changed, settings=SHORT)
    scaled, scales = gc.physical(verdict.to_dataset()), pair.scales
    assert float(scaled["v_rms"]) == pytest.approx(verdict.v_rms * scales.velocity * 1e3, rel=1e-14)
    recorded = json.loads(scaled.attrs["gears"])["pair"]["speed"]
    assert recorded * RPM * pair.n1 / pair.omega0 == pytest.approx(1.5, rel=1e-14)
    assert gc.Regime(changed, settings=SHORT).run().identical(verdict.to_dataset())


def test_gears_whose_torque_cannot_be_varied_scale_their_results(pair):
    idle = replace(pair, M10=0.0, M20=3.0)
    of_idle, of_soft = gc.simulate(operating_model(idle).with_values({"omega": 1.5}), 2), gc.simulate(SOFT, 2)
    for found, gears in ((of_idle, idle), (of_soft, SOFT.at(torque=100.0))):  # in the units of its own torque
        assert gc.physical(found, gears).identical(gc.physical(found))


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
    found = gc.regime(gc.MeshModel(), settings=SHORT).to_dataset()
    given = json.loads(found.attrs["settings"])["classification"]
    assert Classification(**given | {"transient_lengths": tuple(given["transient_lengths"])}) == SHORT
    for name, make in STUDIES.items():
        of_study = json.loads(make(pair).provenance()["settings"]).get("classification")
        assert of_study == (None if name == "simulate" else given)
    default = json.loads(gc.Regime(gc.MeshModel()).provenance()["settings"])["classification"]
    assert default["longest_transient"] == 20_000


def test_units_of_a_dropped_torque():
    zones = gc.zones(SOFT, "speed=1000:3000:2", "torque=3:60:3", settings=SHORT)
    assert gc.physical(zones.isel(torque=2))["v_rms"].identical(gc.physical(zones)["v_rms"].isel(torque=2))
    for dropped in (zones.isel(torque=2, drop=True), zones[["v_rms"]].mean("torque", keep_attrs=True)):
        with pytest.raises(InputError, match="must have the coordinate torque"):
            gc.physical(dropped)


def test_supports_at_another_torque():
    model = operating_model(replace(SOFT, supports={"stiffness": "200 N/um", "damping_ratio": 0.02}), "torsional")
    at_once = model.with_values({"kind": "full", "torque": 3})
    assert at_once == model.with_values({"torque": 3}).with_values({"kind": "full"})
    assert at_once == model.with_values({"kind": "full"}).with_values({"torque": 3})


@pytest.mark.parametrize("study", [
    lambda: gc.operating_map(SOFT, "1000:200000:3", "20:60:2"), lambda: gc.bifurcation(SOFT, "speed=1000:200000:3"),
    lambda: gc.zones(SOFT, "speed=1000:200000:3", "torque=20:60:2")])
def test_last_speed_of_an_axis(study):
    with pytest.raises(InputError, match="must keep the pitch line velocity below 300 m/s; got 200000"):
        study()


def test_store_with_a_table_that_changed(tmp_path):
    path = tmp_path / "te.csv"
    path.write_text("order,peak [um],phase [deg]\n1,5,0\n")
    design = replace(SOFT, transmission_error={"orders": str(path)})
    gc.run(gc.Zones(design, "speed=1000:3000:2", "torque=30:60:2", settings=SHORT), out=tmp_path / "store")
    path.write_text("order,peak [um],phase [deg]\n1,6,0\n")
    for cached in (drawing._file_error, operating._point):  # as in a new process
        cached.cache_clear()
    with pytest.raises(InputError, match=r"te\.csv changed since") as caught:
        open_store(tmp_path / "store")
    assert "damaged" not in str(caught.value)
