"""What every kind of mesh stiffness promises, by which files, pairs, SymPy and proofs take it for what it is."""

import inspect
import re
from dataclasses import dataclass
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.model import STIFFNESS_KINDS, MeshModel, Stiffness, vary
from gearchaos.model.switched import switched_system
from gearchaos.quantities import POSITIVE, Quantity, Range, declare, find, lookup
from gearchaos.studies.proofs.proofs import box_parameters
from gearchaos.validation import check_rule

KINDS = list(STIFFNESS_KINDS.values())


@pytest.fixture(params=KINDS, ids=[kind.kind for kind in KINDS])
def stiffness(request) -> Stiffness:
    return request.param.example()


def test_a_kind_says_what_its_base_class_asks_for(stiffness):
    words = (stiffness.kind, stiffness.form, stiffness.noun, stiffness.predicate, stiffness.keys, stiffness.describe())
    assert all(words) and stiffness.outline in (stiffness.describe(), stiffness.describe().split(",")[0])
    assert type(stiffness).from_record(stiffness.record()) == stiffness
    assert all(type(stiffness).accepts(name) for name in stiffness.parameters())
    assert stiffness.with_values(stiffness.parameters()) == stiffness
    assert inspect.isabstract(Stiffness) and not inspect.isabstract(type(stiffness))


def test_flow_sympy_and_fractions_have_the_same_stiffness(stiffness):
    sympy = pytest.importorskip("sympy")
    omega, model = 0.8, MeshModel(kind="single", omega=0.8, stiffness=stiffness)
    tau = np.linspace(0.01, 2.9 * 2 * np.pi / omega, 57)
    expected, share = stiffness.at(tau, omega), np.mod(tau * omega / (2 * np.pi), 1)
    system, order = switched_system(vary(model, {})), np.arange(1, 1 + len(stiffness.harmonics()[0]))[:, None]
    level = system.levels[0][np.searchsorted(system.starts[0], share, side="right") - 1]
    series = system.chi_cos[0] @ np.cos(order * omega * tau) + system.chi_sin[0] @ np.sin(order * omega * tau)
    np.testing.assert_allclose(level + series, expected, rtol=1e-14)
    if stiffness.shared:
        for call in (gc.to_sympy, gc.script):
            with pytest.raises(gc.InputError, match="stiffness must be one spring"):
                call(model)
        return
    symbolic = gc.to_sympy(model)
    chi = next(e for f, e in symbolic.definitions.items() if f.func.__name__ == "chi").subs(symbolic.values)
    np.testing.assert_allclose([float(chi.subs(sympy.Symbol("tau", real=True), t)) for t in tau], expected, rtol=1e-12)
    exact = {n: [*map(Fraction, v)] if isinstance(v, tuple) else Fraction(v) for n, v in stiffness.numbers().items()}
    assert [(float(s), float(c)) for s, c in stiffness.parts(exact)] == [*stiffness.parts(stiffness.numbers())]
    low, high = stiffness.extremes()
    assert low <= expected.min() and expected.max() <= high


def test_a_gear_pair_has_it_in_newtons_per_metre(stiffness):
    if not stiffness.pair_fields:
        pytest.skip("pairs lack this kind")
    pair = gc.GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1=0.035, R2=0.07, c0=4e8, k=500, backlash=1e-4, M10=85,
                       speed=3000, **stiffness.to_pair(4e8, 5e-5))
    assert pair.to_model().stiffness.kind == stiffness.kind
    for name, value in stiffness.numbers().items():
        np.testing.assert_allclose(pair.to_model().stiffness.numbers()[name], value, rtol=1e-15)


def test_a_kind_that_certificates_cannot_be_checked_for_is_refused(stiffness, monkeypatch):
    parameters = pytest.importorskip("gearchaos.proof.parameters")
    model = MeshModel(kind="single", omega=0.8, stiffness=stiffness)
    if stiffness.form in parameters.STIFFNESS:
        assert parameters.exact_parameters(model)["stiffness"]["form"] == stiffness.form
    monkeypatch.delitem(parameters.STIFFNESS, stiffness.form, raising=False)
    form = f"of a form that can be verified.*'{stiffness.form}'"
    with pytest.raises(gc.InputError, match=f"stiffness must be {'one spring' if stiffness.shared else form}"):
        parameters.exact_parameters(model)


@dataclass(frozen=True)
class Ramp(Stiffness):
    """A kind that no other file names: two levels, of which the second begins later than a time set by name."""

    early: float = 0.2
    late: float = 0.6
    level: float = 0.8

    kind = form = "ramp"
    noun = predicate = keys = "a ramp"
    rows = tuple(Quantity(name, range=Range(0.1, 0.9, 0.1, 0.9)) for name in ("early", "late", "level"))
    pair_fields = {"level": "k"}  # noqa: RUF012 -- no field, and never changed
    stiffness_fields = ("level",)

    @classmethod
    def parts(cls, values):
        return (values["early"], values["level"]), (values["late"], 1)

    @classmethod
    def check_together(cls, values, amplitudes, phases):
        check_rule("late", values["late"] - values["early"], POSITIVE)

    def describe(self):
        return "a ramp"


@pytest.fixture
def ramp(monkeypatch) -> MeshModel:
    """A model with this kind, which is known here alone."""
    monkeypatch.setitem(STIFFNESS_KINDS.own, "ramp", Ramp)
    monkeypatch.setattr(lookup, "STIFFNESS_PARAMETERS", [])
    monkeypatch.setattr(lookup, "_BY_NAME", dict(lookup._BY_NAME))
    declare(Ramp.rows, ())
    yield MeshModel(kind="single", stiffness=Ramp())
    find.cache_clear()


def test_values_that_do_not_go_together_are_refused_where_one_of_them_varies(ramp):
    assert vary(ramp, {"early": [0.1, 0.5]}).size == 2
    for values in ({"early": [0.1, 0.7]}, {"late": [0.1, 0.7]}, {"early": [0.1, 0.5], "late": [0.2, 0.5]}):
        with pytest.raises(gc.InputError, match="late must be greater than 0"):
            vary(ramp, values)


def test_a_number_of_a_pair_is_a_number_of_the_model():
    assert Ramp(level=0.5).to_pair(4e8, 1e-4) == {"k": 2e8}
    assert Ramp.from_pair(SimpleNamespace(c0=4e8, k=2e8)) == Ramp(level=0.5)


def test_a_copied_script_imports_a_kind_that_the_package_does_not_export(ramp, monkeypatch):
    view = pytest.importorskip("gearchaos.explorer.core.text")
    monkeypatch.setattr(view, "_CLASSES", re.compile(r"\b(MeshModel|TransmissionError|Ramp)\("))
    monkeypatch.setattr("gearchaos.model.stiffness.Ramp", Ramp, raising=False)
    names: dict = {}
    exec(view.as_python(view.view_of(ramp)).split("verdict")[0], names)
    assert names["model"] == ramp


def test_words_about_a_box_are_those_of_its_stiffness(ramp):
    pytest.importorskip("flint")
    stepped = gc.MeshModel(kind="single", stiffness=gc.SteppedStiffness((1.25, 0.75), (0.0, 0.5)))
    for model, advice in ((gc.MeshModel(), "error, chi1 and chi2."), (stepped, "Scalars of the model and amplitudes")):
        with pytest.raises(gc.InputError, match=advice):
            box_parameters(model, "theta1")
    with pytest.raises(gc.InputError, match=r"must be two-level or .* or ramp for a box"):
        box_parameters(gc.MeshModel.of(c1=0.1), "omega")
