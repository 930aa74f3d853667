"""Basins of attraction on a plane of initial values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.flow import ExactFlow
from gearchaos.model import state_names, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.attractor_set import NOT_COMPUTED, AttractorSet, attractor_variables, final_states
from gearchaos.studies.axis import Axis
from gearchaos.studies.boundary import entropy, smallest_perturbations, uncertainty_exponent
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.declaration import function_of
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.options import axis_option
from gearchaos.studies.plane import at_cells, check_plane
from gearchaos.studies.study import ClassifyingStudy

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Basins(ClassifyingStudy):
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
    summary: ClassVar[str] = "map"
    model_words: ClassVar[str] = (
        "The operating point. Initial values that are not on the axes are those of the model.")

    x: Axis = axis_option(
        "Initial value of a coordinate, and its range: z or z_dot of the single model, x1, x1_dot, ... of the others.")
    y: Axis = axis_option("Initial value of another one.")

    def __post_init__(self) -> None:
        super().__post_init__()
        names = state_names(self.model.kind)
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
        system = switched_system(vary(self.model, {}))
        return estimate(system, self.x.count * self.y.count, self.classification.max_periods)

    @cached_property
    def _flow(self) -> ExactFlow:
        return initial_value_problems(self.model).flow

    def compute(
        self, items: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        w = initial_state(vary(self.model, at_cells(self.x, self.y, items)), self._flow.system).T
        name = "basins" if progress else None
        return final_states(self._flow, w, settings=self.classification, progress=name, threads=threads)

    def finish(
        self, found: dict[str, np.ndarray], *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset:
        attractors = AttractorSet(self._flow)
        index = attractors.match(found)
        attractors.count_starts(index)
        known = [attractors.members[i] for i in attractors.order()]
        plane = attractors.numbers(index, found["label"]).reshape(self.y.count, self.x.count)
        boundary = dict.fromkeys(("basin_entropy", "boundary_basin_entropy", "uncertainty_exponent"), np.nan)
        if not np.any(plane == NOT_COMPUTED):
            boundary = dict(zip(boundary, (*entropy(plane), uncertainty_exponent(plane)), strict=True))
        per_attractor = {
            "attractor_fraction": np.array([a.count for a in known]) / max(1, np.sum(plane != NOT_COMPUTED)),
            "attractor_kick": self._kicks(plane, attractors),
        }
        data = {
            "attractor": variable("attractor", tuple(self.grid), plane),
            **attractor_variables(attractors, self.classification),
            **{n: variable(n, ("number",), v) for n, v in per_attractor.items()},
            **{n: variable(n, (), np.array(v)) for n, v in boundary.items()},
        }
        coords = {a.name: variable(a.name, (a.name,), a.values) for a in self.axes}
        return new_dataset(data, coords, self.provenance())

    def _kicks(self, plane: np.ndarray, attractors: AttractorSet) -> np.ndarray:
        """Lengths (attractors,) of the smallest perturbations that leave each basin of a plane (ny, nx).

        NaN where the plane is not the whole state space, so that attractors do not lie in it.
        """
        x, y, system = self.x, self.y, attractors.flow.system
        known = [attractors.members[i] for i in attractors.order()]
        corners = initial_state(vary(self.model, {x.name: [0.0, 1.0, 0.0], y.name: [0.0, 0.0, 1.0]}), system)
        jacobian = (corners[1:] - corners[0]).T  # of the state with respect to the coordinates of the plane
        whole_state = system.dimension == 2 and np.allclose(jacobian @ jacobian.T, np.eye(2))
        if not whole_state or np.any(plane == NOT_COMPUTED) or min(x.count, y.count) < 2:
            return np.full(len(known), np.nan)
        return smallest_perturbations(plane, x.values, y.values, [(a.section - corners[0]) @ jacobian for a in known])


basins = function_of(Basins)
