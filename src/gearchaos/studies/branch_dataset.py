"""The Dataset of branches of periodic orbits: their points, their events, jumps from them, what holds for each."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearchaos.continuation.arclength import length
from gearchaos.continuation.branch import Branch
from gearchaos.continuation.events import FOLD, Event
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.shooting import Cycle, CycleEquations, count_unstable
from gearchaos.datasets import describe, new_dataset, variable
from gearchaos.dynamics import Label, classify, orbits
from gearchaos.dynamics.response import compute_response
from gearchaos.flow import Measure, combine_measures
from gearchaos.studies.axis import Axis

if TYPE_CHECKING:
    import xarray as xr

_BATCH = 512
"""Number of orbits whose response measures are computed together."""

_CONTACT_STATES = {1: "front", 0: "free", -1: "back"}


def branch_dataset(
    main: Branch, doubled: Sequence[Branch], asymmetric: Sequence[Branch], flips: Sequence[Event], axis: Axis,
    attributes: dict[str, Any],
) -> xr.Dataset:
    """The Dataset that `gearchaos.branch` returns.

    Parameters
    ----------
    main : Branch
    doubled, asymmetric : sequence of Branch
        The branches of doubled periods, and those at pitchforks.
    flips : sequence of Event
        The flips of the cascade in order.
    axis : Axis
        The parameter and its range.
    attributes : dict
        Further attributes.
    """
    branches = [main, *doubled, *asymmetric]
    family, points = main.family, [point for branch in branches for point in branch.points]
    events = [event for branch in branches for event in branch.events]
    cycles: list[Cycle] = [point.data for point in points]
    found = _values(family, cycles + [event.cycle for event in events])
    steps: list[float] = []  # distances from the point before; 0 for the first of a branch
    for branch in branches:
        weights = CycleEquations(branch.family, branch.period, axis.stop - axis.start).weights
        steps += [0.0, *(length(weights, b.u - a.u) for a, b in pairwise(branch.points))]
    number = np.repeat(np.arange(len(branches)), [len(branch.points) for branch in branches])
    data = {
        "branch": variable("branch", ("point",), number),
        "position": variable("position", ("point",), np.arange(len(points))),
        **_variables({name: v[: len(cycles)] for name, v in found.items()}, "point", ""),
        **_sections(branches),
        "contact_sequence": variable("contact_sequence", ("point",), _texts(map(contact_sequence, cycles))),
        "residual": variable("residual", ("point",), np.array([p.residual for p in points])),
        "step": variable("step", ("point",), np.array(steps)),
        **_variables({name: v[len(cycles) :] for name, v in found.items()}, "event", "event_"),
        **_events(branches, axis),
        **jump_variables(branches, axis),
    }
    coordinates = {axis.name: variable(axis.name, ("point",), np.array([p.u[-1] for p in points]))}
    return new_dataset(data, coordinates, {**attributes, **_attributes(main, doubled, asymmetric, flips)})


def contact_sequence(cycle: Cycle) -> str:
    """The contact states of an orbit in order of time from phase 0, e.g. "front free front"."""
    z = cycle.points[0, 0]
    states = [1 if z > 1 else -1 if z < -1 else 0]
    states += [int(boundary) if into else 0 for _, boundary, into in cycle.switches]
    return " ".join(_CONTACT_STATES[state] for state in states)


def _texts(values: Iterable[str]) -> np.ndarray:
    """Texts as an array of objects (N,)."""
    return np.array(list(values), dtype=object)


def _variables(values: Mapping[str, np.ndarray], dim: str, prefix: str) -> dict[str, xr.Variable]:
    """Variables of orbits along a dimension, by name with a prefix; a second dimension is that of the multipliers."""
    dims = {1: (dim,), 2: (dim, "exponent")}
    return {prefix + name: variable(prefix + name, dims[v.ndim], v) for name, v in values.items()}


def _values(family: ParameterFamily, cycles: Sequence[Cycle]) -> dict[str, np.ndarray]:
    """Period, stability, multipliers and response measures of orbits by name, each (P,) or (P, d)."""
    multipliers = np.array([cycle.multipliers for cycle in cycles])
    parts = [_measures(family, cycles[i : i + _BATCH]) for i in range(0, len(cycles), _BATCH)]
    return {
        "period": np.array([cycle.period for cycle in cycles]),
        "unstable": np.array([count_unstable(m) for m in multipliers]),
        "multipliers_real": multipliers.real, "multipliers_imag": multipliers.imag,
        **{name: np.concatenate([part[name] for part in parts]) for name in parts[0]},
    }


def _measures(family: ParameterFamily, cycles: Sequence[Cycle]) -> dict[str, np.ndarray]:
    """The response measures of orbits over one period, and the range of z, each (P,).

    Every mesh period begins at a stroboscopic point of its own, so that errors do not grow along unstable orbits.
    """
    periods = np.array([cycle.period for cycle in cycles])
    flow = family.exact_flow(np.array([cycle.values for cycle in cycles]))
    states = np.concatenate([cycle.points for cycle in cycles]).T.copy()
    system, points = flow.system, np.repeat(np.arange(len(cycles)), periods)
    single = flow.advance(states, 1, points=points, measured=True).measures
    measures = combine_measures(single, system.period[points], np.cumsum(periods) - periods)
    response = compute_response(measures, periods * system.period, periods, system.static_force)
    return {
        **response.variables(double=True), "mesh_force_peak": response.mesh_force_peak,
        "z_max": measures[Measure.Z_MAX], "z_min": measures[Measure.Z_MIN],
    }


def _sections(branches: Sequence[Branch]) -> dict[str, xr.Variable]:
    """The stroboscopic points of all orbits by name, over point and cycle; NaN after the last one of an orbit."""
    longest = max(branch.period for branch in branches)
    parts: dict[str, list[np.ndarray]] = {}
    for branch in branches:
        values, states = branch.values[:, None], np.array([point.data.points for point in branch.points])
        for name, x in as_initial_values(branch.family, values, states).items():
            padded = np.pad(x, ((0, 0), (0, longest - branch.period)), constant_values=np.nan)
            parts.setdefault(name, []).append(padded)
    return {
        f"section_{name}": variable(f"section_{name}", ("point", "cycle"), np.concatenate(part))
        for name, part in parts.items()
    }


def _events(branches: Sequence[Branch], axis: Axis) -> dict[str, xr.Variable]:
    """The variables of events, by name."""
    sizes = np.cumsum([0] + [len(branch.points) for branch in branches])
    rows = [(number, int(sizes[number]) + position, event) for number, branch in enumerate(branches)
            for position, event in zip(branch.event_positions, branch.events, strict=True)]
    events = [event for *_, event in rows]
    found = {
        "kind": _texts(event.kind for event in events),
        "value": np.array([event.point.u[-1] for event in events], dtype=float),
        "boundary": np.array([event.boundary or 0 for event in events], dtype=int),
        "residual": np.array([max(event.defect, event.point.residual) for event in events], dtype=float),
        "branch": np.array([number for number, *_ in rows], dtype=int),
        "point": np.array([before for _, before, _ in rows], dtype=int),
        **{f"section_{name}": x for name, x in _event_states(branches[0].family, events).items()},
    }
    out = {f"event_{name}": variable(f"event_{name}", ("event",), v) for name, v in found.items()}
    out["event_value"].attrs.update(describe(axis.name), quantity=axis.name)
    return out


def _event_states(family: ParameterFamily, events: Sequence[Event]) -> dict[str, np.ndarray]:
    """The first stroboscopic points of the orbits at events by name, each (E,)."""
    values = np.array([event.cycle.values for event in events]).reshape(len(events), 1)
    states = np.array([event.cycle.points[:1] for event in events]).reshape(len(events), 1, family.dimension)
    if not events:  # a batch of no points has no states
        values, states = family.start[None], np.zeros((1, 1, family.dimension))
    return {name: x[: len(events), 0] for name, x in as_initial_values(family, values, states).items()}


def _attributes(
    main: Branch, doubled: Sequence[Branch], asymmetric: Sequence[Branch], flips: Sequence[Event]
) -> dict[str, str]:
    """What holds for whole branches, as JSON by attribute."""
    values = [float(flip.point.u[-1]) for flip in flips]
    lengths = np.diff(values)
    found = {
        **_of_branch(main), "closed": main.closed,
        "cascade": [{"period": branch.period, **_of_branch(branch)} for branch in doubled],
        "asymmetric": [{"period": branch.period, **_of_branch(branch)} for branch in asymmetric],
        "feigenbaum": (lengths[:-1] / lengths[1:]).tolist(),
    }
    return {name: json.dumps(value) for name, value in found.items()}


def _of_branch(branch: Branch) -> dict[str, Any]:
    """Range of the parameter, ends and stable intervals of a branch; a closed branch has no ends."""
    values = [*branch.values.tolist(), *(float(event.point.u[-1]) for event in branch.events)]
    values += [end.value for end in branch.ends]
    ends = [] if branch.closed else [{"value": end.value, "why": end.why} for end in branch.ends]
    return {"range": [min(values), max(values)], "ends": ends, "stable": branch.stable_intervals()}


_BEYOND = 1e-4
"""Distance beyond a fold at which motions are followed, relative to the range of the parameter."""

_SAME_ORBIT = 0.05
"""Largest distance of the motion reached from an orbit interpolated between two points of a branch, relative to the
larger of 1 and the largest coordinate."""

_WORDS = {"event": "index of the fold", "point": "index of the point before the orbit reached; -1 for none",
          "label": "kind of motion reached", "period": "its period in mesh periods; 0 for none"}


class _Jump(NamedTuple):
    """A fold that ends a stable part."""

    event: int  # index among all events
    value: float
    direction: int  # 1 if the parameter rises, -1 if it falls
    state: np.ndarray  # first stroboscopic point of the orbit at the fold, (d,)


def jump_variables(branches: Sequence[Branch], axis: Axis) -> dict[str, xr.Variable]:
    """The variables over ``jump`` by name: the folds that end a stable part, and the motions to which they lead.

    Parameters
    ----------
    branches : sequence of Branch
    axis : Axis
        The parameter and its range.
    """
    jumps = _jumps(branches)
    beyond = np.array([jump.value + jump.direction * _BEYOND * (axis.stop - axis.start) for jump in jumps])
    beyond = np.clip(beyond, axis.start, axis.stop)
    label, period, point = _reached(branches, jumps, beyond)
    found = {
        "value": np.array([jump.value for jump in jumps], float),
        "direction": np.array([jump.direction for jump in jumps], int),
        "event": np.array([jump.event for jump in jumps], int), "label": label, "period": period, "point": point,
    }
    out = {f"jump_{name}": variable(f"jump_{name}", ("jump",), values) for name, values in found.items()}
    out["jump_value"].attrs.update(describe(axis.name), quantity=axis.name)
    for name, words in _WORDS.items():
        out[f"jump_{name}"].attrs["long_name"] = words
    return out


def _jumps(branches: Sequence[Branch]) -> list[_Jump]:
    """The folds that end a stable part of a branch, in order."""
    found: list[_Jump] = []
    events: list[tuple[Branch, int, Event]] = [
        (branch, position, event) for branch in branches
        for position, event in zip(branch.event_positions, branch.events, strict=True)]
    for index, (branch, before, event) in enumerate(events):
        if event.kind == FOLD and np.any(branch.unstable[before : before + 2] == 0):
            value = float(event.point.u[-1])
            direction = 1 if value > branch.values[before : before + 2].mean() else -1
            found.append(_Jump(index, value, direction, event.cycle.points[0]))
    return found


def _reached(
    branches: Sequence[Branch], jumps: list[_Jump], beyond: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Label, period, and index of the point of a branch before the orbit reached, −1 for none, of each jump, (J,)."""
    if not jumps:
        return np.zeros(0, np.int8), np.zeros(0, int), np.zeros(0, int)
    flow = branches[0].family.exact_flow(beyond[:, None])
    found = classify(flow, np.stack([jump.state for jump in jumps], axis=1), response=False)
    period = np.where(found.label == Label.PERIODIC, found.period, 0)
    sections = orbits.sections(flow, found.w, np.arange(len(jumps)), np.maximum(period, 1))
    at = zip(beyond, sections, period, strict=True)
    point = [_point_before(branches, value, section) if n else -1 for value, section, n in at]
    return found.label, period, np.array(point)


def _point_before(branches: Sequence[Branch], value: float, section: np.ndarray) -> int:
    """Index of the point before the place of an orbit (n, d) on the branches at a value; −1 if it is on none."""
    first, nearest, index = 0, _SAME_ORBIT * max(1.0, float(np.abs(section).max())), -1
    for branch in branches:
        cycles: list[Cycle] = [point.data for point in branch.points]
        x = branch.values
        if branch.period == len(section):
            for i in np.flatnonzero((x[1:] - value) * (x[:-1] - value) <= 0).tolist():
                share = (value - x[i]) / (x[i + 1] - x[i])
                between = cycles[i].points + share * (cycles[i + 1].points - cycles[i].points)
                distance = float(np.linalg.norm(section[0] - between, axis=1).min())
                if distance < nearest:
                    nearest, index = distance, first + i
        first += len(cycles)
    return index
