"""Basins of attraction on a plane of initial values."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.flow import ExactFlow
from gearchaos.gears.operating import AnyModel
from gearchaos.model import MeshModel, state_names, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.studies.attractor_set import NOT_COMPUTED, AttractorSet, attractor_variables, final_states
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.boundary import entropy, smallest_perturbations, uncertainty_exponent
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.plane import at_cells, check_plane
from gearchaos.studies.study import ClassifyingStudy

if TYPE_CHECKING:
    import xarray as xr


def basins(
    model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None,
    progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """Basins of attraction on a plane of initial values.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point. Initial values that are not on the axes are those of the model.
    x, y : Axis or str
        Initial values of two coordinates: z and z_dot of the single model, x1, x1_dot, ... of the others.
    settings, progress, threads
        As in `zones`.

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
    """
    return Basins(model, x, y, settings=settings).run(
        progress=progress, threads=threads)


@dataclass(frozen=True)
class Basins(ClassifyingStudy):
    """The study that `basins` runs. Its work items are the initial states.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point.
    x, y : Axis or str
        Initial values of two coordinates, and their ranges.
    settings : Classification, optional
        Lengths of the runs by which motions are classified.

    Raises
    ------
    InputError
        If a field breaks a rule; before any work.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Basins(gc.MeshModel.of(q0=0.1, eps1=0.1), "x1=-1:1:6", "x1_dot=-1:1:6")
    >>> study.kind, study.count
    ('basins', 36)
    """

    kind: ClassVar[str] = "basins"
    axis_fields: ClassVar[tuple[str, ...]] = ("x", "y")

    x: Axis
    y: Axis

    if TYPE_CHECKING:  # what `__post_init__` converts is accepted, too

        def __init__(
            self, model: AnyModel, x: Axis | str, y: Axis | str, *, settings: Classification | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(x=as_axis(self.x, "x"), y=as_axis(self.y, "y"))
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

    @property
    def grid(self) -> dict[str, int]:
        return {self.y.name: self.y.count, self.x.name: self.x.count}

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
        rank = attractors.numbers(index, found["label"])
        shape = (self.y.count, self.x.count)
        return _dataset(self.model, self.x, self.y, rank.reshape(shape), attractors, self.classification)


def _dataset(
    model: MeshModel, x: Axis, y: Axis, index: np.ndarray, attractors: AttractorSet, settings: Classification
) -> xr.Dataset:
    """The Dataset of `basins` from the attractor index (ny, nx) of the cells."""
    known = [attractors.members[i] for i in attractors.order()]
    shares = np.array([a.count for a in known]) / max(1, np.sum(index != NOT_COMPUTED))
    boundary = dict.fromkeys(("basin_entropy", "boundary_basin_entropy", "uncertainty_exponent"), np.nan)
    if not np.any(index == NOT_COMPUTED):
        boundary = dict(zip(boundary, (*entropy(index), uncertainty_exponent(index)), strict=True))
    data = {
        "attractor": variable("attractor", (y.name, x.name), index),
        **attractor_variables(attractors, settings),
        "attractor_fraction": variable("attractor_fraction", ("number",), shares),
        "attractor_kick": variable("attractor_kick", ("number",), _kicks(model, x, y, index, attractors)),
        **{n: variable(n, (), np.array(v)) for n, v in boundary.items()},
    }
    coords = {a.name: variable(a.name, (a.name,), a.values) for a in (x, y)}
    return new_dataset(data, coords, provenance("basins", model, classification=asdict(settings)))


def _kicks(model: MeshModel, x: Axis, y: Axis, index: np.ndarray, attractors: AttractorSet) -> np.ndarray:
    """Lengths (attractors,) of the smallest perturbations that leave each basin.

    NaN where the plane is not the whole state space, so that attractors do not lie in it.
    """
    known = [attractors.members[i] for i in attractors.order()]
    system = attractors.flow.system
    corners = initial_state(vary(model, {x.name: [0.0, 1.0, 0.0], y.name: [0.0, 0.0, 1.0]}), system)
    jacobian = (corners[1:] - corners[0]).T  # of the state with respect to the coordinates of the plane
    whole_state = system.dimension == 2 and np.allclose(jacobian @ jacobian.T, np.eye(2))
    if not whole_state or np.any(index == NOT_COMPUTED) or min(x.count, y.count) < 2:
        return np.full(len(known), np.nan)
    return smallest_perturbations(index, x.values, y.values, [(a.section - corners[0]) @ jacobian for a in known])
