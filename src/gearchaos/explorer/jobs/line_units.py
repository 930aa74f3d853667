"""Results along the line of the bifurcation diagram in the units that a page shows."""

from __future__ import annotations

import xarray as xr

from gearchaos.explorer.view.state import View
from gearchaos.gears.results import physical


def in_units(dataset: xr.Dataset, view: View) -> xr.Dataset:
    """A dimensionless result along `View.line_axis` in the units that the view shows.

    Values of the parameter stay in the unit of the axis, on which the page draws them: ω is not turned into a frequency
    in Hz. Those of a branch are its coordinate, ``event_value``, ``jump_value`` and the JSON of some attributes.
    """
    if not view.physical or view.gears is None:
        return dataset
    name = view.line_axis.name
    found = physical(dataset, view.gears).assign_coords({name: dataset[name]})
    found = found.assign({n: dataset[n] for n in ("event_value", "jump_value") if n in dataset})
    return found.assign_attrs(dataset.attrs)
