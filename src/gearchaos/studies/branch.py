"""Branches of periodic orbits along one parameter, stable or not, with their events."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import Branch, follow_branch, outside
from gearchaos.continuation.events import FLIP, KINDS, PITCHFORK, Event
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import Orbit, as_orbit, check_period, find_cycle
from gearchaos.continuation.shooting import Cycle
from gearchaos.continuation.switching import cascade as follow_cascade
from gearchaos.continuation.switching import follow_asymmetric
from gearchaos.datasets import provenance
from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import MeshModel, state_names
from gearchaos.quantities import Rule
from gearchaos.studies.axis import Axis, as_range
from gearchaos.studies.branch_dataset import branch_dataset
from gearchaos.studies.operating_point import at_axis_starts
from gearchaos.validation import check_rule, to_float

if TYPE_CHECKING:
    import xarray as xr

_MOST_DOUBLINGS = 10
_MOST_POINTS = 1_000_000
_LONGEST_STEP = Rule(lambda v: (v >= 1e-5) & (v <= 1), "must lie in [1e-5, 1]")


def branch(
    model: AnyModel, axis: Axis | str, *, start: Mapping[str, float] | None = None, period: int | None = None,
    cascade: int = 0, pitchforks: bool = False, events: Mapping[str, Callable[[Orbit], float]] | None = None,
    longest_step: float = 0.03, max_points: int = 10_000,
) -> xr.Dataset:
    """Follow a branch of periodic orbits along one parameter, in both directions, with all its events.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The branch begins at its own value of the parameter.
    axis : Axis or str
        The parameter and its range, "eps1=0:0.3"; a number of values is accepted and has no effect.
    start : mapping of str to float, optional
        Initial values near an orbit of the branch; by default the branch begins with the motion that the model's own
        lead to, or with another period than that of this motion as `orbit` does.
    period : int, optional
        Minimal period in mesh periods, at most 1024; by default that of the motion that the start leads to.
    cascade : int
        Number of period doublings to follow, from the flip at which stability first changes on leaving the start; of
        two such flips, one in each direction, that with the nearer parameter. There are none if stability first changes
        at other events.
    pitchforks : bool
        Whether to follow the two branches of asymmetric orbits at each pitchfork too.
    events : mapping of str to callable, optional
        Further kinds of events: each root, along the branch, of a function of the `Orbit` is an event of that name.
    longest_step : float
        Longest step along the branch. A step has length 1 if the parameter changes by the whole range, or if the root
        mean square distance of all stroboscopic points is half a backlash.
    max_points : int
        Largest number of points in each direction.

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
    corrected orbits: folds, flips, Neimark-Sacker points, branch points (``pitchfork``), neutral saddles and grazes.
    The branch ends at an end of the axis, where it joins one of half its period, where the flow fails, or at its own
    start: then it is closed, an isola.

    Examples
    --------
    >>> import gearchaos as gc
    >>> found = gc.branch(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206), "eps1=0:0.3")
    >>> found.event_kind.values.tolist()
    ['fold', 'flip']
    """
    axis = as_range(axis)
    model = as_model(at_axis_starts(model, [axis]))
    settings = _settings(longest_step, max_points)
    doublings = whole_number("cascade", cascade, 0, _MOST_DOUBLINGS)
    if not isinstance(pitchforks, bool):
        raise InputError("pitchforks", "must be True or False", pitchforks)
    family, cycle = _start(model, axis, start, period)
    bounds = axis.start, axis.stop
    main = follow_branch(family, cycle, bounds, settings, _tests(events, family))
    doubled = list(_doubled(main, bounds, settings, doublings))
    flips = [flip for _, flip in doubled if flip is not None]
    asymmetric = _asymmetric(main, bounds, settings) if pitchforks else []
    attributes = provenance(
        "branch", family.model, axis=[axis.name, axis.start, axis.stop], period=main.period, cascade=doublings,
        pitchforks=pitchforks, events=sorted(events or {}), longest_step=settings.longest, max_points=settings.points)
    return branch_dataset(main, [b for b, _ in doubled if b is not None], asymmetric, flips, axis, attributes)


def _settings(longest_step: Any, max_points: Any) -> Settings:
    """The lengths of steps along the branch; raises `InputError` if an argument is out of range."""
    longest = to_float("longest_step", longest_step)
    check_rule("longest_step", longest, _LONGEST_STEP)
    first = min(Settings.first, longest)
    return Settings(first=first, longest=longest, points=whole_number("max_points", max_points, 2, _MOST_POINTS))


def _start(
    model: MeshModel, axis: Axis, start: Mapping[str, float] | None, period: int | None
) -> tuple[ParameterFamily, Cycle]:
    """The orbit with which the branch begins; raises `InputError` for a wrong axis, period or start."""
    if axis.name in state_names(model.kind):
        raise InputError("axis", "must be a parameter", axis.name,
                         "An initial value only selects an orbit of the model: give it as start.")
    if period is not None:
        check_period(period)
    family = ParameterFamily(model, (axis.name,))
    error = outside(family, float(family.start[0]), (axis.start, axis.stop))
    if error is not None:
        raise error
    return find_cycle(model, (axis.name,), period, start)


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
    return {name: _of_cycle(function, family) for name, function in events.items()}


def _of_cycle(function: Callable[[Orbit], float], family: ParameterFamily) -> Callable[[Cycle], float]:
    """A function of an orbit as one of a cycle."""
    return lambda cycle: float(function(as_orbit(family, cycle)))


def _asymmetric(main: Branch, bounds: tuple[float, float], settings: Settings) -> list[Branch]:
    """The branches of asymmetric orbits that begin at the pitchforks of a branch."""
    events = [event for event in main.events if event.kind == PITCHFORK]
    return [b for event in events for b in follow_asymmetric(main.family, event, bounds, settings)]


def _doubled(
    main: Branch, bounds: tuple[float, float], settings: Settings, count: int
) -> Iterator[tuple[Branch | None, Event | None]]:
    """The branches of doubled periods, each with the flip at its end; first no branch and the flip of the main one."""
    flip = main.first_change_of_stability(FLIP) if count else None
    if flip is not None:
        yield None, flip
        yield from follow_cascade(main.family, flip, bounds, settings, count)
