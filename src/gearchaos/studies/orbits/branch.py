"""Branches of periodic orbits along one parameter, stable or not, with their events and jumps from them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearchaos.continuation.arclength import length
from gearchaos.continuation.branch import Branch as Followed
from gearchaos.continuation.branch import cascade as follow_cascade
from gearchaos.continuation.branch import follow_asymmetric, follow_branch
from gearchaos.continuation.events import FLIP, FOLD, KINDS, PITCHFORK, Event
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.orbit import Orbit, as_orbit, find_cycle
from gearchaos.continuation.shooting import Cycle, CycleEquations, count_unstable
from gearchaos.datasets import describe, new_dataset, provenance, variables
from gearchaos.dynamics import Label, classify, orbits
from gearchaos.dynamics.response import compute_response
from gearchaos.errors import InputError
from gearchaos.flow import Measure, combine_measures
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.declaration import function_of
from gearchaos.studies.core.options import RANGE, axis_option, option
from gearchaos.studies.orbits.following import FollowingStudy, check_inside, check_is_parameter, section_variables

if TYPE_CHECKING:
    import xarray as xr

_BATCH = 512  # number of orbits whose response measures are computed together
_CONTACT_STATES = {1: "front", 0: "free", -1: "back"}

_BEYOND = 1e-4  # distance beyond a fold at which motions are followed, relative to the range of the parameter
_SAME_ORBIT = 0.05
"""Largest distance of the motion reached from an orbit interpolated between two points of a branch, relative to the
larger of 1 and the largest coordinate."""


@dataclass(frozen=True)
class Branch(FollowingStudy):
    """Follow a branch of periodic orbits along one parameter, stable or not, with all its events.

    It is followed in both directions.

    Returns
    -------
    xarray.Dataset
        Over ``point``, in order along the branch: the parameter as a coordinate; ``position`` (0, 1, 2, …), ``branch``
        (0, and 1, 2, … for those of doubled period and then those at pitchforks), ``period``, ``unstable``,
        ``multipliers_real`` and ``multipliers_imag`` (point, exponent),
        ``section_<coordinate>`` (point, cycle), ``contact_sequence``, the response measures over one period of the
        orbit, ``z_max``, ``z_min``, ``residual`` and ``step``. Over ``event``: ``event_kind``, ``event_value``,
        ``event_period``, ``event_boundary``, ``event_residual``, ``event_branch``, ``event_point``, and multipliers,
        one state ``event_section_<coordinate>`` and the response measures with the prefix ``event_``. Over
        ``jump``, the folds that end a stable part: ``jump_value``, ``jump_direction`` (1 or −1), ``jump_event``, and of
        the motion reached just beyond ``jump_label``, ``jump_period`` and ``jump_point``. The attributes
        ``closed``, ``range``, ``ends``, ``stable``, ``cascade``, ``asymmetric`` and ``feigenbaum`` are JSON.

    Raises
    ------
    InputError
        If an argument is out of range, the model's own value lies outside the axis, or there is no orbit of this period
        near the start; the message then has the nearest one found.

    Notes
    -----
    Pseudo-arclength continuation of all stroboscopic points (multiple shooting). Events are located by bracketing on
    corrected orbits: folds, flips, Neimark-Sacker points, branch points (``pitchfork``), neutral saddles and grazes;
    with the damping law ``unilateral`` border collisions in place of grazes. There contact may also end anew while z is
    beyond the boundary, which is no event.
    The branch ends at an end of the axis, where it joins one of half its period, where the flow fails, or at its own
    start: then it is closed, an isola.

    Examples
    --------
    >>> import gearchaos as gc
    >>> found = gc.branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0:0.3")
    >>> found.event_kind.values.tolist()
    ['fold', 'flip']

    As a value
    ----------
    >>> import gearchaos as gc
    >>> study = gc.Branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0:0.3")
    >>> study.kind, study.period
    ('branch', None)
    """

    kind: ClassVar[str] = "branch"
    rank: ClassVar[int] = 7
    group: ClassVar[str] = "Bifurcations"
    summary: ClassVar[str] = "branch"
    model_words: ClassVar[str] = "The branch begins at its own value of the parameter."

    axis: Axis = axis_option(
        'The parameter and its range, "eps1=0:0.3"; a number of values is accepted and has no effect.', RANGE)
    cascade: int = option(
        0, "Period doublings to follow from the first flip. It is the flip at which stability first changes on leaving "
        "the start; of two such flips, one in each direction, that with the nearer parameter. There are none if "
        "stability first changes at other events.", least=0, most=10)
    pitchforks: bool = option(
        False, "Follow both branches at each pitchfork. They are branches of asymmetric orbits.")
    events: Mapping[str, Callable[[Orbit], float]] | None = option(
        None, "Further kinds of events: each root, along the branch, of a function of the `Orbit` is an event of that "
        "name.", in_files=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_is_parameter(self.model, self.axis)
        check_inside(self.model, self.axis)

    def dataset(self, *, progress: bool = False, threads: int | None = None) -> xr.Dataset:
        axis, bounds, settings = self.axis, (self.axis.start, self.axis.stop), self.step_lengths
        family, cycle = find_cycle(self.model, (axis.name,), self.period, self.start)
        main = follow_branch(family, cycle, bounds, settings, _tests(self.events, family))
        flip = main.first_change_of_stability(FLIP) if self.cascade else None
        doubled = [] if flip is None else list(follow_cascade(family, flip, bounds, settings, self.cascade))
        flips = [each for each in (flip, *(end for _, end in doubled)) if each is not None]
        pitchforks = [event for event in main.events if event.kind == PITCHFORK and self.pitchforks]
        asymmetric = [b for event in pitchforks for b in follow_asymmetric(family, event, bounds, settings)]
        attributes = provenance(
            self.kind, family.model, axis=[axis.name, axis.start, axis.stop], period=main.period,
            cascade=self.cascade, pitchforks=self.pitchforks, events=sorted(self.events or {}),
            longest_step=settings.longest, max_points=settings.points)
        return branch_dataset(main, [b for b, _ in doubled if b is not None], asymmetric, flips, axis, attributes)


branch = function_of(Branch)


def _tests(events: Any, family: ParameterFamily) -> dict[str, Callable[[Cycle], float]]:
    """The user's functions of an orbit as functions of a cycle, by name; raises `InputError` for anything else."""
    if events is None:
        return {}
    if not isinstance(events, Mapping) or not all(isinstance(n, str) and callable(f) for n, f in events.items()):
        raise InputError("events", "must give functions of an orbit by name", events,
                         "E.g. {'resonance': lambda orbit: orbit.state['z'] - 1}.")
    for name in events:
        if name in KINDS:
            raise InputError("events", "must not have the name of a kind of event", name)

    def of_cycle(function: Callable[[Orbit], float]) -> Callable[[Cycle], float]:
        return lambda cycle: float(function(as_orbit(family, cycle)))

    return {name: of_cycle(function) for name, function in events.items()}


def branch_dataset(
    main: Followed, doubled: Sequence[Followed], asymmetric: Sequence[Followed], flips: Sequence[Event], axis: Axis,
    attributes: dict[str, Any],
) -> xr.Dataset:
    """The Dataset that `gearchaos.branch` returns.

    ``doubled`` are the branches of doubled periods, ``asymmetric`` those at pitchforks, ``flips`` the flips of the
    cascade in order.
    """
    branches = [main, *doubled, *asymmetric]
    points = [point for branch in branches for point in branch.points]
    cycles: list[Cycle] = [point.data for point in points]
    located = [(number, before, event) for number, branch in enumerate(branches)
               for before, event in zip(branch.event_positions, branch.events, strict=True)]
    found = _values(main.family, cycles + [event.cycle for *_, event in located])
    steps: list[float] = []  # distances from the point before; 0 for the first of a branch
    for branch in branches:
        weights = CycleEquations(branch.family, branch.period, axis.stop - axis.start).weights
        steps += [0.0, *(length(weights, b.u - a.u) for a, b in pairwise(branch.points))]
    data = {
        **variables(("point",), {
            "branch": np.repeat(np.arange(len(branches)), [len(branch.points) for branch in branches]),
            "position": np.arange(len(points))}),
        **variables(("point", "exponent"), {name: v[: len(cycles)] for name, v in found.items()}),
        **section_variables(main.family, [
            (branch.values[:, None], np.array([point.data.points for point in branch.points])) for branch in branches]),
        **variables(("point",), {
            "contact_sequence": np.array(list(map(contact_sequence, cycles)), dtype=object),
            "residual": np.array([p.residual for p in points]), "step": np.array(steps)}),
        **variables(("event", "exponent"), {f"event_{name}": v[len(cycles) :] for name, v in found.items()}),
        **_event_variables(branches, located), **_jump_variables(branches, located, axis),
    }
    for name in ("event_value", "jump_value"):
        data[name].attrs.update(describe(axis.name), quantity=axis.name)
    lengths = np.diff([float(flip.point.u[-1]) for flip in flips])
    whole = {
        **_of_branch(main), "closed": main.closed,
        "cascade": [{"period": branch.period, **_of_branch(branch)} for branch in doubled],
        "asymmetric": [{"period": branch.period, **_of_branch(branch)} for branch in asymmetric],
        "feigenbaum": (lengths[:-1] / lengths[1:]).tolist(),
    }
    coordinates = variables(("point",), {axis.name: np.array([p.u[-1] for p in points])})
    return new_dataset(data, coordinates, attributes | {name: json.dumps(value) for name, value in whole.items()})


def contact_sequence(cycle: Cycle) -> str:
    """The contact states of an orbit in order of time from phase 0, e.g. "front free front"."""
    z = cycle.points[0, 0]
    states = [1 if z > 1 else -1 if z < -1 else 0]
    for _, boundary, into in cycle.switches[:1]:  # a released flank counts as free, wherever z is
        states = [0 if into else int(boundary)]
    states += [int(boundary) if into else 0 for _, boundary, into in cycle.switches]
    return " ".join(_CONTACT_STATES[state] for state in states)


def _of_branch(branch: Followed) -> dict[str, Any]:
    """Range of the parameter, ends, stable and neutral intervals of a branch; a closed branch has no ends."""
    values = [*branch.values.tolist(), *(float(event.point.u[-1]) for event in branch.events)]
    values += [end.value for end in branch.ends]
    ends = [] if branch.closed else [{"value": end.value, "why": end.why} for end in branch.ends]
    stable, neutral = ([], branch.stable_intervals()) if branch.neutral else (branch.stable_intervals(), [])
    return {"range": [min(values), max(values)], "ends": ends, "stable": stable, "neutral": neutral}


def _values(family: ParameterFamily, cycles: Sequence[Cycle]) -> dict[str, np.ndarray]:
    """Period, stability, multipliers, response measures over one period and range of z of orbits, (P,) or (P, d).

    Every mesh period begins at a stroboscopic point of its own, so that errors do not grow along unstable orbits.
    """
    parts = []
    for some in (cycles[i : i + _BATCH] for i in range(0, len(cycles), _BATCH)):
        periods = np.array([cycle.period for cycle in some])
        flow = family.exact_flow(np.array([cycle.values for cycle in some]))
        states = np.concatenate([cycle.points for cycle in some]).T.copy()
        system, points = flow.system, np.repeat(np.arange(len(some)), periods)
        single = flow.advance(states, 1, points=points, measured=True).measures
        measures = combine_measures(single, system.period[points], np.cumsum(periods) - periods)
        response, _ = compute_response(measures, periods * system.period, periods, system.static_force)
        parts.append({
            **response.variables(double=True), "mesh_force_peak": response.mesh_force_peak,
            "z_max": measures[Measure.Z_MAX], "z_min": measures[Measure.Z_MIN]})
    multipliers = np.array([cycle.multipliers for cycle in cycles])
    return {
        "period": np.array([cycle.period for cycle in cycles]),
        "unstable": np.array([count_unstable(m) for m in multipliers]),
        "multipliers_real": multipliers.real, "multipliers_imag": multipliers.imag,
        **{name: np.concatenate([part[name] for part in parts]) for name in parts[0]},
    }


_Located = Sequence[tuple[int, int, Event]]
"""Events, each with the number of its branch and the index of the point before it on that branch."""


def _event_variables(branches: Sequence[Followed], located: _Located) -> dict[str, xr.Variable]:
    """The variables of events by name, with the first stroboscopic points of their orbits."""
    sizes, family = np.cumsum([0] + [len(branch.points) for branch in branches]), branches[0].family
    events = [event for *_, event in located]
    values = np.array([event.cycle.values for event in events]).reshape(len(events), 1)
    states = np.array([event.cycle.points[:1] for event in events]).reshape(len(events), 1, family.dimension)
    if not events:  # a batch of no points has no states
        values, states = family.start[None], np.zeros((1, 1, family.dimension))
    found = {
        "kind": np.array([event.kind for event in events], dtype=object),
        "value": np.array([event.point.u[-1] for event in events], dtype=float),
        "boundary": np.array([event.boundary or 0 for event in events], dtype=int),
        "residual": np.array([max(event.defect, event.point.residual) for event in events], dtype=float),
        "branch": np.array([number for number, *_ in located], dtype=int),
        "point": np.array([sizes[number] + before for number, before, _ in located], dtype=int),
        **{f"section_{name}": x[: len(events), 0] for name, x in as_initial_values(family, values, states).items()},
    }
    return variables(("event",), {f"event_{name}": v for name, v in found.items()})


def _jump_variables(branches: Sequence[Followed], located: _Located, axis: Axis) -> dict[str, xr.Variable]:
    """The variables over ``jump`` by name: the folds that end a stable part, and the motions to which they lead."""
    folds = []  # number of the event, parameter, sign of its change, first stroboscopic point
    for index, (number, before, event) in enumerate(located):
        branch = branches[number]
        if event.kind == FOLD and np.any(branch.unstable[before : before + 2] == 0):
            value = float(event.point.u[-1])
            direction = 1 if value > branch.values[before : before + 2].mean() else -1
            folds.append((index, value, direction, event.cycle.points[0]))
    label, period, point = np.zeros(0, np.int8), np.zeros(0, int), np.zeros(0, int)
    if folds:
        beyond = np.array([value + sign * _BEYOND * (axis.stop - axis.start) for _, value, sign, _ in folds])
        beyond = np.clip(beyond, axis.start, axis.stop)
        flow = branches[0].family.exact_flow(beyond[:, None])
        reached = classify(flow, np.stack([state for *_, state in folds], axis=1), response=False)
        label, period = reached.label, np.where(reached.label == Label.PERIODIC, reached.period, 0)
        sections = orbits.sections(flow, reached.w, np.arange(len(folds)), np.maximum(period, 1))
        at = zip(beyond, sections, period, strict=True)
        point = np.array([_point_before(branches, value, section) if n else -1 for value, section, n in at])
    out = variables(("jump",), {
        "jump_value": np.array([value for _, value, *_ in folds], float),
        "jump_direction": np.array([direction for *_, direction, _ in folds], int),
        "jump_event": np.array([index for index, *_ in folds], int),
        "jump_label": label, "jump_period": period, "jump_point": point})
    for name, words in (("event", "index of the fold"), ("label", "kind of motion reached"),
                        ("point", "index of the point before the orbit reached; -1 for none"),
                        ("period", "its period in mesh periods; 0 for none")):
        out[f"jump_{name}"].attrs["long_name"] = words
    return out


def _point_before(branches: Sequence[Followed], value: float, section: np.ndarray) -> int:
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
