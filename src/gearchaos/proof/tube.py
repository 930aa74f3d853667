"""One mesh period of all motions about one, the centre: their images, slopes and contact switches.

Any two motions of a tube differ by δ with δ' = (A - κ(t) b e1ᵀ) δ for some κ(t) from 0 to χ(t), since the backlash
function has slopes from 0 to 1. Where all motions are in one contact state, κ is 0 or χ; it is unknown only in the time
windows in which they switch. The product of these flows is a matrix of balls, the slopes: it contains a matrix S with
P(x) - P(y) = S (x - y) for any two states, and the derivative of P wherever that exists. So nothing need be known of
derivatives, and grazing is no obstacle.

What is uncertain decides how differences from the centre are followed: the start (`StartTube`, all a proof of one orbit
needs), the place on a segment of states (`SegmentTube`), or parameters too (`families.boxes`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

from flint import arb, arb_mat

from gearchaos.proof.balls import ball, block, interval, least, magnitude, rounded, unit, with_one
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import Cell, MeshEquations
from gearchaos.proof.motion import Displacement, Switch, Trajectory, clearance, clearance_by_bounds, trajectory

WIDENING = 2  # width of a window relative to the spread of the switches to first order
_ENCLOSURES = 8  # most attempts at an enclosure of the states in a window


class Coefficients(Protocol):
    """Of the equations, for one model or all models of a box: see `MeshEquations`."""

    matrix: arb_mat
    spring: arb_mat
    norms: tuple[float, float]
    stiffness: arb

    def forcing_over(self, low: arb, high: arb) -> list[arb]: ...


@dataclass(frozen=True)
class Window:
    """A time window of contact switches; there is none outside windows.

    If it has one switch of the centre, with the number ``first`` = ``last``, every motion has exactly one in it.
    """

    low: arb  # exact, in mesh periods after the section
    high: arb
    flank: int  # 1 or -1
    into_contact: bool  # False where contact is lost
    first: int = 0
    last: int = 0


class Tube:
    """The motions about ``centre`` while they are followed through a mesh period; the base of all tubes."""

    def __init__(self, equations: MeshEquations, centre: Trajectory) -> None:
        self.equations, self.centre, self.dimension = equations, centre, equations.dimension
        self.coefficients: Coefficients = equations

    def follow(self, windows: list[Window]) -> None:
        """Follow the motions from section to section; raises `UndecidedError` unless windows follow each other."""
        for before, after in pairwise(windows):
            if not before.high < after.low:
                raise UndecidedError("windows overlap", least(after.low - before.high))
        if windows and not (windows[0].low > 0 and windows[-1].high < 1):
            gap = min(least(windows[0].low), least(1 - windows[-1].high))
            raise UndecidedError("section on the contact boundary", gap)
        part, time = 0, arb(0)
        for window in (*windows, None):
            until = window.low if window else arb(1)
            for index, cell in enumerate(self.equations.cells):  # those between both times, in one contact state
                if _later(cell.end, time) and _later(until, cell.begin):
                    self._piece(part, index, (time - cell.begin) / cell.span if _later(time, cell.begin) else arb(0),
                                (until - cell.begin) / cell.span if _later(cell.end, until) else arb(1))
            if window:
                self._through(window)
                part, time = window.last + 1, window.high

    def _piece(self, part: int, index: int, first: arb, last: arb) -> None:
        """Follow the motions from the share ``first`` to the share ``last`` of a cell, in one contact state."""
        raise NotImplementedError

    def _through(self, window: Window) -> None:
        """Follow the motions through a window of switches, in which κ is anything from 0 to χ."""
        raise NotImplementedError

    def _window(self, number: int, half: float, digits: int) -> Window:
        """The window about a switch of the centre, with half its width given, and about so many digits of that."""
        switch = self.centre.switches[number]
        places = digits - math.floor(math.log2(half))
        low, high = (ball(rounded(switch.time + side * half, places)) for side in (-1, 1))
        return Window(low, high, switch.flank, switch.into_contact, number, number)

    def _states_in(self, window: Window, states: arb_mat) -> tuple[arb_mat, float]:
        """An enclosure (d, 1) of the states in a window from those (d, 1) at its start, and the least speed.

        Raises `UndecidedError` unless z' has one sign: then every motion passes the boundary once. Windows of several
        switches of the centre need not have one, as motions may pass it any number of times there.
        """
        found = enclosure(self.coefficients, states, window)
        speed = (window.flank if window.into_contact else -window.flank) * found[1, 0]
        if window.first == window.last and not speed > 0:
            raise UndecidedError("tangency undecided", least(speed))
        return found, least(speed)


def _later(time: arb, other: arb) -> bool:
    """Whether a time is later than another; raises `UndecidedError` if the balls do not tell."""
    if not (time > other or time <= other):
        raise UndecidedError("bits exhausted", -magnitude(time - other))
    return bool(time > other)


def speed_at(switch: Switch) -> float:
    """An upper bound of the speed at a switch of the centre; raises `UndecidedError` if it may be 0."""
    if not (switch.rate > 0 or switch.rate < 0):
        raise UndecidedError("tangency undecided", least(abs(switch.rate)))
    return magnitude(switch.rate)


def enclosure(coefficients: Coefficients, states: arb_mat, window: Window) -> arb_mat:
    """A box of states (d, 1) that the equations map into itself: no motion leaves it during a window."""
    duration = window.high - window.low
    span = interval(0, duration)
    forcing = arb_mat(states.nrows(), 1, coefficients.forcing_over(window.low, window.high))

    def later(box: arb_mat) -> arb_mat:
        force = coefficients.stiffness * (box[0, 0] - window.flank)
        return states + span * (coefficients.matrix * box + forcing - force * coefficients.spring)

    trial = later(later(states))
    for _ in range(_ENCLOSURES):
        wide = trial + (trial - trial.mid()) * arb(0, 0.1)
        trial = later(wide)
        if wide.contains(trial):
            return trial
    raise UndecidedError("tangency undecided", -magnitude(duration))


def slopes_through(coefficients: Coefficients, duration: arb) -> arb_mat:
    """Slopes (d, d) of the motions through a window of unknown contact: κ is anything from 0 to χ.

    By variation of constants they are e^(ηA) - ∫ e^((η-s)A) b κ(s) e1ᵀ B(s) ds, with B the slopes up to time s,
    which differ from the unit matrix by at most e^(ηN) - 1; N bounds the norm of A - κ b e1ᵀ.
    """
    a, b, d = coefficients.matrix, coefficients.spring, coefficients.matrix.nrows()
    norm_a, norm_b = coefficients.norms
    change = arb(0, magnitude((duration * largest_rate(coefficients)).expm1()))
    size = magnitude((duration * norm_a).expm1()) * norm_b
    pushed = b + interval(0, duration) * (a * (b + arb_mat(d, 1, [arb(0, size)] * d)))
    row = arb_mat(1, d, [int(j == 0) + change for j in range(d)]) * (coefficients.stiffness * duration)
    return (a * duration).exp() - pushed * row


def largest_rate(coefficients: Coefficients) -> float:
    """N, a bound of the norm of A - κ b e1ᵀ for κ from 0 to χ."""
    norm_a, norm_b = coefficients.norms
    return norm_a + norm_b * magnitude(coefficients.stiffness)


class StartTube(Tube):
    """The motions from a box of states; they lie in w(t) + S(t) (box - centre), with w the motion from the centre.

    The slopes are ``flow`` times ``first_slopes``: those since the last window and those at its end. Multiplied cell by
    cell, the wide balls of the latter would grow with the norm of each cell.

    ``box`` are states (d, 1) of any radii, ``centre`` the motion from its midpoint, if it is known. ``image`` (d, 1)
    contains the states of all motions after the mesh period, ``slopes`` (d, d) an S with P(x) - P(y) = S (x - y) for
    any x, y of the box. Every motion has exactly one switch in each of the ``windows``, which are in order of time.
    ``margins`` are the least "distance" of |z| from 1 outside them and the least "speed" |z'| in them.
    """

    def __init__(self, equations: MeshEquations, box: arb_mat, centre: Trajectory | None = None) -> None:
        centre = centre or trajectory(equations, box.mid())
        super().__init__(equations, centre)
        d = self.dimension
        self.offset, self.states = box - box.mid(), box
        self.margins = {"distance": math.inf, "speed": math.inf}
        self.first_slopes, self.flow = block(unit(d + 1), d + 1, range(d)), unit(d + 1)
        self.windows = list[Window]()
        for number, switch in enumerate(centre.switches):  # twice the spread of the box, over the speed at the switch
            spread = math.fsum(magnitude(switch.slopes[0, j]) * magnitude(self.offset[j, 0]) for j in range(d))
            half = WIDENING * spread / speed_at(switch) + 4 * magnitude(switch.time - switch.time.mid())
            half = max(half, 2.0 ** (24 - equations.bits))
            if not half < 1:
                raise UndecidedError("tangency undecided", 1 - half)
            self.windows.append(self._window(number, half, 8))
        self.follow(self.windows)
        self.slopes = block(self.flow * self.first_slopes, d, range(d))
        self.image = centre.image + self.slopes * self.offset

    def _piece(self, part: int, index: int, first: arb, last: arb) -> None:
        contact = self.centre.contacts[part]
        flow, centre = self.equations.flow(index, contact), self.centre.starts[part, index]
        before, at_start, entry = self.flow, self.flow, centre
        if not first.is_zero():
            forward = flow.at(first)
            at_start, entry = forward.solve(before), forward * centre
        advance = flow.end if last == 1 else flow.at(last)
        self.flow = advance * at_start
        states = centre + at_start * self.first_slopes * self.offset
        self.states = advance * centre + self.flow * self.first_slopes * self.offset
        whole = first.is_zero() and last == 1
        found = clearance_by_bounds(flow.bounds * states, contact) if whole else None
        if found is None:
            start = (entry + before * self.first_slopes * self.offset)[0, 0]
            found = clearance(Displacement(flow.polynomial(states)), contact, first, last, start, self.states[0, 0])
        self.margins["distance"] = min(self.margins["distance"], found)

    def _through(self, window: Window) -> None:
        _, speed = self._states_in(window, block(self.states, self.dimension, range(1)))
        self.margins["speed"] = min(self.margins["speed"], speed)
        slopes = with_one(slopes_through(self.coefficients, window.high - window.low))
        self.first_slopes = slopes * (self.flow * self.first_slopes)
        self.flow = unit(self.dimension + 1)


_CURVATURE = 10.0  # about the largest z″ in units of a mesh period, by which the duration of a graze is estimated
_LEAST = 2.0**-20  # least duration for which contact is taken as unknown, in mesh periods
_SHORTEST = 0.25  # least interval that is divided, relative to the estimated duration for which contact is unknown


class SegmentTube(Tube):
    """The motions from the points c + t h, -1 <= t <= 1, whatever their contact switches are.

    They differ from the motion from c, the centre, by t v + r, where v, r (d + 1, 1) are ``change`` and ``rest``; both
    change by the slopes. Where a contact state is not proved to be the same for all motions, because they switch at
    different times, or some graze a boundary and others do not, κ is anything from 0 to χ, which needs no other proof.
    So an image is found for every segment, near a grazing motion a wider one.

    Without ``forcing_change`` r is 0. Where the forcing is unknown by at most G, r also grows over a
    duration η by at most η G e^(ηN), with N a bound of the norm of the equations.
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


def segment_image(equations: MeshEquations, centre: arb_mat, half: arb_mat,
                  forcing_change: float = 0.0) -> tuple[arb_mat, arb_mat]:
    """Two vectors p and v, each (d, 1), such that P(c + t h) lies in p + t v for -1 <= t <= 1.

    ``centre`` is c, (d, 1), with radii near the rounding unit, ``half`` is h, (d, 1). It holds for every change of
    T f(τ) in z'' by at most ``forcing_change``, G, see `MeshEquations.forcing_change`. Raises `UndecidedError` if the
    contact switches of the motion from c are not decided.
    """
    tube = SegmentTube(equations, trajectory(equations, centre), half, forcing_change)
    rest, change = (block(vector, equations.dimension, range(1)) for vector in (tube.rest, tube.change))
    return tube.centre.image + rest, change
