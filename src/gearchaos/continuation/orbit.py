"""A periodic orbit of any stability at one operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.shooting import Cycle, converge, count_unstable, is_neutral, minimal, passes, same_cycle
from gearchaos.display import HasCard
from gearchaos.dynamics import Classification, Label, classify, motion_name
from gearchaos.dynamics import orbits as polishing
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.dynamics.orbits import SAME_POINT
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.flow import OK
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import MeshModel
from gearchaos.validation import to_float

LONGEST_PERIOD = 1024  # largest period of an orbit, in mesh periods
_STARTS = 256  # number of further initial states from which the nearest orbit is searched where Newton's method fails

_MAX_STARTS = 100_000
_LATER = (1, 2, 4, 8, 16, 32, 64)
"""Mesh periods after which the motions from the initial states are taken as further guesses."""


class Switch(NamedTuple):
    """A contact switch."""

    time: float  # in mesh periods from phase 0
    boundary: int  # 1 front flank, -1 back flank
    into_contact: bool  # false where contact is lost


class Extremum(NamedTuple):
    """An extremum of z."""

    time: float  # in mesh periods from phase 0
    z: float
    maximum: bool


@dataclass(frozen=True, eq=False)
class Orbit(HasCard):
    """A periodic orbit, stable or not; `orbit` returns it.

    Attributes
    ----------
    model : MeshModel
        The operating point; its initial values lie on the orbit.
    period : int
        Minimal period n in mesh periods.
    points : dict of str to (n,)
        The stroboscopic points by coordinate.
    multipliers : (d,)
        Floquet multipliers, complex, largest modulus first.
    switches : list of Switch
        Contact switches in order of time over n mesh periods; empty if the contact state never changes.
    extrema : list of Extremum
        Extrema of z in order of time.
    residual : float
        Largest difference between the image of a point under one mesh period and the next point.
    """

    model: MeshModel
    period: int
    points: dict[str, np.ndarray]
    multipliers: np.ndarray
    switches: list[Switch]
    extrema: list[Extremum]
    residual: float

    @property
    def unstable(self) -> int:
        """Number of multipliers outside the unit circle."""
        return count_unstable(self.multipliers)

    @property
    def stability(self) -> str:
        """"stable", "neutral" where a multiplier on the unit circle is the largest, or how many are outside."""
        if self.unstable:
            return f"{self.unstable} unstable"
        return "neutral" if is_neutral(self.multipliers) else "stable"

    @property
    def state(self) -> dict[str, float]:
        """The first stroboscopic point."""
        return {name: float(values[0]) for name, values in self.points.items()}

    def to_dict(self) -> dict[str, Any]:
        """All attributes except the model as JSON-ready values; multipliers as [re, im]."""
        return {
            "period": self.period, "state": self.state, "unstable": self.unstable,
            "multipliers": [[float(m.real), float(m.imag)] for m in self.multipliers], "residual": self.residual,
            "points": {name: values.tolist() for name, values in self.points.items()},
            "switches": [s._asdict() for s in self.switches], "extrema": [e._asdict() for e in self.extrema],
        }

    def __repr__(self) -> str:
        state = ", ".join(f"{name}={value:.6g}" for name, value in self.state.items())
        return f"Orbit({self.period}T, {self.stability}, {state})"


def orbit(model: AnyModel, *, period: int | None = None, near: Mapping[str, float] | None = None,
          settings: Classification | None = None) -> Orbit:
    """A periodic orbit, stable or not: the nearest to a state, or that of the motion from the initial values.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point.
    period : int, optional
        Period n in mesh periods, at most 1024; by default that of the motion that the state leads to.
    near : mapping of str to float, optional
        A state at phase 0, by names of initial values; by default the model's own initial values. If those lead to a
        motion of the given period, or lie on an orbit of that period, it is taken; otherwise the orbit that Newton's
        method finds from them, or the nearest of those that it finds from many initial states.
    settings : Classification, optional
        How the motion is classified that the state leads to, where it is; by default as `regime` does.

    Returns
    -------
    Orbit

    Raises
    ------
    InputError
        If no orbit of this minimal period is found near the state given; the message says which one is the nearest
        found, and at what distance.

    Notes
    -----
    Newton's method on all n stroboscopic points at once (multiple shooting), with halved steps.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> found = gc.orbit(model, period=1, near={"z": 1.28, "z_dot": -0.1})
    >>> found.unstable, round(found.state["z"], 4)
    (1, 1.2799)
    """
    return as_orbit(*find_cycle(as_model(model), (), period, near, settings))


def orbits(model: AnyModel, *, period: int = 1, starts: int = _STARTS) -> list[Orbit]:
    """All periodic orbits of one period, stable or not, that Newton's method reaches from many initial states.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point.
    period : int
        Minimal period n in mesh periods, at most 1024.
    starts : int
        Number of initial states, spread over ±3 half backlashes and ±2 in velocity.

    Returns
    -------
    list of Orbit
        Each orbit once, in the order in which they are found. An orbit that no start leads to is missing.

    Raises
    ------
    InputError
        If an argument is out of range.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> [(orbit.unstable, round(orbit.state["z"], 4)) for orbit in gc.orbits(model, period=1)]
    [(0, 0.6236), (0, 1.1665), (1, 1.2799)]
    """
    check_period(period)
    starts = whole_number("starts", starts, 1, _MAX_STARTS)
    family = ParameterFamily(as_model(model), ())
    return [as_orbit(family, cycle) for cycle in search(family, family.start, period, starts)]


def find_cycle(model: MeshModel, axes: tuple[str, ...], period: int | None, near: Mapping[str, float] | None,
               settings: Classification | None = None,
               names: tuple[str, ...] | None = None) -> tuple[ParameterFamily, Cycle]:
    """The first orbit of a study, as a cycle of a model along axes, at the model's own values; see `orbit`."""
    model = model.with_values(checked_state(model, near)) if near else model
    family = ParameterFamily(model, axes, names)
    values = family.start
    converged, name, steady = False, "", np.zeros((0, family.dimension))
    if period is not None:
        check_period(period)
        w = family.initial_states(values[None]).T.copy()
        guess = polishing.sections(family.exact_flow(values[None]), w, np.zeros(1, int), np.array([period]))[0]
        cycle = converge(family, guess, values)
        converged = cycle.converged and minimal(family, cycle).period == period
        if converged and (near or np.abs(cycle.points[0] - guess[0]).max() < SAME_POINT):
            return family, cycle
    if period is None or not near:
        flow, w = family.exact_flow(values[None]), family.initial_states(values[None]).T.copy()
        motion = classify(flow, w, settings=settings or SINGLE_MOTION, response=False)
        name = motion_name(Label(int(motion.label[0])), int(motion.period[0]))
        if motion.label[0] == Label.PERIODIC:
            steady = polishing.sections(flow, motion.w, np.zeros(1, int), motion.period)[0]
    if period is None and len(steady) == 0:
        raise InputError("start", "must lead to a periodic motion where no period is given", f"a {name} motion",
                         "Give a period, or another start.")
    if period in (None, len(steady)):
        cycle = minimal(family, converge(family, steady, values))
        if not cycle.converged:
            raise _no_orbit(family, values, steady, [])
        return family, cycle
    if converged:
        return family, cycle
    found = search(family, values, period)
    if near or not found:
        raise _no_orbit(family, values, guess, found, name)
    return family, _nearest(found, guess[0])


def _nearest(found: list[Cycle], state: np.ndarray) -> Cycle:
    """The cycle with the stroboscopic point nearest to a state, which may be any of its points."""
    return min(found, key=lambda cycle: np.linalg.norm(cycle.points - state, axis=1).min())


def checked_state(model: MeshModel, near: Any, field: str = "start") -> dict[str, float]:
    """A state by names of initial values; raises `InputError` for anything else."""
    if not isinstance(near, Mapping):
        raise InputError(field, "must give initial values by name", near, "E.g. {'z': 1.2, 'z_dot': 0.1}.")
    known = model.state_names
    for name in near:
        if name not in known:
            raise unknown_name(field, str(name), known)
    return {name: to_float(name, value) for name, value in near.items()}


def as_orbit(family: ParameterFamily, cycle: Cycle) -> Orbit:
    """The public description of a cycle."""
    points = {name: x[0] for name, x in as_initial_values(family, cycle.values[None], cycle.points[None]).items()}
    model = family.at(cycle.values).with_values({name: float(x[0]) for name, x in points.items()})
    return Orbit(
        model, cycle.period, points, cycle.multipliers,
        [Switch(float(t), int(b), bool(i)) for t, b, i in cycle.switches],
        [Extremum(float(t), float(z), bool(k > 0)) for t, z, k in cycle.extrema], cycle.residual,
    )


def check_period(period: Any) -> None:
    """Raise `InputError` unless a period is a whole number from 1 to `LONGEST_PERIOD`."""
    try:
        whole_number("period", period, 1, LONGEST_PERIOD)
    except InputError:
        rule = f"must be a whole number of mesh periods from 1 to {LONGEST_PERIOD}"
        raise InputError("period", rule, period) from None


def _no_orbit(family: ParameterFamily, values: np.ndarray, guess: np.ndarray, found: list[Cycle],
              name: str = "") -> InputError:
    """The error for a start (n, d) from which Newton's method reaches no orbit of period n; it names the nearest.

    ``name`` is that of the motion that the start leads to, if known.
    """

    def text(state: np.ndarray) -> str:
        named = as_initial_values(family, values[None], state[None, None])
        return ", ".join(f"{name}={x[0, 0]:.6g}" for name, x in named.items())

    advice = f"None was found from {_STARTS} other states either" + (
        f", and the motion from there is {name}" if name else "") + "; try another period."
    if found:
        points = _nearest(found, guess[0]).points
        distance = np.linalg.norm(points - guess[0], axis=1)
        nearest = text(points[np.argmin(distance)])
        advice = f"The nearest one found is at a distance of {distance.min():.3g}: {nearest}."
    return InputError("start", f"must be near an orbit of minimal period {len(guess)}", text(guess[0]), advice)


def search(family: ParameterFamily, values: np.ndarray, period: int, starts: int = _STARTS) -> list[Cycle]:
    """The orbits of minimal period n that Newton's method reaches from many initial states, each once.

    It also begins with later states of the motions from there, which pass near saddles and end on attractors.
    """
    flow = family.exact_flow(values[None])
    later = [family.states_of(values, spread(default_box(family.at(values)), starts, seed=0))]
    for periods in np.diff((0, *_LATER)).tolist():
        done = flow.advance(later[-1], periods, points=np.zeros(later[-1].shape[1], int))
        later.append(done.w[:, done.status == OK])
    w = np.concatenate(later, axis=1)
    points = np.zeros(w.shape[1], int)
    found = polishing.polish(flow, w, points, np.full(w.shape[1], period))
    cycles: list[Cycle] = []
    for lane in np.flatnonzero(found.converged):
        guess = polishing.sections(flow, found.w[:, [lane]], points[:1], np.array([period]))[0]
        if any(passes(c.points, guess[0]) for c in cycles):
            continue
        cycle = converge(family, guess, values)
        minimal_period = cycle.converged and minimal(family, cycle).period == period
        if minimal_period and not any(same_cycle(cycle, c) for c in cycles):
            cycles.append(cycle)
    return cycles
