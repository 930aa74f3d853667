"""Labels and units of parameters, axes and results in plain characters, for figures and for the page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import xarray as xr

from gearchaos.explorer.view import bounds
from gearchaos.gears.operating import Gears, pair_of
from gearchaos.gears.results import physical, unit_of
from gearchaos.plot._axes import axis_label
from gearchaos.quantities import (
    COORDINATES,
    HARMONICS,
    OPERATION,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    STIFFNESS_PARAMETERS,
    VERDICTS,
    find,
    quantity,
)

_SCALES = {"delta": "Δ", "omega0": "ω₀", "1/omega0": "1/ω₀", "c0": "c₀", "1": ""}
"""Symbols of the units that make a quantity dimensionless."""


_HINTS = {
    "omega": "Mesh frequency over the natural frequency √(c₀/m) on the mean mesh stiffness: 1 is resonance",
    "q0": "Torque on both wheels, as a compression of the mean mesh stiffness in half backlashes",
    "q1": "Driving torque on wheel 1, as a compression of the mean mesh stiffness in half backlashes",
    "q2": "Resisting torque on wheel 2, as a compression of the mean mesh stiffness in half backlashes",
    "eps": "Amplitude of a harmonic of the transmission error, in half backlashes: how inexact the teeth are",
    "theta": "Phase of a harmonic of the transmission error, in rad",
    "zeta": "Damping of the mesh over critical damping: gears have 0.02 to 0.1",
    "chi0": "Step of the mesh stiffness about its mean, as the number of tooth pairs in contact changes",
    "chi1": "Height of the upper level of the mesh stiffness above its mean",
    "chi2": "Depth of the lower level of the mesh stiffness below its mean",
    "contact_ratio": "Mean number of tooth pairs in contact: 1.5 means two pairs for half of the time",
    "c": "Amplitude of a harmonic of the mesh stiffness, as a share of its mean",
    "alpha": "Phase of a harmonic of the mesh stiffness, in rad",
    "J": "Inertia of each wheel, over the mass m of the relative motion",
    "beta": "Friction in the bearings of each wheel",
    "mu": "Mass of each wheel, over the mass m of the relative motion",
    "kappa": "Stiffness of the support of each wheel, over the mean mesh stiffness",
    "zeta_support": "Damping of the support of each wheel",
    "speed": "Speed of wheel 1", "torque": "Torque at wheel 1",
    "backlash": "Total play of the teeth along the line of action",
    "grade": "Accuracy grade from which the transmission error follows: 1 is the finest",
    "z": "Dynamic transmission error at the start: from −1 to 1, in half backlashes, the teeth are apart",
    "x": "Rotation of a wheel at the start, as an arc on its base circle, in half backlashes",
    "y": "Displacement of the centre of a wheel at the start, in half backlashes",
    "v_rms": "How strong the vibration is, as the root mean square of the velocity",
    "z_rms": "Root mean square of the dynamic transmission error about its mean",
    "z_peak_to_peak": "Largest minus smallest dynamic transmission error",
    "dynamic_factor": "Peak of the mesh force over the static force that carries the torque",
    "contact_fraction": "Share of the time in which the teeth touch",
    "contact": "Whether the teeth stay in contact, separate, or also hit the back flanks",
    "multiplier": "Growth of a small disturbance over one period of the motion: below 1 the motion is stable",
    "lyapunov": "Mean rate at which neighbouring motions part: positive means chaos",
    "mesh_force_peak": "Largest force between the teeth",
}
"""What a parameter or measure means, by name; that of both wheels or of a family of harmonics holds for all of them."""

_MOTIONS = {
    "quasi-periodic": "Two frequencies without a common period: the motion never repeats",
    "chaotic": "Never repeats, and neighbouring motions part exponentially",
    "undecided": "The computation was not long enough to tell", "diverged": "Grows without bound",
    "other sub-harmonic": "Repeats after 5 or more mesh periods",
    "in contact": "The teeth never separate", "separation": "The teeth separate and meet on the driving flanks",
    "both flanks": "The teeth separate and also hit their back flanks", "no contact": "The teeth never touch",
}
"""What the kinds of motion that have no period, and the contact states, mean."""


def hint(name: str) -> str:
    """What a parameter or measure means, in words."""
    base = name.removesuffix("_dot").rstrip("0123456789") if name not in _HINTS else name
    return f"Velocity of: {_HINTS[base]}" if name.endswith("_dot") else _HINTS.get(base, title(name))


def motion_hint(name: str) -> str:
    """What a kind of motion, such as "2T", or a contact state means, in words."""
    count = name.removesuffix("T")
    if not count.isdecimal():
        return _MOTIONS.get(name, "")
    return "Repeats with every mesh period T" if count == "1" else f"Repeats after {count} mesh periods"


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
    found = [*PARAMETERS, *OPERATION, *STIFFNESS_PARAMETERS, *harmonics, *COORDINATES, *RESPONSES, *VERDICTS, *RESULTS]
    with_units = {q.physical.tex: q.physical.symbol for q in found if q.physical is not None}
    return with_units | {q.tex: q.symbol for q in found}


NONE = "–"
"""The unit of a plain number on a page that marks those."""


@dataclass(frozen=True)
class Units:
    """The units of one figure or text.

    Attributes
    ----------
    gears : GearPair, GearDesign or None
        The gears in whose units results are shown; None for dimensionless ones.
    marked : bool
        Whether dimensionless numbers are marked as such, since the page has others too.
    """

    gears: Gears | None = None
    marked: bool = False

    def scaled(self, dataset: xr.Dataset) -> xr.Dataset:
        """A dimensionless result in these units."""
        return dataset if self.gears is None else physical(dataset, self.gears)

    def variables(self, variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
        """Dimensionless variables by name in these units."""
        shown = self.scaled(xr.Dataset(dict(variables)))
        return {name: shown[name].variable for name in variables}

    def one(self, name: str) -> float:
        """The value of one dimensionless unit of a quantity."""
        found = None if self.gears is None else unit_of(name, pair_of(self.gears).scales)
        return 1.0 if found is None else found[0]

    def label(self, array: xr.DataArray | xr.Variable, name: str) -> str:
        """Label of an axis: words, symbol and unit of a variable."""
        text = plain(axis_label(array, name))
        return text if "[" in text or not self.marked else f"{text} [{unit(array) or NONE}]"

    def parameter(self, name: str) -> str:
        """Label of an axis or a slider: a parameter in words, its symbol, and its unit."""
        return f"{title(name)} {symbol(name)}".strip() + self.bracketed(name)

    def bracketed(self, name: str) -> str:
        """The unit of a parameter in brackets after a space; empty on a page without gears."""
        return f" [{self.of_parameter(name)}]" if self.marked else ""

    def after(self, name: str) -> str:
        """The unit of a parameter to follow its value; empty on a page without gears."""
        text = self.of_parameter(name)
        return f" {text if text != NONE else f'[{NONE}]'}" if self.marked else ""

    def of_parameter(self, name: str) -> str:
        """The unit of a parameter or initial value, which is dimensionless unless it is one of gears."""
        found = find(name)
        if found is not None and found.title.endswith("phase"):
            return "rad"
        return NONE if found is None else unit_symbols(found.unit) or NONE

    def of_measure(self, name: str) -> str:
        """The unit of a measure by which a map is coloured, in brackets after a space; empty without gears."""
        found = find(name)
        if not self.marked or found is None:
            return ""
        physical_unit = found.physical.unit if self.gears is not None and found.physical is not None else None
        return f" [{physical_unit or unit_symbols(found.unit) or NONE}]"

    def number(self, value: float | str, unit_text: str) -> str:
        """A number with its unit."""
        mark = unit_text or (f"[{NONE}]" if self.marked else "")
        return f"{value}\N{NO-BREAK SPACE}{mark}" if mark else str(value)
