"""Materials of gear wheels: elasticity and density."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears import units
from gearchaos.gears.inputs.forms import record_values, two_values
from gearchaos.gears.inputs.plausibility import DENSITY, PRESSURE, check_plausible
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float

_POISSON = Rule(lambda v: (v >= 0) & (v < 0.5), "must be at least 0 and less than 0.5")


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

    E: Any
    poisson: float
    density: Any

    def __post_init__(self) -> None:
        for name, dimension, least, most in (("E", PRESSURE, 1e7, 1.2e12), ("density", DENSITY, 100.0, 25e3)):
            number = units.to_si(name, getattr(self, name), dimension)
            check_plausible(name, number, least, most, dimension)
            object.__setattr__(self, name, number)
        object.__setattr__(self, "poisson", to_float("poisson", self.poisson))
        check_rule("poisson", self.poisson, _POISSON)


STEEL = Material(E=206e9, poisson=0.3, density=7830.0)
"""Steel: E and ν of ISO 6336-2:2006, Table 1; density of ISO 6336-1:2006."""

_NAMED = {"steel": STEEL}


def named(name: str) -> Material:
    """The material of a name, e.g. ``"steel"``; raises `InputError` if there is none."""
    if name not in _NAMED:
        raise unknown_name("material", name, _NAMED)
    return _NAMED[name]


def materials(value: Any) -> tuple[Material, Material]:
    """The materials of both wheels from one or two of: a name, a `Material`, a mapping with the values of one."""
    first, second = two_values("material", value, _material)
    return first, second


def _material(field: str, value: Any) -> Material:
    """One material; the field of an error is that of the value within it, e.g. ``material[0].E``."""
    if isinstance(value, Material):
        return value
    if isinstance(value, str):
        return named(value)
    if not isinstance(value, Mapping):
        raise InputError(field, "must be a name or a table with E, poisson and density", value, "E.g. 'steel'.")
    return record_values(Material, field, value)
