"""Studies at the chosen point: a bifurcation diagram through it, its basins of attraction, its coexisting motions."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.initial_conditions import default_box
from gearchaos.explorer.view.bounds import BASIN_CELLS, DIAGRAM_COLUMNS, DIAGRAM_POINTS, INITIAL_STATES
from gearchaos.explorer.view.state import View
from gearchaos.gears.results import physical
from gearchaos.model import MeshModel
from gearchaos.studies.attractors import Attractors
from gearchaos.studies.axis import Axis
from gearchaos.studies.basins import Basins
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.study import Study

_SETTINGS = Classification(doublings=2, longest_transient=1500)
"""Transients are shorter than those of `gearchaos.regime`, since a page needs many motions within seconds."""

_PARTS = 8
"""Parts in which a fine study is computed; it can be cancelled between them."""


def bifurcation(view: View, *strides: int) -> Generator[xr.Dataset]:
    """The bifurcation diagram along the line through the point, once for each stride between its columns.

    It is in the units that the view shows. An empty Dataset stands for progress without a result.
    """
    axis = view.line_axis
    for stride in strides:
        along = Axis(axis.name, axis.start, axis.stop, DIAGRAM_COLUMNS // stride)
        study = Bifurcation(view.operating_point, along, points=DIAGRAM_POINTS, settings=_SETTINGS)
        for found in _in_parts(study, _PARTS if stride == 1 else 1):
            yield in_units(found, view) if found else found


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


def basins(view: View) -> Generator[xr.Dataset]:
    """Basins of attraction of the point, coarse and then fine, on the plane of `basin_axes`.

    Initial values off the plane are those of the motion chosen at the point. An empty Dataset stands for progress
    without a result.
    """
    for share in (4, 1):
        x, y = basin_axes(view.point, (BASIN_CELLS[0] // share, BASIN_CELLS[1] // share))
        in_plane = view.point.with_values({axis.name: axis.start for axis in (x, y)})
        yield from _in_parts(Basins(in_plane, x, y, settings=_SETTINGS), _PARTS if share == 1 else 1)


def basin_axes(model: MeshModel, count: tuple[int, int]) -> tuple[Axis, Axis]:
    """Displacement and velocity of wheel 1, or relative ones for the single model, with ``count`` values along each."""
    (x, ends), (y, heights) = list(default_box(model).items())[:2]
    return Axis(x, *ends, count[0]), Axis(y, *heights, count[1])


def attractors(view: View) -> Generator[xr.Dataset]:
    """The motions that `INITIAL_STATES` initial states lead to.

    In addition to the variables of `gearchaos.attractors` the Dataset has ``attractor_start_NAME``: initial values that
    lead to each motion.
    """
    found = Attractors(view.operating_point, INITIAL_STATES, settings=_SETTINGS).run()
    index = found["attractor"].values
    first = np.array([int(np.flatnonzero(index == i)[0]) for i in range(found.sizes.get("number", 0))], dtype=int)
    yield found.assign({
        f"attractor_{n}": variable(n.removeprefix("start_"), ("number",), found[n].values[first])
        for n in map(str, found.data_vars) if n.startswith("start_")
    })


def _in_parts(study: Study, parts: int) -> Generator[xr.Dataset]:
    """Compute a study in parts: an empty Dataset after each part, then the result."""
    found: dict[str, np.ndarray] = {}
    for numbers in np.array_split(np.arange(study.count), parts):
        for name, values in study.compute(numbers).items():
            if name not in found:
                found[name] = np.zeros((study.count, *values.shape[1:]), values.dtype)
            found[name][numbers] = values
        yield xr.Dataset()
    yield study.finish(found)
