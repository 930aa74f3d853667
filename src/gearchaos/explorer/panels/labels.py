"""Labels of parameters, axes and units in plain characters, for figures and for the page."""

from __future__ import annotations

from functools import cache

import xarray as xr

from gearchaos.explorer.view import bounds
from gearchaos.plot._axes import axis_label
from gearchaos.quantities import (
    COORDINATES,
    HARMONICS,
    OPERATION,
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


def unit(array: xr.DataArray | xr.Variable) -> str:
    """The unit of a variable, e.g. ``mm/s`` or ``Δω₀``; empty for a plain number."""
    return unit_symbols(array.attrs.get("units", "1"))


def unit_symbols(text: str) -> str:
    """A unit as it is shown: ``Δω₀`` for ``delta*omega0``, ``N m`` for ``N*m``; empty for a plain number."""
    parts = text.split("*")
    return "".join(_SCALES[part] for part in parts) if set(parts) <= _SCALES.keys() else " ".join(parts)


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
    found = [*PARAMETERS, *OPERATION, *STIFFNESS_LEVELS, *harmonics, *COORDINATES, *RESPONSES, *VERDICTS, *RESULTS]
    with_units = {q.physical.tex: q.physical.symbol for q in found if q.physical is not None}
    return with_units | {q.tex: q.symbol for q in found}
