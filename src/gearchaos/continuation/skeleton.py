"""The skeleton of a map: all curves in it on which orbits are born, lose stability or touch a boundary of contact.

Branches on some lines of the map give events, and each event that lies on no known curve gives another curve. Events of
one kind, period and boundary form a group. Only events of the same group can lie on one curve, so that groups are
independent of each other; the events of a group are treated one after another. The result therefore does not depend on
the number of workers.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.curve import SETTINGS, Bounds, CurveData, follow_curve
from gearchaos.continuation.defining import EventSeed
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.lines import Line, line_seeds
from gearchaos.continuation.shooting import shift_difference
from gearchaos.execute.pool import Pool
from gearchaos.execute.progress import bar
from gearchaos.model import MeshModel

_ON_CURVE = 4e-3
"""An event is on a curve if it lies within this distance of it, in units of the axes' lengths …"""

_SAME_ORBIT = 0.3
"""… and no coordinate of the two orbits differs by more than this, relative to the largest coordinate."""


def on_curve(seed: EventSeed, curve: CurveData, spans: np.ndarray) -> bool:
    """Whether an event lies on a curve, with about the same orbit; ``spans`` (2,) are the lengths of the axes."""
    if (seed.kind, seed.period, seed.boundary) != (curve.kind, curve.period, curve.boundary):
        return False
    a, b = curve.values[:-1] / spans, curve.values[1:] / spans
    direction, offset = b - a, seed.values / spans - a
    share = np.clip((offset * direction).sum(1) / np.maximum((direction**2).sum(1), 1e-300), 0.0, 1.0)
    distance = np.linalg.norm(offset - share[:, None] * direction, axis=1)
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


@dataclass(frozen=True)
class CurveWork:
    """What a worker needs to follow curves."""

    model: MeshModel
    axes: tuple[str, str]
    bounds: Bounds
    settings: Settings

    def __call__(self, seed: EventSeed) -> CurveData | str:
        """The curve of a seed, or why there is none."""
        family = ParameterFamily(self.model, self.axes)
        try:
            return follow_curve(family, seed, self.bounds, self.settings)
        except (Stopped, np.linalg.LinAlgError) as error:
            return str(error)


@dataclass(frozen=True)
class Search:
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


def find_curves(
    model: MeshModel, axes: tuple[str, str], bounds: Bounds, pool: Pool, search: Search, *,
    settings: Settings = SETTINGS, journal: Journal | None = None, progress: bool = False,
) -> tuple[list[CurveData], list[tuple[EventSeed, str]]]:
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
        missing = (name for name in work if name not in done)
        for name, future in pool.results(_LineWork(work), missing):
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


@dataclass(frozen=True)
class _LineWork:
    """The events on lines, by the names of the lines."""

    lines: dict[str, Line]

    def __call__(self, name: str) -> list[EventSeed]:
        return line_seeds(self.lines[name])


def _follow(
    groups: list[_Group], pool: Pool, work: CurveWork, spans: np.ndarray, done: Journal, progress: bool
) -> None:
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
