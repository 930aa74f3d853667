"""Models as scripts and as SymPy equations: what is accepted and refused, constants, and the command."""

import ast
import dataclasses
import json
import re
import sys
from functools import cache

import pytest

import gearchaos as gc
from gearchaos.interchange.scripts import TEMPLATES
from gearchaos.model import SteppedStiffness
from gearchaos.studyfile import load_design
from tests import EXAMPLES, ONE_SPRING
from tests.commands import ask, refused

sympy = pytest.importorskip("sympy")

MODEL = gc.MeshModel.of(kind="full", omega=1.05, kappa2=0.7, mu1=3.1, eps1=0.04, eps3=0.01, theta1=0.3, q1=0.11)
MODELS = [
    MODEL, gc.MeshModel.of(kind="single", zeta=0.03, c2=0.1, alpha2=-0.4), gc.MeshModel.of(omega=1 / 3, chi1=0.2),
    gc.MeshModel(stiffness=SteppedStiffness((1.25, 0.75), (0.1, 0.4)), initial={"x1": 0.1})]

def constants(text: str) -> dict[str, object]:
    """The numbers, and lists of numbers, that a script in Julia assigns to names."""
    found = {}
    for name, value in re.findall(r"^(?:const )?(\w+) = ([^#\n]*?)(?: +#.*)?$", text, re.MULTILINE):
        try:
            found[name] = ast.literal_eval(value)
        except (SyntaxError, ValueError):
            continue
    return found


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_the_constants_of_a_script_for_julia_are_the_values_of_the_model(model):
    """What scripts in Python compute is compared in tests/oracles/test_interchange.py."""
    found = constants(gc.script(model, "dynamicalsystems.jl"))
    expected = {n: v for n, v in model.parameters().items() if not re.match(r"(eps|theta|c|alpha)\d|^beta", n)}
    lateral = ("mu", "kappa", "zeta_support")
    expected = {n: v for n, v in expected.items() if model.kind == "full" or not n.startswith(lateral)}
    assert {n: found[n] for n in expected} == expected
    assert (found["eps_j"], found["theta"]) == (list(model.error.amplitudes), list(model.error.phases))
    if isinstance(model.stiffness, SteppedStiffness):
        assert (found["levels"], found["starts"]) == ([1.25, 0.75], [0.1, 0.4])
    if isinstance(model.stiffness, gc.HarmonicStiffness):
        assert (found["c"], found["alpha"]) == ([0.0, 0.1], [0.0, -0.4])
    assert ("mu1" in found, "beta1" in found) == (model.kind == "full", model.kind != "single")
    assert found["initial"] == [*{"full": (1.0, *[0.0] * 7), "single": (1.0, 0.0)}.get(
        model.kind, (model.initial.get("x1", 1.0), 0.0, 0.0, 0.0))]


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_a_script_for_julia_has_balanced_blocks_and_brackets(model):
    text = gc.script(model, "dynamicalsystems.jl")
    code = "\n".join(re.sub(r'"[^"]*"', '""', line).split("#")[0] for line in text.splitlines())
    for opening, closing in ("()", "[]", "{}"):
        assert code.count(opening) == code.count(closing)
    depth = 0
    for line in code.splitlines():
        depth += bool(re.match(r"\s*(function|for|if|while)\b", line)) - bool(re.match(r"\s*end\b", line))
        assert depth >= 0, line
    assert depth == 0
    assert f"SVector{{{len(gc.script(model).split('names = ')[1].splitlines()[0].split(','))}}}" in code
    kinks = 2 + (0 if isinstance(model.stiffness, gc.HarmonicStiffness) else 1)
    assert code.count("out[") == kinks, "contact switches, and the jumps of a stiffness that has some"


def test_a_script_for_julia_prints_times_and_not_the_numbers_of_periods():
    """The time of a StroboscopicMap in DynamicalSystems.jl is the number of its iterations."""
    text = gc.script(MODEL, "dynamicalsystems.jl")
    assert "section, number = trajectory(StroboscopicMap(mesh, T), 20)" in text
    assert 'println(join((number[i] * T, u...), ","))' in text


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_scripts_have_lines_of_at_most_120_characters_and_no_gaps(model):
    for tool in TEMPLATES:
        text = gc.script(dataclasses.replace(model, error=gc.TransmissionError()), tool)
        assert all(len(line) <= 120 and line == line.rstrip() for line in text.splitlines())
        assert "\n\n\n\n" not in text and text.endswith("\n")


def test_a_script_of_gears_says_what_its_units_are():
    pair = load_design(ONE_SPRING, {"damping_law": "always"})
    scales = pair.to_pair().scales
    for tool in TEMPLATES:
        assert f"Here Δ = {scales.length!r} m and ω0 = {scales.rate!r} rad/s." in gc.script(pair, tool)
    assert "Here Δ" not in gc.script(MODEL)


@pytest.mark.parametrize(("call", "message"), [
    (lambda: gc.script(MODEL, "matlab"),
     "tool must be one of dynamicalsystems.jl, opentorsion, ross, scipy; got 'matlab'"),
    (lambda: gc.script(MODEL, "ross"), "tool must be scipy or dynamicalsystems.jl for a single pair; got 'ross'"),
    (lambda: gc.script(gc.open(EXAMPLES / "train_planetary.toml"), "opentorsion"),
     "tool must be another one where centres of bodies move; got 'sun'"),
    (lambda: gc.script("x"), "model must be a "),
    (lambda: gc.from_sympy({}), "symbolic must be a SymbolicModel; got 'a dict'")])
def test_what_is_no_tool_or_model_is_refused(call, message):
    with pytest.raises(gc.InputError, match=message):
        call()


def test_the_command_writes_the_script(tmp_path):
    arguments = ["script", "--set", "omega=0.9", "--set", "eps1=0.1"]
    model, file = gc.MeshModel.of(omega=0.9, eps1=0.1), tmp_path / "gear.jl"
    assert ask(*arguments).stdout == gc.script(model)
    written = ask(*arguments, "--for", "julia", "--out", file)
    assert (written.exit_code, written.stdout) == (0, ""), written.stderr
    assert file.read_text(encoding="utf-8") == gc.script(model, "dynamicalsystems.jl")


@pytest.mark.parametrize(("options", "message"), [
    (["--for", "matlab"], "--for must be one of julia, opentorsion, ross, scipy; got 'matlab'"),
    (["--for", "julia", "--out", "gear.py"], "--out must end in .jl")])
def test_the_command_refuses(options, message):
    assert message in refused("script", *options)


symbolic_of = cache(gc.to_sympy)


def changed(model=MODEL, **fields) -> gc.SymbolicModel:
    return dataclasses.replace(symbolic_of(model), **fields)


def symbol(name: str):
    return sympy.Symbol(name, real=True)


def test_other_values_make_another_model():
    values = {**symbolic_of(MODEL).values, symbol("omega"): sympy.Rational(3, 2), symbol("eps3"): 0.2}
    found = gc.from_sympy(changed(values=values, initial={"y1": 0.5}))
    assert found == MODEL.with_values({"omega": 1.5, "eps3": 0.2, "y1": 0.5})


def test_the_same_equations_may_be_written_in_another_way():
    symbolic = symbolic_of(MODEL)
    first, *others = symbolic.equations
    force = next(f for f in symbolic.definitions if f.func.__name__ == "S")
    first = sympy.Eq(3 * (first.rhs - first.lhs).subs(force, symbolic.definitions[force]), 0)
    backlash = next(f for f in symbolic.definitions if f.func.__name__ == "f")
    z = next(f for f in symbolic.definitions if f.func.__name__ == "z")
    definitions = {**symbolic.definitions, backlash: z - sympy.Max(-1, sympy.Min(1, z))}
    summed = sympy.Eq(others[0].lhs + others[1].lhs, others[0].rhs + others[1].rhs)
    written = changed(equations=[summed.subs(symbol("J2"), 2), first, *others[1:]], definitions=definitions)
    assert gc.from_sympy(written) == MODEL


@pytest.mark.parametrize(("model", "change"), [
    (MODELS[2], lambda row, x: sympy.Eq(row.lhs + x**3 / 1000, row.rhs)),
    (MODELS[1], lambda row, x: sympy.Eq(row.lhs, -row.rhs)), (MODELS[1], lambda row, x: row.subs(symbol("J1"), 2.001)),
], ids=["term", "sign", "value"])
def test_other_equations_are_refused(model, change):
    (x, *_), (first, *others) = symbolic_of(model).coordinates, symbolic_of(model).equations
    with pytest.raises(gc.InputError, match=r"equation of (x1|z) must be that of docs/model.md.*instead of"):
        gc.from_sympy(changed(model, equations=[change(first, x), *others]))


def test_equations_that_do_not_determine_the_motion_are_refused():
    model = MODELS[2]
    (_, x2, *_), rows = symbolic_of(model).coordinates, symbolic_of(model).equations
    for wrong in ([rows[0], rows[0], *rows[2:]], rows[:1]):
        with pytest.raises(gc.InputError, match=r"must determine the second derivative.* for x1\(tau\), x2"):
            gc.from_sympy(changed(model, equations=wrong))
    for name in ("x3", "u"):
        with pytest.raises(gc.InputError, match=r"equations must be those of x1, x2, or of.*need a definition"):
            gc.from_sympy(changed(model, equations=[*rows, sympy.Eq(sympy.Function(name)(symbol("tau")), x2)]))


@pytest.mark.parametrize(("name", "value", "message"), [
    ("zeta", None, r"values must have a value for each symbol of the equations; got \['zeta'\]"),
    ("zeta", -1.0, "zeta must not be negative"), ("speed", 1.0, "parameter must be one of"),
    ("eps10000000000", 0.1, "values must have numbers of at most 64 in their names; got 'eps1000")])
def test_values_are_checked(name, value, message):
    values = {s: v for s, v in symbolic_of(MODEL).values.items() if s.name != name}
    if value is not None:
        values[symbol(name)] = value
    with pytest.raises(gc.InputError, match=message):
        gc.from_sympy(changed(values=values))


@pytest.mark.parametrize(("fields", "message"), [
    ({"values": {symbol("omega"): "fast"}}, "values must be real numbers; got 'omega = fast'"),
    ({"values": {symbol("omega"): sympy.I}}, "values must be real numbers; got 'omega = I'"),
    ({"values": {symbol("omega"): symbol("q")}}, "values must be real numbers; got 'omega = q'"),
    ({"values": {"omega": 1.0}}, "values must have symbols of SymPy as keys; got 'omega'"),
    ({"equations": None}, r"equations must be a sequence of sympy.Eq; got None"),
    ({"equations": ()}, r"equations must be a sequence of sympy.Eq; got \(\)"),
    ({"equations": [symbol("omega")]}, r"equations must be a sequence of sympy.Eq; got \[omega\]")])
def test_parts_of_a_symbolic_model_are_checked(fields, message):
    with pytest.raises(gc.InputError, match=message):
        changed(**fields)


def test_a_definition_that_contains_itself_is_refused():
    definitions = symbolic_of(MODELS[1]).definitions
    force = next(f for f in definitions if f.func.__name__ == "f")
    with pytest.raises(gc.InputError, match=r"definitions must not lead back to themselves; got 'f\("):
        gc.from_sympy(changed(MODELS[1], definitions={**definitions, force: force + 1}))


def test_levels_without_a_gap():
    symbolic, (old, new) = symbolic_of(MODELS[3]), map(symbol, ("level2", "level3"))
    values = {new if s == old else s: v for s, v in symbolic.values.items()}
    definitions = {f: e.subs(old, new) for f, e in symbolic.definitions.items()}
    with pytest.raises(gc.InputError, match="level1, level2, … without gaps"):
        gc.from_sympy(dataclasses.replace(symbolic, values=values, definitions=definitions))


def test_without_sympy_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(gc.InputError, match=r'SymPy must be installed .* Run: pip install "gearchaos\[sympy\]"'):
        gc.to_sympy(MODEL)


def test_symbolic_models_are_values():
    symbolic = symbolic_of(MODEL)
    with pytest.raises(dataclasses.FrozenInstanceError):
        symbolic.values = {}
    with pytest.raises(TypeError):
        symbolic.values[symbol("omega")] = 2.0
    assert json.dumps({s.name: v for s, v in symbolic.values.items()})
