"""A design on its way from a study file to a model, a datasheet and a map."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.quantities import datasheet
from gearchaos.dynamics import Classification
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.operating import gears_from_json, gears_json, operating_model
from gearchaos.gears.transmission_error.tip_relief import from_tip_relief
from gearchaos.model import vary
from gearchaos.studies import motions
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES
from tests.commands import ask, refused, run_json

SPUR, ISO, FZG = (EXAMPLES / f"{n}.toml" for n in ("spur_50_50", "iso_tr_6336_30_example_1", "fzg_type_c"))
SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)


def sheet(path, *arguments):
    return run_json("gear", path, *arguments)


def written(tmp_path, text="", operation=""):
    """A study file with the 50/50 pair, some keys of [design] added, and another [operation]."""
    path = tmp_path / "design.toml"
    body, _, _ = SPUR.read_text().partition("[operation]")
    path.write_text(f"{body}\n{text}\n{operation}")
    return path


def test_the_datasheet_has_the_numbers_of_iso_tr_6336_30():
    document = sheet(ISO)
    found, pairs = document["quantities"], ("virtual_teeth", "tip_diameter", "base_diameter", "masses", "inertias")
    expected = {"single_stiffness_theoretical": (17.85584, 1e-6), "single_stiffness": (12.37047, 1e-4),
                "mesh_stiffness": (17.46485, 1e-4), "overlap_ratio": (1.08337, 1e-5), "velocity": (2.664, 1e-4),
                "tangential_force": (127_352, 1e-5), "contact_ratio": (1.5491, 1e-5),
                "working_pressure_angle": (21.0661, 1e-6)}
    for name, (value, tolerance) in expected.items():
        assert found[name]["value"] == pytest.approx(value, rel=tolerance), name
    assert found["virtual_teeth"]["value"] == pytest.approx([18.905, 114.543], abs=5e-4)
    assert found["Kv_ISO_B"]["value"] == pytest.approx(1.003, abs=3e-3)
    assert found["mesh_stiffness"]["unit"] == "N/(mm µm)" and found["resonance_speed"]["unit"] == "rpm"
    assert found["Kv_AGMA"]["value"] is None and "Q_v" in found["Kv_AGMA"]["reason"]
    for name, entry in found.items():
        assert set(entry) - {"reason"} == {"value", "unit", "symbol", "formula", "source"}, name
        assert entry["formula"] and entry["source"] and (entry["value"] is None) == ("reason" in entry), name
    assert document["model"] is not None and all(len(found[name]["value"]) == 2 for name in pairs)


@pytest.mark.slow
def test_the_printed_datasheet_shows_the_same_numbers_and_the_assumption_of_the_transmission_error():
    (warning,), shown = sheet(SPUR)["warnings"], ask("gear", SPUR, "--all", "--speed", "9000:9500:2")
    text = " ".join(shown.stdout.split())
    assert "1.75467" in text and "ISO 6336-1:2006" in text and "Kasuba and Evans" in text
    assert warning.startswith("The accuracy grade gives no transmission error") and "assumption" in warning
    assert warning in " ".join(shown.stderr.split())
    assert sheet(SPUR, "--set", "design.transmission_error=none")["warnings"] == []


@pytest.mark.slow
def test_the_page_of_a_datasheet_is_written(tmp_path):
    page, scan = tmp_path / "sheet.html", ("--speed", "1000:1020:2")
    assert "mesh_stiffness" in sheet(FZG, "--out", page, *scan)["quantities"]
    text = page.read_text(encoding="utf-8")
    for words in ("Spur gear pair 16/24, module 4.5 mm", "<svg", "damping ratio of the mesh",
                  "Dynamic factor along the speed"):
        assert words in text
    assert "--out must end in .html" in refused("gear", FZG, "--out", tmp_path / "sheet.pdf")
    assert "--speed must read start:stop or start:stop:count" in refused("gear", FZG, "--out", page, "--speed", "1000")


def test_a_missing_input_is_named_where_a_quantity_needs_it(tmp_path):
    complete, keys = written(tmp_path), ("bore", "quality", "damping_ratio", "backlash", "transmission_error")
    assert sheet(complete)["model_reason"].startswith("speed and torque must be given")
    path = tmp_path / "few.toml"
    path.write_text("\n".join(line for line in complete.read_text().splitlines() if not line.startswith(keys)))
    found = sheet(path)
    missing = {n: e["reason"] for n, e in found["quantities"].items() if e["value"] is None}
    for name, input_name in {"masses": "bore", "Kv_ISO_B": "quality", "damping_ratio": "damping_ratio",
                             "backlash_line_of_action": "backlash", "velocity": "speed"}.items():
        assert missing[name].startswith(f"{input_name} must be given"), (name, missing[name])
    assert found["model"] is None and "contact_ratio" not in missing


def test_the_pair_of_a_design_has_its_values():
    design = load_design(SPUR, {"design.load_sharing": "prescribed"})
    pair, geometry = design.to_pair(), design.geometry
    assert (pair.n1, pair.R1, pair.M10, pair.speed) == (50, geometry.base_diameter[0] / 2, 100.0, 3000.0)
    assert pair.c0 == design.tooth_stiffness.mesh_stiffness * 0.02 and pair.backlash == pytest.approx(1.2e-4, rel=1e-15)
    model = design.to_model()
    assert model.zeta == pytest.approx(0.05, rel=1e-14) and model.kind == "torsional"
    assert model.stiffness.contact_ratio == geometry.contact_ratio
    levels = 1 + model.stiffness.chi1, 1 - model.stiffness.chi2
    assert levels[0] / levels[1] == pytest.approx(1.75, rel=1e-14)
    share = geometry.contact_ratio - 1
    assert share * levels[0] + (1 - share) * levels[1] == pytest.approx(1, rel=1e-14)
    supported = replace(design, supports={"stiffness": ["200 N/um", "300 N/um"], "damping_ratio": 0.02}).to_pair()
    assert supported.c2 == 3e8 and supported.k1 == pytest.approx(0.04 * math.sqrt(2e8 * supported.m1), rel=1e-14)


def test_the_torque_changes_the_stiffness_below_100_n_per_mm():
    design = load_design(SPUR)
    full, half = design.at(torque=300.0), design.at(torque=75.0)  # 200 and 50 N/mm
    assert full.to_pair().c0 == design.at(torque=150.0).to_pair().c0
    assert half.to_pair().c0 == pytest.approx(full.to_pair().c0 * 0.5**0.25, rel=1e-14)
    without_speed = datasheet(replace(half, speed=None))
    assert without_speed["load_factor"].value == pytest.approx(0.5**0.25, rel=1e-14)
    assert without_speed["tangential_force"].value == pytest.approx(1000, rel=1e-14)
    assert without_speed["velocity"].reason.startswith("speed must be given")
    with pytest.raises(InputError, match=r"^torque must be greater than 0 for a mesh stiffness by ISO 6336-1"):
        design.at(torque=0.0).to_pair()
    energy = replace(design, stiffness="potential energy")
    assert energy.at(torque=0.0).to_pair().c0 == energy.at(torque=300.0).to_pair().c0


def test_tip_relief_is_added_to_the_error_of_the_grade():
    design = replace(load_design(SPUR), helix_angle="12 deg", centre_distance=None, load_sharing="prescribed")
    relieved = replace(design, tip_relief={"amount": "20 um", "start_diameter": "155 mm"})
    one, both = design.error_harmonics, relieved.error_harmonics
    tau = np.linspace(0, 1, 50)
    relief = from_tip_relief(relieved.geometry, relieved.path_relief)
    assert np.allclose(both.at(tau), one.at(tau) + relief.at(tau), rtol=0, atol=1e-18)
    with pytest.raises(InputError, match=r"^tip_relief.start_diameter must be given"):
        _ = replace(design, tip_relief="20 um").error_harmonics


@pytest.mark.parametrize("path", [SPUR, ISO, FZG], ids=lambda path: path.stem)
def test_a_design_is_made_again_from_its_json(path):
    again, design = gears_from_json(gears_json(load_design(path))), load_design(path)
    assert again == design and hash(again) == hash(design)


@pytest.fixture(scope="module")
def found():
    design = replace(load_design(SPUR), speed=None, torque=None)
    return gc.operating_map(design, "1000:6000:4", "40:400:3", settings=SHORT)


def test_a_cell_of_a_map_is_the_regime_there_in_the_scales_of_its_torque(found):
    model = operating_model(load_design(SPUR))
    for i, j in ((0, 0), (2, 3)):
        cell = found.isel(torque=i, speed=j)
        point = model.with_values({"speed": float(cell["speed"]), "torque": float(cell["torque"])})
        verdict, scales = gc.regime(point, settings=SHORT), point.gears.to_pair().scales
        assert motions(cell["label"], cell["period"]) == [verdict.label]
        assert float(cell["lyapunov"]) == verdict.lyapunov[0] * scales.rate
        assert float(cell["v_rms"]) == pytest.approx(verdict.v_rms * scales.velocity * 1e3, rel=1e-12)
        assert float(cell["omega"]) == point.omega and float(cell["q0"]) == point.q1
    rates = [load_design(SPUR).at(torque=t).to_pair().omega0 for t in found["torque"].values]
    assert rates[0] < 0.95 * rates[1]
    assert np.allclose(found["omega"].values[:, 0], 50 * 1000 * RPM / np.array(rates), rtol=1e-14)
    assert found["z_rms"].dtype == np.float32


def test_the_command_map_writes_what_python_computes(found, tmp_path):
    path, out = written(tmp_path, "", "[classification]\nlongest_transient = 800\ndoublings = 1\n"
                        "averaging_periods = 16\n"), tmp_path / "map.nc"
    said = run_json("map", path, "--speed", "1000:6000:4", "--torque", "40:400:3", "--out", out, "--plot",
                    tmp_path / "map.png")
    assert [(a["name"], a["units"]) for a in said["axes"]] == [("speed", "rpm"), ("torque", "N*m")]
    assert sum(said["cells"].values()) == 12 and (tmp_path / "map.png").stat().st_size > 10_000
    saved = gc.load(out)
    for name in found.data_vars:
        assert np.array_equal(saved[name].values, found[name].values, equal_nan=True), name


@pytest.mark.parametrize(("path", "arguments", "message"), [
    (SPUR, ("--torque", "0:2:2"), "torque must be greater than 0 for a mesh stiffness"),
    (SPUR, ("--set", "design.module=3"), "module must lie between"),
    (SPUR, ("--load-change", "none", "--starts", "4"), "must be a number with --starts; got 'none'. Leave out both"),
    (SPUR, ("--load-change", "reversal"), "--load-change must be a number or none; got 'reversal'. The load is"),
    (SPUR, ("--load-change", "none", "--torque", "0:2:2"), "torque must be greater than 0 for a mesh stiffness"),
    (SPUR, ("--set", "design.quality.grade=13"), "quality.grade must be"),
    (SPUR, ("--set", "gearpair.n1=3"), "gearpair.n1 needs a study file"),
    (EXAMPLES / "fig06.toml", (), "needs a study file with a table [gearpair], [design] or [train]")])
def test_bad_input_of_a_map_is_refused(path, arguments, message, tmp_path):
    assert message in refused("map", path, "--speed", "500:600:2", "--torque", "1:2:2", *arguments, "--out",
                              tmp_path / "m.nc")


@pytest.mark.parametrize(("command", "text", "operation", "message"), [
    ("gear", "colour = 1", "", "[design] must have no key but"),
    ("gear", "[model]\nomega = 1.0", "", "[model] must be left out beside [design]"),
    ("gear", "[gearpair]\nn1 = 3", "", "gearpair"), ("regime", "", "", "torque must be given"),
    ("regime", "", '[operation]\nspeed = "3000 rpm"\n', "torque must be given")])
def test_a_design_that_is_wrong_is_refused(command, text, operation, message, tmp_path):
    assert message in refused(command, written(tmp_path, text, operation))


def test_operation_without_design_is_refused(tmp_path):
    path = tmp_path / "o.toml"
    path.write_text('[operation]\nspeed = "3 rpm"\n')
    assert "[operation] must be left out without [design]" in refused("regime", path)
    assert "study file must have a table [design]" in refused("gear", EXAMPLES / "physical_pair.toml")


def test_a_table_is_found_beside_the_study_file(tmp_path, monkeypatch):
    (tmp_path / "inner").mkdir()
    rows = "fraction, level [N/um]\n0, 300\n0.25, 200\n0.5, 250\n0.75, 150\n"
    (tmp_path / "inner" / "steps.csv").write_text(rows)
    path = written(tmp_path / "inner", "stiffness = { table = 'steps.csv' }", '[operation]\nspeed="1 rpm"\ntorque=9\n')
    monkeypatch.chdir(tmp_path)
    model = load_study(path).model
    assert isinstance(model.stiffness, gc.SteppedStiffness) and model.stiffness.starts == (0.0, 0.25, 0.5, 0.75)
    assert np.allclose(np.array(model.stiffness.levels) * 225, (300, 200, 250, 150), rtol=1e-14)
    assert model.gears.to_pair().c0 == pytest.approx(225e6, rel=1e-14)


def test_values_set_over_a_design():
    design = load_design(SPUR, {"design.quality.grade": 8, "speed": "100 rpm", "design.backlash.value": "0.2 mm"})
    assert design.quality.grade == 8 and design.speed == 100.0
    assert design.backlash_line_of_action == pytest.approx(2e-4, rel=1e-14)
    with pytest.raises(InputError, match=r"^omega must be a value of \[design\]"):
        load_design(SPUR, {"omega": 1.0})
    study = load_study(SPUR, {"torque": 250.0, "zeta": 0.1})
    assert study.pair.M10 == 250.0 and study.model.zeta == 0.1


def test_the_datasheet_does_not_depend_on_which_wheel_drives():
    design = load_design(FZG)
    turned = replace(design, **{n: getattr(design, n)[::-1] for n in ("teeth", "face_width", "profile_shift", "bore",
                                                                    "tip_diameter", "material")},
                     torque=design.torque * 24 / 16, speed=design.speed * 16 / 24)
    one, other = datasheet(design), datasheet(turned)
    for name in ("contact_ratio", "single_stiffness", "mesh_stiffness", "equivalent_mass", "Kv_ISO_B", "Kv_ISO_C",
                 "line_load", "velocity", "theoretical_backlash"):
        assert one[name].value == pytest.approx(other[name].value, rel=1e-9), name
    assert one["base_diameter"].value == other["base_diameter"].value[::-1]


def test_a_value_set_on_the_model_stays_at_every_torque_but_for_those_that_the_torque_sets():
    design = replace(load_design(SPUR), supports={"stiffness": "200 N/um", "damping_ratio": 0.02})
    own = operating_model(design)
    changed = own.with_values({"zeta": 0.2, "kappa1": 9.0, "q1": 0.5})
    values = vary(own, {"torque": [20.0, 50.0, 300.0]}), vary(changed, {"torque": [20.0, 50.0, 300.0]})
    assert np.ptp(values[0]["kappa1"]) > 0.1 and values[1]["kappa1"] == 9.0 and values[1]["zeta"] == 0.2
    for name in ("kappa2", "q1"):
        assert np.array_equal(values[0][name], values[1][name])
    assert values[0]["q1"].tolist() == [design.at(torque=torque).to_model().q1 for torque in (20.0, 50.0, 300.0)]


def test_units_follow_the_torque_where_the_stiffness_does(tmp_path):
    out, design = tmp_path / "z.nc", load_design(SPUR)
    ask("zones", SPUR, "--axis", "speed=1000:3000:2", "--axis", "torque=20:200:2", "--physical", "--out", out)
    mapped = gc.operating_map(design, "1000:3000:2", "20:200:2")
    assert np.array_equal(gc.load(out)["v_rms"].values, mapped["v_rms"].values)
    assert gc.physical(mapped) is mapped and gc.physical(mapped, design) is mapped
    for found in (mapped, gc.zones(design, "speed=1000:3000:2", "torque=20:200:2")):
        with pytest.raises(InputError, match=r"^pair must be the gears of the result"):
            gc.physical(found, replace(design, face_width="40 mm"))
    with pytest.raises(InputError, match=r"^dataset must be over speed instead of omega"):
        gc.physical(gc.zones(design, "omega=0.1:0.2:2", "torque=20:200:2"))


TABLES = {
    "stiffness.table": lambda peak: f"fraction, level [N/um]\n0, {peak}00\n0.7, 250\n",
    "transmission_error.orders": lambda peak: f"order,peak [um],phase [deg]\n1,{peak},0\n",
    "transmission_error.table": lambda peak: "roll angle [deg], error [um]\n" + "".join(
        f"{0.18 * i:.2f}, {peak * math.sin(math.pi * i / 20):.6f}\n" for i in range(40))}


@pytest.mark.parametrize("name", TABLES)
def test_a_file_that_was_changed_is_refused(name, tmp_path):
    def read(design):
        return design.mesh_stiffness.reference if field == "stiffness" else design.error_harmonics.amplitudes[0]

    (field, key), rows = name.split("."), TABLES[name]
    file = tmp_path / "k.csv"
    file.write_text(rows(4))
    design = replace(load_design(SPUR), **{field: {key: str(file)}})
    record = gears_json(design)
    file.write_text(rows(8))
    again = gears_from_json(record)
    assert again == design and again != replace(load_design(SPUR), **{field: {key: str(file)}})
    for change in (lambda: None, file.unlink):
        change()
        with pytest.raises(InputError, match=f"^{name} must be the file with which the design was made"):
            read(design)
    file.write_text(rows(4))
    assert read(again) == pytest.approx(355e6 if field == "stiffness" else 4e-6, rel=1e-6)


def test_a_table_over_time_holds_at_its_own_speed(tmp_path):
    file = tmp_path / "k.csv"
    file.write_text("time [ms], level [N/um]\n0, 400\n0.6, 250\n")
    design = replace(load_design(SPUR), stiffness={"table": str(file), "speed": "1000 rpm"})  # 1.2 ms per mesh period
    assert design.to_model().stiffness.starts == pytest.approx((0, 0.5), rel=1e-12)
    assert design.at(speed=1.0).to_model().stiffness == design.to_model().stiffness
    with pytest.raises(InputError, match=r"^stiffness.speed must be given"):
        _ = replace(design, stiffness={"table": str(file)}).mesh_stiffness


@pytest.mark.parametrize("field", ["stiffness", "transmission_error"])
@pytest.mark.parametrize(("value", "message"), [
    ({"table": "a\0b"}, ".* must be a file that can be read"),
    ({"table": "/dev/null"}, ".* must be a file that can be read"), (np.array([1.0, 2.0]), " must be one of"),
], ids=["null", "device", "array"])
def test_what_is_no_table_of_a_file_is_refused(field, value, message):
    with pytest.raises(InputError, match=f"^{field}{message}"):
        replace(load_design(SPUR), **{field: value}).to_pair()


def test_the_advice_on_an_axis_is_for_that_axis():
    with pytest.raises(InputError, match=r"^torque must be an Axis or a text; got 400\.") as refusal:
        gc.operating_map(load_design(SPUR), "speed=500:8000:12", 400)
    assert "E.g. '20:400:150' or Axis('torque', 20, 400, 150); one value alone is '400:400:1'" in str(refusal.value)
    with pytest.raises(InputError, match=r"^speed must be an Axis or a text; got 'a list'\. E\.g\. '500:8000:200'"):
        gc.operating_map(load_design(SPUR), [1, 2], "400:400:1")


def test_a_speed_without_a_unit_is_in_rpm_wherever_it_is_given(tmp_path):
    """The mesh frequency of 50 teeth at 1200 rpm is 1000 Hz."""
    path = tmp_path / "operation.toml"
    path.write_text(SPUR.read_text().replace('"3000 rpm"', "1200").replace('"100 N*m"', "50"))
    pair = load_design(SPUR).at(speed="125.66370614359172 rad/s", torque=50).to_pair()
    found = {
        "at": load_design(SPUR).at(speed=1200, torque=50).to_pair(),
        "replace": replace(load_design(SPUR), speed=1200, torque=50).to_pair(),
        "file": load_design(path).to_pair(), "set": load_design(SPUR, {"speed": 1200, "torque": "50 N*m"}).to_pair(),
        "table": load_design(SPUR, {"operation.speed": 1200, "torque": 50}).to_pair(),
        "study": load_study(SPUR, {"speed": 1200, "torque": "50 N*m"}).pair,
        "text of a study": load_study(SPUR, {"speed": "1200 rpm", "torque": 50}).pair,
        "pair": pair.at(speed=1200), "field": replace(pair, speed=1200), "text": replace(pair, speed="20 turn/s"),
        "parameter": gc.Regime(pair).model.with_values({"speed": 1200}).operating_gears.to_pair(),
        "json": gears_from_json(gears_json(pair.at(speed=1200)))}
    for name, each in found.items():
        assert each.mesh_frequency == pytest.approx(2000 * math.pi, rel=1e-14), name
        assert each.speed == pytest.approx(1200, rel=1e-14) and each.M10 == 50, name
    with pytest.raises(InputError, match="or a plain number in rpm"):
        pair.at(speed="1200 turns")


def test_the_complete_file_of_the_documents_makes_a_model(tmp_path):
    text = (EXAMPLES.parent / "docs" / "gears.md").read_text(encoding="utf-8")
    complete, *_ = re.findall(r"^```toml\n(\[design\]\nteeth.*?)^```", text, re.MULTILINE | re.DOTALL)
    path = tmp_path / "complete.toml"
    path.write_text(complete, encoding="utf-8")
    found = sheet(path)
    assert found["model"] is not None and found["quantities"]["Kv_ISO_B"]["value"] > 1
    assert found["quantities"]["backlash_line_of_action"]["value"] == pytest.approx(0.3, rel=1e-14)


def test_a_study_warns_once_of_its_design():
    exact = load_design(SPUR, {"design.transmission_error": "none", "speed": 3000, "torque": 100})
    with pytest.warns(DesignWarning, match="exact although a quality is given") as caught:
        gc.Regime(replace(exact, transmission_error=None))
    assert len(caught) == 1
    slip = load_design(SPUR, {"design.module": "1 mm", "design.centre_distance": "50 mm", "design.bore": "10 mm"})
    with pytest.warns(DesignWarning, match="velocity is 75 m/s at 28647.9 rpm, unusually high"):
        gc.Regime(slip.at(speed="3000 rad/s", torque=20))


def test_a_map_of_gears_notes_that_1t_may_include_separation(found):
    assert ((found.contact > 0) & (found.period == 1)).any()
    title = gc.plot.zones(found).get_legend().get_title().get_text()
    assert title.replace("\n", " ") == "1T may include separation of the teeth: see --colour contact"
    touching = found.assign(contact=found.contact * 0)
    assert gc.plot.zones(touching).get_legend().get_title().get_text() == ""
