"""One motion over a mesh period, with every contact switch located in a narrow ball.

Its relative displacement z is a polynomial on each cell. The distance from a contact boundary is y = ±z ± 1, positive
while the contact state lasts. On an interval of width h it is positive if it is at both ends and one of these holds:

- chord: y lies at most h²/8 max y″ below its chord (not at all where y″ <= 0);
- monotony: y' has one sign;
- minimum: y″ >= m > 0, and y(u) - y'(u)²/(2m) > 0 at some u, a bound of the minimum.

Otherwise the interval is halved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from flint import arb, arb_mat, arb_poly, ctx

from gearchaos.proof.balls import block, interval, least, magnitude
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations

_DEEPEST = 60  # most halvings of an interval
_MOST_SWITCHES = 500  # most contact switches in one mesh period


class Boundary(NamedTuple):
    """The contact boundary z = flank, from which a motion is at y = sign z + offset."""

    flank: int
    sign: int
    offset: int

    def distance(self, z: arb) -> arb:
        """y."""
        return self.sign * z + self.offset


# The boundaries at which each contact state can end:
BOUNDARIES = {0: (Boundary(1, -1, 1), Boundary(-1, 1, 1)), 1: (Boundary(1, 1, -1),), -1: (Boundary(-1, -1, -1),)}


class Crossing(NamedTuple):
    """An interval of u on which z passes the boundary of a flank once."""

    flank: int
    low: arb
    high: arb


class Displacement:
    """z as a polynomial with its first two derivatives, each with a ball about 0 added if it is known no better."""

    def __init__(self, polynomial: arb_poly, errors: tuple[arb, ...] = ()) -> None:
        self.z = polynomial
        self.first = polynomial.derivative()
        self.second = self.first.derivative()
        if errors:
            self.z, self.first, self.second = self.z + errors[0], self.first + errors[1], self.second + errors[2]


def clearance_by_bounds(bounds: arb_mat, contact: int) -> float | None:
    """A lower bound of the distance from the boundaries over a whole cell, or None if the bounds prove none.

    ``bounds`` are `Flow.bounds` applied to the states at the start of the cell.
    """
    out = math.inf
    z0, z1, slope, curvature = bounds.entries()
    for boundary in BOUNDARIES[contact]:
        ends = min(least(boundary.distance(z0)), least(boundary.distance(z1)))
        if not ends > 0:
            return None
        bulge = max(0.0, -least(-boundary.sign * curvature)) / 8
        if ends > bulge:
            out = min(out, (ends - bulge) * (1 - 1e-15))
        elif slope > 0 or slope < 0:
            out = min(out, ends)
        else:
            return None
    return out


def clearance(motion: Displacement, contact: int, low: arb, high: arb, z_low: arb, z_high: arb) -> float:
    """A positive lower bound of the distance from the boundaries for u from ``low`` to ``high``.

    ``motion`` contains z of all motions in question. ``z_low`` and ``z_high`` are z at the ends: near a switch they are
    tighter than the polynomial. Raises `UndecidedError` if no bound is found.
    """
    return min(_clearance(motion, boundary, (low, z_low), (high, z_high), 0) for boundary in BOUNDARIES[contact])


def _clearance(motion: Displacement, boundary: Boundary, low: tuple[arb, arb], high: tuple[arb, arb],
               depth: int) -> float:
    """The bound of `clearance` for one boundary; ``low`` and ``high`` are u and z there."""
    ends = min(least(boundary.distance(z)) for _, z in (low, high))
    if not ends > 0:
        raise UndecidedError("tangency undecided", ends)
    found, minimum = _bound(motion, boundary, low[0], high[0], ends)
    if found > 0:
        return found
    if depth == _DEEPEST or (minimum is not None and boundary.distance(motion.z(minimum)) < 0):
        raise UndecidedError("tangency undecided", found)
    u = ((low[0] + high[0]) / 2).mid()
    middle = u, motion.z(u)
    return min(_clearance(motion, boundary, low, middle, depth + 1),
               _clearance(motion, boundary, middle, high, depth + 1))


def _bound(motion: Displacement, boundary: Boundary, low: arb, high: arb, ends: float) -> tuple[float, arb | None]:
    """A lower bound of y on an interval where it is at least ``ends`` at both ends, and where y is least if convex."""
    span = interval(low, high)
    curvature = boundary.sign * motion.second(span)
    bound = ends - max(0.0, -least(-curvature)) * magnitude(high - low)**2 / 8 * (1 + 1e-15)
    if bound > 0:
        return bound * (1 - 1e-15), None
    slope = motion.first(span)
    if slope > 0 or slope < 0:
        return ends, None
    if curvature > 0:
        lowest = ((low + high) / 2).mid()  # about where z' = 0, within the interval; exact, but no bound
        for _ in range(8):
            lowest = (lowest - motion.first(lowest) / motion.second(lowest)).mid()
            if not (low < lowest < high):
                lowest = ((low + high) / 2).mid()
                break
        y, steep = boundary.distance(motion.z(lowest)), motion.first(lowest)
        return least(y - steep * steep / (2 * curvature)), lowest
    return bound, None


def first_crossing(motion: Displacement, contact: int, low: arb, high: arb, leaving: int | None = None,
                   depth: int = 0) -> Crossing | None:
    """The first crossing of a boundary for u from ``low`` to ``high``, for the motion from one state.

    ``contact`` is the state from ``low`` on, ``leaving`` the flank whose boundary the motion is on there. Raises
    `UndecidedError` if an interval can be neither cleared nor proved to be crossed once.
    """
    states = [_state(motion, b, low, high, b.flank == leaving) for b in BOUNDARIES[contact]]
    crossed = [s for s in states if isinstance(s, Crossing)]
    if len(crossed) + states.count(True) == len(states) and len(crossed) <= 1:
        return crossed[0] if crossed else None
    if depth == _DEEPEST:
        raise UndecidedError("tangency undecided", 0.0)
    middle = ((low + high) / 2).mid()
    return (first_crossing(motion, contact, low, middle, leaving, depth + 1)
            or first_crossing(motion, contact, middle, high, None, depth + 1))


def _state(motion: Displacement, boundary: Boundary, low: arb, high: arb, leaving: bool) -> bool | Crossing:
    """True where y is proved positive on an interval, a crossing where it has one zero, False where neither is known.

    If the motion leaves the boundary at ``low``, y is 0 there and is asked to be positive after it.
    """
    start, end = (boundary.distance(motion.z(u)) for u in (low, high))
    slope = boundary.sign * motion.first(interval(low, high))
    if leaving:
        curvature = boundary.sign * motion.second(interval(low, high))
        return bool(end > 0 and (slope > 0 or -least(-curvature) <= 0))
    if start > 0 and end < 0 and slope < 0:
        return Crossing(boundary.flank, low, high)
    if not (start > 0 and end > 0):
        return False
    bound, lowest = _bound(motion, boundary, low, high, min(least(start), least(end)))
    if bound > 0:
        return True
    if lowest is not None and boundary.distance(motion.z(lowest)) < 0:
        return Crossing(boundary.flank, low, lowest)
    return False


def crossing_time(motion: Displacement, crossing: Crossing) -> arb:
    """A narrow ball that contains the u of a crossing, within its interval.

    Raises `UndecidedError` if z - flank is not proved to have opposite signs at the ends of such a ball.
    """
    low, high = crossing.low.mid(), crossing.high.mid()
    falling = bool(motion.z(low) > crossing.flank)
    u = ((low + high) / 2).mid()
    for _ in range(200):
        error = motion.z(u) - crossing.flank
        low, high = (u, high) if bool(error > 0) == falling else (low, u)
        following = (u - error / motion.first(u)).mid()
        if not (low <= following <= high):
            following = ((low + high) / 2).mid()
        if abs(following - u) < arb(2) ** (8 - ctx.prec):
            break
        u = following
    return _verified(motion, crossing, u)


def _verified(motion: Displacement, crossing: Crossing, u: arb) -> arb:
    """A narrow ball about u, within the interval of the crossing, at whose ends z - flank has opposite signs."""
    flank, slope = crossing.flank, abs(motion.first(u)).lower()
    if not slope > 0:
        raise UndecidedError("tangency undecided", 0.0)
    radius = 2 * abs(motion.z(u) - flank).upper() / slope + arb(2) ** (4 - ctx.prec)
    for _ in range(8):
        low, high = (u - radius).mid(), (u + radius).mid()
        if not (crossing.low <= low and high <= crossing.high):
            break
        if (motion.z(low) - flank) * (motion.z(high) - flank) < 0:
            return interval(low, high)
        radius = 8 * radius
    raise UndecidedError("tangency undecided", magnitude(radius))


@dataclass(frozen=True)
class Switch:
    """A contact switch of the motion."""

    time: arb  # in mesh periods after the section
    flank: int  # 1 or -1
    into_contact: bool  # False where contact is lost
    rate: arb  # dz/dt, per mesh period
    slopes: arb_mat  # derivative (d, d) of the state there with respect to that at the section


@dataclass(frozen=True)
class Trajectory:
    """The motion from one state over one mesh period.

    Its parts between switches are numbered from 0; part i ends with switch i. In a part the motion follows the frozen
    equations of one contact state, which is proved together with the tube about it.

    ``starts`` has, by number of the part and of the cell, (w, 1) at the start of the cell, from where the frozen
    equations lead to the motion in the part. If the part begins within the cell, it is no state of the motion.
    """

    contacts: list[int]  # the contact state in each part
    switches: list[Switch]  # in order of time
    starts: dict[tuple[int, int], arb_mat]
    image: arb_mat  # the state after one mesh period, (d, 1)
    derivative: arb_mat  # of the image by the state at the section, (d, d)

    def at(self, equations: MeshEquations, part: int, cell: int, share: arb) -> arb_mat:
        """The state (w, 1), (d + 1, 1), at a share of a cell by the frozen equations of a part."""
        return equations.flow(cell, self.contacts[part]).at(share) * self.starts[part, cell]


def trajectory(equations: MeshEquations, state: arb_mat) -> Trajectory:
    """The motion over one mesh period from a state (d, 1) at the section, exact or with radii near the rounding unit.

    Raises `UndecidedError` if the state is on a contact boundary, or a switch cannot be told from a touch.
    """
    d = equations.dimension
    z = state[0, 0]
    if not (z > 1 or z < -1 or abs(z) < 1):
        raise UndecidedError("section on the contact boundary", -magnitude(abs(z) - 1))
    contacts, switches, starts = [int(z > 1) - int(z < -1)], list[Switch](), {}
    both = arb_mat(d + 1, d + 1, [state[i, 0] if j == 0 else int(i == j - 1) for i in range(d) for j in range(d + 1)]
                   + [int(j == 0) for j in range(d + 1)])
    for index, cell in enumerate(equations.cells):  # ``both`` has the columns (w, 1) and (derivative of w, 0)
        low, leaving = arb(0), None
        while True:
            contact = contacts[-1]
            flow, start = equations.flow(index, contact), block(both, d + 1, range(1))
            starts[len(switches), index] = start
            if leaving is None and clearance_by_bounds(flow.bounds * start, contact) is not None:
                break
            path = Displacement(flow.polynomial(start))
            crossing = first_crossing(path, contact, low, arb(1), leaving)
            if crossing is None:
                break
            low, leaving = crossing_time(path, crossing), crossing.flank
            there = flow.at(low) * both
            contacts.append(0 if contact else leaving)
            both = equations.flow(index, contacts[-1]).at(low).solve(there)
            if len(switches) == _MOST_SWITCHES:
                raise UndecidedError("too many switches", 0.0)
            switches.append(Switch(cell.begin + low * cell.span, leaving, contacts[-1] != 0,
                                   equations.duration * there[1, 0], block(there, d, range(1, d + 1))))
        both = flow.end * both
    return Trajectory(contacts, switches, starts, block(both, d, range(1)), block(both, d, range(1, d + 1)))
