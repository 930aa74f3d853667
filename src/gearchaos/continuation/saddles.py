"""Saddles and the basin boundaries that they divide: stable and unstable manifolds (d = 2), edge states (any d).

An unstable manifold is grown from a fundamental segment next to the saddle: the images of the segment under the
iterated map follow one another along the manifold (D. Hobson, J. Comput. Phys. 104, 1993). Where an image is not
resolved, points are added to the segment. A stable manifold is the unstable one in reversed time.

The edge state between two attractors is the saddle whose stable manifold divides their basins. Edge tracking
(J. D. Skufca, J. A. Yorke, B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006): two states that lead to different
attractors are brought together by bisection and followed; whenever they have separated they are brought together again.
Between them lies a motion that stays on the basin boundary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.continuation.orbit import Orbit, as_orbit, search
from gearchaos.continuation.shooting import SAME_ATTRACTOR, Cycle, converge, minimal
from gearchaos.display import HasCard
from gearchaos.dynamics import Classification, Label, classify, orbits
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow
from gearchaos.model.switched import reversed_in_time, velocity_signs

_DISTANCE = 1e-5  # distance from the saddle at which the fundamental segment begins, in half backlashes

_FIRST_POINTS = 17
_SHARPEST = 0.3
"""Largest angle between neighbouring pieces of a resolved curve, in radians; pieces shorter than a tenth of the largest
distance may turn more."""

_MAX_POINTS = 100_000  # most points of one branch of a manifold

_MAX_IMAGES = 200
_ENDED = 1e-2
"""An image whose extent is less than this share of the spacing lies on an attractor, where the branch ends."""

_CLOSE = 1e-8  # distance to which two states are brought together
_APART = 1e-4  # distance at which they are brought together again
_BETWEEN = 15  # states tried at once between the two


@dataclass(frozen=True, eq=False)
class Manifold:
    """One branch of a manifold.

    It is complete if it was followed over the length asked for, or ended before: outside the region, or on an
    attractor.
    """

    saddle: Cycle
    stable: bool
    points: np.ndarray  # (P, 2) z and z' at phase 0, in order from the saddle
    complete: bool


def saddles(family: ParameterFamily, values: np.ndarray, period: int) -> list[Cycle]:
    """The saddles of all minimal periods up to the given one at one parameter point, with one unstable multiplier."""
    return [
        cycle for n in range(1, period + 1) for cycle in search(family, values, n)
        if np.sum(np.abs(cycle.multipliers) > 1.0) == 1
    ]


def saddle_manifolds(family: ParameterFamily, saddle: Cycle, *, length: float, spacing: float,
                     region: np.ndarray) -> list[Manifold]:
    """All branches of the stable and unstable manifolds of a saddle, at all its n points; raises `InputError` unless
    d = 2.

    The length of each branch, and the largest distance of neighbouring points, the spacing, count inside the region
    (2, 2) of least and largest z, and least and largest z'.
    """
    if family.dimension != 2:
        raise InputError("model", "must have two coordinates for manifolds that are curves", family.dimension,
                         "Use a single model, or a torsional one with the same β/J of both wheels.")
    system, out = family.system(saddle.values[None]), []
    for stable in (False, True):
        flow = ExactFlow(reversed_in_time(system) if stable else system)
        sign = velocity_signs(family.names) if stable else np.ones(2)
        for k in range(saddle.period):
            for direction in (1.0, -1.0):
                grown = _Growth(flow, saddle, k, stable, direction, sign, length, spacing, region)
                out.append(Manifold(saddle, stable, *grown.run()))
    return out


class _Growth:
    """The growth of one branch of a manifold."""

    def __init__(self, flow: ExactFlow, saddle: Cycle, number: int, stable: bool, direction: float, sign: np.ndarray,
                 length: float, spacing: float, region: np.ndarray) -> None:
        self.flow, self.sign, self.length, self.spacing, self.region = flow, sign, length, spacing, region
        monodromy = saddle.monodromy_at(number)
        values, vectors = np.linalg.eig(np.linalg.inv(monodromy) if stable else monodromy)
        unstable = int(np.argmax(np.abs(values)))
        multiplier = float(values[unstable].real)
        self.periods = saddle.period * (1 if multiplier > 0 else 2)  # so that the branch is mapped to itself
        self.stretch = abs(multiplier) ** (1 if multiplier > 0 else 2)
        self.origin = saddle.points[number]
        self.vector = direction * vectors[:, unstable].real * _DISTANCE

    def run(self) -> tuple[np.ndarray, bool]:
        """The points of the branch, and whether it is complete."""
        shares, extent = np.linspace(0.0, 1.0, _FIRST_POINTS), 0.0
        pieces, covered, count = [self._segment(shares)], 0.0, 0
        for images in range(1, _MAX_IMAGES):
            shares, points = self._resolved_image(shares, images)
            pieces.append(points[1:])
            count += len(points)
            inside = self._inside(points)
            covered += float(np.where(inside[:-1] & inside[1:], np.hypot(*np.diff(points, axis=0).T), 0.0).sum())
            before, extent = extent, float(np.ptp(points, axis=0).max())
            ended = not np.any(inside) or extent < min(before, _ENDED * self.spacing)
            if covered >= self.length or ended:
                return np.concatenate(pieces), True
            if count > _MAX_POINTS:
                return np.concatenate(pieces), False
        return np.concatenate(pieces), False

    def _segment(self, shares: np.ndarray) -> np.ndarray:
        """Points (N, 2) of the fundamental segment at shares (N,) of its length on a logarithmic scale."""
        return self.origin + self.vector * self.stretch ** shares[:, None]

    def _image(self, shares: np.ndarray, images: int) -> np.ndarray:
        """The points of the segment after this many applications of the map, (N, 2)."""
        w = (self.sign * self._segment(shares)).T.copy()
        return self.sign * self.flow.advance(w, images * self.periods, points=np.zeros(len(shares), int)).w.T

    def _resolved_image(self, shares: np.ndarray, images: int) -> tuple[np.ndarray, np.ndarray]:
        """The image of the segment, with points added to it until the image is resolved inside the region."""
        points = self._image(shares, images)
        for _ in range(40):
            steps = np.diff(points, axis=0)
            size, inside = np.hypot(*steps.T), self._inside(points)
            turn = np.abs(np.arctan2(
                steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0], (steps[:-1] * steps[1:]).sum(axis=1)))
            sharp = np.concatenate([[False], turn > _SHARPEST, [False]])
            bent = sharp[:-1] | sharp[1:]
            coarse = (inside[:-1] | inside[1:]) & np.isfinite(size) & (
                (size > self.spacing) | (bent & (size > 0.1 * self.spacing)))  # (N - 1,) of the pieces
            if not np.any(coarse) or len(shares) > _MAX_POINTS:
                break
            at = np.flatnonzero(coarse)
            new = 0.5 * (shares[at] + shares[at + 1])
            separate = (new > shares[at]) & (new < shares[at + 1])
            at, new = at[separate], new[separate]
            if len(new) == 0:
                break
            shares, points = np.insert(shares, at + 1, new), np.insert(points, at + 1, self._image(new, images), axis=0)
        return shares, points

    def _inside(self, points: np.ndarray) -> np.ndarray:
        """Whether points (N, 2) lie in the region."""
        return np.all((points >= self.region[:, 0]) & (points <= self.region[:, 1]), axis=1)


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
        numbers = []
        for label, period, section in motions:
            for number, (other, n, points) in enumerate(self.known):
                near = np.linalg.norm(points - section[0], axis=1).min() < SAME_ATTRACTOR
                if (label, period) == (other, n) and (near or label != Label.PERIODIC):
                    numbers.append(number)
                    break
            else:
                numbers.append(len(self.known))
                self.known.append((label, period, section))
        return np.array(numbers)


def track_edge(family: ParameterFamily, first: np.ndarray, second: np.ndarray, *, period: int, rounds: int,
               settings: Classification | None = None) -> EdgeState:
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
        w = np.stack([first, second], axis=1)
        for _ in range(10_000 if states else 0):  # until they have separated
            w = flow.advance(w, 1, points=np.zeros(2, int)).w
            if np.linalg.norm(w[:, 1] - w[:, 0]) > _APART:
                break
        first, second = _brought_together(attractors, w[:, 0], w[:, 1], own)
        states.append(0.5 * (first + second))
        cycle = _saddle_near(family, flow, states[-1], period)
    found = as_initial_values(family, family.start[None], np.array([states]))
    return EdgeState(
        None if cycle is None else as_orbit(family, cycle), {name: x[0] for name, x in found.items()})


def _brought_together(attractors: _Attractors, first: np.ndarray, second: np.ndarray,
                      own: int) -> tuple[np.ndarray, np.ndarray]:
    """Two states on the line between two others, `_CLOSE` apart, of which only the first leads to attractor ``own``."""
    while np.linalg.norm(second - first) > _CLOSE:
        shares = np.arange(1, _BETWEEN + 1)[:, None] / (_BETWEEN + 1)
        between = first + shares * (second - first)
        leaving = np.flatnonzero(attractors.reached(between) != own)
        last = int(leaving[0]) if len(leaving) else _BETWEEN
        line = np.concatenate([first[None], between, second[None]])
        first, second = line[last], line[last + 1]
    return first, second


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
