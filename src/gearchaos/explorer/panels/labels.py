"""Labels of parameters, axes and units in plain characters, for figures and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import xarray as xr

from gearchaos.explorer.view import bounds
from gearchaos.gears.pair import GearPair
from gearchaos.gears.results import physical
from gearchaos.plot._axes import axis_label
from gearchaos.quantities import (
    COORDINATES,
    HARMONICS,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    STIFFNESS_LEVELS,
    VERDICTS,
    find,
    quantity,
)

_SCALES = {"delta": "Δ", "omega0": "ω₀", "1/omega0": "1/ω₀", "c0": "c₀", "1": ""}
"""Symbols of the units that make a quantity dimensionless."""


def title(name: str) -> str:
    """A parameter in words; empty for an initial value."""
    found = find(name)
    return "" if found is None else found.title


def symbol(name: str) -> str:
    """The symbol of a parameter or variable, or its name in words if it has none."""
    found = find(name)
    return found.symbol if found is not None and found.symbol else name.replace("_", " ")


def label(array: xr.DataArray | xr.Variable, name: str) -> str:
    """Label of an axis: words, symbol and unit of a variable."""
    return plain(axis_label(array, name))


def unit(array: xr.Variable) -> str:
    """The unit of a variable, e.g. ``mm/s`` or ``Δω₀``; empty for a plain number."""
    text = array.attrs.get("units", "1")
    return "".join(_SCALES[part] for part in parts) if set(parts := text.split("*")) <= _SCALES.keys() else text


def in_units(variables: Mapping[str, xr.Variable], pair: GearPair | None) -> dict[str, xr.Variable]:
    """Dimensionless variables by name, converted to the units of the pair if there is one."""
    if pair is None:
        return dict(variables)
    shown = physical(xr.Dataset(dict(variables)), pair)
    return {name: shown[name].variable for name in variables}


def plain(text: str) -> str:
    """A text with the mathtext of symbols in plain characters: ``$\\varepsilon_{1}$`` becomes ε₁."""
    before, _, rest = text.partition("$")
    tex, _, after = rest.partition("$")
    return f"{before}{_plain_symbols().get(tex, tex)}{after}"


@cache
def _plain_symbols() -> dict[str, str]:
    """The symbols of all quantities, dimensionless and with units, by their mathtext."""
    orders = range(1, bounds.HIGHEST_HARMONIC + 1)
    harmonics = [quantity(f"{family}{order}") for family in HARMONICS for order in orders]
    found = [*PARAMETERS, *STIFFNESS_LEVELS, *harmonics, *COORDINATES, *RESPONSES, *VERDICTS, *RESULTS]
    with_units = {q.physical.tex: q.physical.symbol for q in found if q.physical is not None}
    return with_units | {q.tex: q.symbol for q in found}
