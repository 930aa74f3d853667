"""The cells of a map over two axes, numbered along rows of constant y."""

from __future__ import annotations

import numpy as np

from gearchaos.axis import Axis
from gearchaos.errors import InputError
from gearchaos.model import MeshModel, vary
from gearchaos.studies import tiles


def check_plane(model: MeshModel, x: Axis, y: Axis) -> None:
    """Raise if a map over these axes is impossible; before any work."""
    if x.name == y.name:
        raise InputError("axes", "must be two different parameters", x.name)
    tiles.check_memory("cells", x.count * y.count)
    for axis in (x, y):
        vary(model, {axis.name: axis.values})


def at_cells(x: Axis, y: Axis, cells: np.ndarray) -> dict[str, np.ndarray]:
    """The values of both axes in some cells of a map."""
    row, column = np.divmod(cells, x.count)
    return {x.name: x.values[column], y.name: y.values[row]}
