"""SciPy's solve_ivp, stopped at the stiffness jumps but not at contact switches, as a user would run it."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from gearchaos.model.switched import SwitchedAffine
from peers.equations import equations, halves


class Scipy:
    """One trajectory after another by the given method and tolerance."""

    def __init__(self, system: SwitchedAffine, method: str, tolerance: float) -> None:
        self.system, self.method, self.tolerance = system, method, tolerance

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        return np.stack([self._one(lane, w[:, lane], periods) for lane in range(w.shape[1])], axis=1)

    def _one(self, lane: int, w: np.ndarray, periods: int) -> np.ndarray:
        e = equations(self.system, lane)

        def slope(t, w, chi):
            out = e.A @ w + e.f0 - e.b * chi * (w[0] - min(max(w[0], -1.0), 1.0))
            out[1] += e.f_cos * np.cos(e.omega * t) + e.f_sin * np.sin(e.omega * t)
            return out

        for begin, end, chi in halves(e, periods):
            w = solve_ivp(
                slope, (begin, end), w, self.method, rtol=self.tolerance, atol=self.tolerance, args=(chi,)
            ).y[:, -1]
        return w
