"""Refusal of values that only a slip of units explains, with the question what was meant."""

from __future__ import annotations

import math

from gearchaos.errors import InputError
from gearchaos.gears import units

PRESSURE = units.Dimension("a modulus of elasticity", "Pa", "206 GPa")
DENSITY = units.Dimension("a density", "kg/m^3", "7830 kg/m^3")

_OTHER_UNITS: dict[units.Dimension, tuple[tuple[str, float], ...]] = {
    units.LENGTH: (("mm", 1e-3), ("um", 1e-6)),
    units.ANGLE: (("deg", math.pi / 180),),
    units.STIFFNESS: (("N/um", 1e6),),
    PRESSURE: (("GPa", 1e9), ("MPa", 1e6)),
    DENSITY: (("g/cm^3", 1e3),),
}
"""Units in which a number may have been meant, and their values in SI."""


def check_plausible(
    field: str, number: float, least: float, most: float, dimension: units.Dimension, reason: str = ""
) -> None:
    """Raise `InputError` unless a number in SI lies within plausible bounds.

    Parameters
    ----------
    field : str
        Name of the value in the message.
    number, least, most : float
        The number in SI and its bounds.
    dimension : Dimension
        What the number is.
    reason : str, optional
        Where the bounds come from, as a sentence.
    """
    if least <= number <= most:
        return
    shown = units.Length(number, number) if dimension is units.LENGTH else units.Shown(number, number)
    unit = shown.unit or dimension.unit
    meant = [unit for unit, size in _OTHER_UNITS.get(dimension, ()) if least <= number * size <= most
             and not isinstance(number, units.Measured)]
    question = f"Did you mean '{number:g} {meant[0]}'? A plain number is in {dimension.unit}. " if meant else ""
    raise InputError(field, f"must lie between {least / shown.size:.4g} and {most / shown.size:.4g} {unit}", shown,
                     f"{question}{reason}".rstrip())
