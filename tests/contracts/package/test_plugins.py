"""What other packages offer: each kind of guest, what is refused in words, and what is missing.

The package of ``examples/plugin`` is imported here, and its entry points are put in the place of those installed;
``tests/slow/test_plugin.py`` installs it.
"""

import json
import shutil
import tomllib
from dataclasses import dataclass, replace
from importlib import import_module, metadata
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.formats import FORMATS, Format
from gearchaos.gears import dynamic_factor
from gearchaos.gears.io.fields import number
from gearchaos.gears.train.faults import FAULTS, Fault, FaultKind
from gearchaos.model import DAMPING_LAWS, STIFFNESS_KINDS, DampingLaw, Stiffness, vary
from gearchaos.model.damping import CONTACT
from gearchaos.model.switched import switched_system
from gearchaos.quantities import Quantity, find, lookup
from gearchaos.studies.core.registry import STUDIES
from gearchaos.studies.core.study import Study
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES, ONE_SPRING

GROUPS = {register.group: register for register in (
    STIFFNESS_KINDS, DAMPING_LAWS, dynamic_factor._register(), FAULTS, STUDIES, FORMATS)}
PLUGIN = EXAMPLES / "plugin"
FILE = """
[model]
kind = "single"
omega = 0.8
[model.error]
amplitudes = [0.1]
[model.stiffness]
kind = "late pair"
late_share = 0.25
[study]
kind = "linear_response"
axis = "omega=0.5:1.8:4"
"""


def said(*command, code=2):
    """What a command prints, which ends with this code."""
    done = CliRunner().invoke(app, command)
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def install(monkeypatch):
    """Has given values, by group and name, in the place of all installed entry points; a text fails to import."""
    monkeypatch.setattr(lookup, "STIFFNESS_PARAMETERS", [*lookup.STIFFNESS_PARAMETERS])
    monkeypatch.setattr(lookup, "_BY_NAME", dict(lookup._BY_NAME))

    def forget():
        find.cache_clear()
        for register in GROUPS.values():
            register._guests.clear()
            register._refused.clear()
            vars(register).pop("offers", None)

    def set_installed(*offers, package="guest"):
        def entry(group, name, value):
            def load():
                if isinstance(value, str):
                    raise ImportError(value)
                return value
            return SimpleNamespace(name=name, group=group, value=f"{package}:it", load=load,
                                   dist=SimpleNamespace(name=package, version="0.1.0"))
        there.extend(entry(f"gearchaos.{group}", name, value) for group, name, value in offers)
        forget()

    there = []
    real = metadata.entry_points

    def entry_points(**given):
        if not given.get("group", "").startswith("gearchaos."):  # Numba and others have theirs
            return real(**given)
        return [each for each in there if each.group == given["group"] and given.get("name") in (None, each.name)]

    monkeypatch.setattr(metadata, "entry_points", entry_points)
    def uninstall():
        there.clear()
        forget()

    set_installed()
    set_installed.uninstall = uninstall
    yield set_installed
    forget()


@pytest.fixture
def plugin(install, tmp_path, monkeypatch):
    """The module of the example, with the entry points that it declares."""
    shutil.copy(PLUGIN / "gearchaos_example.py", tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(import_module("sys").modules, "gearchaos_example", raising=False)
    module = import_module("gearchaos_example")
    declared = tomllib.loads((PLUGIN / "pyproject.toml").read_text())["project"]["entry-points"]
    install(*((group.removeprefix("gearchaos."), name, getattr(module, value.partition(":")[2]))
              for group, names in declared.items() for name, value in names.items()), package="gearchaos-example")
    return module


@pytest.fixture
def file(tmp_path):
    (tmp_path / "study.toml").write_text(FILE)
    return tmp_path / "study.toml"


def test_a_stiffness_has_its_keys_its_names_and_a_verdict(plugin, file):
    model = load_study(file).model
    assert model.stiffness == plugin.LatePairStiffness(0.6, 0.25)
    assert model.with_values({"late_level": 0.5}).stiffness.late_level == 0.5
    assert vary(model, {"late_share": [0.1, 0.2]}).size == 2
    assert gc.regime(model).label == "1T"
    assert load_study(None, {"late_level": 0.5}).model.stiffness == plugin.LatePairStiffness(0.5)
    with pytest.raises(InputError, match="late_level must lie between 0 and 1"):
        load_study(file, {"late_level": 1.5})
    file.write_text(FILE.replace("late_share", "chi1"))
    with pytest.raises(InputError, match="takes late_level and late_share"):
        load_study(file)


def test_a_stiffness_stands_in_the_menu_and_the_address_of_the_explorer(plugin):
    text = pytest.importorskip("gearchaos.explorer.core.text")
    from gearchaos.explorer.core.presets import presets
    from gearchaos.explorer.web.form import parameter_form

    first = presets()["2"].view
    menu = next(menu for menu in parameter_form(first, (), first).menus if menu.name == "stiffness")
    assert ("late pair", "late pair") in menu.options
    view = first.with_stiffness("late pair")
    again = text.from_query(text.to_query(view), first)
    assert again.model.stiffness == view.model.stiffness == plugin.LatePairStiffness()
    names: dict = {}
    exec(text.as_python(view).split("verdict")[0], names)
    assert names["model"].stiffness == plugin.LatePairStiffness()


def test_what_cannot_be_proved_is_refused_in_words(plugin, install):
    pytest.importorskip("flint")
    with pytest.raises(InputError, match=r"form that can be verified.*'late pair'.*without a proof"):
        gc.prove(gc.MeshModel.of("single", stiffness=plugin.LatePairStiffness()))
    install(("damping", "hysteretic", replace(HYSTERETIC, acts_as="always", in_contact=False)))
    with pytest.raises(InputError, match=r"damping_law must be always for a proof"):
        gc.prove(gc.MeshModel.of("single", damping_law="hysteretic"))


HYSTERETIC = replace(CONTACT, name="hysteretic", words="as of steel", acts_as="contact", coefficient=lambda w: 1 / w)


@pytest.mark.parametrize("kind", ["single", "full"])
def test_a_damping_law_scales_zeta_by_its_coefficient(install, kind):
    install(("damping", "hysteretic", HYSTERETIC))
    model = gc.MeshModel.of(kind, damping_law="hysteretic", zeta=0.04, q0=0.2, eps1=0.1)
    own = model.with_values({"damping_law": "contact", "zeta": 0.05, "omega": 0.8})
    assert gc.regime(model.with_values({"omega": 0.8})).multipliers == pytest.approx(gc.regime(own).multipliers)
    found = switched_system(vary(model, {"omega": np.array([0.5, 2.0])}))
    assert found.damping.tolist() == [0.16, 0.04] and found.law is CONTACT
    always = switched_system(vary(model.with_values({"damping_law": "always"}), {}))
    install.uninstall()
    install(("damping", "hysteretic", replace(HYSTERETIC, acts_as="always", in_contact=False)))
    same = switched_system(vary(model.with_values({"omega": 1.0}), {}))
    np.testing.assert_array_equal(same.A, always.A)


def test_a_standard_is_on_the_datasheet(plugin):
    design = load_design(ONE_SPRING, {"speed": "1500 rpm", "torque": "100 N*m"})
    found = datasheet(design)["Kv_Barth"]
    assert found.value == pytest.approx((6.1 + design.load.velocity) / 6.1) and found.words.endswith("Barth's equation")
    assert find("Kv_Barth").long_name


def test_a_fault_takes_its_share_of_the_stiffness(install):
    install(("faults", "pitting", FaultKind(read=number(), stiffness_share=lambda share: 1 - share)))
    fault = Fault(wheel=1, tooth=3, stiffness_loss=0.5, others={"pitting": 0.2})
    assert fault.stiffness_share == pytest.approx(0.4) and [*fault.found] == ["stiffness_loss", "pitting"]
    assert Fault(wheel=1, tooth=3, stiffness_loss=0.5, others=json.loads(json.dumps(fault.others))) == fault
    for others, words in (({"wear": 1e-6}, "must stand beside others"), ({"rust": 1.0}, "must be one of.*rust"),
                          (3, "must be a table")):
        with pytest.raises(InputError, match=words):
            Fault(wheel=1, tooth=3, others=others)
    with pytest.raises(InputError, match=r"others\.pitting must be a number"):
        Fault(wheel=1, tooth=3, others={"pitting": "much"})


def test_a_format_is_written_and_named_where_a_suffix_is_wrong(install, tmp_path):
    def write(dataset, path):
        path.write_text(" ".join(dataset.data_vars))
        return [path]

    install(("formats", "names", Format("names", (".names",), "lists of names", write)))
    found = gc.simulate(gc.MeshModel.of("single"), periods=2)
    assert gc.save(found, tmp_path / "x.names") == [tmp_path / "x.names"]
    assert "section_z" in (tmp_path / "x.names").read_text()
    assert "wrote" in said("simulate", "--periods", "2", "--out", str(tmp_path / "y.names"), code=0)
    with pytest.raises(InputError, match=r"\.names, or have no ending.*\.names for lists of names"):
        gc.save(found, tmp_path / "x.xlsx")


def test_a_study_runs_by_its_file_into_a_store_and_as_a_command(plugin, file, tmp_path):
    study = load_study(file).study(STUDIES["linear_response"])
    omega, zeta = study.axis.values, study.model.zeta
    expected = 0.1 * omega**2 / np.abs(1 + 2j * zeta * omega - omega**2)
    np.testing.assert_allclose(gc.run(study).linear_amplitude, expected, rtol=1e-12)
    assert gc.run(study, out=tmp_path / "s.zarr").finished
    made = gc.load(tmp_path / "s.zarr")
    assert made.equals(gc.run(study)) and made.attrs["gearchaos-example_version"] == "0.1.0"
    other = STUDIES["linear_response"](gc.MeshModel.of(eps1=0.1), "omega=0.5:1:3")  # its stiffness is of gearchaos
    assert gc.run(other).attrs["gearchaos-example_version"] == "0.1.0"
    versions = json.loads((tmp_path / "s.zarr/run/study.json").read_text())["versions"]
    assert versions["gearchaos-example_version"] == "0.1.0"
    assert "linear_amplitude" in said("linear-response", str(file), "--axis", "omega=0.5:1:3", "--json", code=0)
    assert gc.plot.result(made).axes[0].get_ylabel()


def test_a_result_says_which_package_brought_its_stiffness_or_damping_law(plugin, install):
    made = gc.simulate(gc.MeshModel.of(stiffness=plugin.LatePairStiffness()), periods=2)
    assert STIFFNESS_KINDS["late pair"] is plugin.LatePairStiffness
    assert gc.simulate(gc.MeshModel.of(stiffness=plugin.LatePairStiffness()), periods=2).attrs[
        "gearchaos-example_version"] == "0.1.0", made.attrs


def test_a_missing_package_leaves_the_data_and_says_what_to_install(plugin, file, tmp_path, install):
    study = load_study(file).study(STUDIES["linear_response"])
    gc.run(study, out=tmp_path / "s.zarr")
    gc.save(gc.simulate(study.model, periods=2), tmp_path / "motion.nc")
    values = gc.run(study).linear_amplitude.values
    install.uninstall()
    with pytest.warns(UserWarning, match=r"data are read.*made with gearchaos-example 0\.1\.0: install it again"):
        left = gc.load(tmp_path / "s.zarr")
    assert left.linear_amplitude.values.tolist() == values.tolist()
    (tmp_path / "s.zarr/run/finished").unlink()
    with pytest.raises(InputError, match=r"study.kind must be one of .*made with gearchaos-example 0\.1\.0"):
        gc.load(tmp_path / "s.zarr")
    motion = gc.load(tmp_path / "motion.nc")
    from gearchaos.datasets import model_from_json

    with pytest.raises(InputError, match=r"^stiffness.kind must be one of .*; got 'late pair'.* No installed package"):
        model_from_json(motion.attrs["model"])
    for text, words in ((FILE, "study.kind must be"), (FILE.partition("[study]")[0], "model.stiffness.kind must be")):
        file.write_text(text)
        with pytest.raises(InputError, match=f"^{words}.*No installed package offers it in gearchaos"):
            load_study(file)
    assert "No such command 'linear-response'" in said("linear-response")
    with pytest.raises(InputError, match=r"dataset.study must be one of.*No installed package offers it"):
        gc.plot.result(left)


def test_a_branch_along_the_speed_follows_the_coefficient_of_a_law(install):
    install(("damping", "hysteretic", HYSTERETIC))
    model = gc.MeshModel.of("single", damping_law="hysteretic", omega=0.6, q0=0.3, eps1=0.02, zeta=0.05)
    branch = gc.branch(model, "omega=0.58:0.62")
    for at in (0, -1):
        omega = float(branch.omega[at])
        own = model.with_values({"damping_law": "contact", "omega": omega, "zeta": 0.05 / omega})
        section = gc.regime(own).section
        assert float(branch.section_z.values.ravel()[at]) == pytest.approx(section["z"][0], abs=1e-6)


@dataclass(frozen=True)
class Named(Stiffness):
    """A kind whose parameter is one of the model."""

    kind = form = noun = predicate = keys = "named"
    rows = (Quantity("zeta"),)

    @classmethod
    def parts(cls, values):
        return ()

    def describe(self):
        return ""


class Unfinished(Stiffness):
    kind = "unfinished"


FACTOR = next(iter(dynamic_factor.standards()))


@pytest.mark.parametrize(("group", "name", "value", "reason"), [
    ("stiffness", "broken", "no module named numpyy", "cannot be imported (ImportError: no module named numpyy)"),
    ("stiffness", "number", 3, "it must be a class that derives from gearchaos.model.stiffness.base.Stiffness"),
    ("stiffness", "other", gc.HarmonicStiffness, "its kind must be the name of the entry point, not 'harmonics'"),
    ("stiffness", "unfinished", Unfinished, "it must define describe, parts"),
    ("stiffness", "named", Named, "it must have parameters of its own, not zeta"),
    ("stiffness", "harmonics", Named, "the name is taken by gearchaos"),
    ("damping", "plain", DampingLaw, "it must be a gearchaos.model.damping.base.DampingLaw"),
    ("damping", "dry", replace(CONTACT, name="dry"), "it must act as one of always, contact, unilateral, not ''"),
    ("damping", "dry", replace(CONTACT, name="dry", acts_as="unilateral"),
     "its in_contact and releases must be those of unilateral, True and True"),
    ("standards", "Barth", replace(FACTOR, name="Barth"), "its name must begin with Kv_"),
    ("standards", "Kv_B", replace(FACTOR, name="Kv_B", result=Named, beside={}), "its result must have value, desc"),
    ("faults", "rust", 3, "it must be a gearchaos.gears.train.faults.base.FaultKind"),
    ("studies", "zones_too", gc.Zones, "its kind must be the name of the entry point, not 'zones'"),
    ("studies", "zones", gc.Basins, "the name is taken by gearchaos"),
    ("formats", "tables", Format("tables", (".csv",), "", lambda ds, path: []), "suffixes of its own, not .csv"),
])
def test_what_cannot_be_used_is_left_out_with_one_message(install, group, name, value, reason):
    install((group, name, value))
    register = GROUPS[f"gearchaos.{group}"]
    with pytest.warns(UserWarning) as found:
        names = [*register]
    (text,) = (str(each.message) for each in found)
    assert text.startswith(f"{name!r} of guest 0.1.0 is left out: ") and reason in text
    ending = f"Entry point {name} = guest:it in gearchaos.{group}; update the package, or pip uninstall guest."
    assert text.endswith(ending)
    assert names == [*register.own] == [*register]
    if name not in register.own:
        with pytest.raises(InputError, match=r"must be one of .* is left out: "):
            register.check("field", name)


def test_a_law_acts_as_one_of_the_kernels_not_as_another_that_does(install, monkeypatch):
    own = DAMPING_LAWS.own | {"linear": replace(CONTACT, name="linear", acts_as="contact")}
    monkeypatch.setattr(DAMPING_LAWS, "own", own)
    assert gc.MeshModel.of(damping_law="linear").kernel_law is CONTACT
    install(("damping", "dry", replace(HYSTERETIC, name="dry", acts_as="linear")))
    with pytest.warns(UserWarning, match="it must act as one of always, contact, unilateral, not 'linear'"):
        assert "dry" not in DAMPING_LAWS


def test_of_two_packages_that_offer_one_name_the_first_has_it(install):
    install(("damping", "dry", replace(HYSTERETIC, name="dry")), package="one")
    install(("damping", "dry", replace(HYSTERETIC, name="dry")), package="two")
    with pytest.warns(UserWarning, match=r"'dry' of two 0\.1\.0 is left out: the name is taken by one 0\.1\.0"):
        assert [*DAMPING_LAWS] == ["always", "contact", "unilateral", "dry"]
    assert gc.MeshModel.of(damping_law="dry").law.acts_as == "contact"


def test_entry_points_are_not_read_for_names_of_gearchaos(install, monkeypatch, tmp_path):
    real = metadata.entry_points

    def refused(**given):
        if given.get("group", "").startswith("gearchaos."):
            raise AssertionError("entry points are read")
        return real(**given)

    monkeypatch.setattr(metadata, "entry_points", refused)
    model = gc.MeshModel.of("single", stiffness=gc.HarmonicStiffness((0.2,)), damping_law="contact")
    study = STUDIES["simulate"](model, periods=2)
    gc.run(study, out=tmp_path / "s.zarr")
    gc.save(gc.load(tmp_path / "s.zarr"), tmp_path / "s.csv")
    assert "zones" in said("--help", code=0)
    with pytest.raises(AssertionError, match="are read"):
        STIFFNESS_KINDS.get("late pair")


@pytest.mark.parametrize(("attributes", "words"), [
    ({"summary": "map"}, "variables must have contact"), ({"gridded": True}, "variables must have names"),
    ({"variables": ("nothing_like_it",)}, "name must be one of .*; got 'nothing_like_it'"),
    ({"quantities": (Quantity("v_rms", long_name="something else"),)}, "quantities must be of new names; got 'v_rms'"),
])
def test_a_study_whose_results_have_no_names_is_refused_when_its_class_is_made(install, attributes, words):
    with pytest.raises(InputError, match=words):
        type("Unnamed", (Study,), {"kind": "unnamed", "__annotations__": {"kind": ClassVar[str]}, **attributes})
    type("Named", (Study,), {"kind": "named", "variables": ("label", "contact"), "summary": "map", "gridded": True})
