"""The image of a segment of states under one mesh period, whatever the contact switches of the motions are.

The motions from the points c + t h, -1 <= t <= 1, differ from the one from c by t times a vector. It changes by the
slopes of `tube`. Where a contact state is not proved to be the same for all of them, because they switch at different
times, or some graze a boundary and others do not, κ is anything from 0 to χ, which needs no other proof. So an image is
found for every segment, near a grazing motion a wider one.

Where the forcing is unknown by at most G, the motions differ from the one from c by a further vector r. It changes by
the same slopes and over a duration η by at most η G e^(ηN), with N a bound of the norm of the equations.
"""

from __future__ import annotations

import math

from flint import arb, arb_mat

from gearchaos.proof.balls import block, magnitude, with_one
from gearchaos.proof.crossing import Displacement, UndecidedError, clearance, clearance_by_bounds
from gearchaos.proof.equations import Cell, MeshEquations
from gearchaos.proof.tube import Trajectory, Tube, largest_rate, slopes_through, trajectory

_CURVATURE = 10.0
"""About the largest z″ in units of a mesh period, by which the duration of a graze is estimated."""

_LEAST = 2.0**-20
"""Least duration for which contact is taken as unknown, in mesh periods."""

_SHORTEST = 0.25
"""Least interval that is divided, relative to the estimated duration for which contact is unknown."""


def segment_image(
    equations: MeshEquations, centre: arb_mat, half: arb_mat, forcing_change: float = 0.0
) -> tuple[arb_mat, arb_mat]:
    """The image of a segment of states c + t h, -1 <= t <= 1, after one mesh period from the section on.

    ``centre`` is c, (d, 1), with radii near the rounding unit, ``half`` is h, (d, 1). At most ``forcing_change``, G, is
    added to T f(τ) in z'', see `MeshEquations.forcing_change`.

    Returns
    -------
    arb_mat, arb_mat
        p and v, each (d, 1): P(c + t h) lies in p + t v, for every such change of the forcing.

    Raises
    ------
    UndecidedError
        If the contact switches of the motion from c are not decided.
    """
    tube = SegmentTube(equations, trajectory(equations, centre), half, forcing_change)
    rest, change = (block(vector, equations.dimension, range(1)) for vector in (tube.rest, tube.change))
    return tube.centre.image + rest, change


class SegmentTube(Tube):
    """The motions from a segment.

    Attributes
    ----------
    change, rest : arb_mat
        v, (d + 1, 1), and r, (d + 1, 1): the motion from c + t h is at t v + r from the motion from c.
    """

    def __init__(self, equations: MeshEquations, centre: Trajectory, half: arb_mat, forcing_change: float) -> None:
        super().__init__(equations, centre)
        self.change = arb_mat(self.dimension + 1, 1, [*half.entries(), 0])
        self.rest = arb_mat(self.dimension + 1, 1)
        self.forcing_change, self.rate = forcing_change, largest_rate(equations)
        windows = []
        for number, switch in enumerate(centre.switches):  # about as long as others switch; they need not do so in it
            spread = magnitude((block(switch.slopes, 1, range(self.dimension)) * half)[0, 0]) + forcing_change
            rounding = magnitude(switch.time - switch.time.mid())
            duration = max(2 * _duration(spread, magnitude(switch.rate)), 4 * rounding, _LEAST)
            windows.append(self._window(number, duration, 8))
            if not windows[-1].low < switch.time < windows[-1].high:
                raise UndecidedError("bits exhausted", -duration)
        for index, cell in enumerate(equations.cells):
            at = arb(0)
            shares = [((w.low - cell.begin) / cell.span, (w.high - cell.begin) / cell.span) for w in windows]
            ends = [(low.lower().mid().max(arb(0)), high.upper().mid().min(arb(1))) for low, high in shares]
            for low, high in ends:  # of the windows, exact, in order of time, and none within another's
                if not low < high:  # the window is in another cell
                    continue
                if low > at:
                    self._advance(index, at, low, self._part(cell, at))
                    at = low
                if high > at:
                    self._unknown(cell, at, high)
                    at = high
            if at < 1:
                self._advance(index, at, arb(1), self._part(cell, at))

    def _part(self, cell: Cell, share: arb) -> int:
        """The number of switches of the centre before a share of a cell; raises `UndecidedError` if one may be then."""
        time, switches = cell.begin + share * cell.span, self.centre.switches
        before = sum(bool(s.time < time) for s in switches)
        if before + sum(bool(s.time > time) for s in switches) != len(switches):
            raise UndecidedError("bits exhausted", 0.0)
        return before

    def _advance(self, index: int, low: arb, high: arb, part: int) -> None:
        """Follow the segment from a share of a cell to another, between which the centre has no switch."""
        if self._known(index, low, high, part):
            return
        cell = self.equations.cells[index]
        speed = magnitude(self.equations.duration * self.centre.at(self.equations, part, index, low)[1, 0])
        shortest = _SHORTEST * _duration(magnitude(self.change[0, 0]) + magnitude(self.rest[0, 0]), speed)
        if magnitude((high - low) * cell.span) < max(shortest, _LEAST):
            self._unknown(cell, low, high)
            return
        middle = ((low + high) / 2).mid()
        self._advance(index, low, middle, part)
        self._advance(index, middle, high, part)

    def _known(self, index: int, low: arb, high: arb, part: int) -> bool:
        """Follow the segment as far as ``high`` if all its motions are proved to be in the centre's contact state."""
        contact, start, span = self.centre.contacts[part], self.centre.starts[part, index], arb(0, 1)
        flow, cell = self.equations.flow(index, contact), self.equations.cells[index]
        entry, advance = flow.at(low), flow.end if high == 1 else flow.at(high)
        back, added = entry.inv(), self._added((high - low) * cell.span)
        step = advance * back
        change, rest = step * self.change, step * self.rest + added
        states = start + back * self.change * span + back * self.rest
        slope = cell.span * self.rate * added[0, 0]  # what an unknown forcing adds to z, dz/du and d²z/du²
        errors = added[0, 0], slope, cell.span * self.rate * (slope + cell.span * arb(0, self.forcing_change))
        bounds = flow.bounds * states + arb_mat(4, 1, [errors[0], *errors])
        if not (low.is_zero() and high == 1) or clearance_by_bounds(bounds, contact) is None:
            z_low = (entry * start + self.change * span + self.rest)[0, 0]
            z_high = (advance * start + change * span + rest)[0, 0]
            path = Displacement(flow.polynomial(states), errors if self.forcing_change else ())
            try:
                clearance(path, contact, low, high, z_low, z_high)
            except UndecidedError:
                return False
        self.change, self.rest = change, rest
        return True

    def _unknown(self, cell: Cell, low: arb, high: arb) -> None:
        """Follow the segment from a share of a cell to another, between which contact is unknown."""
        duration = (high - low) * cell.span
        slopes = with_one(slopes_through(self.equations, duration))
        self.change, self.rest = slopes * self.change, slopes * self.rest + self._added(duration)

    def _added(self, duration: arb) -> arb_mat:
        """What an unknown forcing adds to the state in a duration: balls (d + 1, 1) about 0."""
        if not self.forcing_change:
            return arb_mat(self.dimension + 1, 1)
        size = self.forcing_change * duration * (duration * self.rate).exp()
        return arb_mat(self.dimension + 1, 1, [arb(0, size.upper())] * self.dimension + [arb(0)])


def _duration(spread: float, speed: float) -> float:
    """About how long motions that differ by ``spread`` in z take to pass a boundary, in mesh periods."""
    return spread / max(speed, math.sqrt(_CURVATURE * spread), 1e-300)
