"""A run-up: speed and torque change from one mesh period to the next, and the motion with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from gearchaos.datasets import new_dataset, variable, variables
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.execute.progress import bar
from gearchaos.flow import OK, ExactFlow, Followed, Measure, follow_schedule
from gearchaos.gears.operation.operating import pair_of
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state, prescribed_rates_at_start, transmission_error_at_start
from gearchaos.model.switched import SwitchedAffine, coordinates, switched_system
from gearchaos.quantities import POSITIVE
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.cost import Cost, estimate
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.operating_ranges import operating_axis
from gearchaos.studies.core.options import RANGE, Option, axis_option, option
from gearchaos.studies.runup.runup_jumps import find_event, find_jumps
from gearchaos.studies.runup.runup_results import WORST, Journal, Run, RunResults
from gearchaos.studies.runup.torque_profile import (
    Profile,
    as_profile,
    check_covers,
    extremes,
    largest_torque,
    torque_at,
)
from gearchaos.studies.vibration.mesh_study import TURNS, MeshStudy

if TYPE_CHECKING:
    import xarray as xr

_SAMPLES = 1 << 16  # instants of the periods whose step matrices are in memory at once
_BINS = 400  # most speeds at which results are given
_HIGHEST = 6  # highest harmonic of the mesh in the spectrum
_SETTLED = 500  # periods at the first speed before the run begins
_OWN_MATRICES = 20.0  # cost of a step whose matrices are made for it alone, relative to one of many with the same
_JUMPS, _EVENT = 5, 2000
"""Jumps of a usual run, and the periods of it that take as long as finding the event of one: 1200 to 2800 in runs of 10
to 40 s."""

_FASTEST_CHANGE = 0.05  # largest relative change of the speed within a period


class _Periods(NamedTuple):
    """N periods of a run: their speeds and torques, equations, and motion."""

    system: SwitchedAffine
    out: Followed
    end: np.ndarray  # (3, d) the state after them; what of it is prescribed; its units over those of the results
    measures: np.ndarray  # (len(Measure), N) of the mesh that is looked at, in the units of the results
    force_units: np.ndarray  # (N,) over those of the results


@dataclass(frozen=True)
class RunUp(MeshStudy):
    """Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force.

    The speed changes linearly with time. It is constant within a mesh period, of a train within its common period, and
    such that these begin when they do at the speed that changes continuously. So is a torque that changes: it is that
    at the middle of the period. From one to the next the positions and the velocities of the wheels stay. Within a
    period the flow is exact. The run begins with the motion that is reached from rest at the first speed and torque; a
    run-down goes on with the motion of the run-up.

    Returns
    -------
    xarray.Dataset
        Over ``direction`` ("up", and with ``down`` also "down") and ``speed``: ``dynamic_factor``, the largest mesh
        force over the static one; ``mesh_force_peak``, ``contact`` and ``z_peak_to_peak``, the worst in any period.
        Over ``order`` too ``order_force``, the amplitude of the mesh force at the orders of the turn of the first
        wheel, the root mean square over windows of two turns, of a train of as many as its periods need. Over ``jump``
        ``speed_of_jump``, ``direction_of_jump``, ``factor_before_jump`` and ``factor_after_jump``: where the range of
        the mesh force in a period suddenly changes by a quarter or more, and is steady before or after; ``clear_jump``,
        whether it is both. With ``events`` also ``event_kind`` and ``event_speed``: the event that ends the branch of
        the motion before the jump, followed over the speed at the torque there; the speed is NaN where there is none,
        and the kind says why. With ``signal`` also ``signal_time``, s, ``signal_force`` and ``signal_speed``, rpm, over
        ``direction`` and ``instant``, of each mesh period ``samples`` instants; what rings faster is filtered out of
        the force. With ``torque`` also this over ``direction`` and ``speed``. The static force is that at the speed and
        the torque of each period; without torque the dynamic factor is NaN.

        Of a train they are those of one mesh, which the coordinate ``mesh`` names. The attribute ``status`` is "ok", or
        says at what speed the motion diverged; ``mesh_order`` is the order of the mesh.

    Raises
    ------
    InputError
        If the gears are not known, the speed changes by more than 5 % within a period, the torque is not given for the
        whole run, or the journal is one of another run-up.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="150 N*m",
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.runup(design.at(speed=500), "speed=500:900", 1.0)
    >>> found.order_force.dims, found.attrs["status"]
    (('direction', 'speed', 'order'), 'ok')

    As a value
    ----------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="150 N*m",
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> study = gc.RunUp(design.at(speed=500), "speed=500:900", 1.0, down=True)
    >>> study.kind, study.count
    ('runup', 1)
    """

    kind: ClassVar[str] = "runup"
    rank: ClassVar[int] = 5
    group: ClassVar[str] = "Gears"
    summary: ClassVar[str] = "runup"
    model_words: ClassVar[str] = "Given gears, with their torque."
    run_options: ClassVar[tuple[Option, ...]] = (
        Option("journal", "str | PathLike[str] | None", None, "A file that keeps what is computed. If it exists, the "
               "same call goes on from there, to the same result.", type=Path),)

    trial_of = 0  # periods of the run of which it is a part that is tried for the price

    speed: Axis = axis_option('The first and the last speed, as a text "speed=500:6000" in rpm.', RANGE)
    duration: float = option(60.0, "Of the run-up, in s.", rule=POSITIVE, keyword=False)
    down: bool = option(False, "Run down again as well, in the same time.")
    torque: str | Mapping[str, Sequence[float]] | None = option(
        None, "A table of the torque over time or speed, linear between rows. It is a file whose header has the units, "
        "or the columns in s, rpm and N m. It replaces the torque of the gears; of a train all mean torques change in "
        "one ratio. Gears are made for 4000 steps from the least to the largest torque.",
        is_path=True)
    events: bool = option(False, "Find the event that ends the branch of the motion before each jump.")
    signal: bool = option(False, "Also give the mesh force and the speed over the time.", in_files=False)

    def __post_init__(self) -> None:
        self._set(speed=operating_axis("speed", self.speed, count=RANGE))
        if self.torque is not None:
            self._set(torque=(profile := as_profile(self.torque)))
            if hasattr(self.model, "at"):  # gears, whose own torque may be missing
                self._set(model=self.model.at(torque=largest_torque(profile)))
        super().__post_init__()
        first, last = self.speed.start, self.speed.stop
        change = self._change
        if change > _FASTEST_CHANGE:
            raise InputError("duration", "must let the speed change by at most 5 % within a period", self.duration,
                             f"At {first:g} rpm it would change by {100 * change:.3g} %. It must be at least "
                             f"{self.duration * change / _FASTEST_CHANGE:.3g} s, or the first speed higher.")
        if self._periods < self._window:
            shortest = 2 * (self._window + 1) / (self._cycles_per_rpm * (first + last))
            raise InputError("duration", f"must be at least that of {self._window} periods", self.duration,
                             f"Give {shortest:.3g} s or more.")
        if self._profile is not None:
            check_covers(self._profile, (1 + self.down) * self.duration, (first, last))
            vary(self.model, {"torque": extremes(self._profile)})  # raises if the gears cannot have them
            if self.model.value("torque") != (largest := largest_torque(self._profile)):
                self._set(model=self.model.with_values({"torque": largest}))
        check_memory("periods in the duration", (1 + self.down) * self._periods * self.signal, 40 * self._samples)
        _ = self.cost

    @property
    def _change(self) -> float:
        """The largest relative change of the speed within a period."""
        return (self.speed.stop - self.speed.start) / self.duration / (self.speed.start**2 * self._cycles_per_rpm)

    @property
    def _periods(self) -> int:
        """Whole periods in a run."""
        return int((self.speed.start + self.speed.stop) / 2 * self._cycles_per_rpm * self.duration)

    @property
    def _profile(self) -> Profile | None:
        return self.torque  # type: ignore[return-value]  # as `__post_init__` has made it

    @cached_property
    def cost(self) -> Cost:
        """That of the runs, one after the other, at the speed where a period has the most steps."""
        ends = switched_system(vary(self.model, {"speed": [self.speed.start, self.speed.stop]}))
        found = estimate(ends, 1, _SETTLED + (1 + self.down) * self._periods, samples=self._samples, model=self.model)
        return replace(found, step_cost=_OWN_MATRICES * found.step_cost)

    def thinned(self, share: float) -> Self:
        """In less time, as far as that is possible, at the largest torque, without the events of jumps."""
        least = max(self.duration * self._change / _FASTEST_CHANGE, self.duration * self._window / self._periods)
        found = replace(self, duration=min(self.duration, max(share * self.duration, 1.1 * least)), torque=None)
        found._set(trial_of=self.trial_of or self._periods)
        return found

    def needed(self, found: Any) -> float:
        """All of the bound, and beyond it the events of as many jumps as this part shows, but at least of `_JUMPS`."""
        whole = _SETTLED + (1 + self.down) * (self.trial_of or self._periods)
        return 1.0 + self.events * max(found.sizes["jump"], _JUMPS) * _EVENT / whole

    @cached_property
    def _runs(self) -> dict[str, Run]:
        first, last, cycles = self.speed.start, self.speed.stop, self._cycles_per_rpm
        rate = (last - first) / self.duration
        runs = {"up": Run(first, rate, cycles, self._periods), "down": Run(last, -rate, cycles, self._periods)}
        return {way: run for way, run in runs.items() if way == "up" or self.down}

    def _point(self, way: str, time: np.ndarray, speed: np.ndarray) -> dict[str, np.ndarray]:
        """The values of speed and of a torque that changes (N,) at times of a run, by name."""
        if self._profile is None:
            return {"speed": speed}
        return {"speed": speed, "torque": torque_at(
            self._profile, time + self.duration * (way == "down"), speed)}

    def dataset(
        self, *, progress: bool = False, threads: int | None = None, journal: str | PathLike[str] | None = None,
    ) -> xr.Dataset:
        if journal is not None and self.signal:
            raise InputError("journal", "must be left out with a signal", str(journal), "That is not kept in it.")
        # each speed of the result has some periods, or a window of the spectrum, the lowest too
        slowest = int(self._cycles_per_rpm * self.speed.start * self.duration)
        bins = max(1, min(_BINS, slowest // min(8, self._window), self._periods))
        edges = np.linspace(self.speed.start, self.speed.stop, bins + 1)
        orders = np.arange(_HIGHEST * (self._samples // self.samples) * self._window + 1)
        found = {way: RunResults(run, edges, self._window, len(orders)) for way, run in self._runs.items()}
        settings = {n: getattr(self, n) for n in ("duration", "mesh", "down", "samples", "torque", "events")}
        attributes = self.provenance(**settings)
        forces = self._follow(found, None if journal is None else Journal(Path(journal), attributes), progress)
        over = ("direction", "speed", "order")
        data = variables(over, {n: np.stack([each.kept[n] for each in found.values()]) for n in WORST})
        data |= variables(over, {"contact": np.stack([each.contact for each in found.values()])})
        data["order_force"] = variable("order_force", over, np.stack([each.amplitudes for each in found.values()]))
        centres = (edges[1:] + edges[:-1]) / 2
        if self._profile is not None:
            torque = [self._point(way, (centres - run.first) / run.rate, centres)["torque"]
                      for way, run in self._runs.items()]
            data["torque"] = variable("torque", over[:2], np.stack(torque))
        data |= self._jump_variables(found, progress)
        if self.signal:
            data |= self._signal_variables(forces)
        coords = {name: variable(name, (name,), values) for name, values in (
            ("direction", np.array([*found])), ("speed", centres),
            ("order", orders / (TURNS * self._cycles_per_turn.denominator)))}
        status = "; ".join(
            f"diverged at {each.lost:.4g} rpm, {way}" for way, each in found.items() if each.lost is not None)
        return new_dataset(data, coords | self._mesh_coordinate, {
            **attributes, "status": status or "ok", "mesh_order": self.mesh_order})

    def _jump_variables(self, found: Mapping[str, RunResults], progress: bool) -> dict[str, xr.Variable]:
        """The variables over ``jump`` by name."""
        jumps = [(way, jump) for way, each in found.items() for jump in find_jumps(
            each, self._samples // self.samples,
            [*self._point(way, each.run.time(each.groups[:-1]), each.run.speed(each.groups)).values()])]
        columns = {
            "speed_of_jump": [jump.speed for _, jump in jumps], "direction_of_jump": [way for way, _ in jumps],
            "factor_before_jump": [jump.before for _, jump in jumps],
            "factor_after_jump": [jump.after for _, jump in jumps], "clear_jump": [jump.clear for _, jump in jumps]}
        if self.events and not self.trial_of:
            events = []
            with bar("runup, events" if progress else None, len(jumps)) as advance:
                for way, jump in jumps:
                    events.append(find_event(jump, self._at, partial(self._at_period, found[way], way)))
                    advance(1)
            columns |= {"event_kind": [kind for kind, _ in events], "event_speed": [speed for _, speed in events]}
        kinds = {"direction_of_jump": str, "event_kind": str, "clear_jump": bool}
        return variables(("jump",), {n: np.array(v, kinds.get(n, float)) for n, v in columns.items()})

    def _signal_variables(self, forces: Mapping[str, np.ndarray]) -> dict[str, xr.Variable]:
        share, instants = np.arange(self._samples) / self._samples, []
        for run in self._runs.values():
            time = run.time(np.arange(run.periods + 1))
            instants.append((time[:-1, None] + np.diff(time)[:, None] * share).ravel())
        found = variables(("direction", "instant"), {
            "signal_time": np.stack(instants), "signal_force": np.stack([force.ravel() for force in forces.values()]),
            "signal_speed": np.stack([np.repeat(run.speed(np.arange(run.periods + 1)), self._samples)
                                      for run in self._runs.values()])})
        found["signal_force"].attrs["comment"] = (
            f"Up to {self.samples // 2} times the mesh frequency: where the flow samples it more often, what is above "
            "is filtered out, and peaks with it. More samples keep more.")
        return found

    def _follow(
        self, found: Mapping[str, RunResults], journal: Journal | None, progress: bool
    ) -> dict[str, np.ndarray]:
        """Follow the motion through all runs, or from where the journal ends; returns the mesh forces (N, samples) of
        each run, if they are asked for."""
        from scipy.signal import resample_poly  # here, since it takes a third of a second to load

        known = {} if journal is None else journal.read()
        motion = known["motion"] if known else self._settled()
        for way, results in found.items():
            results.kept.update({name: known[f"{way}.{name}"] for name in results.kept if known})
        forces = {way: np.full((run.periods * self.signal, self._samples), np.nan, np.float32)
                  for way, run in self._runs.items()}
        total, done = (sum(n) for n in zip(*((r.run.periods, int(r.kept["periods"])) for r in found.values()),
                                           strict=True))
        with bar("runup, periods" if progress else None, total, done) as advance:
            for way, results in found.items():
                while (first := int(results.kept["periods"])) < results.run.periods and results.lost is None:
                    finer = self._finer(results.run.speed(np.array([first, first + 1]))[0])
                    stop = min(first + max(_SAMPLES // (finer * self._samples), 8), results.run.periods)
                    if self.events:
                        results.mark(motion)
                    part = self._periods_of(way, first, stop, motion, finer * self._samples)
                    motion = part.end
                    force = self._forces(part.system, part.out.samples[..., 0])
                    if finer > 1 and part.out.status[0] == OK:
                        force = resample_poly(force, 1, finer, padtype="line")
                    force = force.reshape(stop - first, -1)[:, : self._samples] * part.force_units[:, None]
                    results.add(part.measures, part.system.static_force[:, self._at] * part.force_units, force)
                    if self.signal:
                        forces[way][first:stop] = force
                    if journal is not None:
                        journal.write({"motion": motion} | {
                            f"{w}.{name}": value for w, each in found.items() for name, value in each.kept.items()})
                    advance(stop - first)
        return forces

    @cached_property
    def _names(self) -> tuple[str, ...]:
        """The coordinates, at all speeds and torques."""
        torque = {} if self._profile is None else {"torque": extremes(self._profile)}
        return coordinates(vary(self.model, {"speed": [self.speed.start, self.speed.stop], **torque}))

    def _settled(self) -> np.ndarray:
        """The motion at the first speed and torque, (3, d); see `_Periods`."""
        point = self._point("up", np.zeros(1), np.array([self.speed.start]))
        batch = vary(self.model, point)
        system = switched_system(batch, self._names)
        w = ExactFlow(system).advance(initial_state(batch, system).T.copy(), _SETTLED).w
        return np.concatenate([w.T, self._prescribed(batch), self._units(point)[0]])

    def _periods_of(self, way: str, first: int, stop: int, motion: np.ndarray, samples: int) -> _Periods:
        """The periods from one number to another, from the ``motion`` (3, d) before them."""
        run, k = self._runs[way], np.arange(first, stop + 1)
        time = run.time(k)
        point = self._point(way, (time[1:] + time[:-1]) / 2, run.speed(k))
        batch = vary(self.model, point)
        system, (units, force_units) = switched_system(batch, self._names), self._units(point)
        prescribed, all_units = np.vstack([motion[1], self._prescribed(batch)]), np.vstack([motion[2], units])
        factors = all_units[:-1] / all_units[1:]
        kicks = prescribed[1:] - factors * prescribed[:-1]
        out = follow_schedule(
            ExactFlow(system, samples), motion[0][:, None], np.arange(batch.size)[:, None], kicks[:, :, None],
            factors[:, :, None])
        own = slice(self._at * len(Measure), (self._at + 1) * len(Measure))
        measures = out.measures[:, own, 0].T.copy()
        measures[[Measure.FORCE_MAX, Measure.FORCE_MIN]] *= force_units
        measures[[Measure.Z_MAX, Measure.Z_MIN]] *= units[:, 0]
        return _Periods(system, out, np.stack([out.w[:, 0], prescribed[-1], units[-1]]), measures, force_units)

    def _prescribed(self, batch: Any) -> np.ndarray:
        """What of the coordinates follows from the transmission error and prescribed motions at the start of a period,
        (N, d): the rest follows from the wheels."""
        out = prescribed_rates_at_start(batch, self._names)
        out[:, 0] -= transmission_error_at_start(batch)[0]
        return out

    def _units(self, point: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """The units of the coordinates (N, d) and of the forces (N,) over those of the results: the reference stiffness
        of a pair may depend on the torque."""
        model: Any = self.model
        torques, at = np.unique(point.get("torque", np.zeros(len(point["speed"]))), return_inverse=True)
        if self._profile is None or model.mesh_names:
            return np.ones((len(at), len(self._names))), np.ones(len(at))
        own, scales = pair_of(model.gears).scales, [pair_of(model.gears, torque).scales for torque in torques.tolist()]
        length, velocity, force = (np.array([getattr(each, name) / getattr(own, name) for each in scales])[at]
                                   for name in ("length", "velocity", "force"))
        rates = np.array([name.endswith("_dot") for name in self._names])
        return np.where(rates, velocity[:, None], length[:, None]), force

    def _at_period(self, results: RunResults, way: str, k: int) -> tuple[Any, np.ndarray, tuple[str, ...]]:
        """The model at a period of a run, and the state (d,) at its start, by the names of its coordinates."""
        first, motion = results.marked(k)
        if k > first:
            motion = self._periods_of(way, first, k, motion, 1).end
        run = results.run
        point = self._point(way, run.time(np.array([k])), run.speed(np.array([k, k + 1])))
        return self.model.with_values({n: float(v[0]) for n, v in point.items()}), motion[0], self._names


runup = function_of(RunUp)
