"""The damping law of the mesh wherever a model is written, read, shown, exported or refused."""

import json
import pickle
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasets import model_from_json, model_json
from gearchaos.errors import InputError
from gearchaos.explorer.core.models import own_model
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.text import as_python, as_toml, from_query, to_query
from gearchaos.gears.operation.operating import gears_from_json, gears_json, operating_model
from gearchaos.model import DAMPING_LAWS
from gearchaos.store.record import differences, from_record, to_record
from gearchaos.studies.speeds.speeds_to_avoid import speeds_to_avoid
from gearchaos.studyfile import load_design, load_study
from tests.commands import ask

SINGLE = {"kind": "single", "omega": 0.9, "zeta": 0.05, "q0": 0.1, "eps1": 0.05}
PAIR = gc.GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1="35 mm", R2="70 mm", c0="400 N/um", k="500 N*s/m",
                   backlash="0.12 mm", M10="85 N*m", speed="14000 rpm", error_amplitudes=["6 um"])
DESIGN = """
[design]
teeth = [50, 50]
module = "3 mm"
face_width = "20 mm"
bore = "30 mm"
damping_ratio = 0.05
backlash = { value = "0.12 mm", of = "line of action, total" }
transmission_error = "none"
"""
LATER = [law for law in DAMPING_LAWS if law != "always"]
laws = pytest.mark.parametrize("law", DAMPING_LAWS)


def with_law(law: str) -> str:
    """The study file of the design with a damping law."""
    return DESIGN.replace("[design]", f'[design]\ndamping_law = "{law}"')


def said(*command) -> str:
    """What a command says in words, without line breaks."""
    result = ask(*command)
    return " ".join((result.stdout + result.stderr).split())


@laws
def test_a_model_carries_its_law(law, tmp_path):
    model = gc.MeshModel.of(**SINGLE, damping_law=law)
    assert gc.MeshModel.of(**SINGLE).with_values({"damping_law": law}) == model
    assert model.with_values({"zeta": 0.1}).damping_law == law
    assert pickle.loads(pickle.dumps(model)) == model == model_from_json(model_json(model))
    assert eval(repr(model), {name: getattr(gc, name) for name in ("MeshModel", "TransmissionError")}) == model
    assert len({hash(gc.MeshModel.of(**SINGLE, damping_law=other)) for other in DAMPING_LAWS}) == 3
    gc.save(gc.simulate(model, periods=1), tmp_path / "motion.nc")
    assert model_from_json(gc.load(tmp_path / "motion.nc").attrs["model"]) == model


@pytest.mark.parametrize(("value", "words"), [
    ("in contact", "'in contact'. Did you mean 'contact'?"), ("Kelvin", "'Kelvin'."), (3, "'3'."),
])
def test_another_law_is_refused(value, words, tmp_path):
    given, rule = {"damping_law": value}, f"damping_law must be one of always, contact, unilateral; got {words}"
    (tmp_path / "model.toml").write_text(f'[model]\ndamping_law = "{value}"\n')
    (tmp_path / "design.toml").write_text(with_law(value) + "[operation]\nspeed = 100\ntorque = 1\n")
    for make in (lambda: gc.MeshModel.of(**given), lambda: gc.MeshModel.of().with_values(given),
                 lambda: operating_model(PAIR).with_values(given), lambda: load_study(tmp_path / "model.toml"),
                 lambda: load_study(tmp_path / "design.toml")):
        with pytest.raises(gc.InputError) as found:
            make()
        assert str(found.value).startswith(rule)
    assert rule in said("regime", "--set", f"damping_law={value}")
    with pytest.raises(gc.InputError, match="damping_law"):  # is no axis
        gc.bifurcation(gc.MeshModel.of(), "damping_law=0:1:3")
    assert f"--{rule.replace('damping_law', 'damping-law')}" in said("warmup", "--damping-law", value)


@laws
def test_study_files_and_values_over_them(law, tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(f'[model]\ndamping_law = "{law}"\nomega = 0.9\n')
    assert load_study(path).model == gc.MeshModel.of(omega=0.9, damping_law=law)
    assert load_study(path, {"damping_law": "contact"}).model.damping_law == "contact"
    path.write_text(with_law(law) + "[operation]\nspeed = 1500\ntorque = 100\n")
    model = load_study(path).model
    assert model.damping_law == model.gears.damping_law == model.gears.to_pair().damping_law == law
    for name in ("damping_law", "design.damping_law"):
        found = load_study(path, {name: "unilateral"}).model
        assert found.damping_law == found.gears.damping_law == "unilateral"
        assert load_design(path, {name: "unilateral"}).damping_law == "unilateral"
    assert gears_from_json(gears_json(model.gears)) == model.gears


def test_a_design_whose_load_sharing_depends_on_the_law_takes_it_in_the_design_alone(tmp_path):
    """Another law for the model alone would leave a stiffness that is not that of its gears."""
    path = tmp_path / "study.toml"
    for law, other in (("contact", "unilateral"), ("unilateral", "contact")):
        path.write_text(with_law(law) + "[operation]\nspeed = 1500\ntorque = 100\n")
        model = load_study(path).model
        assert model.gears.shares_load is model.stiffness.shared is (law == "contact")
        with pytest.raises(InputError, match="damping_law must be set in the design"):
            model.with_values({"damping_law": other})
        assert load_study(path, {"damping_law": other}).model.stiffness.shared is (law == "unilateral")
    assert load_design(path).sharing_in_words.startswith("one spring, since with the damping law unilateral each")
    pinned = replace(load_design(path), load_sharing="prescribed")
    assert operating_model(pinned).with_values({"damping_law": "contact"}).gears.damping_law == "contact"
    with pytest.raises(InputError, match="load_sharing must be prescribed or left out: with the damping law unilat"):
        replace(pinned, load_sharing="tooth pairs")


def test_of_gears_the_law_stays_at_every_operating_point():
    model = operating_model(PAIR).with_values({"damping_law": "contact"})
    assert model.gears.damping_law == "contact"
    for values in ({"speed": 9000.0}, {"torque": 10.0}, {"kind": "single"}, {"zeta": 0.1}):
        changed = model.with_values(values)
        assert changed.damping_law == changed.gears.damping_law == changed.operating_gears.damping_law == "contact"


def test_stores_name_the_difference():
    study = gc.Zones(gc.MeshModel.of(**SINGLE, damping_law="contact"), "omega=0.8:1:2", "eps1=0:0.1:2")
    assert from_record(json.loads(json.dumps(to_record(study)))) == study
    other = gc.Zones(gc.MeshModel.of(**SINGLE), "omega=0.8:1:2", "eps1=0:0.1:2")
    found = differences(to_record(study), to_record(other))
    assert found == ["model.damping_law: 'contact' in the store, 'always' asked for"]


@laws
def test_the_datasheet_says_where_damping_acts(law, tmp_path, monkeypatch):
    monkeypatch.setattr("gearchaos.studies.speeds.speeds_to_avoid.speeds_to_avoid", partial(speeds_to_avoid, starts=0))
    (tmp_path / "design.toml").write_text(DESIGN)
    found = said("gear", tmp_path / "design.toml", "--torque", 50, "--speed", "9000:9100:2", "--set",
                 f"damping_law={law}")
    assert f"ζ 0.05 {DAMPING_LAWS[law].words}: vary each" in found
    assert ("damping that ends with contact" in found) == (law == "always")


@laws
def test_the_explorer_keeps_the_law(law):
    view = view_of(gc.MeshModel.of(**SINGLE)).with_damping_law(law)
    assert view.model.damping_law == law
    assert from_query(to_query(view), view_of(gc.MeshModel.of())).model == view.model
    assert f'damping_law = "{law}"' in as_toml(view)
    assert (f"damping_law='{law}'" in as_python(view)) == (law != "always")
    start = view_of(own_model(PAIR, "torsional").with_values({"damping_law": "unilateral"}))
    of_gears = start.with_damping_law(law)
    assert of_gears.model.damping_law == of_gears.gears.damping_law == law
    assert from_query(to_query(of_gears), start).model.damping_law == law
    assert f'damping_law = "{law}"' in as_toml(of_gears) and f"damping_law='{law}'" in as_python(of_gears)
    with pytest.raises(gc.InputError, match="damping_law must be one of"):
        view.with_damping_law("never")


@laws
def test_the_mesh_force_acts_by_the_law(law):
    motion = gc.simulate(gc.MeshModel.of(**SINGLE, damping_law=law), periods=4, transient=40, samples=64)
    apart, force = motion.contact.values == 0, motion.mesh_force.values
    expected = 2 * SINGLE["zeta"] * motion.z_dot.values * (law == "always")
    assert apart.any() and np.allclose(force[apart], expected[apart], rtol=1e-12, atol=0)
    assert np.any(force < 0) == (law != "unilateral")
    of_gears = gc.simulate(operating_model(PAIR).with_values({"damping_law": law}), 1, samples=4)
    for each in (motion, of_gears, gc.physical(of_gears)):
        assert ("not 0 while the teeth are apart" in each.mesh_force.attrs["comment"]) == (law == "always")


@pytest.mark.parametrize("law", LATER)
def test_scripts(law):
    model, names = gc.MeshModel.of(**SINGLE, damping_law=law, initial={"z": 1.2}), {"__name__": "script"}
    exec(gc.script(model), names)
    expected = gc.simulate(model, periods=3).section_z.values
    assert names["section"](3)[:, 1] == pytest.approx(expected, rel=0, abs=1e-9)
    with pytest.raises(gc.InputError, match=r"damping_law must be always for a script in Julia; .* tool='scipy'"):
        gc.script(model, "dynamicalsystems.jl")


@pytest.mark.parametrize("law", LATER)
def test_equations_in_sympy(law):
    pytest.importorskip("sympy")
    for zeta in (0.05, 0.0):
        model = gc.MeshModel.of(**{**SINGLE, "zeta": zeta}, damping_law=law)
        assert gc.from_sympy(gc.to_sympy(model)) == model


@pytest.mark.parametrize("law", LATER)
def test_proofs_refuse_before_any_work(law, monkeypatch):
    pytest.importorskip("flint")
    model, rule = gc.MeshModel.of(**SINGLE, damping_law=law), "damping_law must be always for a proof"
    verdict = gc.regime(model)
    monkeypatch.setattr("gearchaos.studies.proofs.proofs.regime", None)
    for attempt in (
        lambda: gc.prove(model), lambda: gc.prove(verdict), lambda: gc.prove(gc.orbit(model)),
        lambda: gc.prove_box(model, {"eps1": 1e-8}), lambda: gc.prove_event(model, "flip", "eps1", 0.1),
        lambda: gc.prove_chaos(model), lambda: gc.Zones(model, "omega=0.8:1:2", "eps1=0:0.1:2", prove=True),
    ):
        with pytest.raises(gc.InputError, match=rule):
            attempt()
    assert rule in said("regime", "--prove", "--set", f"damping_law={law}")


def test_the_verifier_refuses_a_certificate_with_a_law():
    pytest.importorskip("flint")
    from gearchaos.proof.certificate import checksum
    from gearchaos.proof.verifier import verify

    certificate = json.loads(json.dumps(gc.prove(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)).document))
    assert verify(certificate).proved
    certificate["model"]["damping_law"] = "contact"
    certificate["sha256"] = checksum(certificate)
    result = verify(certificate)
    assert not result.proved and "'damping_law' unknown" in " ".join(result.lines)


@pytest.mark.parametrize("law", LATER)
def test_studies_of_orbits_and_basins(law):
    model = gc.MeshModel.of(**{**SINGLE, "omega": 2.1, "eps1": 0.1}, damping_law=law)
    assert gc.branch(model, "omega=1.9:2.2").event_kind.values.tolist().count("flip") == 1
    assert gc.curve(model, "flip", "omega=1.9:2.2", "eps1=0.09:0.11").sizes["point"] > 3
    assert gc.manifolds(model.with_values({"omega": 1.2, "eps1": 0.2}), period=1).sizes["point"] > 100
    assert gc.basins(model, "z=-2:2:6", "z_dot=-1:1:6").attractor_fraction.values.sum() == pytest.approx(1)


def test_a_released_flank_counts_as_free():
    model = gc.MeshModel.of(**{**SINGLE, "omega": 1.2, "eps1": 0.02}, damping_law="unilateral")
    branch = gc.branch(model, "eps1=0.018:0.025")
    beyond = branch.z_min.values > 1
    assert np.any(beyond & (branch.contact.values == 1))  # contact is lost although z stays beyond the boundary
    for sequence, lost in zip(branch.contact_sequence.values, branch.contact.values == 1, strict=True):
        states = sequence.split()
        assert states[0] == states[-1] and ("free" in states) == lost


@pytest.mark.parametrize(("law", "event", "jump"), [
    ("contact", "graze", 0), ("unilateral", "border-collision", 0.0458)])
def test_multipliers_jump_at_a_border_collision_alone(law, event, jump):
    model = gc.MeshModel.of(**{**SINGLE, "omega": 1.2, "eps1": 0.02}, damping_law=law)
    branch = gc.branch(model, "eps1=0.018:0.025")
    assert branch.event_kind.values.tolist() == [event]
    at = float(branch.event_value[0])
    before, after = (gc.orbit(model.with_values({"eps1": at + h}), period=1).multipliers[0] for h in (-1e-10, 1e-10))
    assert abs(before - after) == pytest.approx(jump, abs=1e-4)
    assert abs(before) == pytest.approx(abs(after), abs=1e-5)  # the saltation matrix has the determinant 1


def test_no_curve_of_grazes_where_contact_ends_with_its_force():
    model = gc.MeshModel.of(**SINGLE, damping_law="unilateral")
    with pytest.raises(gc.InputError, match=r"event must not be a graze .* border collision"):
        gc.Curve(model, "graze", "omega=0.6:1.2", "eps1=0.02:0.12")
