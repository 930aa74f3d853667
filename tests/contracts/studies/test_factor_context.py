"""What stands beside every dynamic factor: where the mesh damping acts, the quasi-static ratio, and the root stress."""

import re
from dataclasses import replace

import pytest

import gearchaos as gc
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.assessment import worst
from gearchaos.datasheet.page import sheet_html
from gearchaos.gears.geometry.root_stress import root_stress
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import DAMPING_LAWS
from gearchaos.studies.operation.factor_context import (
    beside_factors,
    peak_root_stress,
    root_in_words,
    root_of_model,
    words_beside,
)
from tests.commands import ask, refused, run_json
from tests.contracts.model.test_damping_law import DESIGN, PAIR

LOADED = {"kind": "single", "omega": 0.9, "zeta": 0.05, "q0": 0.1, "eps1": 0.05, "chi1": 0.25, "chi2": 0.25}
laws = pytest.mark.parametrize("law", DAMPING_LAWS)


def flat(text):
    return " ".join(text.split())


@pytest.fixture
def design(tmp_path):
    """The path of the file of a design."""
    (tmp_path / "design.toml").write_text(DESIGN)
    return tmp_path / "design.toml"


@laws
def test_of_two_levels_the_ratio_is_that_of_the_stiffnesses(law):
    found = beside_factors(gc.MeshModel.of(**LOADED, damping_law=law))
    assert found == {"mesh damping": DAMPING_LAWS[law].words, "quasi-static ratio": f"{1.25 / 0.75:.3g}"}


@pytest.mark.parametrize(("changes", "varied"), [({"q0": 0.0}, ()), ({}, ("chi1",)), ({"chi0": 0.0}, ())])
def test_no_ratio_is_named_without_load_or_jump_or_where_it_is_varied(changes, varied):
    given = {n: v for n, v in LOADED.items() if not n.startswith("chi") or "chi0" not in changes}
    assert beside_factors(gc.MeshModel.of(**given | changes), varied) == {"mesh damping": "also across the gap"}


@laws
def test_pictures_name_both(law):
    model = gc.MeshModel.of(**LOADED, damping_law=law)
    words = f"mesh damping {DAMPING_LAWS[law].words}, quasi-static ratio 1.67"
    along = gc.bifurcation(model, "omega=0.8:1:3", points=0)
    assert words in flat(gc.plot.response(along, "dynamic_factor").get_ylabel())
    assert "damping" not in gc.plot.response(along, "v_rms").get_ylabel()
    zones = gc.zones(model, "omega=0.8:1:2", "eps1=0:0.1:2")
    assert words in flat(gc.plot.level(zones, "dynamic_factor").figure.axes[-1].get_ylabel())
    varied = gc.bifurcation(model, "chi1=0.1:0.2:3", points=0)
    assert "quasi-static" not in gc.plot.response(varied, "dynamic_factor").get_ylabel()


@laws
def test_the_picture_beside_standards_names_the_law(law, design):
    gears = gc.studyfile.load_design(design, {"damping_law": law})
    ax = gc.plot.dynamic_factor(gc.dynamic_factor(gears, "1000:2000:2", "100 N*m"))
    assert ax.get_legend().get_title().get_text() == f"mesh damping {DAMPING_LAWS[law].words}"
    assert "quasi-static ratio" in [text.get_text() for text in ax.texts]


def test_large_factors_leave_room_for_those_of_the_standards(design):
    found = gc.dynamic_factor(gc.studyfile.load_design(design), "1000:2000:3", "100 N*m")
    for largest, scale in ((20.0, "linear"), (20.1, "log")):
        found["dynamic_factor"][:] = [1.0, float("nan"), largest]
        assert gc.plot.dynamic_factor(found).get_yscale() == scale


@laws
def test_prints_and_cards_name_both(law):
    words, model = DAMPING_LAWS[law].words, gc.MeshModel.of(**LOADED, damping_law=law)
    both = (f"mesh damping {words}", "quasi-static ratio 1.67")
    sets = [part for name, value in (*LOADED.items(), ("damping_law", law)) for part in ("--set", f"{name}={value}")]
    assert f"dynamic factor: {', '.join(both)}" in flat(ask("attractors", "--starts", "4", *sets).stdout)
    assert " ".join(both) in flat(ask("regime", *sets).stdout)
    assert all(each in gc.regime(model)._repr_html_() for each in ("quasi-static ratio", "1.67", words))
    assert (f"0.05 {words}" in model._repr_html_()) == (law != "always")


def test_other_variables_and_results_without_a_model_have_nothing_beside():
    along = gc.bifurcation(gc.MeshModel.of(**LOADED), "omega=0.8:1:2", points=0)
    assert words_beside(along, "v_rms") == words_beside(along.drop_attrs(), "dynamic_factor") == []


def test_gears_are_damped_in_contact_and_dimensionless_models_always(design):
    assert gc.studyfile.load_design(design).damping_law == PAIR.damping_law == PAIR.to_model().damping_law == "contact"
    assert gc.MeshModel().damping_law == "always"


def test_a_proof_of_gears_says_what_to_set(design):
    pytest.importorskip("flint")
    design.write_text(DESIGN + "[operation]\nspeed = 1500\ntorque = 100\n")
    said, one_spring = refused("regime", design, "--prove"), ("--set", "design.load_sharing=prescribed")
    assert "stiffness must be one spring for a proof; got 'tooth pairs" in said and " ".join(one_spring) in flat(said)
    said = refused("regime", design, "--prove", *one_spring)
    assert "damping_law must be always for a proof; got 'contact'" in said and "--set damping_law=always" in said
    assert run_json("regime", design, "--prove", *one_spring, "--set", "damping_law=always")["proof"]["proved"]


def test_of_tooth_pairs_the_ratio_is_named_at_one_load_alone():
    pairs = gc.ToothPairStiffness((0.7,), (0.0,), 1.6, 0.1, 0.1)
    model = gc.MeshModel.of(kind="single", q0=0.14, stiffness=pairs)
    assert "quasi-static ratio" in beside_factors(model, ("omega",))
    assert "quasi-static ratio" not in beside_factors(model, ("omega", "q0"))


def nominal(design, torque):
    return [1e-6 * each for each in root_stress(gc.studyfile.load_design(design).geometry, torque)]


def test_the_root_stress_stands_beside_the_factor_of_a_design(design):
    gears, (first, second) = gc.studyfile.load_design(design), nominal(design, 100.0)
    assert peak_root_stress(gears, 100.0, 2.5) == pytest.approx([2.5 * first, 2.5 * second])
    assert peak_root_stress(gears, -200.0, 1.0) == pytest.approx([2 * first, 2 * second])
    for nothing in ((gears, None, 2.0), (gears, 100.0, None), (gears, 100.0, float("nan")), (PAIR, 100.0, 2.0),
                    (None, 100.0, 2.0), (replace(gears, profile_shift=(1.0, 0.0), centre_distance=None, rack={
                        "dedendum": 1.25, "root_radius": 0.0}), 100.0, 2.0)):
        assert peak_root_stress(*nothing) is None and root_in_words(*nothing) == ""
    unlike = replace(gears, teeth=(27, 35))
    stresses = peak_root_stress(unlike, 100.0, 2.0)
    assert stresses[0] > 1.01 * stresses[1]
    assert root_in_words(unlike, 100.0, 2.0) == f" (root {measured(stresses[0], 3)} N/mm²)"
    model = as_model(gears.at(speed=1500, torque=100))
    found = beside_factors(model, factor=2.0)["root stress"]
    assert found == f"{measured(2 * max(first, second), 3)} N/mm², whole force"
    assert root_of_model(model.with_values({"torque": 50.0}), 2.0) == pytest.approx([first, second])
    assert "root stress" not in beside_factors(model) | beside_factors(gc.MeshModel.of(**LOADED), factor=2.0)


def test_prints_of_a_design_have_the_root_stress_at_the_peak(design):
    root, sets = max(nominal(design, 100.0)), ["--set", "speed=1500", "--set", "torque=100"]
    verdict = run_json("regime", design, *sets)
    said = flat(ask("regime", design, *sets).stdout)
    assert f"root stress {measured(verdict['dynamic_factor'] * root, 3)} N/mm², whole force" in said
    assert "root stress" in gc.regime(gc.studyfile.load_design(design, {"speed": 1500, "torque": 100}))._repr_html_()
    said = flat(ask("attractors", design, *sets, "--starts", "4").stdout)
    assert f"dynamic factor: root stress {measured(root, 3)} N/mm² times it, mesh damping" in said


def test_the_largest_factor_of_a_map_has_the_root_stress_at_its_torque(design, tmp_path):
    arguments = ["map", design, "--speed", "1500:1700:2", "--torque", "80:160:2", "--out", tmp_path / "m.nc"]
    largest = run_json(*arguments)["largest"]
    said = flat(ask(*arguments).stdout)
    stress = measured(largest["value"] * max(nominal(design, largest["at"]["torque"])), 3)
    assert f"largest dynamic factor {largest['value']:.4g} (root {stress} N/mm²), at speed" in said


def test_a_run_with_a_torque_that_changes_has_the_root_stress_at_that_of_its_peak(design, tmp_path):
    (tmp_path / "load.csv").write_text("speed [rpm], torque [N m]\n1000, 60\n2000, 200\n")
    sets = ["runup", design, "--speed", "1400:1600", "--duration", "0.3 s", "--torque", tmp_path / "load.csv"]
    most = run_json(*sets)["directions"]["up"]["largest"]
    torque = 60 + 140 * (most["speed"] - 1000) / 1000
    stress, factor = most["dynamic_factor"] * max(nominal(design, torque)), measured(most["dynamic_factor"])
    found = float(flat(ask(*sets).stdout).split(f"dynamic factor up to {factor} (root ")[1].split(" N/mm²")[0])
    assert found == pytest.approx(stress, rel=0.01)


@pytest.mark.slow
def test_an_assessment_and_an_answer_have_the_root_stress_of_each_range(design):
    gears = gc.studyfile.load_design(design)
    found = gc.assess(gears, "1400:1800:6", [100.0], starts=4)
    part, document = found.at[0].largest, found.document()
    stress = measured(part.dynamic_factor * max(nominal(design, 100.0)), 3)
    assert f" is {measured(part.dynamic_factor, 3)} (root {stress} N/mm²), at" in worst(found)
    assert document["avoid"]
    for each in document["avoid"]:
        assert each["root_stress"] == pytest.approx([each["dynamic_factor"] * v for v in nominal(design, 100.0)])
    answer = DesignAnswer.of(gears.at(torque=100.0), found.at[0])
    for each in answer.document()["speeds_to_avoid"]["ranges"]:
        assert each["root_stress"] == pytest.approx([each["dynamic_factor"] * v for v in nominal(design, 100.0)])
    both = "/".join(dict.fromkeys(measured(v, 3) for v in nominal(design, 100.0)))
    assert dict(answer.facts)["load"].endswith(f", root stress {both} N/mm²")
    root = measured(document["avoid"][0]["dynamic_factor"] * max(nominal(design, 100.0)), 3)
    assert re.search(f"<td[^>]*>{root}</td>", sheet_html([answer]))
    at_two = gc.assess(gears, "1400:1800:6", [100.0, 300.0], starts=4)
    light, heavy = (each.largest for each in at_two.at)
    stress = heavy.dynamic_factor * max(nominal(design, 300.0))
    said = f"; the largest root stress {measured(stress, 3)} N/mm², at {heavy.largest_at} rpm and 300 N m"
    assert light.dynamic_factor > heavy.dynamic_factor and said in worst(at_two)
    assert "largest root stress" not in worst(found)
    pair = gc.assess(PAIR, "1400:1800:6", [100.0], starts=4)
    assert "root" not in worst(pair) and all(each["root_stress"] is None for each in pair.document()["avoid"])
