"""Proof that a model with two coordinates has a chaotic set, and the search for candidates, in floating point.

About a point of a saddle there is a parallelogram, the home set, with its edges along the two eigenvectors. Points on
the unstable manifold that leave it and return to it next to the stable manifold give chains of states from home to
home. About each state of a chain is a parallelogram, so that each covers the next (see `proof.families.chaos`):

- its unstable half axis, along the image of the unstable direction, is as long as needed to cover the next set, and
  is found from the end of the chain backwards;
- its stable half axis, along the preimage of the stable direction of the home set, is as long as needed to contain the
  width of the image of the set before it, and is found forwards.

As each depends on the other, both are repeated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.saddles import saddles
from gearchaos.continuation.shooting import Cycle
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.quantities import parse_harmonic
from gearchaos.studies.proofs.proofs import check_can_prove
from gearchaos.validation import to_float

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.families.chaos import ChaoticSet

_LONGEST_PERIOD = 3  # largest period of a saddle, in mesh periods
_SIZES = ((0.1, 0.1), (0.1, 0.05), (0.05, 0.05), (0.2, 0.05), (0.02, 0.02))
"""Unstable and stable half axes of the home set that are tried, in half backlashes."""

_MOST_PROOFS = 3  # most candidates whose proof is tried
_SLACK = 0.03  # slack with which sets are chosen; the proof asks for less
_ROUNDS = 5
_NEAR = 1e-3  # distance from the saddle at which the unstable manifold is taken as straight
_STARTS = 4000  # number of points on either side of the saddle
_LONGEST = 14  # most mesh periods of a chain
_MOST_CHAINS = 40  # most chains that are tried with one home set
_CORNERS = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])

_EDGE = np.linspace(-1, 1, 1001)
_BOUNDARY = np.concatenate([np.column_stack(np.broadcast_arrays(*edge)) for edge in (
    (-1.0, _EDGE), (1.0, _EDGE), (_EDGE, -1.0), (_EDGE, 1.0))])
"""Coordinates of points of the edges a = -1, a = 1, b = -1, b = 1 in this order, (4004, 2)."""


def prove_chaos(
    model: AnyModel, *, tolerances: Mapping[str, float] | None = None, bits: int = 128
) -> ChaoticSet | Unproved:
    """Prove that there is a chaotic set, and a lower bound of the topological entropy.

    The set need not attract: such sets exist inside periodic windows too. What motion an initial state leads to is
    said by `regime`.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point; its relative motion must have two coordinates, z and z_dot.
    tolerances : mapping of str to float, optional
        Amplitudes of the transmission error by name, e.g. ``{"eps1": 1e-6}``: the theorem then holds for all values
        that differ by at most this from those of the model.
    bits : int
        Precision, 53 to 800.

    Returns
    -------
    ChaoticSet or Unproved
        `ChaoticSet` states what is proved (``theorem``, ``entropy``); ``write`` saves it for ``gearchaos verify``.
        `Unproved` has the ``reason``; it does not say that there is no chaotic set.

    Raises
    ------
    InputError
        If python-flint is not installed, the relative motion has more than two coordinates, or an argument is out of
        range.

    Notes
    -----
    Covering relations along homoclinic orbits of a saddle: P. Zgliczynski, M. Gidea, J. Differential Equations 202,
    2004. Saddles of periods up to 3 are found by Newton's method from many initial states.

    Examples
    --------
    >>> import gearchaos as gc
    >>> result = gc.prove_chaos(gc.MeshModel.of(omega=1.6, q0=2.0, eps1=0.0, chi1=0.0, chi2=0.0))  # no saddle
    >>> result.proved, result.reason
    (False, 'no saddle')
    """
    check_can_prove(model, bits)
    from gearchaos.proof.certificate import Unproved
    from gearchaos.proof.families.chaos import prove_chaotic_set

    family = ParameterFamily(as_model(model), ())
    if family.dimension != 2:
        raise InputError("model", "must have two coordinates for a proof of a chaotic set", family.dimension,
                         "Use a single model, or a torsional one with the same β/J of both wheels.")
    sizes: dict[str, str] = {}  # as decimal numbers
    for name, value in (tolerances or {}).items():
        harmonic = parse_harmonic(str(name))
        if harmonic is None or harmonic.family != "eps":
            raise InputError("tolerances", "must be of amplitudes of the transmission error", name, "E.g. 'eps1'.")
        size = to_float(f"tolerances.{name}", value)
        if not 0 <= size < 1:
            raise InputError(f"tolerances.{name}", "must be in [0, 1)", size)
        sizes[str(name)] = repr(size)
    found = saddles(family, family.start, _LONGEST_PERIOD)
    candidates = (_CoveringSearch(family, saddle, axes).horseshoe() for saddle in found for axes in _SIZES)
    result: ChaoticSet | Unproved = Unproved("no homoclinic orbit" if found else "no saddle", float("nan"), bits)
    for sets, loops in islice(filter(None, candidates), _MOST_PROOFS):
        result = prove_chaotic_set(family.model, sets, loops, bits, sizes)
        if result.proved:
            break
    return result


class _FloatSet(NamedTuple):
    """A parallelogram."""

    centre: np.ndarray  # (2,)
    axes: np.ndarray  # (2, 2), the unstable and the stable half axis as columns

    def coordinates(self, states: np.ndarray) -> np.ndarray:
        """The coordinates (a, b) of states (..., 2)."""
        return (states - self.centre) @ np.linalg.inv(self.axes).T

    def at(self, coordinates: np.ndarray) -> np.ndarray:
        """The states (..., 2) with given coordinates."""
        return self.centre + coordinates @ self.axes.T

    def is_apart_from(self, other: _FloatSet) -> bool:
        """Whether an edge of one of the two separates them."""
        for first, second in ((self, other), (other, self)):
            corners = first.coordinates(second.at(_CORNERS))
            if np.any(corners.min(axis=0) > 1) or np.any(corners.max(axis=0) < -1):
                return True
        return False


def _unit(vector: np.ndarray) -> np.ndarray:
    """The vector with length 1."""
    return vector / np.linalg.norm(vector)


class _CoveringSearch:
    """The search with one saddle and one home set, for the map P over one mesh period."""

    def __init__(self, family: ParameterFamily, saddle: Cycle, sizes: tuple[float, float]) -> None:
        self.flow, self.derivatives = family.exact_flow(family.start[None]), family.flow(family.start[None])
        values, vectors = np.linalg.eig(saddle.monodromy)
        order = np.argsort(-np.abs(values))
        self.saddle, self.stretch = saddle, abs(values[order[0]])
        self.home = _FloatSet(saddle.points[0], vectors[:, order].real * sizes)

    def horseshoe(self) -> tuple[list[_FloatSet], list[list[int]]] | None:
        """Sets, and loops through them from the home set, number 0, which the last set of each loop covers.

        The first loop is that of the saddle, the others are along homoclinic orbits; None if there are none of these.
        """
        own = self._chain_sets(np.concatenate([self.saddle.points, self.saddle.points[:1]]))
        if own is None:
            return None
        chains = [own]
        for number, states in enumerate(self._homoclinic_chains()):
            found = self._chain_sets(states)
            if found and all(found[0].is_apart_from(other[0] if other else self.home) for other in chains):
                chains.append(found)
            if number == _MOST_CHAINS:
                break
        if len(chains) == 1:
            return None
        sets, loops = [self.home], []
        for chain in chains:
            loops.append([0, *range(len(sets), len(sets) + len(chain))])
            sets += chain
        return sets, loops

    def _image(self, states: np.ndarray) -> np.ndarray:
        """The images of states (..., 2)."""
        flat = np.ascontiguousarray(states.reshape(-1, 2).T)
        return self.flow.advance(flat, 1, points=np.zeros(flat.shape[1], int)).w.T.reshape(states.shape)

    def _paths(self, distances: np.ndarray, periods: int) -> np.ndarray:
        """States at distances (N,) from the saddle on the unstable manifold, and their images, (periods + 1, N, 2)."""
        path = [self.saddle.points[0] + distances[:, None] * _unit(self.home.axes[:, 0])]
        for _ in range(periods):
            path.append(self._image(path[-1]))
        return np.array(path)

    def _homoclinic_chains(self) -> Iterator[np.ndarray]:
        """Chains of states (L + 1, 2) of the unstable manifold from home to next to the stable manifold, shortest
        first; their ends at a = 0 are found by bisection."""
        distances = _NEAR * self.stretch ** np.linspace(0, 1, _STARTS)
        leaving = int(np.ceil(np.log(np.linalg.norm(self.home.axes[:, 0]) / _NEAR) / np.log(self.stretch))) + 1
        starts = np.concatenate([distances, -distances])
        path = self._paths(starts, leaving * self.saddle.period + _LONGEST)
        seen: list[np.ndarray] = []
        for length, first, lane in _returns(self.home.coordinates(path), self.saddle.period):
            states = path[first : first + length + 1, lane]
            if any(len(other) == len(states) and np.abs(other - states).max() < _NEAR for other in seen):
                continue
            seen.append(states)
            bracket = starts[lane : lane + 2]
            for _ in range(5):
                between = np.linspace(bracket[0], bracket[1], 513)
                finer = self._paths(between, first + length)
                side = self.home.coordinates(finer[-1])[:, 0] > 0
                at = int(np.argmax(side[1:] != side[:-1]))
                bracket = between[at : at + 2]
            yield finer[first:, at]

    def _chain_sets(self, states: np.ndarray) -> list[_FloatSet] | None:
        """Sets about states 1 ... L - 1 of a chain (L + 1, 2) from home to home; None if one covers not the next."""
        length, home = len(states) - 1, self.home
        derivatives = self.derivatives.advance(np.ascontiguousarray(states[:-1]), np.zeros(length, int)).monodromy
        unstable, stable = [_unit(home.axes[:, 0])], [_unit(home.axes[:, 1])]
        for derivative in derivatives[:-1]:
            unstable.append(_unit(derivative @ unstable[-1]))
        for derivative in derivatives[:0:-1]:
            stable.insert(0, _unit(np.linalg.solve(derivative, stable[0])))
        sets, width = [home], home.axes[:, 1]
        for k in range(1, length):
            frame = np.column_stack([unstable[k], stable[k - 1]])
            width = frame[:, 1] * 1.2 * abs(np.linalg.solve(frame, derivatives[k - 1] @ width)[1])
            sets.append(_FloatSet(states[k], np.column_stack([frame[:, 0], width])))
        sets.append(home)
        backwards = [(k, self._adjusted_length, k, k + 1) for k in range(length - 1, 0, -1)]
        forwards = [(k, self._adjusted_width, k - 1, k) for k in range(1, length)]
        for k, adjust, first, second in (backwards + forwards) * _ROUNDS:
            adjusted = adjust(sets[first], sets[second])
            if adjusted is None:
                return None
            sets[k] = adjusted
        for before, after in pairwise(sets):  # do points of the boundary satisfy the conditions of a covering relation?
            a, b = after.coordinates(self._image(before.at(_BOUNDARY))).T
            left, right = a[: len(_EDGE)], a[len(_EDGE) : 2 * len(_EDGE)]
            beyond = max(min(right.min(), -left.max()), min(left.min(), -right.max())) - 1
            if not min(beyond, 1 - np.abs(b[np.abs(a) <= 1 + _SLACK]).max(initial=0.0)) > 0.5 * _SLACK:
                return None
        return sets[1:-1]

    def _adjusted_length(self, first: _FloatSet, second: _FloatSet) -> _FloatSet | None:
        """The first set with the unstable half axis and centre with which its edges are mapped just beyond the second.

        The ends are found by the secant method; None if it does not converge.
        """
        across = np.linspace(-1, 1, 5)[:, None] * first.axes[:, 1]
        unit = _unit(first.axes[:, 0])

        def images(t: float) -> np.ndarray:
            return second.coordinates(self._image(first.centre + t * unit + across))[:, 0]

        rate = float((images(1e-6) - images(-1e-6)).mean()) / 2e-6

        def beyond(t: float, side: float) -> float:
            return float((side * np.sign(rate) * images(side * t)).min()) - 1 - _SLACK

        ends = []
        for side in (1.0, -1.0):
            before, value_before, at = 0.0, beyond(0.0, side), (1 + _SLACK) / abs(rate)
            value = beyond(at, side)
            for _ in range(12):
                if not abs(value) >= 1e-4 or value == value_before:
                    break
                following = min(max(at - value * (at - before) / (value - value_before), at / 3), at * 3)
                before, value_before, at, value = at, value, following, beyond(following, side)
            if not abs(value) < 1e-2:
                return None
            ends.append(side * at)
        axes = np.column_stack([unit * 0.5 * (ends[0] - ends[1]), first.axes[:, 1]])
        return _FloatSet(first.centre + unit * 0.5 * (ends[0] + ends[1]), axes)

    def _adjusted_width(self, first: _FloatSet, second: _FloatSet) -> _FloatSet | None:
        """The second set with the stable half axis and centre with which it just holds the image of the first.

        None if the image is nowhere beside it.
        """
        unit = _unit(second.axes[:, 1])
        frame = _FloatSet(second.centre, np.column_stack([second.axes[:, 0], unit]))
        images = frame.coordinates(self._image(first.at(_BOUNDARY)))
        beside = images[np.abs(images[:, 0]) <= 1 + 2 * _SLACK, 1]
        if not len(beside):
            return None
        middle, half = 0.5 * (beside.max() + beside.min()), 0.5 * np.ptp(beside)
        axes = np.column_stack([second.axes[:, 0], unit * (half * (1 + 2 * _SLACK) + 1e-7)])
        return _FloatSet(second.centre + middle * unit, axes)


def _returns(coordinates: np.ndarray, period: int) -> list[tuple[int, int, int]]:
    """The first return of each lane to home at which a neighbour passes a = 0: length, first mesh period, lane.

    ``coordinates`` are those of paths, (periods + 1, N, 2).
    """
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
