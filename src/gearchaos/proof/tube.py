"""One mesh period of all motions from a box of states: their image, their slopes and their contact switches.

Any two motions from the box differ by δ with δ' = (A - κ(t) b e1ᵀ) δ for some κ(t) from 0 to χ(t), since the backlash
function has slopes from 0 to 1. Where all motions of the box are in one contact state, κ is 0 or χ; it is unknown only
in the time windows in which they switch. The product of these flows is a matrix of balls, the slopes: it contains a
matrix S with P(x) - P(y) = S (x - y) for any two states of the box, and the derivative of P wherever that exists. So
nothing need be known of derivatives, and grazing is no obstacle.

All motions from the box lie in w(t) + S(t) (box - centre), with w the motion from the centre (`trajectory`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from flint import arb, arb_mat

from gearchaos.proof.balls import ball as exact
from gearchaos.proof.balls import block, interval, least, magnitude, rounded, unit
from gearchaos.proof.crossing import Displacement, UndecidedError, clearance, clearance_by_bounds
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.trajectory import Switch, Trajectory, trajectory

_WIDENING = 2
"""Width of a window relative to the spread of the switches to first order."""

_ENCLOSURES = 8
"""Most attempts at an enclosure of the states in a window."""


@dataclass(frozen=True)
class Window:
    """A time window in which every motion of the box has exactly one contact switch; there is none outside windows.

    Attributes
    ----------
    low, high : arb
        Its ends, exact, in mesh periods after the section.
    flank : int
        1 or -1.
    into_contact : bool
        False where contact is lost.
    """

    low: arb
    high: arb
    flank: int
    into_contact: bool


@dataclass(frozen=True)
class Tube:
    """What `period_tube` proves.

    Attributes
    ----------
    image : arb_mat
        Contains the states after one mesh period of all motions from the box, (d, 1).
    slopes : arb_mat
        Contains a matrix S with P(x) - P(y) = S (x - y) for any x, y of the box, (d, d).
    windows : list of Window
        In order of time.
    margins : dict of str to float
        "distance": least distance of \\|z\\| from 1 outside the windows; "speed": least \\|z'\\| in them (infinite if
        there are none).
    trajectory : Trajectory
        The motion from the centre of the box.
    """

    image: arb_mat
    slopes: arb_mat
    windows: list[Window]
    margins: dict[str, float]
    trajectory: Trajectory


def period_tube(equations: MeshEquations, box: arb_mat, centre: Trajectory | None = None) -> Tube:
    """The motions from a box of states over one mesh period from the section on.

    Parameters
    ----------
    equations : MeshEquations
        Made at the precision that is set.
    box : arb_mat
        States, (d, 1), of any radii.
    centre : Trajectory, optional
        The motion from the midpoint of the box, if it is known.

    Raises
    ------
    UndecidedError
        With the reason and margin of what could not be proved.
    """
    centre = centre or trajectory(equations, box.mid())
    return _Tube(equations, box, centre).result()


class _Tube:
    """The states and slopes of a box while they are followed through a mesh period.

    The slopes are ``flow`` times ``first_slopes``: those since the last window and those at its end. Multiplied cell by
    cell, the wide balls of the latter would grow with the norm of each cell.
    """

    def __init__(self, equations: MeshEquations, box: arb_mat, centre: Trajectory) -> None:
        self.equations, self.centre, self.dimension = equations, centre, equations.dimension
        self.offset = box - box.mid()
        self.distance = self.speed = math.inf
        self.first_slopes = arb_mat(self.dimension + 1, self.dimension,
                                    [int(i == j) for i in range(self.dimension + 1) for j in range(self.dimension)])
        self.flow = unit(self.dimension + 1)

    def result(self) -> Tube:
        """Follow the box from section to section."""
        windows = [self._window(switch) for switch in self.centre.switches]
        self._check_order(windows)
        ends = [arb(0), *(w.high for w in windows)], [*(w.low for w in windows), arb(1)]
        for segment, (low, high) in enumerate(zip(*ends, strict=True)):
            states = self._between(segment, low, high)
            if segment < len(windows):
                self._through(windows[segment], states)
        slopes = block(self.flow * self.first_slopes, self.dimension, range(self.dimension))
        image = self.centre.image + slopes * self.offset
        return Tube(image, slopes, windows, {"distance": self.distance, "speed": self.speed}, self.centre)

    def _window(self, switch: Switch) -> Window:
        """The window of a switch: twice the spread of the box, over the speed with which the centre crosses."""
        spread = math.fsum(
            magnitude(switch.slopes[0, j]) * magnitude(self.offset[j, 0]) for j in range(self.dimension))
        speed = magnitude(switch.rate)
        if not (switch.rate > 0 or switch.rate < 0):
            raise UndecidedError("tangency undecided", least(abs(switch.rate)))
        half = _WIDENING * spread / speed + 4 * magnitude(switch.time - switch.time.mid())
        half = max(half, 2.0 ** (24 - self.equations.bits))
        if not half < 1:
            raise UndecidedError("tangency undecided", 1 - half)
        digits = 8 - math.floor(math.log2(half))
        low, high = (exact(rounded(switch.time + side * half, digits)) for side in (-1, 1))
        return Window(low, high, switch.flank, switch.into_contact)

    def _check_order(self, windows: list[Window]) -> None:
        """Raise `UndecidedError` unless the windows follow each other within the period."""
        for before, after in pairwise(windows):
            if not before.high < after.low:
                raise UndecidedError("windows overlap", least(after.low - before.high))
        if windows and not (windows[0].low > 0 and windows[-1].high < 1):
            gap = min(least(windows[0].low), least(1 - windows[-1].high))
            raise UndecidedError("section on the contact boundary", gap)

    def _between(self, segment: int, low: arb, high: arb) -> arb_mat:
        """Follow the box from one window to the next; the states (d, 1) at the end."""
        contact = self.centre.contacts[segment]
        for index, cell in enumerate(self.equations.cells):
            if not (_later(cell.end, low) and _later(high, cell.begin)):
                continue
            first = (low - cell.begin) / cell.span if _later(low, cell.begin) else arb(0)
            last = (high - cell.begin) / cell.span if _later(cell.end, high) else arb(1)
            states = self._cell(segment, index, contact, first, last)
        return states

    def _cell(self, segment: int, index: int, contact: int, first: arb, last: arb) -> arb_mat:
        """Follow the box from the share ``first`` to the share ``last`` of a cell; the states (d, 1) there."""
        flow, centre = self.equations.flow(index, contact), self.centre.starts[segment, index]
        before, at_start, entry = self.flow, self.flow, centre
        if not first.is_zero():
            forward = flow.at(first)
            at_start, entry = forward.solve(before), forward * centre
        advance = flow.end if last == 1 else flow.at(last)
        self.flow = advance * at_start
        states = centre + at_start * self.first_slopes * self.offset
        final = advance * centre + self.flow * self.first_slopes * self.offset
        found = None
        if first.is_zero() and last == 1:
            found = clearance_by_bounds(flow.bounds * states, contact)
        if found is None:
            start = (entry + before * self.first_slopes * self.offset)[0, 0]
            path = Displacement(flow.polynomial(states))
            found = clearance(path, contact, first, last, start, final[0, 0])
        self.distance = min(self.distance, found)
        return final

    def _through(self, window: Window, states: arb_mat) -> None:
        """Follow the box through a window of switches, in which κ is anything from 0 to χ."""
        duration = window.high - window.low
        enclosure = self._enclosure(window, block(states, self.dimension, range(1)), duration)
        speed = (window.flank if window.into_contact else -window.flank) * enclosure[1, 0]
        if not speed > 0:
            raise UndecidedError("tangency undecided", least(speed))
        self.speed = min(self.speed, least(speed))
        self.first_slopes = self._slopes_through(duration) * (self.flow * self.first_slopes)
        self.flow = unit(self.dimension + 1)

    def _enclosure(self, window: Window, states: arb_mat, duration: arb) -> arb_mat:
        """States (d, 1) that no motion of the box leaves during a window: a box that the equations map into itself."""
        equations, span = self.equations, interval(0, duration)
        forcing = arb_mat(self.dimension, 1, equations.forcing_over(window.low, window.high))

        def later(box: arb_mat) -> arb_mat:
            force = equations.stiffness * (box[0, 0] - window.flank)
            return states + span * (equations.matrix * box + forcing - force * equations.spring)

        trial = later(later(states))
        for _ in range(_ENCLOSURES):
            wide = trial + (trial - trial.mid()) * arb(0, 0.1)
            trial = later(wide)
            if wide.contains(trial):
                return trial
        raise UndecidedError("tangency undecided", -magnitude(duration))

    def _slopes_through(self, duration: arb) -> arb_mat:
        """Slopes (d + 1, d + 1) of the motions through a window.

        By variation of constants they are e^(ηA) - ∫ e^((η-s)A) b κ(s) e1ᵀ B(s) ds, with B the slopes up to time s,
        which differ from the unit matrix by at most e^(ηN) - 1; N bounds the norm of A - κ b e1ᵀ.
        """
        a, b, d = self.equations.matrix, self.equations.spring, self.dimension
        norm_a, norm_b = self.equations.norms
        bound = norm_a + norm_b * magnitude(self.equations.stiffness)
        change = arb(0, magnitude((duration * bound).expm1()))
        size = magnitude((duration * norm_a).expm1()) * norm_b
        pushed = b + interval(0, duration) * (a * (b + arb_mat(d, 1, [arb(0, size)] * d)))
        row = arb_mat(1, d, [int(j == 0) + change for j in range(d)]) * (self.equations.stiffness * duration)
        slopes = (a * duration).exp() - pushed * row
        out = arb_mat(d + 1, d + 1)
        for i in range(d):
            for j in range(d):
                out[i, j] = slopes[i, j]
        out[d, d] = 1
        return out


def _later(time: arb, other: arb) -> bool:
    """Whether a time is later than another; raises `UndecidedError` if the balls do not tell."""
    if time > other:
        return True
    if time <= other:
        return False
    raise UndecidedError("bits exhausted", -magnitude(time - other))
