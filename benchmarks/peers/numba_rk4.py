"""Fixed-step Runge-Kutta in Numba, one trajectory after another: what a Python user writes by hand."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearchaos.switched import SwitchedAffine


@njit(fastmath=True)
def _slope(t, w, A, b, f0, f_cos, f_sin, omega, chi, out):
    z = w[0]
    spring = chi * (z - min(max(z, -1.0), 1.0))
    for i in range(len(w)):
        total = f0[i] - b[i] * spring
        for j in range(len(w)):
            total += A[i, j] * w[j]
        out[i] = total
    out[1] += f_cos * np.cos(omega * t) + f_sin * np.sin(omega * t)


@njit(fastmath=True)
def _advance(w, A, b, f0, f_cos, f_sin, omega, levels, periods, steps):
    d, lanes = w.shape
    slopes, y, probe = np.empty((4, d)), np.empty(d), np.empty(d)
    for lane in range(lanes):
        y[:] = w[:, lane]
        h = 2 * np.pi / omega[lane] / steps
        for step in range(periods * steps):
            chi = levels[lane, 0 if step % steps < steps // 2 else 1]
            for stage in range(4):
                share = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                for i in range(d):
                    probe[i] = y[i] if stage == 0 else y[i] + share * h * slopes[stage - 1, i]
                _slope((step + share) * h, probe, A[lane], b[lane], f0[lane], f_cos[lane, 0], f_sin[lane, 0],
                       omega[lane], chi, slopes[stage])
            for i in range(d):
                y[i] += h / 6 * (slopes[0, i] + 2 * slopes[1, i] + 2 * slopes[2, i] + slopes[3, i])
        w[:, lane] = y


class NumbaRk4:
    """RK4 with a fixed number of steps a period."""

    def __init__(self, system: SwitchedAffine, steps: int) -> None:
        self.steps, s = steps, system
        self.arrays = s.A, s.b, s.f0, s.f_cos, s.f_sin, s.omega, s.levels

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        w = np.ascontiguousarray(w.copy())
        _advance(w, *self.arrays, periods, self.steps)
        return w
