"""What motion for every pair of two parameters: the zones of the paper's figures 2, 5, 10 and 11."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearchaos.datasets import provenance, variable
from gearchaos.dynamics import Classification, Verdicts
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.flow.layout import WIDTH
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import MeshModel, state_names, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import switched
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.batch_classification import InitialStates, classify_batch
from gearchaos.studies.coexistence import coexisting, signature
from gearchaos.studies.cost import Effort, effort
from gearchaos.studies.plan import Plan
from gearchaos.studies.plane import at_cells, check_plane, corners, shared_coordinates
from gearchaos.studies.refine import SIDE, refined
from gearchaos.studies.sweep import CARRY

_REFINED = 1 / 8
"""About this share of a refined map's cells is computed."""


def zones(
    model: MeshModel | GearPair, x: Axis | str, y: Axis | str, *, starts: int = 1, refine: int = 1,
    settings: Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """A map of motions over two parameters, every cell from the model's initial values.

    Parameters
    ----------
    model : MeshModel or GearPair
        Everything but the two parameters.
    x, y : Axis or str
        Parameters (or initial values) and their ranges, as a text "omega=0.2:3:400".
    starts : int
        Starts in each cell, the model's own first, the others spread as by `attractors`. With more than one the cells
        are also reached by slow sweeps along x, upwards and downwards.
    refine : int
        Compute every so many-th row and column first, a power of two, and the cells between only where neighbours
        differ; the others are inferred from them, and say so in ``inferred`` and ``reason``. 1 computes every cell.
    settings : Classification, optional
        How long to wait and how hard to look in each cell.
    progress : bool
        Show a progress bar on stderr.
    threads : int, optional
        Tiles computed at once; by default one per core.

    Returns
    -------
    xarray.Dataset
        With dims (y.name, x.name): label, period, reason, largest Lyapunov exponent with its interval, residual and
        largest multiplier of the orbit, levels, contact, periods spent. With more than one start also the number of
        ``attractors`` found in each cell, ``v_rms_least`` and ``v_rms_most`` among them, ``contact_worst``,
        ``v_rms_up`` and ``v_rms_down`` after the sweeps, and ``hysteresis``: 1 where these end in different motions.
    """
    return plan(model, x, y, starts=starts, refine=refine, settings=settings).run(progress=progress, threads=threads)


def plan(
    model: MeshModel | GearPair, x: Axis | str, y: Axis | str, *, starts: int = 1, refine: int = 1,
    settings: Classification | None = None,
) -> Plan:
    """The cells of `zones`, checked and ready to be computed."""
    model, x, y, settings = as_model(model), as_axis(x, "x"), as_axis(y, "y"), as_settings(settings)
    starts = whole_number("starts", starts, 1)
    check_plane(model, x, y)
    tiles.check_memory("cells times starts", x.count * y.count * starts)
    if starts > 1 and {x.name, y.name} & set(state_names(model.kind)):
        raise InputError("starts", "must be 1 where an axis is an initial value", starts)
    refine = _checked_refine(refine, starts)
    cost = _cost(model, x, y, starts, settings)

    def compute(
        cells: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        options: dict[str, Any] = {
            "settings": settings, "progress": progress, "threads": threads, "largest": cost.largest(threads),
        }
        if refine == 1:
            return _cells(model, x, y, cells, starts, **options)
        return refined(lambda chosen: _cells(model, x, y, chosen, 1, **options), cells, x.count, refine)

    def finish(found: dict[str, np.ndarray], **_: Any) -> xr.Dataset:
        data = {n: variable(n, (y.name, x.name), v.reshape(y.count, x.count)) for n, v in found.items()}
        coords = {a.name: variable(a.name, (a.name,), a.values) for a in (x, y)}
        return xr.Dataset(data, coords, provenance("zones", model, starts=starts, refine=refine))

    motions: float = starts + 2 if starts > 1 else 1  # with those that the sweeps end in
    block = {y.name: 1, x.name: x.count if starts > 1 else 1}
    if refine > 1:
        motions, block = _REFINED, {y.name: min(SIDE, y.count), x.name: min(SIDE, x.count)}
    return Plan({y.name: y.count, x.name: x.count}, block, compute, finish, cost, labelled=True, motions=motions)


def _cost(model: MeshModel, x: Axis, y: Axis, starts: int, settings: Classification | None) -> Effort:
    """What all cells take at most; with several starts their rows are also swept both ways, side by side."""
    motions, sequential = x.count * y.count, 0
    if starts > 1:
        motions, sequential = motions * (starts + 2), 2 * x.count * CARRY * -(-y.count // WIDTH)
    return effort(switched(corners(model, x, y)), motions, (settings or Classification()).most, sequential)


def initial_states(model: MeshModel, x: Axis, y: Axis) -> InitialStates:
    """Begins the motions of a map's cells by their numbers."""
    names = shared_coordinates(model, x, y)

    def begin(cells: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        batch = vary(model, at_cells(x, y, cells))
        system = switched(batch, names)
        return ExactFlow(system), start(batch, system).T.copy(), np.arange(len(cells))

    return begin


def _checked_refine(refine: int, starts: int) -> int:
    refine = whole_number("refine", refine, 1)
    if refine > SIDE // 2 or refine & (refine - 1):
        raise InputError("refine", f"must be a power of two, at most {SIDE // 2}", refine)
    if refine > 1 and starts > 1:
        raise InputError("refine", "must be 1 where there is more than one start", refine)
    return refine


def _cells(
    model: MeshModel, x: Axis, y: Axis, cells: np.ndarray, starts: int, *, settings: Classification | None,
    progress: bool,
    threads: int | None, largest: int,
) -> dict[str, np.ndarray]:
    """What is found of some cells (N,), whole rows of them where there is more than one start."""
    begin = initial_states(model, x, y)
    order = np.arange(len(cells), dtype=cells.dtype)
    if x.name == "omega":  # neighbours in a tile then share node counts
        order = np.argsort(cells % x.count, kind="stable").astype(cells.dtype)

    def keep(_: np.ndarray, flow: ExactFlow, points: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
        return found.variables() | (signature(flow, points, found) if starts > 1 else {})

    out = classify_batch(
        lambda tile: begin(cells[tile]), keep, order, settings=settings, progress="zones" if progress else None,
        threads=threads, largest=largest,
    )
    if starts > 1:
        options: dict[str, Any] = {"settings": settings, "progress": progress, "threads": threads, "largest": largest}
        out |= coexisting(model, x, y, cells, order, out, starts - 1, **options)
        del out["centre_z"], out["centre_z_dot"]
    return out
