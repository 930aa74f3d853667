"""What lies about the point: a bifurcation diagram through it, its basins, and all motions it has."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
import xarray as xr

from gearchaos.datasets import variable
from gearchaos.dynamics import Classification
from gearchaos.explorer.bounds import BASIN, COLUMNS, POINTS, STARTS
from gearchaos.explorer.state import View
from gearchaos.model import MeshModel
from gearchaos.studies.attractors import Attractors
from gearchaos.studies.axis import Axis
from gearchaos.studies.basins import Basins
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.initial_conditions import default_box
from gearchaos.studies.study import Study

_BUDGET = Classification(doublings=2, longest_transient=1500)
_PARTS = 8


def bifurcation(view: View, *strides: int) -> Generator[xr.Dataset]:
    """The diagram along the line through the point, every so many-th column first, and then every so many."""
    axis = view.x if view.line == "x" else view.y
    for stride in strides:
        along = Axis(axis.name, axis.start, axis.stop, COLUMNS // stride)
        yield from _in_parts(Bifurcation(view.base, along, points=POINTS, settings=_BUDGET), stride == 1)


def _in_parts(whole: Study, parted: bool) -> Generator[xr.Dataset]:
    """A study in a few parts; its result comes after the last, and nothing but a chance to stop after the others."""
    found: dict[str, np.ndarray] = {}
    for numbers in np.array_split(np.arange(whole.count), _PARTS if parted else 1):
        for name, values in whole.compute(numbers).items():
            if name not in found:
                found[name] = np.zeros((whole.count, *values.shape[1:]), values.dtype)
            found[name][numbers] = values
        yield xr.Dataset()
    yield whole.finish(found)


def basin_axes(model: MeshModel, count: tuple[int, int]) -> tuple[Axis, Axis]:
    """The plane of starts: displacement and velocity of the first wheel, or the relative ones of `single`."""
    (x, ends), (y, heights) = list(default_box(model).items())[:2]
    return Axis(x, *ends, count[0]), Axis(y, *heights, count[1])


def basins(view: View) -> Generator[xr.Dataset]:
    """The basins of the point's motions, coarse and then fine."""
    model = view.base
    for share in (4, 1):
        x, y = basin_axes(model, (BASIN[0] // share, BASIN[1] // share))
        yield from _in_parts(Basins(_on(model, x, y), x, y, settings=_BUDGET), share == 1)


def _on(model: MeshModel, *plane: Axis) -> MeshModel:
    """The model started in the plane, from the other initial values that it has."""
    return model.with_values({axis.name: axis.start for axis in plane})


def attractors(view: View) -> Generator[xr.Dataset]:
    """All motions found from some starts, with one start that leads to each."""
    whole = Attractors(view.base, STARTS, settings=_BUDGET)
    found = whole.run()
    index = found["attractor"].values
    first = np.array([int(np.flatnonzero(index == i)[0]) for i in range(found.sizes.get("number", 0))], dtype=int)
    yield found.assign({
        f"attractor_{n}": variable(n.removeprefix("start_"), ("number",), found[n].values[first])
        for n in map(str, found.data_vars) if n.startswith("start_")
    })
