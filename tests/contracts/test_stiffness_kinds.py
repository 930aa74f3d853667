"""What every kind of mesh stiffness promises, by which files, pairs, SymPy and proofs take it for what it is."""

import inspect
from fractions import Fraction

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.model import STIFFNESS_KINDS, MeshModel, Stiffness, vary
from gearchaos.model.switched import switched_system

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
    symbolic = gc.to_sympy(model)
    chi = next(e for f, e in symbolic.definitions.items() if f.func.__name__ == "chi").subs(symbolic.values)
    np.testing.assert_allclose([float(chi.subs(sympy.Symbol("tau", real=True), t)) for t in tau], expected, rtol=1e-12)
    exact = {n: [*map(Fraction, v)] if isinstance(v, tuple) else Fraction(v) for n, v in stiffness.numbers().items()}
    assert [(float(s), float(c)) for s, c in stiffness.parts(exact)] == [*stiffness.parts(stiffness.numbers())]
    low, high = stiffness.extremes()
    assert low <= expected.min() and expected.max() <= high


def test_a_gear_pair_has_it_in_newtons_per_metre(stiffness):
    pair = gc.GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1=0.035, R2=0.07, c0=4e8, k=500, backlash=1e-4, M10=85,
                       speed=3000, **stiffness.to_pair(4e8))
    assert pair.to_model().stiffness.kind == stiffness.kind
    for name, value in stiffness.numbers().items():
        np.testing.assert_allclose(pair.to_model().stiffness.numbers()[name], value, rtol=1e-15)


def test_a_kind_that_certificates_cannot_be_checked_for_is_refused(stiffness, monkeypatch):
    parameters = pytest.importorskip("gearchaos.proof.parameters")
    model = MeshModel(kind="single", omega=0.8, stiffness=stiffness)
    assert parameters.exact_parameters(model)["stiffness"]["form"] == stiffness.form
    monkeypatch.delitem(parameters.STIFFNESS, stiffness.form)
    with pytest.raises(gc.InputError, match=f"stiffness must be of a form that can be verified.*'{stiffness.form}'"):
        parameters.exact_parameters(model)
