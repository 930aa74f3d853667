"""What stands beside every dynamic factor: where the mesh damping acts, and the quasi-static ratio."""

import pytest

import gearchaos as gc
from gearchaos.model import DAMPING_LAWS
from gearchaos.studies.beside_factors import beside_factors, words_beside
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
    assert found == {"mesh damping": DAMPING_LAWS[law], "quasi-static ratio": f"{1.25 / 0.75:.3g}"}


@pytest.mark.parametrize(("changes", "varied"), [({"q0": 0.0}, ()), ({}, ("chi1",)), ({"chi0": 0.0}, ())])
def test_no_ratio_is_named_without_load_or_jump_or_where_it_is_varied(changes, varied):
    given = {n: v for n, v in LOADED.items() if not n.startswith("chi") or "chi0" not in changes}
    assert beside_factors(gc.MeshModel.of(**given | changes), varied) == {"mesh damping": "also across the gap"}


@laws
def test_pictures_name_both(law):
    model = gc.MeshModel.of(**LOADED, damping_law=law)
    words = f"mesh damping {DAMPING_LAWS[law]}, quasi-static ratio 1.67"
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
    assert ax.get_legend().get_title().get_text() == f"mesh damping {DAMPING_LAWS[law]}"
    assert "quasi-static ratio" in [text.get_text() for text in ax.texts]


def test_large_factors_leave_room_for_those_of_the_standards(design):
    found = gc.dynamic_factor(gc.studyfile.load_design(design), "1000:2000:3", "100 N*m")
    for largest, scale in ((20.0, "linear"), (20.1, "log")):
        found["dynamic_factor"][:] = [1.0, float("nan"), largest]
        assert gc.plot.dynamic_factor(found).get_yscale() == scale


@laws
def test_prints_and_cards_name_both(law):
    words, model = DAMPING_LAWS[law], gc.MeshModel.of(**LOADED, damping_law=law)
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
    said = refused("regime", design, "--prove")
    assert "damping_law must be always for a proof; got 'contact'" in said and "--set damping_law=always" in said
    assert run_json("regime", design, "--prove", "--set", "damping_law=always")["proof"]["proved"]


def test_of_tooth_pairs_the_ratio_is_named_at_one_load_alone():
    pairs = gc.ToothPairStiffness((0.7,), (0.0,), 1.6, 0.1, 0.1)
    model = gc.MeshModel.of(kind="single", q0=0.14, stiffness=pairs)
    assert "quasi-static ratio" in beside_factors(model, ("omega",))
    assert "quasi-static ratio" not in beside_factors(model, ("omega", "q0"))
