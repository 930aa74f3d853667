"""Materials of gear wheels: elasticity and density."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.inputs.declared import DENSITY, PRESSURE, convert_fields, number, one, read_by, record_values
from gearchaos.quantities import Rule


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic elastic material.

    Parameters
    ----------
    E : pressure
        Modulus of elasticity: a number in Pa, a text such as ``"206 GPa"`` or a pint quantity.
    poisson : float
        Poisson's ratio ν.
    density : mass/volume
        ρ, e.g. ``"7830 kg/m^3"``.

    Raises
    ------
    InputError
        For a value that is not of its dimension, or that no solid has.
    """

    E: Any = field(metadata=read_by(one(PRESSURE, between=(1e7, 1.2e12))))
    poisson: float = field(metadata=read_by(number(
        Rule(lambda v: (v >= 0) & (v < 0.5), "must be at least 0 and less than 0.5"))))
    density: Any = field(metadata=read_by(one(DENSITY, between=(100.0, 25e3))))

    def __post_init__(self) -> None:
        convert_fields(self)


STEEL = Material(E=206e9, poisson=0.3, density=7830.0)
"""Steel: E and ν of ISO 6336-2:2006, Table 1; density of ISO 6336-1:2006."""

_NAMED = {"steel": STEEL}


def read_material(field: str, value: Any) -> Material:
    """The material of a wheel: a name, a `Material`, or a mapping with its values.

    The field of an error is that of the value within it, e.g. ``material[0].E``.
    """
    if isinstance(value, Material):
        return value
    if isinstance(value, str):
        if value not in _NAMED:
            raise unknown_name("material", value, _NAMED)
        return _NAMED[value]
    if not isinstance(value, Mapping):
        raise InputError(field, "must be a name or a table with E, poisson and density", value, "E.g. 'steel'.")
    return record_values(Material, field, value)
