"""One trajectory: sampled in time, and its stroboscopic section."""

from __future__ import annotations

from dataclasses import MISSING, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable
from gearchaos.errors import whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.flow import CHATTER, DIVERGED, DIVERGED_AT, OK, ExactFlow
from gearchaos.gears.pair import GearPair
from gearchaos.model import Batch, MeshModel, backlash, mesh_stiffness, transmission_error, vary
from gearchaos.model.coordinates import initial_state, to_physical, transmission_error_at_start
from gearchaos.model.switched import switched_system
from gearchaos.studies import rotation
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.initial_value_problems import InitialValueProblems, initial_value_problems
from gearchaos.studies.study import Study, option

if TYPE_CHECKING:
    import xarray as xr


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
    return Simulate(model, periods, transient, samples).run(progress=progress)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Simulate(Study):
    """The value behind `simulate`; its one work item is the motion."""

    kind: ClassVar[str] = "simulate"

    periods: int = option(MISSING, "Mesh periods to record.", least=1, keyword=False)
    transient: int = option(0, "Mesh periods to let pass before.", least=0, keyword=False)
    samples: int | None = option(None, "Instants per period, for --out.", least=1, keyword=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._set(periods=whole_number("periods", self.periods, 1),
                  transient=whole_number("transient", self.transient, 0),
                  samples=None if self.samples is None else whole_number("samples", self.samples, 1))
        samples = self.samples or 0
        check_memory("periods", self.periods, _SECTION)
        check_memory("periods times samples", self.periods * samples, _INSTANT)
        check_memory("samples", samples, (self.cost.table + _NODE * self.cost.steps) // max(1, samples))

    @property
    def grid(self) -> dict[str, int]:
        return {"motion": 1}

    @cached_property
    def cost(self) -> Cost:
        system = switched_system(vary(self.model, {}))
        return estimate(system, 1, self.periods + self.transient, samples=self.samples or 0)

    @cached_property
    def _problem(self) -> InitialValueProblems:
        return initial_value_problems(self.model, samples=self.samples or 0)

    def compute(
        self, items: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        _, flow, w = self._problem
        before = flow.advance(w, self.transient) if self.transient else None
        out = flow.advance(
            before.w if before else w, self.periods, sections=self.periods, sample=self.samples is not None)
        codes = {int(run.status[0]) for run in (before, out) if run}
        status = DIVERGED if DIVERGED in codes else max(codes)
        sampled = {"samples": out.samples[None, ..., 0]} if self.samples else {}
        return {"sections": out.sections[None, :, :, 0], "status": np.array([status]), **sampled}

    def finish(
        self, found: dict[str, np.ndarray], *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset:
        batch, flow, _ = self._problem
        names, w = flow.system.names, _bounded(found["sections"][0])
        x2 = _rotation(batch, flow, w, self.transient)
        data = _section(batch, names, w, self.transient, x2)
        if self.samples:
            data.update(_trajectory(batch, names, _bounded(found["samples"][0]), self.transient, x2))
        settings = {"periods": self.periods, "transient": self.transient, "samples": self.samples or 0}
        status = {"status": _STATUS[int(found["status"][0])]}
        return new_dataset(data, attrs={**provenance("simulate", self.model, **settings), **status})


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
    begin, point = initial_state(batch, flow.system).T.copy(), np.zeros(1, dtype=int)
    return rotation.at_sections(batch, flow, point, begin, np.array([transient]), w[:, :, None])[0]


def _section(batch: Batch, names: tuple[str, ...], w: np.ndarray, transient: int, x2: np.ndarray | None) -> dict:
    number = np.arange(1, len(w) + 1)
    tau = (transient + number) * batch.model.period
    known = None if x2 is None else x2[None, 1:]
    values = to_physical(batch, names, w[None], tau[None], *transmission_error_at_start(batch), known)
    data: dict[str, Any] = {f"section_{n}": variable(f"section_{n}", ("period",), v[0]) for n, v in values.items()}
    data["period"] = ("period", number, {"long_name": "mesh period after the transient", "units": "T"})
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
