"""A run-up: the speed changes from one mesh period to the next, and the motion with it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np

from gearchaos.datasets import new_dataset, variable, variables
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.execute.progress import bar
from gearchaos.flow import OK, ExactFlow, Measure, follow_schedule
from gearchaos.model import vary
from gearchaos.model.coordinates import prescribed_rates_at_start
from gearchaos.model.switched import switched_system
from gearchaos.quantities import POSITIVE
from gearchaos.studies.axis import Axis
from gearchaos.studies.cost import Cost, estimate
from gearchaos.studies.declaration import function_of
from gearchaos.studies.initial_value_problems import initial_value_problems
from gearchaos.studies.mesh_study import TURNS, MeshStudy
from gearchaos.studies.options import RANGE, axis_option, option

if TYPE_CHECKING:
    import xarray as xr

_SAMPLES = 1 << 16  # instants of the periods whose step matrices are in memory at once
_BINS = 400  # most speeds at which results are given
_HIGHEST = 6  # highest harmonic of the mesh in the spectrum
_SETTLED = 500  # periods at the first speed before the run begins
_FASTEST_CHANGE = 0.05  # largest relative change of the speed within a period
# of a run; fewest mesh cycles, and fewest and most periods, on either side of a jump
_PARTS, _WIDTHS = 800, (24, 4, 400)
_JUMP = 1.25  # smallest ratio of the ranges of the force beyond which they change suddenly
_LEAST = 1e-12  # range of the force that counts as none
_SLOW = 0.05  # largest relative change of the speed on both sides of a jump together: that of a resonance is slower
_BEYOND = 0.05  # share of the periods on either side that may lie beyond those on the other side


class _Run(NamedTuple):
    """N periods of a run, one after the other."""

    time: np.ndarray  # (N + 1,) when they begin, s
    speed: np.ndarray  # (N,) the mean speed in each, rpm


_State = tuple[np.ndarray, np.ndarray]
_Measures = dict[Measure, np.ndarray]  # of each period, (N,)
_MEASURED = (Measure.FORCE_MAX, Measure.FORCE_MIN, Measure.Z_MAX, Measure.Z_MIN, Measure.FRONT_TIME, Measure.BACK_TIME,
             Measure.SWITCHES)


@dataclass(frozen=True)
class RunUp(MeshStudy):
    """Run gears up through a range of speeds, and down again: response, jumps, orders of the mesh force.

    The speed changes linearly with time. It is constant within a mesh period, of a train within its common period, and
    such that these begin when they do at the speed that changes continuously. From one to the next the deflections
    stay, and the velocities of the wheels. Within a period the flow is exact. The run begins with the motion that is
    reached from rest at the first speed; a run-down goes on with the motion of the run-up.

    Returns
    -------
    xarray.Dataset
        Over ``direction`` ("up", and with ``down`` also "down") and ``speed``: ``dynamic_factor``, the largest mesh
        force over the static one; ``mesh_force_peak``, ``contact`` and ``z_peak_to_peak``, the worst in any period.
        Over ``order`` too ``order_force``, the amplitude of the mesh force at the orders of the turn of the first
        wheel, the root mean square over windows of two turns, of a train of as many as its periods need. Over ``jump``
        ``speed_of_jump``, ``direction_of_jump``, ``factor_before_jump`` and ``factor_after_jump``: where the range of
        the mesh force in a period suddenly changes by a quarter or more, and is steady before or after. With ``signal``
        also ``signal_time``, s, ``signal_force`` and ``signal_speed``, rpm, over ``direction`` and ``instant``.

        Of a train they are those of one mesh, which the coordinate ``mesh`` names. The attribute ``status`` is "ok", or
        says at what speed the motion diverged; ``mesh_order`` is the order of the mesh.

    Raises
    ------
    InputError
        If the gears are not known, or the speed changes by more than 5 % within a period.

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

    speed: Axis = axis_option('The first and the last speed, as a text "speed=500:6000" in rpm.', RANGE)
    duration: float = option(60.0, "Of the run-up, in s.", rule=POSITIVE, keyword=False)
    down: bool = option(False, "Run down again as well, in the same time.")
    signal: bool = option(False, "Also give the mesh force and the speed over the time.", in_files=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.speed.name != "speed":
            raise InputError("speed", "must be an axis of speed", self.speed.name, "E.g. speed=500:6000.")
        first, last = self.speed.start, self.speed.stop
        change = (last - first) / self.duration / (first**2 * self._cycles_per_rpm)
        if change > _FASTEST_CHANGE:
            raise InputError("duration", "must let the speed change by at most 5 % within a period", self.duration,
                             f"At {first:g} rpm it would change by {100 * change:.3g} %. It must be at least "
                             f"{self.duration * change / _FASTEST_CHANGE:.3g} s, or the first speed higher.")
        if self._periods < self._window:
            shortest = 2 * (self._window + 1) / (self._cycles_per_rpm * (first + last))
            raise InputError("duration", f"must be at least that of {self._window} periods", self.duration,
                             f"Give {shortest:.3g} s or more.")
        check_memory("periods in the duration", self._periods, 150 + 24 * self._samples * self.signal)
        _ = self.cost

    @property
    def _periods(self) -> int:
        """Whole periods in a run."""
        return int((self.speed.start + self.speed.stop) / 2 * self._cycles_per_rpm * self.duration)

    @cached_property
    def cost(self) -> Cost:
        """That of the runs, one after the other, at the speed where a period has the most steps."""
        ends = switched_system(vary(self.model, {"speed": [self.speed.start, self.speed.stop]}))
        return estimate(ends, 1, _SETTLED + (1 + self.down) * self._periods, samples=self._samples)

    def _run(self, down: bool) -> _Run:
        """The periods of a run: k of them are over when the wheel has turned that far."""
        first, last = (self.speed.stop, self.speed.start) if down else (self.speed.start, self.speed.stop)
        rate = (last - first) / self.duration
        turned = np.arange(self._periods + 1) / self._cycles_per_rpm  # integral of the speed
        time = 2 * turned / (first + np.sqrt(np.maximum(first**2 + 2 * rate * turned, 0.0)))
        return _Run(time, 1 / (self._cycles_per_rpm * np.diff(time)))

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        self.cost.announce(progress)
        runs = [self._run(down) for down in (False, True)[: 1 + self.down]]
        edges = np.linspace(self.speed.start, self.speed.stop, self._bins(runs[0]) + 1)
        orders = np.arange(_HIGHEST * (self._samples // self.samples) * self._window + 1)
        lines = [_Lines(run, edges, self._window, len(orders)) for run in runs]
        measures, forces, stopped = [], [], []
        start = initial_value_problems(self.model, {"speed": [self.speed.start]})
        state = start.flow.advance(start.w, _SETTLED).w, prescribed_rates_at_start(start.batch, start.flow.system.names)
        for run, spectrum in zip(runs, lines, strict=True):
            state, measure, force, lost = self._follow(run, state, start.flow.system.names, spectrum, progress)
            measures.append(measure)
            forces.append(force)
            stopped.append(lost)
        names = ["up", "down"][: len(runs)]
        found = [_over_speed(run, m, edges) for run, m in zip(runs, measures, strict=True)]
        over = ("direction", "speed", "order")
        data = variables(over, {n: np.stack([each[n] for each in found]) for n in found[0]})
        static = self._static((edges[1:] + edges[:-1]) / 2)
        data["dynamic_factor"] = variable("dynamic_factor", over[:2], data["mesh_force_peak"].values / static)
        data["order_force"] = variable("order_force", over, np.stack([each.amplitudes for each in lines]))
        jumps = [(speed, name, *(np.array(forces) / self._static(np.array([speed]))))
                 for name, run, m in zip(names, runs, measures, strict=True)
                 for speed, *forces in _jumps(run, m, self._samples // self.samples)]
        for i, name in enumerate(("speed_of_jump", "direction_of_jump", "factor_before_jump", "factor_after_jump")):
            values = np.array([jump[i] for jump in jumps], str if name == "direction_of_jump" else float)
            data[name] = variable(name, ("jump",), values)
        if self.signal:
            instants = [(run.time[:-1, None] + np.diff(run.time)[:, None] * np.arange(self._samples) / self._samples
                         ).ravel() for run in runs]
            data["signal_time"] = variable("signal_time", ("direction", "instant"), np.stack(instants))
            data["signal_force"] = variable("signal_force", ("direction", "instant"), np.stack(
                [force.ravel() for force in forces]))
            data["signal_speed"] = variable("signal_speed", ("direction", "instant"), np.stack(
                [np.repeat(run.speed, self._samples) for run in runs]))
        coords = {name: variable(name, (name,), values) for name, values in (
            ("direction", np.array(names)), ("speed", (edges[1:] + edges[:-1]) / 2),
            ("order", orders / (TURNS * self._cycles_per_turn.denominator)))}
        coords |= self._mesh_coordinate
        settings = {n: getattr(self, n) for n in ("duration", "mesh", "down", "samples")}
        status = "; ".join(f"diverged at {speed:.4g} rpm, {name}" for name, speed in zip(names, stopped, strict=True)
                           if speed is not None)
        attrs = {"status": status or "ok", "mesh_order": self.mesh_order}
        return new_dataset(data, coords, {**self.provenance(**settings), **attrs})

    def _static(self, speeds: np.ndarray) -> np.ndarray:
        """The static mesh force at speeds (V,); NaN without load."""
        force = np.abs(switched_system(vary(self.model, {"speed": speeds})).static_force[:, self._at])
        return np.where(force == 0, np.nan, force)

    def _bins(self, run: _Run) -> int:
        """The number of speeds of the result: each has some periods, or a window of the spectrum, the lowest too."""
        slowest = self._cycles_per_rpm * self.speed.start * self.duration
        return max(1, min(_BINS, int(slowest) // min(8, self._window), len(run.speed)))

    def _follow(
        self, run: _Run, state: _State, names: tuple[str, ...], lines: _Lines, progress: bool
    ) -> tuple[_State, _Measures, np.ndarray, float | None]:
        """The state at the end of a run, the measures of its periods, the mesh forces (N, samples) if they are asked
        for, and the speed at which it diverged; the mesh forces are added to the ``lines`` of the spectrum.

        A state has the coordinates (d, 1), and what of them is prescribed at the start of the period before (1, d).
        """
        from scipy.signal import resample_poly  # here, since it takes a third of a second to load

        count, (w, before) = len(run.speed), state
        measures = {name: np.full(count, np.nan) for name in _MEASURED}
        forces = np.full((count * self.signal, self._samples), np.nan, np.float32)
        with bar("runup, periods" if progress else None, count) as advance:
            first = 0
            while first < count:
                finer = self._finer(run.speed[first])
                part = slice(first, min(first + max(_SAMPLES // (finer * self._samples), 8), count))
                first = part.stop
                batch = vary(self.model, {"speed": run.speed[part]})
                system = switched_system(batch, names)
                prescribed = prescribed_rates_at_start(batch, names)
                kicks = np.diff(prescribed, axis=0, prepend=before)[:, :, None]
                flow, points = ExactFlow(system, finer * self._samples), np.arange(batch.size)[:, None]
                out = follow_schedule(flow, w, points, kicks)
                w, before = out.w, prescribed[-1:]
                for name, values in measures.items():
                    values[part] = out.measures[:, self._at * len(Measure) + name, 0]
                force = self._forces(system, out.samples[..., 0])
                if finer > 1 and out.status[0] == OK:
                    force = resample_poly(force, 1, finer, padtype="line")
                force = force.reshape(batch.size, -1)[:, : self._samples]
                lines.add(force)
                forces[part if self.signal else slice(0)] = force[: batch.size * self.signal]
                advance(batch.size)
                if out.status[0] != OK:
                    break
        lost = np.flatnonzero(np.isnan(measures[Measure.FORCE_MAX]))
        return (w, before), measures, forces, float(run.speed[lost[0]]) if len(lost) else None


class _Lines:
    """The spectrum of a run in bins of speed: the mean power of its windows, which are added as they come, at O lines
    of whole numbers of periods in a window."""

    def __init__(self, run: _Run, edges: np.ndarray, window: int, count: int) -> None:
        self.window, self.added, self.rest = window, 0, np.zeros((0, 0))
        whole = len(run.speed) // window
        speed = run.speed[: whole * window].reshape(whole, window).mean(axis=1)
        centres, at = (edges[1:] + edges[:-1]) / 2, np.digitize(speed, edges[1:-1])
        # a bin in which no window has its mean speed has the nearest one
        self.windows = [np.flatnonzero(at == b) if (at == b).any() else np.array([np.argmin(np.abs(speed - centre))])
                        for b, centre in enumerate(centres)]
        self.power = np.zeros((len(centres), count))

    def add(self, force: np.ndarray) -> None:
        """Add the mesh forces (n, samples) of the next periods."""
        force = np.concatenate([self.rest, force]) if len(self.rest) else force
        for first in range(0, len(force) - self.window + 1, self.window):
            signal = force[first : first + self.window].ravel()
            power = np.abs(np.fft.rfft(signal)[: self.power.shape[1]] / (len(signal) / 2)) ** 2
            power[0] /= 4
            for bin_power, windows in zip(self.power, self.windows, strict=True):
                if windows[0] <= self.added <= windows[-1]:
                    bin_power += power / len(windows)
            self.added += 1
        self.rest = force[len(force) // self.window * self.window :].copy()

    @property
    def amplitudes(self) -> np.ndarray:
        """The root mean square over the windows of each bin, (B, O); NaN where the run did not come."""
        known = [windows[-1] < self.added for windows in self.windows]
        return np.where(np.array(known)[:, None], np.sqrt(self.power), np.nan).astype(np.float32)


runup = function_of(RunUp)


def response_peaks(dataset: xr.Dataset) -> list[int]:
    """The indices of the speeds with a peak of the dynamic factor, of a run in one direction: it falls by a quarter or
    more on both sides before it rises higher."""
    from scipy.signal import find_peaks  # here, since it takes a third of a second to load

    level = np.log(dataset["dynamic_factor"].values)
    return find_peaks(np.where(np.isfinite(level), level, -np.inf), prominence=math.log(_JUMP))[0].tolist()


def _over_speed(run: _Run, measures: _Measures, edges: np.ndarray) -> dict[str, np.ndarray]:
    """The largest values of the periods of a run in each bin of speeds, and their contact."""
    m, at, bins = measures, np.digitize(run.speed, edges[1:-1]), len(edges) - 1
    peak = np.maximum(np.abs(m[Measure.FORCE_MAX]), np.abs(m[Measure.FORCE_MIN]))
    out = {}
    for name, each in (("mesh_force_peak", peak), ("z_peak_to_peak", m[Measure.Z_MAX] - m[Measure.Z_MIN])):
        out[name] = np.full(bins, np.nan)
        np.fmax.at(out[name], at, each)
    front, back = m[Measure.FRONT_TIME] > 0, m[Measure.BACK_TIME] > 0
    apart = (m[Measure.SWITCHES] > 0) | ~(front | back)
    front, back, apart, known = (np.bincount(at, each & ~np.isnan(peak), bins) > 0
                                 for each in (front, back, apart, np.True_))
    contact = np.select([~known, front & back, apart & (front | back), front | back], [-1, 2, 1, 0], default=3)
    return {**out, "contact": contact.astype(np.int8)}


def _jumps(run: _Run, measures: _Measures, cycles: int) -> list[tuple[float, float, float]]:
    """Where the range of the mesh force of the periods, each of so many mesh cycles, changes suddenly: the speed, and
    the largest forces before and after.

    That of two periods is taken, alike along a motion of doubled period. On one side it must be steady, so that a
    chaotic motion has no jumps but its beginning and end.
    """
    from scipy.ndimage import maximum_filter1d, percentile_filter  # here, since they take a tenth of a second to load

    width = int(np.clip(len(run.speed) // _PARTS, max(_WIDTHS[0] // cycles, _WIDTHS[1]), _WIDTHS[2]))
    extent = measures[Measure.FORCE_MAX] - measures[Measure.FORCE_MIN]
    peak = np.maximum(np.abs(measures[Measure.FORCE_MAX]), np.abs(measures[Measure.FORCE_MIN]))
    known = int(np.count_nonzero(np.isfinite(extent)))
    if known < 4 * width:
        return []
    level = np.log(np.maximum(maximum_filter1d(extent[:known], 2), _LEAST))
    low, middle, high = (percentile_filter(level, share, width) for share in (100 * _BEYOND, 50, 100 * (1 - _BEYOND)))
    before, after = slice(0, -2 * width), slice(2 * width, None)
    steady = np.minimum((high - low)[before], (high - low)[after]) < math.log(_JUMP)
    steady &= np.abs(np.log(run.speed[:known][after] / run.speed[:known][before])) < _SLOW
    change = np.where(steady, np.abs(middle[after] - middle[before]), 0.0)
    out = []
    while change.max() > math.log(_JUMP):
        middle_of = int(np.argmax(change)) + width
        near = slice(middle_of - width // 2, middle_of + width // 2)  # between the two windows
        k = near.start + int(np.argmax(np.abs(np.diff(level[near]))))
        earlier = peak[max(0, near.start - width) : near.start].max()
        later = peak[middle_of + width : middle_of + 2 * width].max()  # when the transient is over
        out.append((float(run.speed[k]), float(earlier), float(later)))
        change[max(0, middle_of - 3 * width) : middle_of + width] = 0.0
    return sorted(out)
