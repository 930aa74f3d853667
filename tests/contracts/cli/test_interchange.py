"""Models as scripts and as SymPy equations: what is accepted and refused, constants, and the command."""

import ast
import dataclasses
import json
import re
import sys

import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.interchange.scripts import TEMPLATES
from gearchaos.model import SteppedStiffness

sympy = pytest.importorskip("sympy")

MODEL = gc.MeshModel.of(kind="full", omega=1.05, kappa2=0.7, mu1=3.1, eps1=0.04, eps3=0.01, theta1=0.3, q1=0.11)
MODELS = [
    MODEL, gc.MeshModel.of(kind="single", zeta=0.03, c2=0.1, alpha2=-0.4), gc.MeshModel.of(omega=1 / 3, chi1=0.2),
    gc.MeshModel(stiffness=SteppedStiffness((1.25, 0.75), (0.1, 0.4)), initial={"x1": 0.1}),
]
PAIR = gc.GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm", damping_ratio=0.05, stiffness="ISO 6336-1",
                     backlash={"value": "0.12 mm", "of": "line of action, total"}, bore=("30 mm", "30 mm"),
                     transmission_error="from quality", quality={"standard": "ISO 1328-1:1995", "grade": 6},
                     speed="1500 rpm", torque="300 N*m")


def constants(text: str) -> dict[str, object]:
    """The numbers, and lists of numbers, that a script assigns to names, in Python or Julia."""
    found = {}
    for name, value in re.findall(r"^(?:const )?(\w+) = (?:np\.array\()?([^#\n]*?)\)?(?: +#.*)?$", text, re.MULTILINE):
        try:
            found[name] = ast.literal_eval(value)
        except (SyntaxError, ValueError):
            continue
    return found


@pytest.mark.parametrize("tool", TEMPLATES)
@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.kind)
def test_the_constants_of_a_script_are_the_values_of_the_model(tool, model):
    found = constants(gc.script(model, tool))
    expected = {n: v for n, v in model.parameters().items() if not re.match(r"(eps|theta|c|alpha)\d|^beta", n)}
    lateral = ("mu", "kappa", "zeta_support")
    expected = {n: v for n, v in expected.items() if model.kind == "full" or not n.startswith(lateral)}
    assert {n: found[n] for n in expected} == expected
    assert found["eps" if tool == "scipy" else "eps_j"] == list(model.error.amplitudes)
    assert found["theta"] == list(model.error.phases)
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
    scales, pair = PAIR.to_pair().scales, dataclasses.replace(PAIR, damping_law="always")
    for tool in TEMPLATES:
        assert f"Here Δ = {scales.length!r} m and ω0 = {scales.rate!r} rad/s." in gc.script(pair, tool)
    assert "Here Δ" not in gc.script(MODEL)


@pytest.mark.parametrize(("given", "message"), [
    ((MODEL, "matlab"), "tool must be one of dynamicalsystems.jl, scipy; got 'matlab'"), (("x",), "model must be a "),
])
def test_scripts_are_refused(given, message):
    with pytest.raises(gc.InputError, match=message):
        gc.script(*given)


def test_the_command_writes_the_script(tmp_path):
    arguments = ["script", "--set", "omega=0.9", "--set", "eps1=0.1"]
    model = gc.MeshModel.of(omega=0.9, eps1=0.1)
    printed = CliRunner().invoke(app, arguments)
    assert (printed.exit_code, printed.stdout) == (0, gc.script(model))
    file = tmp_path / "gear.jl"
    written = CliRunner().invoke(app, [*arguments, "--for", "julia", "--out", str(file)])
    assert (written.exit_code, written.stdout) == (0, ""), written.stderr
    assert file.read_text(encoding="utf-8") == gc.script(model, "dynamicalsystems.jl")


@pytest.mark.parametrize(("options", "message"), [
    (["--for", "matlab"], "--for must be one of julia, scipy; got 'matlab'"),
    (["--for", "julia", "--out", "gear.py"], "--out must end in .jl"), (["--set", "omga=1"], "Did you mean 'omega'?"),
])
def test_the_command_refuses(options, message):
    run = CliRunner().invoke(app, ["script", *options])
    assert run.exit_code == 2 and message in run.stderr and run.stdout == ""


def changed(model=MODEL, **fields) -> gc.SymbolicModel:
    return dataclasses.replace(gc.to_sympy(model), **fields)


def symbol(name: str):
    return sympy.Symbol(name, real=True)


def test_other_values_make_another_model():
    values = {**gc.to_sympy(MODEL).values, symbol("omega"): sympy.Rational(3, 2), symbol("eps3"): 0.2}
    found = gc.from_sympy(changed(values=values, initial={"y1": 0.5}))
    assert found == MODEL.with_values({"omega": 1.5, "eps3": 0.2, "y1": 0.5})


def test_the_same_equations_may_be_written_in_another_way():
    symbolic = gc.to_sympy(MODEL)
    first, *others = symbolic.equations
    force = next(f for f in symbolic.definitions if f.func.__name__ == "S")
    first = sympy.Eq(3 * (first.rhs - first.lhs).subs(force, symbolic.definitions[force]), 0)
    backlash = next(f for f in symbolic.definitions if f.func.__name__ == "f")
    z = next(f for f in symbolic.definitions if f.func.__name__ == "z")
    definitions = {**symbolic.definitions, backlash: z - sympy.Max(-1, sympy.Min(1, z))}
    summed = sympy.Eq(others[0].lhs + others[1].lhs, others[0].rhs + others[1].rhs)
    written = changed(equations=[summed.subs(symbol("J2"), 2), first, *others[1:]], definitions=definitions)
    assert gc.from_sympy(written) == MODEL


@pytest.mark.slow
def test_other_equations_are_refused():
    model = MODELS[2]
    symbolic = gc.to_sympy(model)
    x1, x2 = symbolic.coordinates[:2]
    rows = symbolic.equations
    for wrong in (sympy.Eq(rows[0].lhs + x1**3 / 1000, rows[0].rhs), sympy.Eq(rows[0].lhs, -rows[0].rhs),
                  rows[0].subs(symbol("J1"), 2.001)):
        with pytest.raises(gc.InputError, match=r"equation of x1 must be that of docs/model.md.*instead of"):
            gc.from_sympy(changed(model, equations=[wrong, *rows[1:]]))
    for wrong in ([rows[0], rows[0], *rows[2:]], rows[:1]):
        with pytest.raises(gc.InputError, match=r"must determine the second derivative.* for x1\(tau\), x2"):
            gc.from_sympy(changed(model, equations=wrong))
    for wrong in (sympy.Eq(sympy.Function("x3")(symbol("tau")), x2), sympy.Eq(sympy.Function("u")(symbol("tau")), x2)):
        with pytest.raises(gc.InputError, match=r"equations must be those of x1, x2, or of.*need a definition"):
            gc.from_sympy(changed(model, equations=[*rows, wrong]))


@pytest.mark.parametrize(("name", "value", "message"), [
    ("zeta", None, r"values must have a value for each symbol of the equations; got \['zeta'\]"),
    ("zeta", -1.0, "zeta must not be negative"), ("speed", 1.0, "parameter must be one of"),
])
def test_values_are_checked(name, value, message):
    values = {s: v for s, v in gc.to_sympy(MODEL).values.items() if s.name != name}
    if value is not None:
        values[sympy.Symbol(name, real=True)] = value
    with pytest.raises(gc.InputError, match=message):
        gc.from_sympy(changed(values=values))


@pytest.mark.parametrize(("fields", "message"), [
    ({"values": {symbol("omega"): "fast"}}, "values must be real numbers; got 'omega = fast'"),
    ({"values": {symbol("omega"): sympy.I}}, "values must be real numbers; got 'omega = I'"),
    ({"values": {symbol("omega"): symbol("q")}}, "values must be real numbers; got 'omega = q'"),
    ({"values": {"omega": 1.0}}, "values must have symbols of SymPy as keys; got 'omega'"),
    ({"equations": None}, r"equations must be a sequence of sympy.Eq; got None"),
    ({"equations": ()}, r"equations must be a sequence of sympy.Eq; got \(\)"),
    ({"equations": [symbol("omega")]}, r"equations must be a sequence of sympy.Eq; got \[omega\]"),
])
def test_parts_of_a_symbolic_model_are_checked(fields, message):
    with pytest.raises(gc.InputError, match=message):
        changed(**fields)


@pytest.mark.slow
def test_a_definition_that_contains_itself_is_refused():
    symbolic = gc.to_sympy(MODEL)
    z = next(f for f in symbolic.definitions if f.func.__name__ == "z")
    with pytest.raises(gc.InputError, match=r"definitions must not lead back to themselves; got 'z\(tau\)'"):
        gc.from_sympy(changed(definitions={**symbolic.definitions, z: z + 1}))


def test_the_number_of_a_harmonic_is_checked_before_any_work():
    values = {**gc.to_sympy(MODEL).values, symbol("eps10000000000"): 0.1}
    with pytest.raises(gc.InputError, match="values must have numbers of at most 64 in their names; got 'eps1000"):
        gc.from_sympy(changed(values=values))


def test_levels_without_a_gap():
    symbolic = gc.to_sympy(MODELS[3])
    values = {s if s.name != "level2" else sympy.Symbol("level3", real=True): v for s, v in symbolic.values.items()}
    definitions = {f: e.subs(sympy.Symbol("level2", real=True), sympy.Symbol("level3", real=True))
                   for f, e in symbolic.definitions.items()}
    with pytest.raises(gc.InputError, match="level1, level2, … without gaps"):
        gc.from_sympy(dataclasses.replace(symbolic, values=values, definitions=definitions))


def test_what_is_no_symbolic_model_is_refused():
    with pytest.raises(gc.InputError, match="symbolic must be a SymbolicModel; got 'a dict'"):
        gc.from_sympy({})


def test_without_sympy_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(gc.InputError, match=r'SymPy must be installed .* Run: pip install "gearchaos\[sympy\]"'):
        gc.to_sympy(MODEL)


def test_symbolic_models_are_values():
    symbolic = gc.to_sympy(MODEL)
    with pytest.raises(dataclasses.FrozenInstanceError):
        symbolic.values = {}
    with pytest.raises(TypeError):
        symbolic.values[symbol("omega")] = 2.0
    assert json.dumps({s.name: v for s, v in symbolic.values.items()})
