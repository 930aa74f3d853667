"""The skeleton of a map: all curves in it on which orbits are born, lose stability or touch a boundary of contact.

Branches on some lines of the map give events, and each event that lies on no known curve gives another curve. Events of
one kind, period and boundary form a group. Only events of the same group can lie on one curve, so that groups are
independent of each other; the events of a group are treated one after another. The result therefore does not depend on
the number of workers.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped, from_polyline
from gearchaos.continuation.branch import Branch, doubled_start, follow_branch, follow_doubled
from gearchaos.continuation.curve import SETTINGS, Bounds, CurveData, follow_curve
from gearchaos.continuation.defining import EventSeed, seed_of
from gearchaos.continuation.events import FLIP, FOLD, KINDS
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, converge, minimal, passes, same_cycle, shift_difference
from gearchaos.dynamics import Classification, Label, classify, orbits
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.errors import InputError
from gearchaos.execute.pool import Pool
from gearchaos.execute.progress import bar
from gearchaos.model import MeshModel

_SETTINGS = Settings(first=1e-2, longest=4e-2, shortest=1e-7, finest=1e-4, points=3000)
"""Steps along the branches of a line, unless others are given."""

_MARGIN = 0.25  # how far branches are followed beyond both ends of a line, relative to its length
_CLASSIFICATION = Classification(exponent_run=400, doublings=0, longest_transient=0)  # only periodic motions are needed
_NEAR = 0.5  # largest distance of a branch, interpolated between two points, from an orbit that may lie on it

_ON_CURVE = 4e-3  # an event is on a curve if it lies within this distance of it, in units of the axes' lengths …
_SAME_ORBIT = 0.3  # … and no coordinate of the two orbits differs by more than this, relative to the largest coordinate


@dataclass(frozen=True)
class Line:
    """A line of a map: one parameter varies, the other is fixed."""

    model: MeshModel
    axes: tuple[str, str]
    bounds: Bounds
    along: int  # index of the axis along which the parameter varies, 0 or 1
    value: float  # of the other parameter
    cells: int  # number of equidistant places at which motions are searched
    starts: int  # number of initial states at each place, besides the model's own
    period: int  # largest one of the orbits followed, in mesh periods


def line_branches(line: Line) -> tuple[ParameterFamily, list[Branch]]:
    """The branches through all stable periodic motions found on a line, and the doubled branches at their flips.

    They are followed somewhat beyond the line, since arms of a branch in a window can be joined outside it.
    """
    other = 1 - line.along
    family = ParameterFamily(line.model.with_values({line.axes[other]: line.value}), (line.axes[line.along],))
    low, high = line.bounds[line.along]
    ends, margin, branches = [low, high], _MARGIN * (high - low), list[Branch]()
    for side, value in enumerate((low - margin, high + margin)):  # as far as the model accepts it
        with suppress(InputError):
            family.check(np.array([[value]]))
            ends[side] = value
    bounds = ends[0], ends[1]
    for cycle in stable_orbits(line, family):
        if on_any(family, branches, cycle):
            continue
        try:
            branch = follow_branch(family, cycle, bounds, _SETTINGS)
        except InputError:  # an orbit that is not isolated, of a free motion without load
            continue
        _add(family, branches, branch, bounds, line.period)
    return family, branches


def line_seeds(line: Line) -> list[EventSeed]:
    """The events on all branches of a line, as seeds of their curves.

    A fold without contact switches has none: the motion is linear, and the orbits with this multiplier are a continuum
    at one value of the parameters.
    """
    _, branches = line_branches(line)
    seeds = []
    for branch in branches:
        for event in branch.events:
            values = np.empty(2)
            values[line.along], values[1 - line.along] = event.cycle.values[0], line.value
            linear = event.kind == FOLD and len(event.cycle.switches) == 0
            inside = line.bounds[line.along][0] <= event.cycle.values[0] <= line.bounds[line.along][1]
            if KINDS[event.kind].curve and inside and not linear:
                seeds.append(seed_of(event, values))
    return seeds


def stable_orbits(line: Line, family: ParameterFamily) -> list[Cycle]:
    """The stable orbits, up to the largest period, that motions on a line lead to; an orbit may occur repeatedly."""
    values = np.linspace(*line.bounds[line.along], line.cells)
    flow = family.exact_flow(values[:, None])
    box = spread(default_box(family.model), line.starts, seed=0) if line.starts else {}
    own = family.initial_states(values[:, None]).T
    parts = [own] + [family.states_of(np.array([v]), box) for v in values if line.starts]
    index = np.concatenate([np.arange(line.cells), *(np.full(line.starts, i) for i in range(line.cells))]).astype(int)
    found = classify(flow, np.concatenate(parts, axis=1), index, settings=_CLASSIFICATION, response=False)
    periodic = np.flatnonzero((found.label == Label.PERIODIC) & (found.period <= line.period) & (found.period > 0))
    if len(periodic) == 0:
        return []
    points = orbits.sections(flow, found.w[:, periodic], index[periodic], found.period[periodic])
    out: list[Cycle] = []
    for motion, section in zip(periodic, points, strict=True):
        value = values[index[motion]]
        if any(c.values[0] == value and passes(c.points, section[0]) for c in out):
            continue
        cycle = converge(family, section, np.array([value]))
        if cycle.converged:
            out.append(cycle)
    return out


def _add(family: ParameterFamily, branches: list[Branch], branch: Branch, bounds: tuple[float, float],
         longest: int) -> None:
    """Add a branch, and the branches of twice the period at its flips that are not among them yet."""
    branches.append(branch)
    if 2 * branch.period > longest:
        return
    for event in branch.events:
        if event.kind != FLIP:
            continue
        try:
            _, start = doubled_start(family, event, bounds[1] - bounds[0])
            if bounds[0] <= start.u[-1] <= bounds[1] and not on_any(family, branches, start.data):
                _add(family, branches, follow_doubled(family, event, bounds, _SETTINGS), bounds, longest)
        except (Stopped, InputError):
            continue


def on_any(family: ParameterFamily, branches: list[Branch], cycle: Cycle) -> bool:
    """Whether an orbit lies on one of the branches."""
    return any(on_branch(family, branch, cycle) for branch in branches if branch.period == cycle.period)


def on_branch(family: ParameterFamily, branch: Branch, cycle: Cycle) -> bool:
    """Whether an orbit lies on a branch of the same period."""
    value, values = cycle.values[0], branch.values
    for i in np.flatnonzero((values[:-1] - value) * (values[1:] - value) <= 0):
        a, b = branch.points[i].data, branch.points[i + 1].data
        full = values[i + 1] - values[i]
        guess = a.points + (b.points - a.points) * ((value - values[i]) / full if full else 0.5)
        if shift_difference(guess, cycle.points) > _NEAR:
            continue
        found = converge(family, guess, cycle.values)
        if found.converged and same_cycle(minimal(family, found), cycle):
            return True
    return False


def on_curve(seed: EventSeed, curve: CurveData, spans: np.ndarray) -> bool:
    """Whether an event lies on a curve, with about the same orbit; ``spans`` (2,) are the lengths of the axes."""
    if (seed.kind, seed.period, seed.boundary) != (curve.kind, curve.period, curve.boundary):
        return False
    distance, share = from_polyline(curve.values / spans, seed.values / spans)
    size = max(1.0, float(np.abs(seed.points).max()))
    for i in np.flatnonzero(distance < _ON_CURVE):
        points = curve.points[i] + share[i] * (curve.points[i + 1] - curve.points[i])
        if shift_difference(points, seed.points) < _SAME_ORBIT * size:
            return True
    return False


def same_curve(new: CurveData, old: CurveData, spans: np.ndarray) -> bool:
    """Whether the middle and both quarters of a curve lie on another one."""
    count = len(new.values)
    return all(
        on_curve(EventSeed(new.kind, new.points[i], new.values[i], new.boundary), old, spans)
        for i in (count // 4, count // 2, 3 * count // 4))


Journal = MutableMapping[str, Any]
"""Finished work by name: the events of a line (list of EventSeed), and the curve of an event (CurveData), or why there
is none (str)."""


@lru_cache(maxsize=4)
def _plane(model: MeshModel, axes: tuple[str, str]) -> ParameterFamily:
    """The model along both axes: one for all curves of a worker, since it keeps the equations that it has computed."""
    return ParameterFamily(model, axes)


@dataclass(frozen=True)
class CurveWork:
    """What a worker needs to follow curves."""

    model: MeshModel
    axes: tuple[str, str]
    bounds: Bounds
    settings: Settings

    def __call__(self, seed: EventSeed) -> CurveData | str:
        """The curve of a seed, or why there is none."""
        try:
            return follow_curve(_plane(self.model, self.axes), seed, self.bounds, self.settings)
        except (Stopped, np.linalg.LinAlgError) as error:
            return str(error)


@dataclass(frozen=True)
class CurveSearch:
    """Where the events of a skeleton are searched."""

    period: int  # largest one of the orbits, in mesh periods
    lines: tuple[int, int]  # on which branches are followed, along the first and along the second axis
    cells: tuple[int, int]  # places on these lines at which stable motions are searched
    starts: int  # initial states at each place, besides the model's own


@dataclass
class _Group:
    """Events of one kind, period and boundary, and the curves found from them so far."""

    name: str
    seeds: list[EventSeed] = field(default_factory=list)
    next: int = 0  # index of the first seed that has not been treated yet
    curves: list[CurveData] = field(default_factory=list)
    failed: list[tuple[EventSeed, str]] = field(default_factory=list)  # whose curve could not be followed, and why

    @property
    def work_name(self) -> str:
        """Name of the curve of the next seed in a journal."""
        return f"{self.name} {self.next}"

    def skip_known(self, spans: np.ndarray) -> bool:
        """Pass the seeds that lie on curves found; whether one remains."""
        while self.next < len(self.seeds):
            if not any(on_curve(self.seeds[self.next], curve, spans) for curve in self.curves):
                return True
            self.next += 1
        return False

    def add(self, result: CurveData | str, spans: np.ndarray) -> None:
        """Add the result for the next seed."""
        if isinstance(result, str):
            self.failed.append((self.seeds[self.next], result))
        elif not any(same_curve(result, curve, spans) for curve in self.curves):
            self.curves.append(result)
        self.next += 1


def find_curves(model: MeshModel, axes: tuple[str, str], bounds: Bounds, pool: Pool, search: CurveSearch, *,
                settings: Settings = SETTINGS, journal: Journal | None = None,
                progress: bool = False) -> tuple[list[CurveData], list[tuple[EventSeed, str]]]:
    """The curves of all events of orbits up to a period that are found in a window, between the ends of both axes; and
    the events whose curve could not be followed, and why.

    What is computed is added to the journal of the work that is finished already.
    """
    done = {} if journal is None else journal
    inside = [np.linspace(*bounds[1 - along], 2 * search.lines[along] + 1)[1::2] for along in (0, 1)]
    work = {
        f"line {along} {i}": Line(model, axes, bounds, along, value, search.cells[along], search.starts, search.period)
        for along in (0, 1) for i, value in enumerate(inside[along])
    }
    with bar("lines" if progress else None, len(work), sum(name in done for name in work)) as advance:
        missing = (item for item in work.items() if item[0] not in done)
        for (name, _), future in pool.results(_named_line_seeds, missing):
            done[name] = future.result()
            advance(1)
    named: dict[str, _Group] = {}
    for seed in (seed for name in work for seed in done[name]):
        name = f"{seed.kind} {seed.period} {seed.boundary or 0}"
        named.setdefault(name, _Group(name)).seeds.append(seed)
    # groups with most events first, so that no long one is left for the end
    groups = sorted(named.values(), key=lambda group: -len(group.seeds))
    spans = np.array([high - low for low, high in bounds])
    _follow(groups, pool, CurveWork(model, axes, bounds, settings), spans, done, progress)
    return [c for g in groups for c in g.curves], [f for g in groups for f in g.failed]


def _named_line_seeds(item: tuple[str, Line]) -> list[EventSeed]:
    """The events on a line that has a name."""
    return line_seeds(item[1])


def _follow(groups: list[_Group], pool: Pool, work: CurveWork, spans: np.ndarray, done: Journal,
            progress: bool) -> None:
    """Follow the curves of all groups, one curve of a group at a time."""
    pending: dict[Future[Any], _Group] = {}
    with bar("curves" if progress else None, sum(len(group.seeds) for group in groups)) as advance:

        def submit_next(group: _Group) -> None:
            """Take all results for a group that are there, and submit the next event on no known curve if any."""
            before = group.next
            while group.skip_known(spans):
                if group.work_name not in done:
                    pending[pool.submit(work, group.seeds[group.next])] = group
                    break
                group.add(done[group.work_name], spans)
            advance(group.next - before)

        try:
            for group in groups:
                submit_next(group)
            while pending:
                finished, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    group = pending.pop(future)
                    done[group.work_name] = future.result()
                    submit_next(group)
        finally:
            for future in pending:
                future.cancel()
