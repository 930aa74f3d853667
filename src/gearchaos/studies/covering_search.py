"""Candidates for a chaotic set (d = 2), in floating point: a saddle, homoclinic orbits, and sets along them.

About a point of the saddle there is a parallelogram, the home set, with its edges along the two eigenvectors. Points on
the unstable manifold that leave it and return to it next to the stable manifold give chains of states from home to
home. About each state of a chain is a parallelogram, so that each covers the next (see `proof.families.chaos`):

- its unstable half axis, along the image of the unstable direction, is as long as needed to cover the next set, and
  is found from the end of the chain backwards;
- its stable half axis, along the preimage of the stable direction of the home set, is as long as needed to contain the
  width of the image of the set before it, and is found forwards.

As each depends on the other, both are repeated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle

_SLACK = 0.03
"""Slack with which sets are chosen; the proof asks for less."""

_ROUNDS = 5
_NEAR = 1e-3
"""Distance from the saddle at which the unstable manifold is taken as straight."""

_STARTS = 4000
"""Number of points on either side of the saddle."""

_LONGEST = 14
"""Most mesh periods of a chain."""

_MOST_CHAINS = 40
"""Most chains that are tried with one home set."""


class FloatSet(NamedTuple):
    """A parallelogram.

    Attributes
    ----------
    centre : (2,)
    axes : (2, 2)
        The unstable and the stable half axis as columns.
    """

    centre: np.ndarray
    axes: np.ndarray

    def coordinates(self, states: np.ndarray) -> np.ndarray:
        """The coordinates (a, b) of states (..., 2)."""
        return (states - self.centre) @ np.linalg.inv(self.axes).T

    def at(self, coordinates: np.ndarray) -> np.ndarray:
        """The states (..., 2) with given coordinates."""
        return self.centre + coordinates @ self.axes.T

    def is_apart_from(self, other: FloatSet) -> bool:
        """Whether an edge of one of the two separates them."""
        for first, second in ((self, other), (other, self)):
            corners = first.coordinates(second.at(_CORNERS))
            if np.any(corners.min(axis=0) > 1) or np.any(corners.max(axis=0) < -1):
                return True
        return False


_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])


def _boundary(count: int) -> np.ndarray:
    """Points (4 count, 2) of the edges a = -1, a = 1, b = -1, b = 1 in this order."""
    t, one = np.linspace(-1, 1, count), np.ones(count)
    return np.concatenate([np.column_stack(v) for v in ((-one, t), (one, t), (t, -one), (t, one))])


class StroboscopicMap:
    """The map P over one mesh period and its derivative."""

    def __init__(self, family: ParameterFamily) -> None:
        self.flow = family.exact_flow(family.start[None])
        self.derivatives = family.flow(family.start[None])

    def __call__(self, states: np.ndarray) -> np.ndarray:
        """The images of states (..., 2)."""
        flat = np.ascontiguousarray(states.reshape(-1, 2).T)
        return self.flow.advance(flat, 1, points=np.zeros(flat.shape[1], int)).w.T.reshape(states.shape)

    def derivative(self, states: np.ndarray) -> np.ndarray:
        """The derivatives (N, 2, 2) at states (N, 2)."""
        points = np.zeros(len(states), int)
        return self.derivatives.advance(np.ascontiguousarray(states), points).monodromy


@dataclass(frozen=True)
class Horseshoe:
    """Sets and loops through them from the home set, number 0.

    Attributes
    ----------
    sets : list of FloatSet
    loops : list of list of int
        Each begins with 0; its last set covers set 0.
    """

    sets: list[FloatSet]
    loops: list[list[int]]

    @property
    def entropy(self) -> float:
        """About the topological entropy per mesh period: the h with Σ exp(-h L) = 1 over the lengths L of the loops."""
        lengths = np.array([len(loop) for loop in self.loops], float)
        low, high = 0.0, np.log(len(lengths)) + 1e-9
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if np.exp(-middle * lengths).sum() > 1 else (low, middle)
        return low


def find_horseshoe(family: ParameterFamily, saddle: Cycle, sizes: tuple[float, float]) -> Horseshoe | None:
    """The saddle's loop and loops along homoclinic orbits from a home set; None if there are none.

    Parameters
    ----------
    family : ParameterFamily
        d = 2, without axes.
    saddle : Cycle
    sizes : (float, float)
        Length of the unstable and of the stable half axis of the home set.
    """
    stroboscopic = StroboscopicMap(family)
    values, vectors = np.linalg.eig(saddle.monodromy)
    order = np.argsort(-np.abs(values))
    home = FloatSet(saddle.points[0], vectors[:, order].real * sizes)
    own = _chain_sets(stroboscopic, home, np.concatenate([saddle.points, saddle.points[:1]]))
    if own is None:
        return None
    chains = [own]
    for number, states in enumerate(_homoclinic_chains(stroboscopic, saddle, home, abs(values[order[0]]))):
        found = _chain_sets(stroboscopic, home, states)
        if found and all((found[0]).is_apart_from(other[0] if other else home) for other in chains):
            chains.append(found)
        if number == _MOST_CHAINS:
            break
    if len(chains) == 1:
        return None
    sets, loops = [home], []
    for chain in chains:
        loops.append([0, *range(len(sets), len(sets) + len(chain))])
        sets += chain
    return Horseshoe(sets, loops)


def _homoclinic_chains(
    stroboscopic: StroboscopicMap, saddle: Cycle, home: FloatSet, stretch: float
) -> Iterator[np.ndarray]:
    """Chains of states (L + 1, 2) of the unstable manifold from home to next to the stable manifold, shortest first."""
    direction = home.axes[:, 0] / np.linalg.norm(home.axes[:, 0])
    distances = _NEAR * stretch ** np.linspace(0, 1, _STARTS)
    leaving = int(np.ceil(np.log(np.linalg.norm(home.axes[:, 0]) / _NEAR) / np.log(stretch))) + 1
    starts = np.concatenate([distances, -distances])
    path = _iterates(stroboscopic, saddle.points[0] + starts[:, None] * direction, leaving * saddle.period + _LONGEST)
    found = _returns(home.coordinates(path), saddle.period)
    seen: list[np.ndarray] = []
    for length, first, lane in found:
        states = path[first : first + length + 1, lane]
        if any(len(other) == len(states) and np.abs(other - states).max() < _NEAR for other in seen):
            continue
        seen.append(states)
        yield _on_stable_manifold(stroboscopic, saddle, home, starts[lane : lane + 2], first, length)


def _iterates(stroboscopic: StroboscopicMap, states: np.ndarray, periods: int) -> np.ndarray:
    """States and their images, (periods + 1, N, 2)."""
    path = [states]
    for _ in range(periods):
        path.append(stroboscopic(path[-1]))
    return np.array(path)


def _returns(coordinates: np.ndarray, period: int) -> list[tuple[int, int, int]]:
    """(length, first mesh period, lane) of the first return of each lane to home at which a neighbour passes a = 0."""
    inside = np.all(np.abs(coordinates) <= 1, axis=2)
    side = coordinates[..., 0] > 0
    passing = inside[:, :-1] & inside[:, 1:] & (side[:, :-1] != side[:, 1:])
    passing[:, _STARTS - 1] = False  # the two sides of the saddle
    found = []
    for lane in np.flatnonzero(passing.any(axis=0)):
        outside = np.flatnonzero(~inside[::period, lane]) * period
        if len(outside):
            first = int(outside[0]) - period
            later = np.flatnonzero(passing[outside[0] :, lane])
            if len(later) and first >= 0 and (length := int(outside[0] + later[0]) - first) <= _LONGEST:
                found.append((length, first, int(lane)))
    return sorted(found)


def _on_stable_manifold(
    stroboscopic: StroboscopicMap, saddle: Cycle, home: FloatSet, bracket: np.ndarray, first: int, length: int
) -> np.ndarray:
    """The chain between two starts, by bisection, that ends at a = 0, (length + 1, 2)."""
    direction = home.axes[:, 0] / np.linalg.norm(home.axes[:, 0])
    for _ in range(5):
        starts = np.linspace(bracket[0], bracket[1], 513)
        path = _iterates(stroboscopic, saddle.points[0] + starts[:, None] * direction, first + length)
        side = home.coordinates(path[-1])[:, 0] > 0
        at = int(np.argmax(side[1:] != side[:-1]))
        bracket = starts[at : at + 2]
    return path[first:, at]


def _chain_sets(stroboscopic: StroboscopicMap, home: FloatSet, states: np.ndarray) -> list[FloatSet] | None:
    """Sets about states 1 ... L - 1 of a chain (L + 1, 2) from home to home; None if a set does not cover the next."""
    derivatives = stroboscopic.derivative(states[:-1])
    length = len(derivatives)
    unstable, stable = [_unit(home.axes[:, 0])], [_unit(home.axes[:, 1])]
    for derivative in derivatives[:-1]:
        unstable.append(_unit(derivative @ unstable[-1]))
    for derivative in derivatives[:0:-1]:
        stable.insert(0, _unit(np.linalg.solve(derivative, stable[0])))
    sets, width = [home], home.axes[:, 1]
    for k in range(1, length):
        frame = np.column_stack([unstable[k], stable[k - 1]])
        width = frame[:, 1] * 1.2 * abs(np.linalg.solve(frame, derivatives[k - 1] @ width)[1])
        sets.append(FloatSet(states[k], np.column_stack([frame[:, 0], width])))
    sets.append(home)
    for _ in range(_ROUNDS if length > 1 else 0):
        for k in range(length - 1, 0, -1):
            adjusted = _adjusted_length(stroboscopic, sets[k], sets[k + 1])
            if adjusted is None:
                return None
            sets[k] = adjusted
        for k in range(1, length):
            adjusted = _adjusted_width(stroboscopic, sets[k - 1], sets[k])
            if adjusted is None:
                return None
            sets[k] = adjusted
    slack = min(_slack(stroboscopic, *pair) for pair in pairwise(sets))
    return sets[1:-1] if slack > 0.5 * _SLACK else None


def _unit(vector: np.ndarray) -> np.ndarray:
    """The vector with length 1."""
    return vector / np.linalg.norm(vector)


def _adjusted_length(stroboscopic: StroboscopicMap, first: FloatSet, second: FloatSet) -> FloatSet | None:
    """The first set with the unstable half axis and centre with which its edges are mapped just beyond the second.

    None if there are none.
    """
    across = np.linspace(-1, 1, 5)[:, None] * first.axes[:, 1]
    unit = _unit(first.axes[:, 0])

    def images(t: float) -> np.ndarray:
        return second.coordinates(stroboscopic(first.centre + t * unit + across))[:, 0]

    rate = float((images(1e-6) - images(-1e-6)).mean()) / 2e-6
    ends = []
    for side in (1.0, -1.0):

        def beyond(t: float, side: float = side) -> float:
            return float((side * np.sign(rate) * images(side * t)).min()) - 1 - _SLACK

        end = _root(beyond, (1 + _SLACK) / abs(rate))
        if end is None:
            return None
        ends.append(side * end)
    axes = np.column_stack([unit * 0.5 * (ends[0] - ends[1]), first.axes[:, 1]])
    return FloatSet(first.centre + unit * 0.5 * (ends[0] + ends[1]), axes)


def _root(function: Callable[[float], float], guess: float) -> float | None:
    """A zero of an increasing function of positive t by the secant method; None if it does not converge."""
    before, value_before = 0.0, function(0.0)
    at, value = guess, function(guess)
    for _ in range(12):
        if not abs(value) >= 1e-4 or value == value_before:
            break
        following = min(max(at - value * (at - before) / (value - value_before), at / 3), at * 3)
        before, value_before, at, value = at, value, following, function(following)
    return at if abs(value) < 1e-2 else None


def _adjusted_width(stroboscopic: StroboscopicMap, first: FloatSet, second: FloatSet) -> FloatSet | None:
    """The second set with the stable half axis and centre with which it just holds the image of the first.

    None if the image is nowhere beside it.
    """
    unit = _unit(second.axes[:, 1])
    frame = FloatSet(second.centre, np.column_stack([second.axes[:, 0], unit]))
    images = frame.coordinates(stroboscopic(first.at(_boundary(1001))))
    beside = images[np.abs(images[:, 0]) <= 1 + 2 * _SLACK, 1]
    if not len(beside):
        return None
    middle, half = 0.5 * (beside.max() + beside.min()), 0.5 * np.ptp(beside)
    axes = np.column_stack([second.axes[:, 0], unit * (half * (1 + 2 * _SLACK) + 1e-7)])
    return FloatSet(second.centre + middle * unit, axes)


def _slack(stroboscopic: StroboscopicMap, first: FloatSet, second: FloatSet) -> float:
    """The slack with which points of the boundary of a set satisfy the conditions of a covering relation."""
    count = 1001
    a, b = second.coordinates(stroboscopic(first.at(_boundary(count)))).T
    left, right = a[:count], a[count : 2 * count]
    beyond = max(min(right.min(), -left.max()), min(left.min(), -right.max())) - 1
    beside = np.abs(a) <= 1 + _SLACK
    return min(beyond, 1 - np.abs(b[beside]).max(initial=0.0))
