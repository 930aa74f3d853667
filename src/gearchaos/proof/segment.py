"""The image of a segment of states under one mesh period, whatever the contact switches of the motions are.

The motions from the points c + t h, -1 <= t <= 1, differ from that from c by t times a vector that changes by the
slopes of `tube`. Where a contact state is not proved to be the same for all of them, because they switch at different
times, or some graze a boundary and others do not, κ is anything from 0 to χ, which needs no other proof. So an image is
found for every segment, near a grazing motion a wider one.

Where the forcing is unknown by at most G, the motions differ from that from c by a further vector r, which changes by
the same slopes and over a duration η by at most η G e^(ηN), with N a bound of the norm of the equations.
"""

from __future__ import annotations

import math

from flint import arb, arb_mat, arb_poly

from gearchaos.proof.balls import ball as exact
from gearchaos.proof.balls import block, magnitude, rounded
from gearchaos.proof.crossing import Displacement, UndecidedError, clearance, clearance_by_bounds
from gearchaos.proof.equations import Cell, MeshEquations
from gearchaos.proof.trajectory import Trajectory, trajectory
from gearchaos.proof.tube import slopes_through

_CURVATURE = 10.0
"""About the largest z″ in units of a mesh period, by which the duration of a graze is estimated."""

_LEAST = 2.0**-20
"""Least duration for which contact is taken as unknown, in mesh periods."""

_SHORTEST = 0.25
"""Least interval that is divided, relative to the estimated duration for which contact is unknown."""


def segment_image(
    equations: MeshEquations, centre: arb_mat, half: arb_mat, forcing_change: float = 0.0
) -> tuple[arb_mat, arb_mat]:
    """The image of a segment of states after one mesh period from the section on.

    Parameters
    ----------
    equations : MeshEquations
        Made at the precision that is set.
    centre : arb_mat
        c, (d, 1), with radii near the rounding unit.
    half : arb_mat
        h, (d, 1): the segment is c + t h, -1 <= t <= 1.
    forcing_change : float
        G, at most this is added to T f(τ) in z'', see `MeshEquations.forcing_change`.

    Returns
    -------
    arb_mat, arb_mat
        p and v, each (d, 1): P(c + t h) lies in p + t v, for every such change of the forcing.

    Raises
    ------
    UndecidedError
        If the contact switches of the motion from c are not decided.
    """
    motion = trajectory(equations, centre)
    segment = _Segment(equations, motion, half, forcing_change)
    segment.follow()
    d = range(1)
    return motion.image + block(segment.rest, equations.dimension, d), block(segment.change, equations.dimension, d)


class _Segment:
    """A segment while it is followed through a mesh period.

    Attributes
    ----------
    change, rest : arb_mat
        v, (d + 1, 1), and r, (d + 1, 1): the motion from c + t h is at t v + r from the motion from c.
    """

    def __init__(self, equations: MeshEquations, motion: Trajectory, half: arb_mat, forcing_change: float) -> None:
        self.equations, self.motion, self.dimension = equations, motion, equations.dimension
        self.change = arb_mat(self.dimension + 1, 1, [*half.entries(), 0])
        self.rest = arb_mat(self.dimension + 1, 1)
        self.forcing_change = forcing_change
        self.rate = equations.norms[0] + equations.norms[1] * magnitude(equations.stiffness)
        self.windows = [self._window(number, half) for number in range(len(motion.switches))]

    def follow(self) -> None:
        """Follow the segment through the period."""
        for index, cell in enumerate(self.equations.cells):
            at = arb(0)
            for low, high in self._windows_in(cell):
                if low > at:
                    self._advance(index, at, low)
                    at = low
                if high > at:
                    self._unknown(cell, at, high)
                    at = high
            if at < 1:
                self._advance(index, at, arb(1))

    def _window(self, number: int, half: arb_mat) -> tuple[arb, arb]:
        """Exact times before and after a switch of the centre, about those between which others switch."""
        switch = self.motion.switches[number]
        spread = magnitude((block(switch.slopes, 1, range(self.dimension)) * half)[0, 0]) + self.forcing_change
        rounding = magnitude(switch.time - switch.time.mid())
        duration = max(2 * _duration(spread, magnitude(switch.rate)), 4 * rounding, _LEAST)
        digits = 8 - math.floor(math.log2(duration))
        low, high = (exact(rounded(switch.time + side * duration, digits)) for side in (-1, 1))
        if not low < switch.time < high:
            raise UndecidedError("bits exhausted", -duration)
        return low, high

    def _windows_in(self, cell: Cell) -> list[tuple[arb, arb]]:
        """The windows in a cell in order of time as exact shares from 0 to 1, none within another's."""
        shares = [((low - cell.begin) / cell.span, (high - cell.begin) / cell.span) for low, high in self.windows]
        ends = [(low.lower().mid().max(arb(0)), high.upper().mid().min(arb(1))) for low, high in shares]
        return [(low, high) for low, high in ends if low < high]

    def _advance(self, index: int, low: arb, high: arb) -> None:
        """Follow the segment from a share of a cell to another, between which the centre has no switch."""
        if self._known(index, low, high):
            return
        cell = self.equations.cells[index]
        if magnitude((high - low) * cell.span) < self._shortest(index, low):
            self._unknown(cell, low, high)
            return
        middle = ((low + high) / 2).mid()
        self._advance(index, low, middle)
        self._advance(index, middle, high)

    def _shortest(self, index: int, low: arb) -> float:
        """The least duration, in mesh periods, of an interval that is divided."""
        z_dot = (self.equations.flow(index, self._contact(index, low)).at(low) * self._start(index, low))[1, 0]
        speed = magnitude(self.equations.duration * z_dot)
        return max(_SHORTEST * _duration(magnitude(self.change[0, 0]) + magnitude(self.rest[0, 0]), speed), _LEAST)

    def _part(self, index: int, low: arb) -> int:
        """The number of switches of the centre before a share of a cell; raises `UndecidedError` if one may be then."""
        time = self.equations.cells[index].begin + low * self.equations.cells[index].span
        before = [s for s in self.motion.switches if s.time < time]
        if len(before) + sum(bool(s.time > time) for s in self.motion.switches) != len(self.motion.switches):
            raise UndecidedError("bits exhausted", 0.0)
        return len(before)

    def _contact(self, index: int, low: arb) -> int:
        """The contact state of the centre at a share of a cell."""
        return self.motion.contacts[self._part(index, low)]

    def _start(self, index: int, low: arb) -> arb_mat:
        """The state (d + 1, 1) of the centre at the start of a cell, by the equations that hold for it at a share."""
        return self.motion.starts[self._part(index, low), index]

    def _known(self, index: int, low: arb, high: arb) -> bool:
        """Follow the segment as far as ``high`` if all its motions are proved to be in the centre's contact state."""
        contact, start = self._contact(index, low), self._start(index, low)
        flow, added = self.equations.flow(index, contact), self._added((high - low) * self.equations.cells[index].span)
        entry, advance = flow.at(low), flow.end if high == 1 else flow.at(high)
        back = entry.inv()
        step = advance * back
        change, rest = step * self.change, step * self.rest + added
        states = start + back * self.change * arb(0, 1) + back * self.rest
        whole = low.is_zero() and high == 1
        if not whole or clearance_by_bounds(flow.bounds * states + self._bounds(index, added), contact) is None:
            z_low = (entry * start + self.change * arb(0, 1) + self.rest)[0, 0]
            z_high = (advance * start + change * arb(0, 1) + rest)[0, 0]
            try:
                clearance(self._path(index, flow.polynomial(states), added), contact, low, high, z_low, z_high)
            except UndecidedError:
                return False
        self.change, self.rest = change, rest
        return True

    def _unknown(self, cell: Cell, low: arb, high: arb) -> None:
        """Follow the segment from a share of a cell to another, between which contact is unknown."""
        duration = (high - low) * cell.span
        slopes = slopes_through(self.equations, duration)
        self.change, self.rest = slopes * self.change, slopes * self.rest + self._added(duration)

    def _added(self, duration: arb) -> arb_mat:
        """What an unknown forcing adds to the state in a duration: balls (d + 1, 1) about 0."""
        if not self.forcing_change:
            return arb_mat(self.dimension + 1, 1)
        size = self.forcing_change * duration * (duration * self.rate).exp()
        return arb_mat(self.dimension + 1, 1, [arb(0, size.upper())] * self.dimension + [arb(0)])

    def _bounds(self, index: int, added: arb_mat) -> arb_mat:
        """What an unknown forcing adds to z at the ends of an interval of a cell, to dz/du and to d²z/du², (4, 1)."""
        span, size = self.equations.cells[index].span, added[0, 0]
        slope = span * self.rate * size
        curvature = span * self.rate * (slope + span * arb(0, self.forcing_change))
        return arb_mat(4, 1, [size, size, slope, curvature])

    def _path(self, index: int, polynomial: arb_poly, added: arb_mat) -> Displacement:
        """z of all motions from a polynomial that contains z for known forcing."""
        path = Displacement(polynomial)
        if self.forcing_change:
            _, size, slope, curvature = self._bounds(index, added).entries()
            path.z, path.first, path.second = path.z + size, path.first + slope, path.second + curvature
        return path


def _duration(spread: float, speed: float) -> float:
    """About how long motions that differ by ``spread`` in z take to pass a boundary, in mesh periods."""
    return spread / max(speed, math.sqrt(_CURVATURE * spread), 1e-300)
