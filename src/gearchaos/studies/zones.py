"""What motion for every pair of two parameters: the zones of the paper's figures 2, 5, 10 and 11."""

from __future__ import annotations

import numpy as np
import xarray as xr

from gearchaos.axis import Axis
from gearchaos.coordinates import start
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.motion import Budget, classify
from gearchaos.studies import tiles
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.evidence import evidence
from gearchaos.switched import switched


def zones(
    model: MeshModel, x: Axis, y: Axis, *, budget: Budget | None = None, progress: bool = False,
    threads: int | None = None,
) -> xr.Dataset:
    """A map of motions over two parameters, every cell from the model's initial values.

    Parameters
    ----------
    model : MeshModel
        Everything but the two parameters.
    x, y : Axis
        Parameters (or initial values) and their ranges.
    budget : Budget, optional
        How long to wait and how hard to look in each cell.
    progress : bool
        Show a progress bar on stderr.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        With dims (y.name, x.name): label, period, reason, largest Lyapunov exponent with its interval, residual and
        largest multiplier of the orbit, levels, contact, periods spent.
    """
    grid = plane(model, x, y)
    out: dict[str, np.ndarray] = {}
    order = np.arange(x.count * y.count)
    if x.name == "omega":  # neighbours in a tile then share node counts
        order = order.reshape(y.count, x.count).T.ravel()

    def work(tile: np.ndarray) -> dict[str, np.ndarray]:
        batch = vary(model, {k: v[tile] for k, v in grid.items()})
        system = switched(batch)
        return evidence(classify(ExactFlow(system), start(batch, system).T.copy(), budget=budget))

    for tile, values in tiles.run(work, tiles.split(order), progress="zones" if progress else None, threads=threads):
        for name, value in values.items():
            out.setdefault(name, np.zeros(len(order), value.dtype))[tile] = value
    data = {n: variable(n, (y.name, x.name), v.reshape(y.count, x.count)) for n, v in out.items()}
    coords = {a.name: variable(a.name, (a.name,), a.values) for a in (x, y)}
    return xr.Dataset(data, coords, provenance("zones", model))


def plane(model: MeshModel, x: Axis, y: Axis) -> dict[str, np.ndarray]:
    """Both parameters over all cells, rows of constant y, flattened; checked before any work."""
    if x.name == y.name:
        raise InputError("axes", "must be two different parameters", x.name)
    tiles.check_memory("cells", x.count * y.count)
    for axis in (x, y):
        vary(model, {axis.name: axis.values})
    xs, ys = np.meshgrid(x.values, y.values)
    return {x.name: xs.ravel(), y.name: ys.ravel()}
