"""An approximate periodic orbit with exact points, and its refinement by Newton's method in balls."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from flint import arb, arb_mat

from gearchaos.proof.balls import ball, rounded
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.krawczyk import CyclicSystem
from gearchaos.proof.trajectory import Trajectory, trajectory

_MOST_STEPS = 12
"""Most steps of Newton's method."""

_GUARD_BITS = 16
"""Refined points are multiples of 2^(_GUARD_BITS - bits)."""

_ROUNDING_BITS = 40
"""Corrections below 2^(_ROUNDING_BITS - bits) may be rounding errors."""

_NEAR = 1e-3
"""A first correction by Newton's method above this means that the points are not near an orbit."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Points near an orbit of period n, with the motions from them over one mesh period.

    Attributes
    ----------
    equations : MeshEquations
    points : list of list of Fraction
        n points c_k of d coordinates.
    trajectories : list of Trajectory
        The motion from each point.
    """

    equations: MeshEquations
    points: list[list[Fraction]]
    trajectories: list[Trajectory]

    @classmethod
    def at(cls, equations: MeshEquations, points: list[list[Fraction]]) -> Candidate:
        """The candidate with these points; raises `UndecidedError` where a motion cannot be followed."""
        return cls(equations, points, [trajectory(equations, column(point)) for point in points])

    @property
    def period(self) -> int:
        """n."""
        return len(self.points)

    @cached_property
    def defects(self) -> list[arb_mat]:
        """P(c_k) - c_(k+1), each (d, 1)."""
        following = [*self.points[1:], self.points[0]]
        return [t.image - column(point) for t, point in zip(self.trajectories, following, strict=True)]

    @cached_property
    def system(self) -> CyclicSystem:
        """The linearised cyclic system; raises `UndecidedError` if it is singular."""
        system = CyclicSystem.at([t.derivative for t in self.trajectories])
        if system is None:
            raise UndecidedError("Krawczyk not contracting", 0.0)
        return system

    @cached_property
    def correction(self) -> np.ndarray:
        """The correction (n, d) of the points by Newton's method."""
        return self.system.newton_step(self.defects)

    @cached_property
    def error(self) -> float:
        """The largest entry of the correction, about the distance from the orbit."""
        return float(np.abs(self.correction).max())

    def box(self, k: int, radius: Fraction) -> arb_mat:
        """The cube about point k, (d, 1)."""
        half = ball(radius)
        return arb_mat(len(self.points[k]), 1, [arb(ball(c), half) for c in self.points[k]])

    def refined(self, tolerance: float) -> Candidate:
        """A candidate with an error of at most ``tolerance``: this one, or one found by Newton's method.

        Raises
        ------
        UndecidedError
            With the reason that Newton's method does not get nearer, and a negative margin.
        """
        candidate, steps = self, 0
        while not candidate.error <= tolerance:
            following = candidate.corrected() if candidate.error < _NEAR and steps < _MOST_STEPS else candidate
            if not following.error < 0.5 * candidate.error:
                raise UndecidedError(candidate._obstacle(), 1 - candidate.error / tolerance)
            candidate, steps = following, steps + 1
        return candidate

    def _obstacle(self) -> str:
        """The reason for which Newton's method gets no nearer to an orbit from here."""
        if not self.error < _NEAR:
            return "Newton diverged"
        at_rounding = self.error < 2.0 ** (_ROUNDING_BITS - self.equations.bits)
        return "bits exhausted" if at_rounding else "Krawczyk not contracting"

    def corrected(self) -> Candidate:
        """The candidate after one step of Newton's method."""
        digits = self.equations.bits - _GUARD_BITS
        points = [
            [rounded(ball(c) + change, digits) for c, change in zip(point, changes, strict=True)]
            for point, changes in zip(self.points, self.correction.tolist(), strict=True)]
        return Candidate.at(self.equations, points)


def column(point: list[Fraction]) -> arb_mat:
    """A point as a matrix (d, 1)."""
    return arb_mat(len(point), 1, [ball(value) for value in point])
