"""pynamicalsys: its RK4, the whole right-hand side compiled by Numba.

Both its integrators overshoot the end of the time asked for by up to a step; with fixed steps that can be allowed for.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from pynamicalsys import ContinuousDynamicalSystem

from gearchaos.model.switched import SwitchedAffine
from peers.equations import equations, halves


@njit
def _slope(time, u, parameters):
    d = len(u)
    b, f0, rest = d * d, d * d + d, d * d + 2 * d
    spring = parameters[rest + 3] * (u[0] - min(max(u[0], -1.0), 1.0))
    out = np.empty(d)
    for i in range(d):
        total = parameters[f0 + i] - parameters[b + i] * spring
        for j in range(d):
            total += parameters[i * d + j] * u[j]
        out[i] = total
    phase = parameters[rest + 2] * (time + parameters[rest + 4])
    out[1] += parameters[rest] * np.cos(phase) + parameters[rest + 1] * np.sin(phase)
    return out


class Pynamicalsys:
    """One trajectory after another, half a period at a time, since its clock begins at zero."""

    def __init__(self, system: SwitchedAffine, steps: int) -> None:
        d = system.dimension
        self.system, self.steps = system, steps
        self.solver = ContinuousDynamicalSystem(
            equations_of_motion=_slope, system_dimension=d, number_of_parameters=d * d + 2 * d + 5
        )

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        out = np.empty_like(w)
        for lane in range(w.shape[1]):
            e, state = equations(self.system, lane), w[:, lane]
            step = 2 * np.pi / e.omega / self.steps
            self.solver.integrator("rk4", time_step=step)
            for begin, end, chi in halves(e, periods):
                parameters = np.concatenate([e.flat, [chi, begin]])
                until = end - begin - step  # it goes one step beyond
                state = self.solver.evolve_system(state, until, parameters=parameters)
            out[:, lane] = state
        return out
