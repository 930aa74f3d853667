"""The descriptions of computed gear quantities: each has a source, and its unit fits its factor."""

from __future__ import annotations

from dataclasses import is_dataclass
from importlib import import_module
from pkgutil import walk_packages

import pytest

from gearchaos import gears
from gearchaos.gears import units
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.fields import Formula, formulas

MODULES = [import_module(found.name) for found in walk_packages(gears.__path__, "gearchaos.gears.")]
RESULTS = [value for module in MODULES for value in vars(module).values()
           if is_dataclass(value) and value.__module__ == module.__name__ and formulas(value)]

SI = {"N": "N", "N/mm": "N/m", "N/(mm µm)": "N/m^2", "mm µm/N": "m^2/N", "µm": "m", "m/s": "m/s", "kg/mm": "kg/m",
      "rpm": "rad/s"}


def described():
    """Each formula with the name of its result and field."""
    return [(f"{r.__name__}.{name}", formula) for r in RESULTS for name, formula in formulas(r).items()]


@pytest.mark.parametrize("formula", [pytest.param(formula, id=name) for name, formula in described()])
def test_formula(formula: Formula):
    assert formula.text and formula.source
    if not formula.unit:
        assert formula.factor == 1
        return
    dimension = units.Dimension("a value", SI[formula.unit], "")
    if formula.unit == "rpm":
        dimension = units.SPEED
    text = formula.unit.replace(" ", "*")
    in_si = units.to_si("value", f"1 {text}", dimension) * (units.RPM if formula.unit == "rpm" else 1)
    assert in_si * formula.factor == pytest.approx(1, rel=1e-12)


def test_every_standard_has_formulas():
    assert {standard.result for standard in standards()} < set(RESULTS)


def test_results_without_formulas_have_none():
    assert formulas(Formula) == {}
