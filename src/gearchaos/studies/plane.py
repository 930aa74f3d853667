"""The cells of a map over two axes, numbered along rows of constant y."""

from __future__ import annotations

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.axis import Axis

_MOST_TORQUES = 256
"""Most torques of an axis that are checked before any work: each needs the gears at this torque, some milliseconds."""


def check_plane(model: MeshModel, x: Axis, y: Axis) -> None:
    """Raise `InputError` unless the axes are different, and valid for the model.

    Of a long axis of torques some values are checked, with both ends; each of the others when it is computed.
    """
    shared = set(model.set_by(x.name)) & set(model.set_by(y.name))
    if shared:
        both = x.name if x.name == y.name else f"{x.name} and {y.name}, which both set {', '.join(sorted(shared))}"
        raise InputError("axes", "must be two different parameters", both)
    for axis in (x, y):
        values = axis.values
        if axis.name == "torque" and axis.count > _MOST_TORQUES:
            values = values[np.linspace(0, axis.count - 1, _MOST_TORQUES).round().astype(int)]
        vary(model, {axis.name: values})


def shared_coordinates(model: MeshModel, *axes: Axis) -> tuple[str, ...]:
    """Names of the coordinates of the dynamic state, the same for all values of the axes and so for all tiles.

    The conditions under which a coordinate can be left out are products of parameters. Where they hold at all corners,
    they hold for all values.
    """
    return coordinates(corners(model, *axes))


def corners(model: MeshModel, *axes: Axis) -> Batch:
    """The model at all combinations of the ends of the axes."""
    ends = np.meshgrid(*([a.start, a.stop if a.count > 1 else a.start] for a in axes))
    return vary(model, {a.name: c.ravel() for a, c in zip(axes, ends, strict=True)})


def at_cells(x: Axis, y: Axis, cells: np.ndarray) -> dict[str, np.ndarray]:
    """The values (L,) of both axes, by name, in the cells (L,) of a map."""
    row, column = np.divmod(cells, x.count)
    return {x.name: x.values[column], y.name: y.values[row]}
