"""The units in which a page shows numbers: dimensionless ones, or those of gears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import xarray as xr

from gearchaos.explorer.panels.labels import plain, symbol, title, unit, unit_symbols
from gearchaos.gears.operating import Gears, pair_of
from gearchaos.gears.results import physical
from gearchaos.gears.scales import unit_of
from gearchaos.plot._axes import axis_label
from gearchaos.quantities import find

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
