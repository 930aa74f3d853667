"""Points of an orbit at another phase of the mesh period."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from flint import arb_mat

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.balls import ball, precision
from gearchaos.proof.coordinates import lifted
from gearchaos.proof.crossing import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.krawczyk import float_midpoint
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.trajectory import trajectory

_BITS = 128
_OFF_BOUNDARY = 1e-11
"""A point on a contact boundary is moved by this in its velocity direction; Newton's method corrects it."""


def at_phase(model: MeshModel, points: np.ndarray, phase: float) -> np.ndarray | None:
    """Approximate states w (n, d) at τ = (k + phase) T from those at τ = k T; None if they cannot be computed."""
    with precision(_BITS):
        equations = MeshEquations(exact_parameters(model), bits=_BITS)
        out = []
        for point in lifted(points, equations):
            state = [ball(value) for value in point]
            state[0] += _OFF_BOUNDARY * (1 if state[1] > 0 else -1)
            try:
                out.append(_state_after(equations, arb_mat(len(state), 1, state), Fraction(phase)))
            except UndecidedError:
                return None
    return np.array(out)


def _state_after(equations: MeshEquations, state: arb_mat, time: Fraction) -> np.ndarray:
    """The state (d,) a time after the section, in mesh periods from 0 to 1."""
    motion = trajectory(equations, state)
    part = sum(bool(switch.time < ball(time)) for switch in motion.switches)
    cell = max(i for i, c in enumerate(equations.cells) if c.start <= time)
    share = ball((time - equations.cells[cell].start) / equations.cells[cell].length)
    there = equations.flow(cell, motion.contacts[part]).at(share) * motion.starts[part, cell]
    return float_midpoint(there)[:-1, 0]
