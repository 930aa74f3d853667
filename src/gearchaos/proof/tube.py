"""One mesh period of motions: of one from a state, and of all motions about one, the centre.

`trajectory` follows one motion and locates every contact switch in a narrow ball. A tube has the images of all motions
about it, their slopes and their contact switches.

Any two motions of a tube differ by δ with δ' = (A - κ(t) b e1ᵀ) δ for some κ(t) from 0 to χ(t), since the backlash
function has slopes from 0 to 1. Where all motions are in one contact state, κ is 0 or χ; it is unknown only in the time
windows in which they switch. The product of these flows is a matrix of balls, the slopes: it contains a matrix S with
P(x) - P(y) = S (x - y) for any two states, and the derivative of P wherever that exists. So nothing need be known of
derivatives, and grazing is no obstacle.

What is uncertain decides how differences from the centre are followed: the start (`StartTube`, all a proof of one orbit
needs), parameters too (`families.parameter_tube`), or the place on a segment of states (`families.segment`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Protocol

from flint import arb, arb_mat

from gearchaos.proof.balls import ball, block, interval, least, magnitude, rounded, unit, with_one
from gearchaos.proof.crossing import (
    Displacement,
    UndecidedError,
    clearance,
    clearance_by_bounds,
    crossing_time,
    first_crossing,
)
from gearchaos.proof.equations import MeshEquations

_MOST_SWITCHES = 500
"""Most contact switches in one mesh period."""


@dataclass(frozen=True)
class Switch:
    """A contact switch of the motion."""

    time: arb  # in mesh periods after the section
    flank: int  # 1 or -1
    into_contact: bool  # False where contact is lost
    rate: arb  # dz/dt, per mesh period
    slopes: arb_mat  # derivative (d, d) of the state there with respect to that at the section


@dataclass
class Trajectory:
    """The motion from one state over one mesh period.

    Its parts between switches are numbered from 0; part i ends with switch i. In a part the motion follows the frozen
    equations of one contact state, which is proved together with the tube about it.

    ``starts`` has, by number of the part and of the cell, (w, 1) at the start of the cell, from where the frozen
    equations lead to the motion in the part. If the part begins within the cell, it is no state of the motion.
    """

    contacts: list[int]  # the contact state in each part
    switches: list[Switch] = field(default_factory=list)  # in order of time
    starts: dict[tuple[int, int], arb_mat] = field(default_factory=dict)
    image: arb_mat = field(default_factory=lambda: arb_mat(0, 0))  # the state after one mesh period, (d, 1)
    derivative: arb_mat = field(default_factory=lambda: arb_mat(0, 0))  # of the image by the state at the section

    def at(self, equations: MeshEquations, part: int, cell: int, share: arb) -> arb_mat:
        """The state (w, 1), (d + 1, 1), at a share of a cell by the frozen equations of a part."""
        return equations.flow(cell, self.contacts[part]).at(share) * self.starts[part, cell]


def trajectory(equations: MeshEquations, state: arb_mat) -> Trajectory:
    """The motion over one mesh period from a state (d, 1) at the section, exact or with radii near the rounding unit.

    Raises `UndecidedError` if the state is on a contact boundary, or a switch cannot be told from a touch.
    """
    d = equations.dimension
    motion = Trajectory([contact_state(state[0, 0])])
    both = arb_mat(d + 1, d + 1, [state[i, 0] if j == 0 else int(i == j - 1) for i in range(d) for j in range(d + 1)]
                   + [int(j == 0) for j in range(d + 1)])
    for index, cell in enumerate(equations.cells):  # ``both`` has the columns (w, 1) and (derivative of w, 0)
        low, leaving = arb(0), None
        while True:
            contact = motion.contacts[-1]
            flow, start = equations.flow(index, contact), block(both, d + 1, range(1))
            motion.starts[len(motion.switches), index] = start
            if leaving is None and clearance_by_bounds(flow.bounds * start, contact) is not None:
                break
            path = Displacement(flow.polynomial(start))
            crossing = first_crossing(path, contact, low, arb(1), leaving)
            if crossing is None:
                break
            low, leaving = crossing_time(path, crossing), crossing.flank
            there = flow.at(low) * both
            motion.contacts.append(0 if contact else leaving)
            both = equations.flow(index, motion.contacts[-1]).at(low).solve(there)
            if len(motion.switches) == _MOST_SWITCHES:
                raise UndecidedError("too many switches", 0.0)
            motion.switches.append(Switch(
                cell.begin + low * cell.span, leaving, motion.contacts[-1] != 0, equations.duration * there[1, 0],
                block(there, d, range(1, d + 1))))
        both = flow.end * both
    motion.image = block(both, d, range(1))
    motion.derivative = block(both, d, range(1, d + 1))
    return motion


def contact_state(z: arb) -> int:
    """The contact state at a section from z; raises `UndecidedError` if the ball contains 1 or -1."""
    if z > 1 or z < -1:
        return 1 if z > 0 else -1
    if abs(z) < 1:
        return 0
    raise UndecidedError("section on the contact boundary", -magnitude(abs(z) - 1))


_WIDENING = 2
"""Width of a window relative to the spread of the switches to first order."""

_ENCLOSURES = 8
"""Most attempts at an enclosure of the states in a window."""


class Coefficients(Protocol):
    """Of the equations, for one model or all models of a box: see `MeshEquations`."""

    matrix: arb_mat
    spring: arb_mat
    norms: tuple[float, float]
    stiffness: arb

    def forcing_over(self, low: arb, high: arb) -> list[arb]:
        """T f(τ) from time ``low`` to ``high``, as balls (d)."""


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
            for index, first, last in pieces(self.equations, time, window.low if window else arb(1)):
                self._piece(part, index, first, last)
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

    def _states_in(self, window: Window, states: arb_mat) -> arb_mat:
        """An enclosure (d, 1) of the states in a window from those (d, 1) at its start.

        Raises `UndecidedError` unless z' has one sign: then every motion passes the boundary once. Windows of several
        switches of the centre need not have one, as motions may pass it any number of times there.
        """
        found = enclosure(self.coefficients, states, window)
        speed = (window.flank if window.into_contact else -window.flank) * found[1, 0]
        if window.first == window.last and not speed > 0:
            raise UndecidedError("tangency undecided", least(speed))
        return found


def pieces(equations: MeshEquations, low: arb, high: arb) -> Iterator[tuple[int, arb, arb]]:
    """The numbers of the cells between two times, with the shares of each between which they lie."""
    for index, cell in enumerate(equations.cells):
        if _later(cell.end, low) and _later(high, cell.begin):
            yield (index, (low - cell.begin) / cell.span if _later(low, cell.begin) else arb(0),
                   (high - cell.begin) / cell.span if _later(cell.end, high) else arb(1))


def _later(time: arb, other: arb) -> bool:
    """Whether a time is later than another; raises `UndecidedError` if the balls do not tell."""
    if time > other:
        return True
    if time <= other:
        return False
    raise UndecidedError("bits exhausted", -magnitude(time - other))


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

    ``box`` are states (d, 1) of any radii, ``centre`` the motion from its midpoint, if it is known.

    Attributes
    ----------
    image : arb_mat
        Contains the states after one mesh period of all motions from the box, (d, 1).
    slopes : arb_mat
        Contains a matrix S with P(x) - P(y) = S (x - y) for any x, y of the box, (d, d).
    windows : list of Window
        In order of time, with exactly one switch of every motion in each.
    margins : dict of str to float
        "distance": least distance of \\|z\\| from 1 outside the windows; "speed": least \\|z'\\| in them (infinite if
        there are none).
    """

    def __init__(self, equations: MeshEquations, box: arb_mat, centre: Trajectory | None = None) -> None:
        centre = centre or trajectory(equations, box.mid())
        super().__init__(equations, centre)
        d = self.dimension
        self.offset, self.states = box - box.mid(), box
        self.margins = {"distance": math.inf, "speed": math.inf}
        self.first_slopes = arb_mat(d + 1, d, [int(i == j) for i in range(d + 1) for j in range(d)])
        self.flow = unit(d + 1)
        self.windows = list[Window]()
        for number, switch in enumerate(centre.switches):  # twice the spread of the box, over the speed at the switch
            spread = math.fsum(magnitude(switch.slopes[0, j]) * magnitude(self.offset[j, 0]) for j in range(d))
            half = _WIDENING * spread / speed_at(switch) + 4 * magnitude(switch.time - switch.time.mid())
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
        found = None
        if first.is_zero() and last == 1:
            found = clearance_by_bounds(flow.bounds * states, contact)
        if found is None:
            start = (entry + before * self.first_slopes * self.offset)[0, 0]
            path = Displacement(flow.polynomial(states))
            found = clearance(path, contact, first, last, start, self.states[0, 0])
        self.margins["distance"] = min(self.margins["distance"], found)

    def _through(self, window: Window) -> None:
        states = self._states_in(window, block(self.states, self.dimension, range(1)))
        speed = (window.flank if window.into_contact else -window.flank) * states[1, 0]
        self.margins["speed"] = min(self.margins["speed"], least(speed))
        slopes = with_one(slopes_through(self.coefficients, window.high - window.low))
        self.first_slopes = slopes * (self.flow * self.first_slopes)
        self.flow = unit(self.dimension + 1)
