"""Labels of parameters, axes and units in plain characters, for figures and for the page."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from gearchaos.gears.pair import GearPair
from gearchaos.gears.results import physical
from gearchaos.plot._axes import axis_label
from gearchaos.plot._axes import symbol as mathtext

_WORDS = {
    "omega": "mesh frequency", "q": "torque", "zeta": "mesh damping", "chi": "stiffness step",
    "contact_ratio": "contact ratio", "eps": "error amplitude", "theta": "error phase", "c": "stiffness amplitude",
    "alpha": "stiffness phase", "J": "inertia", "beta": "bearing friction", "mu": "wheel mass",
    "kappa": "support stiffness", "zeta_support": "support damping",
}
_GREEK = {
    r"\omega": "ω", r"\varepsilon": "ε", r"\theta": "θ", r"\alpha": "α", r"\kappa": "κ", r"\beta": "β", r"\mu": "μ",
    r"\zeta": "ζ", r"\chi": "χ", r"\tau": "τ", r"\lambda": "λ", r"\dot{z}": "z′", r"V_\mathrm{RMS}": "V_RMS",
}
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
_SCALES = {"delta": "Δ", "omega0": "ω₀", "1/omega0": "1/ω₀", "c0": "c₀", "1": ""}
"""Symbols of the units that make a quantity dimensionless."""


def title(name: str) -> str:
    """A parameter in words; empty for an initial value."""
    return _WORDS.get(name.rstrip("0123456789"), _WORDS.get(name, ""))


def symbol(name: str) -> str:
    """The symbol of a parameter or variable."""
    return plain(mathtext(name))


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
    """A text with mathtext in plain characters: ``$\\varepsilon_{1}$`` becomes ε₁."""
    if "$" not in text:
        return text
    before, sign, after = text.partition("$")[0], text.split("$")[1], text.split("$", 2)[2]
    for name, letter in _GREEK.items():
        sign = sign.replace(name, letter)
    if sign.startswith(r"\dot{"):
        sign = sign.replace(r"\dot{", "").replace("}", "", 1) + "′"
    head, low, index = sign.partition("_")
    index = index.strip("{}") if low else ""
    subscript = index.replace("{", "").replace("}", "")
    digits = subscript.strip("′").replace(",", "").isdigit()
    shown = subscript.translate(_SUBSCRIPTS) if digits else f"_{subscript}" if low else ""
    return f"{before}{head}{shown}{after}"
