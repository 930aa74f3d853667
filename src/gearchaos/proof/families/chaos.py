"""A chaotic set as a theorem (d = 2): parallelograms of states of which each covers others, and what follows.

A parallelogram N has a centre c and two half axes, the unstable one p and the stable one q: its points are
c + a p + b q with |a| <= 1 and |b| <= 1. N covers M under a continuous map if, in the coordinates (a, b) of M, the
image of

- one of the edges a = ±1 of N lies in a < -1, that of the other one in a > 1;
- the whole of N has |b| < 1 wherever |a| <= 1.

Then a chain N_0, N_1, ... of sets, each of which covers the next, has a point of N_0 whose images lie in N_1, N_2, ...
one after another, and for a closed chain one that returns to itself (P. Zgliczynski, M. Gidea, Covering relations for
multidimensional dynamical systems, J. Differential Equations 202, 2004).

Only the boundary of N needs to be mapped: P is continuous and one to one, so the image of N is enclosed by the image of
its boundary; and the part of the plane with |b| < 1 or |a| > 1 has no holes.

The sets and the transitions form a graph. Let the sets to which one set leads be disjoint. Then two motions with
different paths from the same set are in disjoint sets at some time. So the topological entropy of P is at least log ρ,
with ρ the spectral radius of the matrix A of the graph (A_ij = 1 for a transition from i to j). For any positive vector
v, ρ is at least the least (A v)_i / v_i (Collatz and Wielandt).
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, arb_mat

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import ball, from_text, least, precision, to_fraction, to_text
from gearchaos.proof.certificate import Theorem, UndecidedError, Unproved, used_versions
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.tube import segment_image
from gearchaos.proof.verifier import growth, sealed

_MOST_PIECES = 400  # most pieces into which the boundary of a set is divided
_FIRST_PIECES = 4  # pieces of an edge at first

Vector = tuple[Fraction, Fraction]


@dataclass(frozen=True)
class Parallelogram:
    """The states c + a p + b q with |a| <= 1 and |b| <= 1."""

    centre: Vector  # c
    unstable: Vector  # p
    stable: Vector  # q

    def vector(self, a: Fraction, b: Fraction) -> Vector:
        """a p + b q."""
        x, y = (a * p + b * q for p, q in zip(self.unstable, self.stable, strict=True))
        return x, y

    def at(self, a: Fraction, b: Fraction) -> Vector:
        """The state c + a p + b q."""
        x, y = (c + v for c, v in zip(self.centre, self.vector(a, b), strict=True))
        return x, y

    def coordinates(self, x: Any, y: Any) -> tuple[Any, Any]:
        """(a, b) of a vector a p + b q: of exact numbers exactly, of balls as balls."""
        (p0, p1), (q0, q1), number = self.unstable, self.stable, ball if isinstance(x, arb) else Fraction
        area = number(p0 * q1 - p1 * q0)
        return (x * number(q1) - y * number(q0)) / area, (number(p0) * y - number(p1) * x) / area

    def is_apart_from(self, other: Parallelogram) -> bool:
        """Whether no point belongs to both, decided exactly: an edge of one of them separates them."""
        for first, second in ((self, other), (other, self)):
            corners = (second.at(Fraction(a), Fraction(b)) for a in (-1, 1) for b in (-1, 1))
            seen = [first.coordinates(*(v - c for v, c in zip(x, first.centre, strict=True))) for x in corners]
            if any(all(sign * corner[axis] > 1 for corner in seen) for axis in (0, 1) for sign in (1, -1)):
                return True
        return False


@dataclass(frozen=True)
class _Piece:
    """A segment of the boundary of a set, from c - h to c + h in its coordinates (a, b)."""

    centre: Vector  # c
    half: Vector  # h
    side: int  # -1 or 1 on the edge a = -1 or a = 1, otherwise 0

    def divided(self, count: int) -> list[_Piece]:
        """The segment in equal parts."""
        half = self.half[0] / count, self.half[1] / count
        steps = [2 * k - count + 1 for k in range(count)]
        return [_Piece((self.centre[0] + k * half[0], self.centre[1] + k * half[1]), half, self.side) for k in steps]


_ZERO, _ONE = Fraction(0), Fraction(1)
_POINT = (_ZERO, _ZERO)
_EDGES = (
    _Piece((-_ONE, _ZERO), (_ZERO, _ONE), -1), _Piece((_ONE, _ZERO), (_ZERO, _ONE), 1),
    _Piece((_ZERO, -_ONE), (_ONE, _ZERO), 0), _Piece((_ZERO, _ONE), (_ONE, _ZERO), 0),
)


def prove_covering(equations: MeshEquations, first: Parallelogram, second: Parallelogram, slack: Fraction,
                   forcing_change: float = 0.0) -> int:
    """Prove that a set covers another one under the map P over one mesh period, with a slack (d = 2).

    The edges a = ±1 are mapped to |a| > 1 + slack, and |b| < 1 - slack wherever |a| <= 1 + slack. For
    ``forcing_change`` see `segment_image`. The result is the number of pieces of the boundary. Raises `UndecidedError`
    with the least margin, which is negative, if the relation is not proved.
    """
    def image(piece: _Piece, forcing_change: float) -> tuple[arb, arb]:
        """Balls (a, b) in the coordinates of the second set that contain the image of a piece of the boundary."""
        centre = arb_mat(2, 1, list(map(ball, first.at(*piece.centre))))
        half = arb_mat(2, 1, list(map(ball, first.vector(*piece.half))))
        middle, change = segment_image(equations, centre, half, forcing_change)
        a, b = second.coordinates(*(middle[i, 0] - ball(second.centre[i]) for i in range(2)))
        along = second.coordinates(change[0, 0], change[1, 0])
        return a + along[0] * arb(0, 1), b + along[1] * arb(0, 1)

    try:  # to which side the edge a = 1 seems to be mapped: not proved here
        orientation = 1 if image(_Piece((_ONE, _ZERO), _POINT, 1), 0.0)[0].mid() > 0 else -1
    except UndecidedError:
        orientation = 1
    pieces = [piece for edge in _EDGES for piece in edge.divided(_FIRST_PIECES)]
    count = 0
    while pieces:
        piece, count = pieces.pop(), count + 1
        side, margin = orientation * piece.side, float("-inf")
        try:
            margin = _margin(*image(piece, forcing_change), side, slack)
            if margin > 0:
                continue
            violated = not _margin(*image(_Piece(piece.centre, _POINT, 0), forcing_change), side, slack) > 0
        except UndecidedError:  # the motion from the centre grazes: those from other centres do not
            violated = False
        if violated or count + len(pieces) > _MOST_PIECES:
            raise UndecidedError("covering not proved", margin)
        pieces += piece.divided(2)
    return count


def _margin(a: arb, b: arb, side: int, slack: Fraction) -> float:
    """The distance of the image of a piece from where it must not be; proved if positive.

    ``side`` is the side of the second set on which the image of an edge a = ±1 must lie, or 0.
    """
    bound = 1 + ball(slack)
    if side:
        return least(side * a - bound)
    return max(least(a - bound), least(-a - bound), least(1 - ball(slack) - abs(b)))


FORMAT, VERSION = "gearchaos chaotic set", 1

SLACK = "0.01"  # the slack of each covering relation
_DIGITS = 6  # decimal digits of the bound of the entropy


@dataclass(frozen=True, eq=False)
class ChaoticSet(Theorem):
    """A proved chaotic set: the theorem with the sets and transitions."""

    seconds: float  # how long the proof took, without the search for the sets

    entropy = property(lambda self: float(self.document["entropy"]),
                       doc="A lower bound of the topological entropy of P: natural logarithm, per mesh period.")
    slack = property(lambda self: float(self.document["slack"]), doc="The slack of every covering relation.")

    @property
    def loops(self) -> list[list[int]]:
        """The closed paths from set 0 that pass it once, as numbers of sets: every other set leads to one set."""
        transitions, out = self.document["transitions"], []
        after = {first: second for first, second in transitions if first}
        for start in (second for first, second in transitions if not first):
            loop = [0]
            while start:
                loop.append(start)
                start = after[start]
            out.append(loop)
        return out

    def to_dict(self) -> dict[str, Any]:
        """A summary as JSON-ready values; all is in ``document``."""
        return self.selected("theorem", entropy=self.entropy, sets=len(self.document["sets"]),
                             loops=[len(loop) for loop in self.loops], slack=self.slack, bits=self.bits,
                             seconds=self.seconds)

    def __repr__(self) -> str:
        return f"ChaoticSet(entropy >= {self.document['entropy']}, {len(self.document['sets'])} sets)"


def prove_chaotic_set(model: MeshModel, sets: Sequence[tuple[np.ndarray, np.ndarray]], loops: Sequence[Sequence[int]],
                      bits: int = 128, tolerances: Mapping[str, str] | None = None) -> ChaoticSet | Unproved:
    """Prove the covering relations along loops of sets, and what follows of those that are proved.

    The parameters of the model (d = 2) are taken as exactly the floats they are. ``sets`` has the centre (2,) of each
    parallelogram, and its unstable and stable half axis as columns (2, 2), ``loops`` the numbers of the sets of each
    loop, from set 0; the last one covers set 0. The first loop is that of the saddle. ``tolerances`` are numbers as in
    a certificate, by the names ``eps1``, ... of amplitudes of the transmission error: the theorem is to hold for all
    amplitudes within these distances of those of the model.
    """
    start, tolerances = time.perf_counter(), dict(tolerances or {})
    parallelograms = []
    for centre, axes in sets:
        (x, y), (p, q) = centre.tolist(), axes.T.tolist()
        parallelograms.append(Parallelogram(*((Fraction(v), Fraction(w)) for v, w in ((x, y), p, q))))
    parameters = exact_parameters(model)
    with precision(bits):
        equations = MeshEquations(parameters, bits=bits)
        change = equations.forcing_change({harmonic(name): from_text(size) for name, size in tolerances.items()})
        proved, failures = [], []
        for loop in loops:
            try:
                for first, second in _steps(loop):
                    prove_covering(equations, parallelograms[first], parallelograms[second], Fraction(SLACK), change)
                proved.append(list(loop))
            except UndecidedError as failure:
                failures.append(failure)
        kept = list[list[int]]()  # each leads from set 0 to a set that is disjoint from those of the loops before it
        for loop in proved:
            following = parallelograms[_steps(loop)[0][1]]
            if all(following.is_apart_from(parallelograms[_steps(other)[0][1]]) for other in kept):
                kept.append(loop)
        if len(kept) < 2:
            return Unproved("covering not proved", max((f.margin for f in failures), default=0.0), bits)
        used = sorted({number for loop in kept for number in loop})
        places = {number: place for place, number in enumerate(used)}
        transitions = [[places[a], places[b]] for loop in kept for a, b in _steps(loop)]
        texts = [{name: [to_text(value) for value in getattr(parallelograms[k], name)]
                  for name in ("centre", "unstable", "stable")} for k in used]
        document = {
            "format": FORMAT, "version": VERSION, "model": parameters, "tolerances": tolerances,
            "coordinates": list(equations.names), "sets": texts,
            "transitions": transitions, "slack": SLACK, "bits": bits, **_entropy_bound(transitions),
        }
    seconds = round(time.perf_counter() - start, 3)
    return ChaoticSet(sealed({**document, "versions": used_versions()}), seconds)


def harmonic(name: str) -> int:
    """The number j of ``epsj``; raises `ValueError` for any other name."""
    number = int(name.removeprefix("eps"))
    if number < 1 or name != f"eps{number}":
        raise ValueError(f"no amplitude of the transmission error: {name!r}")
    return number


def _steps(loop: Sequence[int]) -> list[tuple[int, int]]:
    """The transitions of a closed path."""
    return list(zip(loop, [*loop[1:], loop[0]], strict=True))


def _entropy_bound(transitions: list[list[int]]) -> dict[str, Any]:
    """The bound of the entropy, rounded down, and the vector v by which it is proved."""
    count = 1 + max(max(pair) for pair in transitions)
    matrix = np.zeros((count, count))
    for first, second in transitions:
        matrix[first, second] += 1
    values, vectors = np.linalg.eig(matrix)
    weights = np.abs(vectors[:, np.argmax(values.real)].real)
    weights = [Fraction(float(w)) for w in weights / weights.max()]
    scaled = ball(growth(transitions, weights)).log() * 10**_DIGITS
    entropy = Fraction(to_fraction(scaled.lower()).__floor__(), 10**_DIGITS)
    return {"entropy": f"{float(entropy):.{_DIGITS}f}", "weights": [to_text(w) for w in weights]}
