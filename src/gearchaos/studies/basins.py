"""Which motion from which start: basins of attraction on a plane of initial values."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import provenance, variable
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import MeshModel, state_names, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import switched
from gearchaos.studies.attractor_set import AttractorSet, attractor_variables, final_states
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.boundary import entropy, smallest_perturbations, uncertainty_exponent
from gearchaos.studies.cost import effort
from gearchaos.studies.plan import Plan
from gearchaos.studies.plane import at_cells, check_plane

NOT_YET = -2


def basins(
    model: MeshModel | GearPair, x: Axis | str, y: Axis | str, *, settings: Classification | None = None,
    progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """Basins of attraction on a plane of initial values.

    Parameters
    ----------
    model : MeshModel or GearPair
        The operating point; initial values off the plane are the model's.
    x, y : Axis or str
        Two coordinates: z and z_dot of the single model, x1, x1_dot, ... of the others.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        ``attractor(y, x)``, an index into the dim "number" or -1 where the motion diverged or stayed undecided (-2
        where a run has not come to yet);
        per attractor its label, period, share of the plane, levels, exponent or multiplier, and section. Periodic
        attractors are told apart by their polished orbits, others by their means and spreads. ``basin_entropy``,
        ``boundary_basin_entropy`` and ``uncertainty_exponent`` say how tangled the boundaries are, and where
        the plane is the whole state (all of a model with two coordinates) ``attractor_kick`` is the smallest change
        of the state that leaves a basin.
    """
    return plan(model, x, y, settings=settings).run(progress=progress, threads=threads)


def plan(
    model: MeshModel | GearPair, x: Axis | str, y: Axis | str, *, settings: Classification | None = None
) -> Plan:
    """The starts of `basins`, checked and ready to be followed."""
    model, x, y, settings = as_model(model), as_axis(x, "x"), as_axis(y, "y"), as_settings(settings)
    for axis in (x, y):
        if axis.name not in state_names(model.kind):
            raise InputError(f"axis {axis.name}", "must be an initial value of the model", axis.name,
                             f"Choose from {', '.join(state_names(model.kind))}.")
    check_plane(model, x, y)
    system = switched(vary(model, {}))
    cost = effort(system, x.count * y.count, (settings or Classification()).most)
    flow = ExactFlow(system)

    def compute(
        cells: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        w = start(vary(model, at_cells(x, y, cells)), flow.system).T
        return final_states(flow, w, settings=settings, progress="basins" if progress else None, threads=threads)

    def finish(found: dict[str, np.ndarray], **_: Any) -> xr.Dataset:
        catalogue = AttractorSet(flow)
        index = catalogue.match(found)
        catalogue.count_members(index)
        rank = np.where(found["label"] == 0, NOT_YET, catalogue.ranks()[index])
        return _dataset(model, x, y, rank.reshape(y.count, x.count), catalogue, settings)

    return Plan({y.name: y.count, x.name: x.count}, {y.name: 1, x.name: 1}, compute, finish, cost, labelled=False)


def _dataset(
    model: MeshModel, x: Axis, y: Axis, index: np.ndarray, catalogue: AttractorSet, settings: Classification | None
) -> xr.Dataset:
    known = [catalogue.attractors[i] for i in catalogue.order()]
    shares = np.array([a.count for a in known]) / max(1, np.sum(index != NOT_YET))
    tangled = dict.fromkeys(("basin_entropy", "boundary_basin_entropy", "uncertainty_exponent"), np.nan)
    if not np.any(index == NOT_YET):
        tangled = dict(zip(tangled, (*entropy(index), uncertainty_exponent(index)), strict=True))
    data = {
        "attractor": variable("attractor", (y.name, x.name), index),
        **attractor_variables(catalogue, settings),
        "attractor_fraction": variable("attractor_fraction", ("number",), shares),
        "attractor_kick": variable("attractor_kick", ("number",), _kicks(model, x, y, index, catalogue)),
        **{n: variable(n, (), np.array(v)) for n, v in tangled.items()},
    }
    coords = {a.name: variable(a.name, (a.name,), a.values) for a in (x, y)}
    return xr.Dataset(data, coords, provenance("basins", model))


def _kicks(model: MeshModel, x: Axis, y: Axis, index: np.ndarray, catalogue: AttractorSet) -> np.ndarray:
    """Smallest kicks where the plane is the whole state; elsewhere attractors do not lie in the plane."""
    known = [catalogue.attractors[i] for i in catalogue.order()]
    system = catalogue.flow.system
    corners = start(vary(model, {x.name: [0.0, 1.0, 0.0], y.name: [0.0, 0.0, 1.0]}), system)
    across = (corners[1:] - corners[0]).T  # from the plane's coordinates to the state
    whole_state = system.dimension == 2 and np.allclose(across @ across.T, np.eye(2))
    if not whole_state or np.any(index == NOT_YET) or min(x.count, y.count) < 2:
        return np.full(len(known), np.nan)
    return smallest_perturbations(index, x.values, y.values, [(a.section - corners[0]) @ across for a in known])
