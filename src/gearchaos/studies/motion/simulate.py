"""One trajectory: its stroboscopic section, and samples in time; sections of steady motions, mean rotation included.

Where the two bearings differ the rotation of the wheels has no closed form, and is integrated along the motion. The
integral over each mesh period is computed from the state recorded at its start. It is exact to rounding errors, and
all periods of a motion are computed in parallel.
"""

from __future__ import annotations

import warnings
from dataclasses import MISSING, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gearchaos.datasets import new_dataset, variable
from gearchaos.dynamics import Verdicts
from gearchaos.execute.machine import check_memory
from gearchaos.flow import CHATTER, DIVERGED, DIVERGED_AT, OK, ExactFlow, Measure
from gearchaos.model import Batch, backlash, transmission_error
from gearchaos.model.base import SAMPLES
from gearchaos.model.contacts import MeshContacts
from gearchaos.model.coordinates import (
    bearings_differ,
    initial_state,
    initial_values,
    relative_rotation,
    to_physical,
    transmission_error_at_start,
    weakly_damped,
)
from gearchaos.model.switched import SwitchedAffine, rotation_decay, switched_system
from gearchaos.studies.core.cost import Cost
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.initial_value_problems import InitialValueProblems, initial_value_problems
from gearchaos.studies.core.options import Option, option
from gearchaos.studies.core.study import PROGRESS, Results, Study

if TYPE_CHECKING:
    import xarray as xr

_LEAST_PER_CYCLE = 4


@dataclass(frozen=True)
class Simulate(Study):
    """Integrate one motion: its stroboscopic section, one state per mesh period, and samples in time.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(period)`` at τ = T, 2T, ... after the transient; with ``samples`` also the coordinates,
        ``mesh_force`` 2ζz' + χ f(z), whose damping part acts by the damping law, and ``contact`` (-1 back flank, 0
        free, 1 front flank) over ``tau``.

        The attribute ``status`` is "ok", "diverged" if |z| or |z'| exceeded 1e8 half backlashes (from there on values
        are NaN), or "chatter" if a step had more contact switches than can be followed.

    Raises
    ------
    InputError
        If a number is out of range, or the computation needs more memory than this machine has.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.1), periods=4, transient=200, samples=32)
    >>> motion.section_z.shape, motion.z.shape, motion.attrs["status"]
    ((4,), (128,), 'ok')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Simulate(gc.MeshModel.of(q0=0.1, eps1=0.1), periods=4)
    >>> study.kind, study.count
    ('simulate', 1)
    """

    kind: ClassVar[str] = "simulate"
    rank: ClassVar[int] = 1
    summary: ClassVar[str] = "section"
    run_options: ClassVar[tuple[Option, ...]] = (PROGRESS,)

    periods: int = option(MISSING, "Mesh periods to record.", least=1, keyword=False)
    transient: int = option(0, "Mesh periods before the recorded ones.", least=0, keyword=False)
    samples: int | None = option(
        None, "Instants recorded in each mesh period, at equal distances. By default only the stroboscopic section is "
        "recorded.", least=1, keyword=False, file_only="Stdout shows only the stroboscopic section.")

    def __post_init__(self) -> None:
        super().__post_init__()
        samples = self.samples or 0
        check_memory("periods", self.periods, _BYTES_PER_SECTION)
        check_memory("periods times samples", self.periods * samples, _BYTES_PER_SAMPLE)
        check_memory("samples", samples, (self.cost.table_bytes + _BYTES_PER_STEP * self.cost.steps) // max(1, samples))

    @cached_property
    def cost(self) -> Cost:
        return self.estimate(1, self.periods + self.transient, samples=self.samples or 0)

    def thinned(self, share: float) -> Self:
        """Of fewer periods."""
        return replace(self, **{name: max(1, round(share * getattr(self, name))) for name in ("periods", "transient")})

    @cached_property
    def _problem(self) -> InitialValueProblems:
        return initial_value_problems(self.model, samples=self.samples or 0)

    def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> Results:
        cycles = self.model.most_cycles
        if cycles > 1 and self.samples and self.samples < _LEAST_PER_CYCLE * cycles:
            warnings.warn(f"samples: {self.samples} in a period of {cycles} mesh cycles do not show what happens in a "
                          f"cycle. Take {SAMPLES * cycles}, {SAMPLES} in each.", stacklevel=1)
        flow, w = self._problem.flow, self._problem.w
        transient = flow.advance(w, self.transient) if self.transient else None
        out = flow.advance(transient.w if transient else w, self.periods, sections=self.periods,
                           sample=self.samples is not None)
        codes = {int(run.status[0]) for run in (transient, out) if run}
        status = DIVERGED if DIVERGED in codes else max(codes)
        sampled = {"samples": out.samples[None, ..., 0]} if self.samples else {}
        return {"sections": out.sections[None, :, :, 0], "status": np.array([status]), **sampled}

    def finish(self, found: Results, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        batch, names = self._problem.batch, self._problem.flow.system.names
        w, x2 = _bounded(found["sections"][0]), None
        if "x2_dot" in names:  # the bearings differ
            x2 = rotation_at_sections(self._problem, np.array([self.transient]), w[:, :, None])[0]
        number = np.arange(1, len(w) + 1)
        tau = (self.transient + number) * batch.model.period
        known = None if x2 is None else x2[None, 1:]
        values = to_physical(batch, names, w[None], tau[None], *transmission_error_at_start(batch), known)
        data: dict[str, Any] = {f"section_{n}": variable(f"section_{n}", ("period",), v[0]) for n, v in values.items()}
        data["period"] = ("period", number, {"long_name": "mesh period after the transient", "units": "T"})
        data["tau_section"] = variable("tau", ("period",), tau)
        if (contacts := self._problem.flow.system.contacts) and contacts.names:
            data.update(mesh_variables(contacts, "period", w, np.zeros(len(w)), "section_"))
        if self.samples:
            samples = _bounded(found["samples"][0])
            data.update(_trajectory(batch, names, samples, self.transient, x2, self._problem.flow.system))
        settings = {"periods": self.periods, "transient": self.transient, "samples": self.samples or 0}
        status = {"status": _STATUS.get(int(found["status"][0]), "not computed")}
        return new_dataset(data, attrs={**self.provenance(**settings), **status})


simulate = function_of(Simulate)

_BYTES_PER_SECTION, _BYTES_PER_SAMPLE = 700, 800
"""Upper bounds of the memory that a section and a sample take until they are saved."""

_BYTES_PER_STEP = 200
"""Memory that each step of the step grid of a mesh period takes, besides the step matrices."""

_STATUS = {OK: "ok", DIVERGED: "diverged", CHATTER: "chatter"}


def _bounded(w: np.ndarray) -> np.ndarray:
    """Coordinates w (..., d), time first and z and z' leading, with NaN from the first that exceed `DIVERGED_AT`."""
    inside = np.all(np.abs(w[..., :2]) < DIVERGED_AT, axis=-1)
    kept = np.logical_and.accumulate(inside.ravel()).reshape(inside.shape)
    return np.where(kept[..., None], w, np.nan)


def mesh_variables(contacts: MeshContacts, dim: str, w: np.ndarray, phase: np.ndarray, prefix: str = "") -> dict:
    """Variables of all meshes over ``dim`` and "mesh", from states w (S, d) at phases (S,) of the period.

    The deflection is 0 where the front flanks touch, −backlash where the back flanks do.
    """
    displacement, velocity, force, flank = contacts.states(w, phase)
    values = {"deflection": displacement - contacts.front, "deflection_rate": velocity, "mesh_force": force}
    found = {f"{prefix}{n}": variable(n, (dim, "mesh"), v) for n, v in values.items()}
    found[f"{prefix}contact"] = variable("contact", (dim, "mesh"), flank, coded=False)
    return {**found, "mesh": ("mesh", list(contacts.names))}


def mesh_forces(system: SwitchedAffine, w: np.ndarray, contact: np.ndarray, share: np.ndarray) -> np.ndarray:
    """The force of each mesh (S, K) in states w (S, d) with these contact states (S,), at shares (S,) of the period, at
    the first point."""
    if system.contacts is not None:
        return system.contacts.states(w, share)[2]
    angle = 2 * np.pi * share[:, None] * np.arange(1, system.chi_cos.shape[1] + 1)
    level = system.levels[0, np.searchsorted(system.starts[0], share, side="right") - 1]
    stiffness = level + np.cos(angle) @ system.chi_cos[0] + np.sin(angle) @ system.chi_sin[0]
    force = system.damping[0] * w[:, 1] + stiffness * backlash(w[:, 0])
    return (force * (contact != 0) if system.law.in_contact else force)[:, None]


def _trajectory(
    batch: Batch, names: tuple[str, ...], samples: np.ndarray, transient: int, x2: np.ndarray | None,
    system: SwitchedAffine,
) -> dict:
    """Variables over τ from samples (periods, samples, d + 1), whose last column is the contact state.

    If the bearings differ, x2 (periods + 1,) has the values at the start of the first and the end of each period.
    """
    model, (periods, per_period, _) = batch.model, samples.shape
    flat = samples.reshape(periods * per_period, -1)
    share = np.tile(np.arange(per_period) / per_period, periods)
    tau = (transient + np.repeat(np.arange(periods), per_period) + share) * model.period
    if (contacts := system.contacts) and contacts.names:
        found = to_physical(batch, names, flat[None, :, :-1], tau[None], *transmission_error_at_start(batch))
        data = {n: variable(n, ("tau",), v[0]) for n, v in found.items()}
        return {**data, **mesh_variables(contacts, "tau", flat[:, :-1], share), "tau": variable("tau", ("tau",), tau)}
    phase = share * model.period
    error, error_dot = (transmission_error(model, phase, derivative) for derivative in (0, 1))
    known = None
    if x2 is not None:  # with its change since the start of the mesh period
        flow = ExactFlow(switched_system(batch, (*names, "x2")), per_period)
        w = np.concatenate([np.nan_to_num(samples[:, 0, :-1].T), np.zeros((1, periods))])
        out = flow.advance(w, 1, points=np.zeros(periods, dtype=int), sample=True)
        known = (x2[:-1, None] + out.samples[0, :, samples.shape[2] - 1].T).reshape(1, -1)
    physical = to_physical(batch, names, flat[None, :, :-1], tau[None], error, error_dot, known)
    values = {n: v[0] for n, v in physical.items()}
    contact = np.nan_to_num(flat[:, -1]).astype(np.int8)
    values["mesh_force"] = mesh_forces(system, flat[:, :-1], contact, share)[:, 0]
    data = {n: variable(n, ("tau",), v) for n, v in values.items()}
    data["mesh_force"].attrs["comment"] = model.law.comment
    data["contact"] = variable("contact", ("tau",), contact, coded=False)
    data["tau"] = variable("tau", ("tau",), tau)
    return data


def steady_sections(problems: InitialValueProblems, verdicts: Verdicts, count: int) -> dict[str, np.ndarray]:
    """Stroboscopic sections (L, count) of L steady motions in physical coordinates, by name of the coordinate.

    They start from the states of the verdicts: a point of the orbit, or the last state of a motion without one. The
    mean rotation is that of the motion itself.
    """
    batch, flow, points = problems.batch, problems.flow, problems.points
    sections = flow.advance(verdicts.w, count, points=points, sections=count).sections
    x2 = np.full((len(points), count), np.nan)  # where it follows from the sections
    differ = bearings_differ(batch, flow.system.names)
    needed = differ & ((verdicts.period > 0) | weakly_damped(batch)) if differ.any() else differ
    integrated = np.flatnonzero(needed)
    if len(integrated):
        x2[integrated] = rotation_at_sections(
            problems.take(integrated), verdicts.periods_run[integrated], sections[:, :, integrated],
            verdicts.w[:, integrated])[:, 1:]
    number = verdicts.periods_run[:, None] + np.arange(1, count + 1)
    error, error_dot = transmission_error_at_start(batch)
    return to_physical(
        batch, flow.system.names, np.moveaxis(sections, (0, 1, 2), (1, 2, 0)),
        number * flow.system.period[points, None], error[:, None], error_dot[:, None], x2)


def rotation_at_sections(
    problems: InitialValueProblems, before: np.ndarray, sections: np.ndarray, orbit: np.ndarray | None = None
) -> np.ndarray:
    """x2 (L, S + 1) of L motions from τ = 0: after ``before`` (L,) mesh periods, and at the sections (S, d, L) then.

    ``orbit`` (d, L) are the states from which the sections follow, by default those that the motions have reached. The
    mean rotation of the motions is kept.
    """
    batch, flow, points = problems.batch, problems.flow, problems.points
    names, error = flow.system.names, transmission_error_at_start(batch)[0]
    end = flow.advance(initial_state(batch, flow.system).T, before, points=points, measured=True)
    first = end.w if orbit is None else orbit
    x1 = initial_values(batch)["x1"] + end.measures[Measure.VELOCITY]
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    x1 = x1 + J2 / (J1 + J2) * (relative_rotation(names, first.T, error) - relative_rotation(names, end.w.T, error))
    states = np.concatenate([first[None], sections])
    motions = states.shape[2]
    flat = np.moveaxis(states[:-1], 1, 0).reshape(states.shape[1], -1)
    bounded = np.all(np.isfinite(flat), axis=0)
    out = flow.advance(np.where(bounded, flat, 0.0), 1, points=np.tile(points, len(sections)), measured=True)
    changes = np.where(bounded, out.measures[Measure.VELOCITY], np.nan).reshape(-1, motions)  # of x1 in a period
    x1 = np.concatenate([x1[None], changes]).cumsum(axis=0).T
    # The mean velocity v of a motion differs from that of its orbit. Bearing damping makes the difference decay as
    # v e^(−rτ), whose integral is v τ (1 − e^(−rτ))/(rτ).
    from scipy.special import hyp1f1  # here, since it takes a tenth of a second to load

    apart = end.w - first
    velocity = apart[names.index("x2_dot")] + J1 / (J1 + J2) * relative_rotation(names, apart.T, np.zeros(1), "_dot")
    tau = np.arange(len(sections) + 1) * flow.system.period[points, None]
    decay = velocity[:, None] * tau * hyp1f1(1, 2, -rotation_decay(batch)[:, None] * tau)
    return x1 + decay - relative_rotation(names, np.moveaxis(states, 1, 2), error).T
