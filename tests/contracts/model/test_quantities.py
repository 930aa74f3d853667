"""The table of quantities: names in every form, symbols, completeness."""

from __future__ import annotations

import re

import pytest
from matplotlib.mathtext import MathTextParser

from gearchaos.errors import InputError
from gearchaos.model import MeshModel, ToothPairStiffness
from gearchaos.quantities import (
    COORDINATES,
    HARMONICS,
    PARAMETER_PAIRS,
    PARAMETERS,
    PREFIXES,
    RESPONSES,
    RESULTS,
    STIFFNESS_PARAMETERS,
    VERDICTS,
    Name,
    find,
    parse,
    parse_harmonic,
    quantity,
)
from tests import ROOT

TABLES = (PARAMETERS, STIFFNESS_PARAMETERS, COORDINATES, RESPONSES, VERDICTS, RESULTS)
NAMES = [q.name for table in TABLES for q in table] + [f"{family}{n}" for family in HARMONICS for n in (1, 12, 64)]


def test_a_dynamic_factor_is_a_quantity_by_whatever_standard_it_is():
    for name in ("Kv_STANDARD", "Kv_ISO_B", "Kv_made_up"):
        assert (quantity(name).name, quantity(name).symbol, quantity(name).unit) == (name, "K_v", "1")
    assert find("Kv") is None


@pytest.mark.parametrize("prefix", ["", *PREFIXES])
def test_every_name_has_one_row_is_its_parts_and_leads_to_its_quantity(prefix):
    assert len(NAMES) == len(set(NAMES))
    for name in NAMES:
        assert str(parse(prefix + name)) == prefix + name
        assert parse(prefix + name).prefix == prefix
        assert quantity(prefix + name).name == name


@pytest.mark.parametrize(("name", "parts"), [
    ("omega", Name("omega")), ("eps3", Name("eps", 3)), ("q0", Name("q", 0)),
    ("zeta_support2", Name("zeta_support", 2)),
    ("z_dot", Name("z", None, 1)), ("z_dot_rms", Name("z_dot_rms")), ("x1_dot", Name("x", 1, 1)),
    ("section_x1_dot", Name("x", 1, 1, "section_")), ("start_y2", Name("y", 2, 0, "start_")),
    ("attractor_section_z", Name("z", prefix="attractor_section_")), ("attractor", Name("attractor")),
    ("attractor_start_z", Name("z", prefix="attractor_start_")), ("tau_section", Name("tau_section")),
    ("attractor_v_rms", Name("v_rms", prefix="attractor_")), ("no name", Name("no name")), ("", Name("")),
])
def test_parts(name, parts):
    assert parse(name) == parts


@pytest.mark.parametrize("name", ["eps0", "eps01", "eps", "eps-1", "eps1_dot", "section_eps1", "q1", "eps²", "eps１"])
def test_what_is_no_harmonic(name):
    assert parse_harmonic(name) is None


@pytest.mark.parametrize("name", ["eps0", "eps", "x3", "x", "omegas", "section_", "J3", "J1_dot", "eps1_dot", ""])
def test_what_is_no_quantity(name):
    assert find(name) is None
    with pytest.raises(InputError, match="must be one of"):
        quantity(name)


def test_every_parameter_and_coordinate_of_every_model_has_a_row_with_a_range():
    parameters = {q.name for q in (*PARAMETERS, *STIFFNESS_PARAMETERS)}
    assert all(set(members) <= parameters for members in PARAMETER_PAIRS.values())
    models = [MeshModel.of("full", eps3=0.1), MeshModel.of("single", c2=0.1), MeshModel()]
    for name in {*PARAMETER_PAIRS, *(n for m in models for n in m.parameters()), *(q.name for q in COORDINATES)}:
        low, high, least, most = quantity(name).range
        assert least <= low < high <= most, name
        assert quantity(name).range.step == (high - low) / 400


def test_every_symbol_renders():
    parser = MathTextParser("path")
    for name in NAMES:
        q = quantity(name)
        assert bool(q.tex) == bool(q.symbol), name
        for tex in filter(None, (q.tex, q.physical and q.physical.tex)):
            parser.parse(f"${tex}$")


@pytest.mark.parametrize(("name", "symbol", "tex"), [
    ("eps12", "ε₁₂", r"\varepsilon_{12}"), ("zeta_support2", "ζ₂", r"\zeta_{2}"), ("q0", "q₀", "q_0"),
    ("section_x1_dot", "x₁′", r"\dot{x}_{1}"), ("z_dot", "z′", r"\dot{z}"), ("attractor_lyapunov", "λ₁", r"\lambda_1"),
])
def test_symbols(name, symbol, tex):
    assert (quantity(name).symbol, quantity(name).tex) == (symbol, tex)
    of_order = quantity("eps3").physical
    assert (of_order.symbol, of_order.tex) == ("e₃", "e_{3}")


MODEL_PAGE = (ROOT / "docs" / "model.md").read_text()


def _rows(title: str) -> list[list[str]]:
    """The cells of the first table below a title of docs/model.md."""
    table = MODEL_PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    lines = (line.replace("| |", "|  |") for line in table.splitlines() if line.startswith("| `"))
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in lines]


def test_the_documents_table_of_parameters_agrees():
    rows = [row for row in _rows("Parameters") if row[0] not in ("`kind`", "`damping_law`")]
    values, found = MeshModel.of("full", theta1=0.0).parameters() | MeshModel.of(c1=0.0).parameters(), set()
    values |= ToothPairStiffness().parameters()
    for names, symbols, default, rule, _ in rows:
        for name, symbol in zip(re.findall(r"`(\w+)`", names.split(" …")[0]), symbols.split(", "), strict=True):
            q = quantity(name)
            words = "" if q.rule is None else _short(q.rule.text)
            assert q.symbol.translate(_PLAIN) == symbol
            assert values[name] == float(default.split(";")[0]), name
            assert words == rule.split(";")[0], name
            found.add(name)
    assert found == set(values)


def _short(rule: str) -> str:
    """A rule as the table of the documents has it."""
    return rule.removeprefix("must ").removeprefix("be ").removeprefix("lie ").replace("not be", "not")


_PLAIN = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")


def test_the_documents_table_of_variables_is_that_of_the_code():
    described = [q for table in (COORDINATES, RESPONSES, VERDICTS, RESULTS) for q in table if q.long_name]
    expected = [[f"`{q.name}`", q.long_name, q.unit, q.physical.unit if q.physical else ""] for q in described]
    lines = "\n".join(f"| {' | '.join(row)} |".replace("|  |", "| |") for row in expected)
    assert _rows("Variables of results") == expected, f"The table should be\n{lines}"
