"""A mesh stiffness, a standard of K_v and a study from outside."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from gearchaos.gears.dynamic_factor import Standard
from gearchaos.gears.io.fields import described
from gearchaos.model import Stiffness, vary
from gearchaos.quantities import Quantity, Range, Rule
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import axis_option
from gearchaos.studies.core.study import Study
from gearchaos.validation import to_float

SHARE = Rule(lambda v: (v > 0) & (v < 1), "must lie between 0 and 1")


@dataclass(frozen=True)
class LatePairStiffness(Stiffness):
    """The stiffness is 1, and less while the second pair is late: in the
    last share of the mesh period."""

    late_level: float = 0.6
    late_share: float = 0.3

    kind = form = "late pair"
    noun, predicate = "a stiffness with a late pair", "has a late pair"
    keys = "late_level and late_share"
    rows = tuple(
        Quantity(name, title=name.replace("_", " "), rule=SHARE,
                 range=Range(0.1, 0.9, 0.01, 0.99),
                 toml_table="[model.stiffness]")
        for name in ("late_level", "late_share"))

    def __post_init__(self):
        for name in ("late_level", "late_share"):
            value = to_float(name, getattr(self, name))
            object.__setattr__(self, name, value)

    @classmethod
    def parts(cls, values):
        late_from = 1 - values["late_share"]
        return (0, 1), (late_from, values["late_level"])

    def describe(self):
        late = f"{self.late_level:.4g} for {self.late_share:.4g}"
        return f"{late} of the mesh period, else 1"


@dataclass(frozen=True)
class DynamicFactorBarth:
    value: float = described(
        "K_v", "(6.1 + v)/6.1, v in m/s", "C. Barth, for cut teeth")
    reason: ClassVar[str] = ""


def barth(gears):
    return DynamicFactorBarth((6.1 + gears.load.velocity) / 6.1)


BARTH = Standard(
    name="Kv_Barth", label="Barth", words="Barth's equation",
    result=DynamicFactorBarth, needs=("speed", "torque"), compute=barth)


@dataclass(frozen=True)
class LinearResponse(Study):
    """Compute the amplitude of the deflection without a gap that the first
    harmonic of the transmission error causes."""

    kind: ClassVar[str] = "linear_response"
    gridded: ClassVar[bool] = True
    quantities: ClassVar = (Quantity(
        "linear_amplitude", "a", unit="delta",
        long_name="linear amplitude of the deflection"),)
    variables: ClassVar = ("linear_amplitude",)

    axis: Axis = axis_option("A parameter and its range.")

    @cached_property
    def cost(self):
        return self.estimate(self.axis.count, 1)

    def compute(self, items, *, progress=False, threads=None):
        at = vary(self.model, {self.axis.name: self.axis.values[items]})
        omega, inverse_mass = at["omega"], 1 / at["J1"] + 1 / at["J2"]
        stiffness = inverse_mass * (1 + 2j * at["zeta"] * omega)
        found = np.abs(at["eps1"] * omega**2 / (stiffness - omega**2))
        return {"linear_amplitude": np.broadcast_to(found, len(items))}


linear_response = function_of(LinearResponse)
