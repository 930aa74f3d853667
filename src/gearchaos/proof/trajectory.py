"""The motion from one state over one mesh period, with every contact switch located in a narrow ball."""

from __future__ import annotations

from dataclasses import dataclass, field

from flint import arb, arb_mat

from gearchaos.proof.balls import block, magnitude
from gearchaos.proof.crossing import Displacement, UndecidedError, clearance_by_bounds, crossing_time, first_crossing
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
    """The motion from a state over one mesh period.

    Parameters
    ----------
    equations : MeshEquations
        Made at the precision that is set.
    state : arb_mat
        At the section, (d, 1); exact, or with radii near the rounding unit.

    Raises
    ------
    UndecidedError
        If the state is on a contact boundary, or a switch cannot be told from a touch.
    """
    d = equations.dimension
    motion = Trajectory([contact_state(state[0, 0])])
    both = arb_mat(d + 1, d + 1, [state[i, 0] if j == 0 else int(i == j - 1) for i in range(d) for j in range(d + 1)]
                   + [int(j == 0) for j in range(d + 1)])
    for index in range(len(equations.cells)):
        both = _through_cell(equations, motion, index, both)
    motion.image = block(both, d, range(1))
    motion.derivative = block(both, d, range(1, d + 1))
    return motion


def contact_state(z: arb) -> int:
    """The contact state at a section from z.

    Raises
    ------
    UndecidedError
        If the ball contains 1 or -1.
    """
    if z > 1 or z < -1:
        return 1 if z > 0 else -1
    if abs(z) < 1:
        return 0
    raise UndecidedError("section on the contact boundary", -magnitude(abs(z) - 1))


def _through_cell(equations: MeshEquations, motion: Trajectory, index: int, both: arb_mat) -> arb_mat:
    """Follow the motion through a cell.

    ``both`` and the result have the columns (w, 1) and (derivative of w, 0), (d + 1, d + 1).
    """
    low, leaving, cell, d = arb(0), None, equations.cells[index], equations.dimension
    while True:
        contact = motion.contacts[-1]
        flow = equations.flow(index, contact)
        state = block(both, d + 1, range(1))
        motion.starts[len(motion.switches), index] = state
        if leaving is None and clearance_by_bounds(flow.bounds * state, contact) is not None:
            return flow.end * both
        path = Displacement(flow.polynomial(state))
        crossing = first_crossing(path, contact, low, arb(1), leaving)
        if crossing is None:
            return flow.end * both
        low, leaving = crossing_time(path, crossing), crossing.flank
        there = flow.at(low) * both
        motion.contacts.append(0 if contact else leaving)
        both = equations.flow(index, motion.contacts[-1]).at(low).solve(there)
        if len(motion.switches) == _MOST_SWITCHES:
            raise UndecidedError("too many switches", 0.0)
        motion.switches.append(Switch(
            cell.begin + low * cell.span, leaving, motion.contacts[-1] != 0, equations.duration * there[1, 0],
            block(there, d, range(1, d + 1))))
