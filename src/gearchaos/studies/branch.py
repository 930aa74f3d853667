"""Branches of periodic orbits along one parameter, stable or not, with their events."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import cascade as follow_cascade
from gearchaos.continuation.branch import follow_asymmetric, follow_branch
from gearchaos.continuation.events import FLIP, KINDS, PITCHFORK
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import Orbit, as_orbit, check_period, checked_state, find_cycle
from gearchaos.continuation.shooting import Cycle
from gearchaos.datasets import provenance
from gearchaos.errors import InputError
from gearchaos.quantities import Rule
from gearchaos.studies.axis import Axis
from gearchaos.studies.branch_dataset import branch_dataset
from gearchaos.studies.curve_dataset import check_inside, check_is_parameter
from gearchaos.studies.declaration import function_of
from gearchaos.studies.options import RANGE, axis_option, option
from gearchaos.studies.study import WholeStudy

if TYPE_CHECKING:
    import xarray as xr

_LONGEST_STEP = Rule(lambda v: (v >= 1e-5) & (v <= 1), "must lie in [1e-5, 1]")


def step_option(default: float) -> Any:
    """The option of the longest step, with its default."""
    return option(
        default, "Longest step. A step has length 1 if a parameter changes by its whole range, or if the root mean "
        "square distance of all stroboscopic points is half a backlash.", rule=_LONGEST_STEP)


@dataclass(frozen=True)
class FollowingStudy(WholeStudy):
    """A study that follows orbits along a curve in parameters, from an orbit near initial values.

    Attributes
    ----------
    steps : Settings
        Lengths of steps where nothing is said of them.
    """

    steps: ClassVar[Settings] = Settings()

    start: Mapping[str, float] | None = option(
        None, "Initial values near the first orbit; by default those of the model. If its own lead to a motion of "
        "another period, the orbit is found as by `orbit`.")
    period: int | None = option(
        None, "Minimal period; by default that of the motion that the start leads to. It counts mesh periods, at most "
        "1024.")
    longest_step: float = step_option(Settings.longest)
    max_points: int = option(10_000, "Largest number of points in each direction.", least=2, most=1_000_000)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.period is not None:
            check_period(self.period)
        if self.start:
            self._set(start=checked_state(self.model, self.start))

    @property
    def step_lengths(self) -> Settings:
        """The lengths of steps along the curve."""
        steps = self.steps
        return replace(steps, first=min(steps.first, self.longest_step), longest=self.longest_step,
                       shortest=min(steps.shortest, self.longest_step), points=self.max_points)


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
    corrected orbits: folds, flips, Neimark-Sacker points, branch points (``pitchfork``), neutral saddles and grazes.
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
        check_inside(ParameterFamily(self.model, (self.axis.name,)), self.axis)

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
