"""A kind of mesh stiffness, a standard of the dynamic factor and a study, from outside gearchaos."""

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
    """The stiffness 1, and less for the last share of the mesh period, in which the second pair is late."""

    late_level: float = 0.6
    late_share: float = 0.3

    kind = form = "late pair"
    noun, predicate, keys = "a stiffness with a late pair", "has a late pair", "late_level and late_share"
    rows = tuple(Quantity(name, title=name.replace("_", " "), range=Range(0.1, 0.9, 0.01, 0.99), rule=SHARE,
                          toml_table="[model.stiffness]") for name in ("late_level", "late_share"))

    def __post_init__(self):
        for name in ("late_level", "late_share"):
            object.__setattr__(self, name, to_float(name, getattr(self, name)))

    @classmethod
    def parts(cls, values):
        return (0, 1), (1 - values["late_share"], values["late_level"])

    def describe(self):
        return f"{self.late_level:.4g} for {self.late_share:.4g} of the mesh period, else 1"


@dataclass(frozen=True)
class DynamicFactorBarth:
    value: float = described("K_v", "(6.1 + v)/6.1, v in m/s", "C. Barth, for cut teeth")
    reason: ClassVar[str] = ""


BARTH = Standard(name="Kv_Barth", label="Barth", words="Barth's equation", result=DynamicFactorBarth,
                 needs=("speed", "torque"), compute=lambda gears: DynamicFactorBarth((6.1 + gears.load.velocity) / 6.1))


@dataclass(frozen=True)
class LinearResponse(Study):
    """Compute the amplitude of the deflection that the first harmonic of the transmission error causes without gap."""

    kind: ClassVar[str] = "linear_response"
    gridded: ClassVar[bool] = True
    quantities: ClassVar = (Quantity("linear_amplitude", "a", long_name="linear amplitude of the deflection",
                                     unit="delta"),)
    variables: ClassVar = ("linear_amplitude",)

    axis: Axis = axis_option("A parameter and its range.")

    @cached_property
    def cost(self):
        return self.estimate(self.axis.count, 1)

    def compute(self, items, *, progress=False, threads=None):
        at = vary(self.model, {self.axis.name: self.axis.values[items]})
        omega, inverse_mass = at["omega"], 1 / at["J1"] + 1 / at["J2"]
        response = omega**2 / (inverse_mass * (1 + 2j * at["zeta"] * omega) - omega**2)
        return {"linear_amplitude": np.broadcast_to(np.abs(at["eps1"] * response), len(items))}


linear_response = function_of(LinearResponse)
