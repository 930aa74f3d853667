"""The edge state between two attractors: the saddle whose stable manifold divides their basins, for any d.

Edge tracking (J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006): two states that lead to
different attractors are brought together by bisection and followed; whenever they have separated they are brought
together again. Between them lies a motion that stays on the basin boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.orbit import Orbit, as_orbit
from gearchaos.continuation.shooting import SAME_ATTRACTOR, Cycle, converge, minimal
from gearchaos.display import HasCard
from gearchaos.dynamics import Classification, Label, classify, orbits
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow

_CLOSE = 1e-8  # distance to which two states are brought together
_APART = 1e-4  # distance at which they are brought together again
_BETWEEN = 15  # states tried at once between the two


@dataclass(frozen=True, eq=False)
class EdgeState(HasCard):
    """What divides the basins of two attractors; `gearchaos.edge_state` returns it.

    Attributes
    ----------
    orbit : Orbit or None
        The saddle that the motion on the boundary approaches; None if it approaches no periodic orbit.
    states : dict of str to (R,)
        States on the boundary at phase 0 by coordinate, in order of time.
    """

    orbit: Orbit | None
    states: dict[str, np.ndarray]


class _Attractors:
    """Numbers the attractors that motions lead to."""

    def __init__(self, flow: ExactFlow, settings: Classification) -> None:
        self.flow, self.settings = flow, settings
        self.known: list[tuple[int, int, np.ndarray]] = []  # label, period and points (n, d)

    def reached(self, states: np.ndarray) -> np.ndarray:
        """Numbers (L,) of the attractors that states (L, d) lead to."""
        points = np.zeros(len(states), int)
        found = classify(self.flow, states.T.copy(), points, settings=self.settings, response=False)
        sections = orbits.sections(self.flow, found.w, points, np.maximum(found.period, 1))
        motions = zip(found.label.tolist(), found.period.tolist(), sections, strict=True)
        return np.array([self._number(*motion) for motion in motions])

    def _number(self, label: int, period: int, section: np.ndarray) -> int:
        for number, (other, n, points) in enumerate(self.known):
            near = np.linalg.norm(points - section[0], axis=1).min() < SAME_ATTRACTOR
            if (label, period) == (other, n) and (near or label != Label.PERIODIC):
                return number
        self.known.append((label, period, section))
        return len(self.known) - 1


def track_edge(
    family: ParameterFamily, first: np.ndarray, second: np.ndarray, *, period: int, rounds: int,
    settings: Classification | None = None,
) -> EdgeState:
    """Follow the boundary between the basins of two attractors, to which two states (d,) at phase 0 lead, to its edge
    state of at most this period. The states are brought together at most ``rounds`` times.

    Raises `InputError` if both lead to the same attractor.
    """
    flow = family.exact_flow(family.start[None])
    attractors = _Attractors(flow, settings or SINGLE_MOTION)
    own, other = attractors.reached(np.stack([first, second]))
    if own == other:
        raise InputError("second", "must lead to another attractor than the first start", second.tolist(),
                         "See gearchaos.attractors for the attractors and starts of each.")
    states, cycle = list[np.ndarray](), None
    while cycle is None and len(states) < rounds:
        if states:
            first, second = _separated(flow, first, second)
        first, second = _brought_together(attractors, first, second, own)
        states.append(0.5 * (first + second))
        cycle = _saddle_near(family, flow, states[-1], period)
    found = as_initial_values(family, family.start[None], np.array([states]))
    return EdgeState(
        None if cycle is None else as_orbit(family, cycle), {name: x[0] for name, x in found.items()})


def _brought_together(
    attractors: _Attractors, first: np.ndarray, second: np.ndarray, own: int
) -> tuple[np.ndarray, np.ndarray]:
    """Two states on the line between two others, `_CLOSE` apart, of which only the first leads to attractor ``own``."""
    while np.linalg.norm(second - first) > _CLOSE:
        shares = np.arange(1, _BETWEEN + 1)[:, None] / (_BETWEEN + 1)
        between = first + shares * (second - first)
        leaving = np.flatnonzero(attractors.reached(between) != own)
        last = int(leaving[0]) if len(leaving) else _BETWEEN
        line = np.concatenate([first[None], between, second[None]])
        first, second = line[last], line[last + 1]
    return first, second


def _separated(flow: ExactFlow, first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both states after as many mesh periods as they need to separate to `_APART`."""
    w = np.stack([first, second], axis=1)
    for _ in range(10_000):
        w = flow.advance(w, 1, points=np.zeros(2, int)).w
        if np.linalg.norm(w[:, 1] - w[:, 0]) > _APART:
            break
    return w[:, 0], w[:, 1]


def _saddle_near(family: ParameterFamily, flow: ExactFlow, state: np.ndarray, period: int) -> Cycle | None:
    """A saddle with one unstable multiplier near a state; None if Newton's method finds none nearby."""
    for n in range(1, period + 1):
        guess = orbits.sections(flow, state[:, None].copy(), np.zeros(1, int), np.array([n]))[0]
        cycle = converge(family, guess, family.start)
        if not cycle.converged or np.linalg.norm(cycle.points[0] - state) > 10 * _APART:
            continue
        cycle = minimal(family, cycle)
        if np.sum(np.abs(cycle.multipliers) > 1.0) == 1:
            return cycle
    return None
