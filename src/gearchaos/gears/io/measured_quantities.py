"""What is measured of a mesh, and computed beside it: one declaration for spectra, fits, run-ups and files."""

from __future__ import annotations

from typing import Literal, NamedTuple

from gearchaos.gears.io import units
from gearchaos.gears.io.tables import Column

MeasuredQuantity = Literal["mesh force", "deflection", "transmission error", "acceleration"]

MEANING = ("The deflection is that of the mesh, the transmission error R1 φ1 − R2 φ2, both along the line of "
           "action; the acceleration is that of the latter.")


class Measured(NamedTuple):
    """A quantity that may be measured."""

    dimension: units.Dimension
    words: str  # a regular expression, found in headers
    variable: str  # its amplitude at an order, in results
    reference: float  # of levels in dB, in the physical unit of the variable
    reference_words: str


# levels of accelerations by ISO 1683
MEASURED: dict[MeasuredQuantity, Measured] = {
    "mesh force": Measured(units.FORCE, "force|kraft", "order_force", 1.0, "1 N"),
    "deflection": Measured(units.LENGTH, "deflection|verformung", "order_deflection", 1.0, "1 µm"),
    "transmission error": Measured(
        units.LENGTH, r"\bd?te\b|error|fehler|abweich", "order_transmission_error", 1.0, "1 µm"),
    "acceleration": Measured(units.ACCELERATION, "accel|beschleunig", "order_acceleration", 1e-6, "1 µm/s²"),
}


def other_quantities(of: MeasuredQuantity, advice: str) -> tuple[tuple[Column, str], ...]:
    """Columns of quantities with other units, and the advice for each, with its name in place of {0}."""
    return tuple((Column(name, {each.dimension: 1.0}), advice.format(name)) for name, each in MEASURED.items()
                 if each.dimension is not MEASURED[of].dimension)
