"""Proof that a region next to a fold contains no periodic orbit.

The unknowns are, as in `krawczyk`, the n states at the sections, in one vector x of length N = n d; F(x) = 0 are the
equations of an orbit. Next to a fold the derivative J of F is nearly singular, with a right and a left singular vector
v and l. The bordered matrix

    M = | J   l |
        | vᵀ  0 |

is regular. The region D, |x - c| <= R in each coordinate, is covered by slices |vᵀ(x - c_s) - y| <= h. If x in a slice
is a zero of F, then M (x - c_s, 0) = (-F(c_s), vᵀ(x - c_s)) with slopes J of F between x and c_s. So for any matrix Y

    (x - c_s, 0) = Y (-F(c_s), vᵀ(x - c_s)) + (1 - Y M) (x - c_s, 0).

With Y near the inverse of M the first N rows bound x - c_s, which is used again with slopes of the smaller box; if the
last row cannot vanish there is no zero of F in the slice. Slices for which this fails are halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from gearchaos.proof.balls import magnitude
from gearchaos.proof.candidate import Candidate
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.krawczyk import cyclic_jacobian, float_midpoint, row_spread
from gearchaos.proof.search import critical_directions, distance, moved
from gearchaos.proof.tube import period_tube

_MOST_SLICES = 4000
_REFINEMENTS = 6
"""Most boxes that are tried for one slice, each smaller than the one before."""

_UNIT = 2.0**-53


@dataclass(frozen=True)
class EmptyRegion:
    """A region without periodic orbits of period n.

    Attributes
    ----------
    centre : list of list of Fraction
        n points.
    radius : Fraction
        R, in each coordinate of each point.
    slices : int
        Number of slices.
    margin : float
        Least amount, relative to the defect, by which the last row of a slice is off zero.
    """

    centre: list[list[Fraction]]
    radius: Fraction
    slices: int
    margin: float


class _Slice:
    """A point c_s of a slice with the bordered system there."""

    def __init__(self, candidate: Candidate, right: np.ndarray, left: np.ndarray) -> None:
        self.candidate = candidate
        self.border = right.ravel(), left.ravel()
        middle = [float_midpoint(t.derivative) for t in candidate.trajectories]
        self.inverse = np.linalg.inv(self._bordered(middle))
        self.defect = np.array([magnitude(v) for d in candidate.defects for v in d.entries()])
        self.signed = np.array([float(v.mid()) for d in candidate.defects for v in d.entries()])

    def _bordered(self, derivatives: list[np.ndarray]) -> np.ndarray:
        """M, (N + 1, N + 1)."""
        right, left = self.border
        return np.block([[cyclic_jacobian(derivatives), left[:, None]], [right[None, :], np.zeros((1, 1))]])

    def correction(self) -> np.ndarray:
        """The change (n, d) of c_s to first order by which F becomes a multiple of l, with vᵀx kept."""
        change = self.inverse @ np.append(-self.signed, 0.0)
        return change[:-1].reshape(len(self.candidate.points), -1)

    def remainder(self, size: float) -> np.ndarray:
        """Upper bounds (N + 1,) of the row sums of 1 - Y M over all x within ``size`` of c_s in each coordinate."""
        boxes = [self.candidate.box(k, Fraction(size)) for k in range(self.candidate.period)]
        equations = self.candidate.equations
        slopes = [period_tube(equations, box, t).slopes
                  for box, t in zip(boxes, self.candidate.trajectories, strict=True)]
        middle = list(map(float_midpoint, slopes))
        matrix, count = self._bordered(middle), len(self.inverse)
        spread = np.concatenate([row_spread(s, m) for s, m in zip(slopes, middle, strict=True)])
        gamma = (count + 2) * _UNIT / (1 - (count + 2) * _UNIT)
        weight = np.abs(self.inverse)
        rounding = gamma * (weight @ np.abs(matrix).sum(axis=1) + 1)
        rest = np.abs(np.eye(count) - self.inverse @ matrix).sum(axis=1)
        return (rest + rounding + weight[:, :-1] @ spread) * (1 + 8 * gamma)

    def height(self, centre: list[list[Fraction]]) -> float:
        """About vᵀ(c_s - c)."""
        difference = [float(a - b) for p, q in zip(self.candidate.points, centre, strict=True)
                      for a, b in zip(p, q, strict=True)]
        return float(self.border[0] @ difference)


def empty_region(
    equations: MeshEquations, centre: list[list[Fraction]], radius: Fraction
) -> EmptyRegion:
    """Prove that no orbit of period n has all its points within ``radius`` of the n points of ``centre``.

    Raises
    ------
    UndecidedError
        If that is not proved; its reason is "region not proved empty".
    """
    start = Candidate.at(equations, centre)
    right, left, _ = critical_directions([t.derivative for t in start.trajectories])
    height = float(np.abs(right).sum() * float(radius)) * (1 + 1e-9)
    waiting, done, margin = [(-height, height)], 0, float("inf")
    while waiting:
        low, high = waiting.pop()
        found = _slice_margin(start, right, left, (low, high), float(radius))
        if found > 0:
            done, margin = done + 1, min(margin, found)
            continue
        if done + len(waiting) > _MOST_SLICES or high - low < 1e-9 * height:
            raise UndecidedError("region not proved empty", found)
        middle = (low + high) / 2
        waiting += [(low, middle), (middle, high)]
    return EmptyRegion(centre, radius, done, margin)


def _slice_margin(
    start: Candidate, right: np.ndarray, left: np.ndarray, ends: tuple[float, float], radius: float
) -> float:
    """The margin of a slice without zeros; not positive if it is not proved to have none."""
    equations, centre = start.equations, start.points
    low, high = ends
    points = moved(equations, centre, (low + high) / 2 * right)
    try:
        for _ in range(2):
            points = moved(equations, points, _Slice(Candidate.at(equations, points), right, left).correction())
        piece = _Slice(Candidate.at(equations, points), right, left)
    except (UndecidedError, np.linalg.LinAlgError):
        return -1.0
    at = piece.height(centre)
    half = (max(high - at, at - low) + 1e-10 * radius) * (1 + 1e-12)
    size = (radius + distance(points, centre)) * (1 + 1e-12)
    return _excluded(piece, half, size)


def _excluded(piece: _Slice, half: float, size: float) -> float:
    """The margin by which the last row of a slice cannot vanish; not positive if it may."""
    weight = np.abs(piece.inverse)
    radii = piece.defect - np.abs(piece.signed)
    value = piece.inverse[:, :-1] @ piece.signed
    rounding = (len(weight) + 8) * _UNIT * (weight[:, :-1] @ np.abs(piece.signed))
    error = weight[:, :-1] @ np.maximum(radii, 0) + rounding + 1e-300
    margin = -1.0
    for _ in range(_REFINEMENTS):
        try:
            rest = piece.remainder(size)
        except UndecidedError:
            return -1.0
        bounds = (np.abs(value) + error + weight[:, -1] * half + rest * size) * (1 + 1e-12)
        off = abs(value[-1]) - error[-1] - weight[-1, -1] * half - rest[-1] * size
        margin = off / abs(value[-1]) if value[-1] else -1.0
        if margin > 0.05:
            return float(margin)
        smaller = float(bounds[:-1].max())
        if not smaller < 0.8 * size:
            break
        size = smaller
    return float(margin)
