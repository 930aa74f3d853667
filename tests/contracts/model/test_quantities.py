"""The table of quantities: names in every form, symbols, completeness."""

from __future__ import annotations

import re

import pytest
from matplotlib.mathtext import MathTextParser

from gearchaos import quantities
from gearchaos.errors import InputError
from gearchaos.model import MeshModel, ToothPairStiffness
from gearchaos.model.stiffness.two_level import CONTACT_RATIO
from gearchaos.quantities import Name, find, parse, parse_harmonic, quantity
from tests import ROOT

OF_RESULTS = (quantities.COORDINATES, quantities.RESPONSES, quantities.VERDICTS, quantities.RESULTS)
OF_MODELS = [each.name for each in (*quantities.PARAMETERS, *quantities.STIFFNESS_PARAMETERS)]
NAMES = [*OF_MODELS, *(each.name for table in OF_RESULTS for each in table),
         *(f"{family}{n}" for family in quantities.HARMONICS for n in (1, 12, 64))]


def test_a_dynamic_factor_is_a_quantity_by_whatever_standard_it_is():
    for name in ("Kv_STANDARD", "Kv_ISO_B", "Kv_made_up"):
        assert (quantity(name).name, quantity(name).symbol, quantity(name).unit) == (name, "K_v", "1")
    assert find("Kv") is None


@pytest.mark.parametrize("prefix", ["", *quantities.PREFIXES])
def test_every_name_has_one_row_is_its_parts_and_leads_to_its_quantity(prefix):
    assert len(NAMES) == len(set(NAMES))
    for name in NAMES:
        parts = parse(prefix + name)
        assert (str(parts), parts.prefix, quantity(prefix + name).name) == (prefix + name, prefix, name)


@pytest.mark.parametrize(("name", "parts"), [
    ("omega", Name("omega")), ("eps3", Name("eps", 3)), ("q0", Name("q", 0)), ("z_dot", Name("z", None, 1)),
    ("zeta_support2", Name("zeta_support", 2)), ("z_dot_rms", Name("z_dot_rms")), ("x1_dot", Name("x", 1, 1)),
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
    models, pairs = (MeshModel.of("full", eps3=0.1), MeshModel.of(c2=0.1), MeshModel()), quantities.PARAMETER_PAIRS
    assert all(set(members) <= set(OF_MODELS) for members in pairs.values())
    coordinates = (each.name for each in quantities.COORDINATES)
    for name in {*pairs, *(n for m in models for n in m.parameters()), *coordinates}:
        low, high, least, most = quantity(name).range
        assert least <= low < high <= most, name
        assert quantity(name).range.step == (high - low) / 400


def test_every_symbol_renders():
    parser = MathTextParser("path")
    for name in NAMES:
        one = quantity(name)
        assert bool(one.tex) == bool(one.symbol), name
        for tex in filter(None, (one.tex, one.physical and one.physical.tex)):
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
    plain = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")
    for names, symbols, default, rule, _ in rows:
        for name, symbol in zip(re.findall(r"`(\w+)`", names.split(" …")[0]), symbols.split(", "), strict=True):
            one = quantity(name)
            rule_of_kind = CONTACT_RATIO if name == "contact_ratio" else one.rule  # tooth pairs have another one
            words = re.sub("^must (be |lie )?", "", rule_of_kind.text).replace("not be", "not") if rule_of_kind else ""
            assert one.symbol.translate(plain) == symbol
            assert values[name] == float(default.split(";")[0]) and words == rule.split(";")[0], name
            found.add(name)
    assert found == set(values)


def test_the_documents_table_of_variables_is_that_of_the_code():
    described = [each for table in OF_RESULTS for each in table if each.long_name]
    expected = [[f"`{each.name}`", each.long_name, each.unit, each.physical.unit if each.physical else ""]
                for each in described]
    lines = "\n".join(f"| {' | '.join(row)} |".replace("|  |", "| |") for row in expected)
    assert _rows("Variables of results") == expected, f"The table should be\n{lines}"
