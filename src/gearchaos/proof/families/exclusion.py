"""Proof that the orbits of a region next to a fold end within it: none is there at one end, none crosses its border.

Let F(x; p) = 0 be the equations of an orbit of period n at a value p of the parameter, x its states at the sections in
one vector of length N = n d, and D the region |x - c| <= R in each coordinate. Proved are

1. at one end A of the interval there is an orbit in D;
2. at the other end B there is none;
3. for no p from A to B is there an orbit on the border of D.

The pairs (x, p) with F(x; p) = 0 and x in D form a compact set. So there is a last p* on the way from A to B at which
D contains an orbit x*; it is not B, by (2), and x* lies inside D, by (3). F is continuously differentiable at x*, as
the tube about it proves that z' is not 0 where contact switches. If its derivative by x were regular, orbits would go
on beyond p* (implicit function theorem). Hence x* has the multiplier 1: the interval contains a fold. Without (3) the
orbits may just leave D.

(2) and (3) are proved by covering. Next to a fold the derivative J of F is nearly singular, with a right and a left
singular vector v and l. The bordered matrix

    M = | J   l |
        | vᵀ  0 |

is regular. D is covered by slices |vᵀ(x - c_s) - y| <= h. For p = p0 + D u, |u| <= 1, the tubes of `boxes`
give F(x; p) = F(c_s; p0) + J (x - c_s) + B u. So if x in a slice is a zero of F, M (x - c_s, 0) is the vector
(-F(c_s; p0) - B u, vᵀ(x - c_s)), and for any matrix Y

    (x - c_s, 0) = Y (-F(c_s; p0) - B u, vᵀ(x - c_s)) + (1 - Y M) (x - c_s, 0).

With Y near the inverse of M the first N rows bound x - c_s, which is used again with tubes of the smaller box. If the
last row cannot vanish there is no zero of F in the slice, as (2) needs it; for (3) it is enough that the bound keeps
the zeros of the slice off the border. Slices for which this fails are halved.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from copy import copy
from fractions import Fraction
from functools import cached_property
from itertools import pairwise, product

import numpy as np
from flint import arb_mat

from gearchaos.proof.balls import magnitude
from gearchaos.proof.candidate import (
    COARSE_GUARD_BITS,
    UNIT,
    Candidate,
    Points,
    converged,
    cyclic_jacobian,
    distance_from_unit,
    float_midpoint,
    midpoints_and_spread,
    moved,
)
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.boxes import BoxSystem, ParameterTube
from gearchaos.proof.tube import StartTube

# Distances along the critical direction from which orbits are sought:
_AMPLITUDES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
_DISTINCT = 1e-13  # orbits count as different if their points differ by more than this
_FIRST_SLICES = 16
_THINNEST = 2.0**-13  # the least width of a slice that is divided, in widths of the region
_REFINEMENTS = 6  # most boxes that are tried for one slice, each smaller than the one before


class _Slice:
    """A point c_s of a slice with the bordered system there, for all values of the parameter."""

    def __init__(self, region: Region, points: Points) -> None:
        self.region, self.candidate = region, Candidate.at(region.equations, points)
        middle = [float_midpoint(t.derivative) for t in self.candidate.trajectories]
        self.inverse = np.linalg.inv(self._bordered(middle))
        self.defect = np.array([magnitude(v) for d in self.candidate.defects for v in d.entries()])
        self.signed = np.array([float(v.mid()) for d in self.candidate.defects for v in d.entries()])

    def _bordered(self, derivatives: list[np.ndarray]) -> np.ndarray:
        """M, (N + 1, N + 1)."""
        right, left = self.region.right.ravel(), self.region.left.ravel()
        return np.block([[cyclic_jacobian(derivatives), left[:, None]], [right[None, :], np.zeros((1, 1))]])

    def correction(self) -> np.ndarray:
        """The change (n, d) of c_s to first order by which F becomes a multiple of l, with vᵀx kept."""
        return (self.inverse @ np.append(-self.signed, 0.0))[:-1].reshape(len(self.candidate.points), -1)

    def remainder(self, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Bounds (N + 1,) of the row sums of 1 - Y M, and of Y (B u, 0).

        They hold for all x within ``size`` of c_s in each coordinate and all values of the parameter.
        """
        slopes, drift = self.region.slopes(self.candidate, size)
        middle, spread = midpoints_and_spread(slopes)
        rest, factor = distance_from_unit(self.inverse, self._bordered(middle))
        weight = np.abs(self.inverse)[:, :-1]
        return (rest + weight @ spread) * factor, weight @ drift * factor

    def excluded(self, half: float, size: float) -> tuple[float, float]:
        """The margin by which the last row of a slice cannot vanish, and how far from c_s its zeros lie at most."""
        weight = np.abs(self.inverse)
        radii = self.defect - np.abs(self.signed)
        value = self.inverse[:, :-1] @ self.signed
        rounding = (len(weight) + 8) * UNIT * (weight[:, :-1] @ np.abs(self.signed))
        error = weight[:, :-1] @ np.maximum(radii, 0) + rounding + 1e-300
        margin = -1.0
        with suppress(UndecidedError):
            for _ in range(_REFINEMENTS):
                rest, drift = self.remainder(size)
                other = error + drift + weight[:, -1] * half + rest * size
                margin = (abs(value[-1]) - other[-1]) / abs(value[-1]) if value[-1] else -1.0
                smaller = float((np.abs(value) + other)[:-1].max()) * (1 + 1e-12)
                if margin > 0.05 or not smaller < 0.8 * size:
                    break
                size = smaller
        return float(margin), size


class Region:
    """The region D for the values of a parameter in an interval.

    ``equations`` are those in the middle of the interval, ``centre`` the n points c, ``radius`` R in each coordinate of
    each point, and ``widths`` the half-widths of the parameters that change with u.
    """

    def __init__(self, equations: MeshEquations, centre: Points, radius: Fraction, widths: dict[str, Fraction]) -> None:
        self.equations, self.centre, self.radius = equations, centre, float(radius)
        start = Candidate.at(equations, centre)
        self.right, self.left = critical_directions([t.derivative for t in start.trajectories])
        self.system: BoxSystem | None = BoxSystem(start, [widths])
        self.bounds = self.system.bounds(Fraction(1))

    def at(self, equations: MeshEquations) -> Region:
        """The same region with the same slices at one value of the parameter."""
        there = copy(self)
        there.equations, there.system = equations, None
        return there

    @cached_property
    def whole(self) -> list[tuple[float, float]]:
        """The values vᵀ(x - c) between which all points of the region lie, in intervals."""
        height = float(np.abs(self.right).sum() * self.radius) * (1 + 1e-9)
        return list(pairwise(np.linspace(-height, height, _FIRST_SLICES + 1).tolist()))

    def slopes(self, candidate: Candidate, size: float) -> tuple[list[arb_mat], np.ndarray]:
        """J within ``size`` of the points of a candidate, and bounds of B u (N,); may raise `UndecidedError`."""
        motions, d = candidate.trajectories, self.equations.dimension
        if self.system is None:
            boxes = [candidate.box(k, Fraction(size)) for k in range(candidate.period)]
            found = [StartTube(self.equations, box, t).slopes for box, t in zip(boxes, motions, strict=True)]
            return found, np.zeros(d * candidate.period)
        if [len(t.switches) for t in motions] != list(map(len, self.system.delays)):
            raise UndecidedError("region not proved empty", 0.0)
        tubes = [ParameterTube(self.bounds, motion, np.zeros((d, 1)), size, delays)
                 for motion, delays in zip(motions, self.system.delays, strict=True)]
        return [t.slopes for t in tubes], np.array([magnitude(v) for t in tubes for v in t.by_parameters.entries()])

    def not_empty(self, slices: list[tuple[float, float]], *, border: bool) -> tuple[list[tuple[float, float]], int]:
        """Divide slices until no orbit lies in them, or with ``border`` until none lies on the border of the region.

        The result are the slices that may have orbits off the border, and the number of all slices. Raises
        `UndecidedError` if it is not proved.
        """
        waiting, left, done = list(slices), list[tuple[float, float]](), 0
        least = _THINNEST * (self.whole[-1][1] - self.whole[0][0])
        while waiting:
            low, high = waiting.pop()
            margin, inside = self._slice(low, high)
            if margin > 0 or (border and inside):
                done += 1
                left += [(low, high)] if margin <= 0 else []
                continue
            if high - low < least:
                raise UndecidedError("region not proved empty", margin)
            middle = (low + high) / 2
            waiting += [(low, middle), (middle, high)]
        return left, done

    def _slice(self, low: float, high: float) -> tuple[float, bool]:
        """The margin by which a slice has no orbit, and whether the orbits in it are off the border of the region."""
        points = moved(self.equations, self.centre, (low + high) / 2 * self.right, COARSE_GUARD_BITS)
        try:
            for _ in range(2):
                points = moved(self.equations, points, _Slice(self, points).correction(), COARSE_GUARD_BITS)
            piece = _Slice(self, points)
        except (UndecidedError, np.linalg.LinAlgError):
            return -1.0, False
        offsets = [float(a - b) for p, q in zip(points, self.centre, strict=True) for a, b in zip(p, q, strict=True)]
        at, away = float(self.right.ravel() @ offsets), distance(points, self.centre) * (1 + 1e-12)
        half = (max(high - at, at - low) + 1e-10 * self.radius) * (1 + 1e-12)
        margin, size = piece.excluded(half, (self.radius + away) * (1 + 1e-12))
        return margin, size + away < self.radius


def critical_directions(derivatives: list[arb_mat]) -> tuple[np.ndarray, np.ndarray]:
    """The right and left singular vectors (n, d) of the least singular value of the cyclic system."""
    left, _, right = np.linalg.svd(cyclic_jacobian(list(map(float_midpoint, derivatives))))
    shape = len(derivatives), derivatives[0].nrows()
    return right[-1].reshape(shape), left[:, -1].reshape(shape)


def neighbours(equations: MeshEquations, points: Points) -> Iterator[Candidate]:
    """Different orbits near points next to which the cyclic system is nearly singular, each once.

    They are sought along the critical direction: in floats Newton's method ends far from the orbit there.
    """
    try:
        direction, _ = critical_directions([t.derivative for t in Candidate.at(equations, points).trajectories])
    except UndecidedError:
        return
    found: list[Candidate] = []
    for amplitude, side in product(_AMPLITUDES, (1, -1)):
        start = moved(equations, points, side * amplitude / np.abs(direction).max() * direction, COARSE_GUARD_BITS)
        candidate = converged(equations, start)
        if candidate is not None and all(distance(candidate.points, f.points) > _DISTINCT for f in found):
            found.append(candidate)
            yield candidate


def distance(first: Points, second: Points) -> float:
    """The largest difference of a coordinate of two lists of points."""
    return float(max(abs(a - b) for p, q in zip(first, second, strict=True) for a, b in zip(p, q, strict=True)))


def as_floats(points: Points) -> np.ndarray:
    """Points (n, d) rounded to floats."""
    return np.array([[float(value) for value in point] for point in points])
