"""All branches on a line of a map: one parameter varies, the other is fixed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.arclength import Settings, Stopped
from gearchaos.continuation.branch import Branch, doubled_start, follow_branch, follow_doubled
from gearchaos.continuation.defining import EventSeed, seed_of
from gearchaos.continuation.events import FLIP, FOLD, NEUTRAL_SADDLE, PITCHFORK
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, converge, minimal, passes, same_cycle, shift_difference
from gearchaos.dynamics import Classification, Label, classify, orbits
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.errors import InputError
from gearchaos.model import MeshModel

_SETTINGS = Settings(first=1e-2, longest=4e-2, shortest=1e-7, finest=1e-4, points=3000)
"""Steps along the branches of a line, unless others are given."""

_MARGIN = 0.25
"""How far branches are followed beyond both ends of a line, relative to its length."""

_CLASSIFICATION = Classification(exponent_run=400, doublings=0, longest_transient=0)
"""Only periodic motions are needed."""

_NEAR = 0.5
"""Largest distance of a branch, interpolated between two points, from an orbit that may lie on it."""

_NO_CURVE = (NEUTRAL_SADDLE, PITCHFORK)
"""Events of codimension 1 in parameters whose curves are not followed: neutral saddles are no bifurcations, and
pitchforks need a symmetry that a second parameter breaks."""


@dataclass(frozen=True)
class Line:
    """A line of a map."""

    model: MeshModel
    axes: tuple[str, str]
    bounds: tuple[tuple[float, float], tuple[float, float]]
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
    bounds, branches = _beyond(family, line.bounds[line.along]), list[Branch]()
    for cycle in stable_orbits(line, family):
        if on_any(family, branches, cycle):
            continue
        try:
            branch = follow_branch(family, cycle, bounds, _SETTINGS)
        except InputError:  # an orbit that is not isolated, of a free motion without load
            continue
        _add(family, branches, branch, bounds, line.period)
    return family, branches


def _beyond(family: ParameterFamily, bounds: tuple[float, float]) -> tuple[float, float]:
    """A range with a margin on both sides, as far as the model accepts it."""
    margin, out = _MARGIN * (bounds[1] - bounds[0]), list(bounds)
    for side, value in enumerate((bounds[0] - margin, bounds[1] + margin)):
        try:
            family.check(np.array([[value]]))
            out[side] = value
        except InputError:
            continue
    return out[0], out[1]


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
            if event.kind not in _NO_CURVE and inside and not linear:
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


def _add(
    family: ParameterFamily, branches: list[Branch], branch: Branch, bounds: tuple[float, float], longest: int
) -> None:
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
