"""Basins of attraction on a plane of initial values, and measures of their boundaries.

The measures are entropy, uncertainty exponent, and distance of the attractors from the boundaries.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.studies.core.axis import Axis, at_cells, check_plane
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import axis_option
from gearchaos.studies.core.study import Results
from gearchaos.studies.motion.attractor_set import NOT_COMPUTED, AttractorStudy

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Basins(AttractorStudy):
    """Map the basins of attraction over two initial values.

    Returns
    -------
    xarray.Dataset
        ``attractor(y, x)``, an index into the dim "number", -1 where the motion diverged or is undecided, -2 where the
        cell is not computed yet. For each attractor: label, period, share of the plane, response measures, largest
        exponent or multiplier, and section. Periodic attractors are distinguished by their orbits, others by the mean
        and standard deviation of their stroboscopic points. ``basin_entropy``, ``boundary_basin_entropy`` and
        ``uncertainty_exponent`` measure how fractal the boundaries are. Where the plane is the whole state space (of a
        model with two coordinates) ``attractor_kick`` is the length of the smallest change of the state that leaves the
        basin.

    Raises
    ------
    InputError
        If an axis is no initial value of the model, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> basins = gc.basins(model, "z=-2:2:20", "z_dot=-1:1:20")
    >>> basins.attractor.shape, basins.sizes["number"]
    ((20, 20), 2)

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Basins(gc.MeshModel.of(q0=0.1, eps1=0.1), "x1=-1:1:6", "x1_dot=-1:1:6")
    >>> study.kind, study.count
    ('basins', 36)
    """

    kind: ClassVar[str] = "basins"
    rank: ClassVar[int] = 6
    needs_out: ClassVar[bool] = True
    variables: ClassVar[tuple[str, ...]] = ("label", "period", "contact")
    summary: ClassVar[str] = "map"
    model_words: ClassVar[str] = (
        "The operating point. Initial values that are not on the axes are those of the model.")

    x: Axis = axis_option(
        "Initial value of a coordinate, and its range: z or z_dot of the single model, x1, x1_dot, ... of the others.")
    y: Axis = axis_option("Initial value of another one.")

    def __post_init__(self) -> None:
        super().__post_init__()
        names = self.model.state_names
        for axis in (self.x, self.y):
            if axis.name not in names:
                raise InputError(f"axis {axis.name}", "must be an initial value of the model", axis.name,
                                 f"Choose from {', '.join(names)}.")
        check_plane(self.model, self.x, self.y)
        self.check_in_memory()

    def check_in_memory(self) -> None:
        check_memory("cells", self.x.count * self.y.count)
        super().check_in_memory()

    @cached_property
    def cost(self) -> Cost:
        return self.estimate(self.x.count * self.y.count, self.classification.max_periods)

    def initial_values(self, items: np.ndarray) -> dict[str, np.ndarray]:
        return at_cells(self.x, self.y, items)

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        attractors, index = self.attractors(found)
        known = attractors.ordered
        plane = attractors.numbers(index, found["label"]).reshape(self.y.count, self.x.count)
        boundary = dict.fromkeys(("basin_entropy", "boundary_basin_entropy", "uncertainty_exponent"), np.nan)
        if not np.any(plane == NOT_COMPUTED):
            boundary = dict(zip(boundary, (*entropy(plane), uncertainty_exponent(plane)), strict=True))
        share = np.array([a.count for a in known]) / max(1, np.sum(plane != NOT_COMPUTED))
        x, y, system = self.x, self.y, self.flow.system
        corners = initial_state(vary(self.model, {x.name: [0.0, 1.0, 0.0], y.name: [0.0, 0.0, 1.0]}), system)
        jacobian = (corners[1:] - corners[0]).T  # of the state with respect to the coordinates of the plane
        kicks = np.full(len(known), np.nan)  # where attractors do not lie in the plane
        whole_state = system.dimension == 2 and np.allclose(jacobian @ jacobian.T, np.eye(2))
        if whole_state and not np.any(plane == NOT_COMPUTED) and min(x.count, y.count) >= 2:
            sections = [(a.section - corners[0]) @ jacobian for a in known]
            kicks = smallest_perturbations(plane, x.values, y.values, sections)
        data = {
            "attractor": variable("attractor", tuple(self.grid), plane),
            **attractors.variables(self.classification),
            "attractor_fraction": variable("attractor_fraction", ("number",), share),
            "attractor_kick": variable("attractor_kick", ("number",), kicks),
            **{n: variable(n, (), np.array(v)) for n, v in boundary.items()},
        }
        coords = {a.name: variable(a.name, (a.name,), a.values) for a in self.axes}
        return new_dataset(data, coords, self.provenance())


basins = function_of(Basins)


_BOX = 5
"""Side of the boxes of the basin entropy, in cells."""

_DISTANCES = (1, 2, 4, 8, 16)
"""Distances ε at which the share of uncertain cells is taken, in cells."""


def entropy(index: np.ndarray) -> tuple[float, float]:
    """Basin entropy and boundary basin entropy, in nats, of the number (ny, nx) of the attractor of each cell.

    They are means of −Σ p ln p, p being the shares of the attractors in a box of 5 × 5 cells: over all boxes, NaN for a
    plane smaller than one, and over those with more than one attractor, NaN if there are none; above ln 2 the boundary
    is fractal. A. Daza, A. Wagemakers, B. Georgeot, D. Guéry-Odelin, M. A. F. Sanjuán, *Basin entropy*, Sci. Rep. 6
    (2016) 31416.
    """
    ny, nx = (n // _BOX * _BOX for n in index.shape)
    boxes = index[:ny, :nx].reshape(ny // _BOX, _BOX, nx // _BOX, _BOX).swapaxes(1, 2).reshape(-1, _BOX**2)
    shares = np.stack([(boxes == k).mean(axis=1) for k in np.unique(index)], axis=1)
    entropies = -np.sum(shares * np.log(np.where(shares > 0, shares, 1.0)), axis=1)
    mixed = shares.max(axis=1, initial=0.0) < 1
    basin, boundary = (float(e.mean()) if len(e) else float("nan") for e in (entropies, entropies[mixed]))
    return basin, boundary


def uncertainty_exponent(index: np.ndarray) -> float:
    """The uncertainty exponent α of a basin boundary, from the number (ny, nx) of the attractor of each cell.

    The share f(ε) ~ ε^α of the cells has a neighbour at distance ε that leads to another attractor. α is 1 for a smooth
    boundary and smaller for a fractal one, whose dimension is 2 − α. NaN without a boundary, or for a plane of less
    than 64 cells a side. C. Grebogi, S. W. McDonald, E. Ott, J. A. Yorke, *Final state sensitivity*, Phys. Lett. A 99
    (1983) 415.
    """
    if min(index.shape) < 4 * _DISTANCES[-1]:
        return float("nan")
    share = [0.5 * ((index[:, k:] != index[:, :-k]).mean() + (index[k:] != index[:-k]).mean()) for k in _DISTANCES]
    if share[0] == 0:
        return float("nan")
    return float(np.polyfit(np.log(_DISTANCES), np.log(share), 1)[0])


def smallest_perturbations(index: np.ndarray, x: np.ndarray, y: np.ndarray, sections: list[np.ndarray]) -> np.ndarray:
    """Distance (attractors,) of each attractor from the boundary of its basin, to the accuracy of a cell.

    ``index`` (ny, nx) is the number of the attractor of each cell, x (nx,) and y (ny,) are evenly spaced, and
    ``sections`` (n, 2) the stroboscopic points of each attractor in the same coordinates. The distance is the smallest
    of such a point from a cell that does not lead to the attractor; NaN where no point lies in a cell of the
    attractor's own basin, or all cells lead to one attractor.
    """
    from scipy.ndimage import distance_transform_edt  # here, since it takes a tenth of a second to load

    out = np.full(len(sections), np.nan)
    if np.all(index == index[0, 0]):
        return out
    step = (y[1] - y[0], x[1] - x[0])
    for number, points in enumerate(sections):
        distance = distance_transform_edt(index == number, sampling=step)
        column, row = np.rint((points.T - [[x[0]], [y[0]]]) / np.array(step[::-1])[:, None]).astype(int)
        inside = (column >= 0) & (column < len(x)) & (row >= 0) & (row < len(y))
        found = distance[row[inside], column[inside]]
        if np.any(found > 0):
            out[number] = found[found > 0].min()
    return out
