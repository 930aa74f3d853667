"""Values in the units on show: those of the physical pair, or what makes them dimensionless."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from gearchaos.gears.pair import GearPair
from gearchaos.gears.results import physical

_SIGNS = {"delta": "Δ", "omega0": "ω₀", "1/omega0": "1/ω₀", "c0": "c₀", "1": ""}


def in_units(variables: Mapping[str, xr.Variable], pair: GearPair | None) -> dict[str, xr.Variable]:
    """Dimensionless variables by name, in the units of the pair if there is one."""
    if pair is None:
        return dict(variables)
    shown = physical(xr.Dataset(dict(variables)), pair)
    return {name: shown[name].variable for name in variables}


def unit_words(array: xr.Variable) -> str:
    """The unit of a variable as it is read, e.g. ``mm/s`` or ``Δω₀``; nothing for a pure number."""
    unit = array.attrs.get("units", "1")
    return "".join(_SIGNS[part] for part in parts) if set(parts := unit.split("*")) <= _SIGNS.keys() else unit
