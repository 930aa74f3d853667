"""JiTCODE: the right-hand side compiled from symbols to C, stepped by DOP853, half a period at a time."""

from __future__ import annotations

from contextlib import chdir
from tempfile import TemporaryDirectory

import numpy as np
import symengine
from jitcode import jitcode, t, y

from gearchaos.model.switched import SwitchedAffine
from peers.equations import equations, halves


class Jitcode:
    """One trajectory after another."""

    def __init__(self, system: SwitchedAffine, tolerance: float) -> None:
        self.system, d = system, system.dimension
        names = symengine.symbols(f"p0:{d * d + 2 * d + 4}")
        b, f0, (f_cos, f_sin, omega, chi) = names[d * d :], names[d * d + d :], names[-4:]
        z = y(0)
        spring = chi * (z - (symengine.Abs(z + 1) - symengine.Abs(z - 1)) / 2)
        rows = [f0[i] - b[i] * spring + sum(names[i * d + j] * y(j) for j in range(d)) for i in range(d)]
        rows[1] += f_cos * symengine.cos(omega * t) + f_sin * symengine.sin(omega * t)
        self.solver = jitcode(rows, control_pars=names, verbose=False)
        with TemporaryDirectory() as folder, chdir(folder):  # for it would read the project file of this one
            self.solver.compile_C()
        self.solver.set_integrator("dop853", rtol=tolerance, atol=tolerance, nsteps=100_000)

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        out = np.empty_like(w)
        for lane in range(w.shape[1]):
            e, state = equations(self.system, lane), w[:, lane]
            for begin, end, chi in halves(e, periods):
                self.solver.set_parameters(*e.flat, chi)
                self.solver.set_initial_value(state, begin)
                state = self.solver.integrate(end)
            out[:, lane] = state
        return out
