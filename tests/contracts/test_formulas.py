"""The descriptions of computed gear quantities: each has a source, and its unit fits its factor."""

from __future__ import annotations

import pytest

from gearchaos.gears import units
from gearchaos.gears.dynamic_factor import Resonance
from gearchaos.gears.dynamic_factor.agma import DynamicFactorAGMA
from gearchaos.gears.dynamic_factor.iso_method_b import Deviations, DynamicFactorB
from gearchaos.gears.dynamic_factor.iso_method_c import DynamicFactorC
from gearchaos.gears.fields import Formula, formulas
from gearchaos.gears.mechanics import MeshLoad
from gearchaos.gears.stiffness.iso6336 import ToothStiffness
from gearchaos.gears.transmission_error.harmonics import QualityError
from gearchaos.gears.transmission_error.iso1328_1995 import Tolerances1995
from gearchaos.gears.transmission_error.iso1328_2013 import Tolerances2013

RESULTS = (
    Deviations, DynamicFactorAGMA, DynamicFactorB, DynamicFactorC, MeshLoad, QualityError, Resonance,
    Tolerances1995, Tolerances2013, ToothStiffness,
)

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


def test_results_without_formulas_have_none():
    assert formulas(Formula) == {}
