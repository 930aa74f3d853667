"""One trajectory: sampled in time, and its stroboscopic section."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearchaos.coordinates import error_at_start, start, to_physical
from gearchaos.errors import whole_number
from gearchaos.flow import CHATTER, DIVERGED, DIVERGED_AT, OK, ExactFlow
from gearchaos.gearpair import GearPair, as_model
from gearchaos.model import Batch, MeshModel, backlash, mesh_stiffness, transmission_error, vary
from gearchaos.studies import rotation, tiles
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.effort import effort
from gearchaos.studies.plan import Plan
from gearchaos.switched import switched


def simulate(
    model: MeshModel | GearPair, periods: int, transient: int = 0, samples: int | None = None, *,
    progress: bool = False,
) -> xr.Dataset:
    """Follow the motion of a gear mesh exactly.

    Parameters
    ----------
    model : MeshModel or GearPair
    periods : int
        Mesh periods to record.
    transient : int
        Mesh periods to let pass before.
    samples : int, optional
        Record this many equidistant instants per mesh period; without it only the stroboscopic section.
    progress : bool
        Say on stderr how long it may take, if that is long.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(period)`` at τ = T, 2T, ... after the transient; with ``samples`` also the coordinates,
        ``mesh_force`` 2ζz' + χ f(z) and ``contact`` (-1 back flank, 0 free, 1 front flank) over ``tau``.

        The attribute ``status`` is "ok", "diverged" if |z| or |z'| passed 1e8 half backlashes (what came after is
        NaN), or "chatter" if a step had more contact switches than can be followed.

    Raises
    ------
    InputError
        If a number is out of range, or what is asked for does not fit this machine's memory.
    """
    return plan(model, periods, transient, samples).run(progress=progress)


def plan(model: MeshModel | GearPair, periods: int, transient: int = 0, samples: int | None = None) -> Plan:
    """The one piece of `simulate`, checked and ready to be computed."""
    model = as_model(model)
    periods, transient = whole_number("periods", periods, 1), whole_number("transient", transient, 0)
    samples = whole_number("samples", samples, 1) if samples is not None else 0
    batch = vary(model, {})
    system = switched(batch)
    cost = effort(system, 1, periods + transient, samples=samples)
    tiles.check_memory("periods", periods, _SECTION)
    tiles.check_memory("periods times samples", periods * samples, _INSTANT)
    tiles.check_memory("samples", samples, (cost.table + _NODE * cost.steps) // max(1, samples))

    def compute(_: np.ndarray, **__: Any) -> dict[str, np.ndarray]:
        flow, w = ExactFlow(system, samples), start(batch, system).T.copy()
        before = flow.advance(w, transient) if transient else None
        out = flow.advance(before.w if before else w, periods, sections=periods, sample=samples > 0)
        codes = {int(run.status[0]) for run in (before, out) if run}
        status = DIVERGED if DIVERGED in codes else max(codes)
        sampled = {"samples": out.samples[None, ..., 0]} if samples else {}
        return {"sections": out.sections[None, :, :, 0], "status": np.array([status]), **sampled}

    def finish(found: dict[str, np.ndarray], **_: Any) -> xr.Dataset:
        w = _bounded(found["sections"][0])
        x2 = _rotation(batch, ExactFlow(system, samples), w, transient)
        data = _section(batch, system.names, w, transient, x2)
        if samples:
            data.update(_trajectory(batch, system.names, _bounded(found["samples"][0]), transient, x2))
        settings = {"periods": periods, "transient": transient, "samples": samples}
        status = {"status": _STATUS[int(found["status"][0])]}
        return xr.Dataset(data, attrs={**provenance("simulate", model, **settings), **status})

    return Plan({"motion": 1}, {"motion": 1}, compute, finish, cost, labelled=False)


_SECTION, _INSTANT = 700, 800
"""Bytes that a section and a sampled instant take at most, until they are saved."""

_NODE = 200
"""Bytes that laying out the course of a period takes for every instant of it."""

_STATUS = {OK: "ok", DIVERGED: "diverged", CHATTER: "chatter"}


def _bounded(w: np.ndarray) -> np.ndarray:
    """Coordinates with NaN from where the motion left the range that the flow follows; time first, z and z' leading."""
    inside = np.all(np.abs(w[..., :2]) < DIVERGED_AT, axis=-1)
    kept = np.logical_and.accumulate(inside.ravel()).reshape(inside.shape)
    return np.where(kept[..., None], w, np.nan)


def _rotation(batch: Batch, flow: ExactFlow, w: np.ndarray, transient: int) -> np.ndarray | None:
    """x2 (N + 1,) after the transient and at the sections w (N, d), where the bearings differ."""
    if "x2_dot" not in flow.system.names:
        return None
    begin, point = start(batch, flow.system).T.copy(), np.zeros(1, dtype=int)
    return rotation.at_sections(batch, flow, point, begin, np.array([transient]), w[:, :, None])[0]


def _section(batch: Batch, names: tuple[str, ...], w: np.ndarray, transient: int, x2: np.ndarray | None) -> dict:
    number = np.arange(1, len(w) + 1)
    tau = (transient + number) * batch.model.period
    known = None if x2 is None else x2[None, 1:]
    values = to_physical(batch, names, w[None], tau[None], *error_at_start(batch), known)
    data = {f"section_{n}": variable(f"section_{n}", ("period",), v[0]) for n, v in values.items()}
    data["period"] = xr.Variable("period", number, {"long_name": "mesh period after the transient", "units": "T"})
    data["tau_section"] = variable("tau", ("period",), tau)
    return data


def _trajectory(
    batch: Batch, names: tuple[str, ...], samples: np.ndarray, transient: int, x2: np.ndarray | None
) -> dict:
    """Variables over τ from samples (periods, samples, d + 1), the last column the contact state, and from x2
    (periods + 1,) at their begin and end where the bearings differ."""
    model, (periods, per_period, _) = batch.model, samples.shape
    flat = samples.reshape(periods * per_period, -1)
    share = np.tile(np.arange(per_period) / per_period, periods)
    tau = (transient + np.repeat(np.arange(periods), per_period) + share) * model.period
    phase = share * model.period
    error, error_dot = (transmission_error(model, phase, derivative) for derivative in (0, 1))
    known = None if x2 is None else _between(batch, names, samples[..., :-1], x2[:-1])
    physical = to_physical(batch, names, flat[None, :, :-1], tau[None], error, error_dot, known)
    values = {n: v[0] for n, v in physical.items()}
    force = 2 * model.zeta * values["z_dot"] + mesh_stiffness(model, phase) * backlash(values["z"])
    data = {n: variable(n, ("tau",), v) for n, v in {**values, "mesh_force": force}.items()}
    data["contact"] = variable("contact", ("tau",), np.nan_to_num(flat[:, -1]).astype(np.int8), coded=False)
    data["tau"] = variable("tau", ("tau",), tau)
    return data


def _between(batch: Batch, names: tuple[str, ...], samples: np.ndarray, x2: np.ndarray) -> np.ndarray:
    """x2 (1, N M) at samples (N, M, d), from its values (N,) at the begin of each period."""
    return (x2[:, None] + rotation.within_periods(batch, names, samples)).reshape(1, -1)
