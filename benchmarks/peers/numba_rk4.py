"""Fixed-step Runge-Kutta in Numba, one trajectory after another: what a Python user writes by hand, with care."""

from __future__ import annotations

import numpy as np
from numba import njit

from gearchaos.model.switched import SwitchedAffine


@njit(fastmath=True, inline="always")
def _slope(w, A, b, f0, push, chi, out):
    z = w[0]
    spring = chi * (z - min(max(z, -1.0), 1.0))
    for i in range(len(f0)):
        total = f0[i] - b[i] * spring
        for j in range(len(f0)):
            total += A[i, j] * w[j]
        out[i] = total
    out[1] += push


@njit(fastmath=True)
def _advance(w, A, b, f0, f_cos, f_sin, omega, levels, cosine, sine, periods, steps):
    d, lanes = w.shape
    one, two, three, four = np.empty(d), np.empty(d), np.empty(d), np.empty(d)
    y, probe = np.empty(d), np.empty(d)
    for lane in range(lanes):
        a, c, f = A[lane], b[lane], f0[lane]
        h = 2 * np.pi / omega[lane] / steps
        for i in range(d):
            y[i] = w[i, lane]
        for step in range(periods * steps):
            k = 2 * (step % steps)
            chi = levels[lane, 0 if k < steps else 1]
            push0 = f_cos[lane, 0] * cosine[k] + f_sin[lane, 0] * sine[k]
            push1 = f_cos[lane, 0] * cosine[k + 1] + f_sin[lane, 0] * sine[k + 1]
            push2 = f_cos[lane, 0] * cosine[k + 2] + f_sin[lane, 0] * sine[k + 2]
            _slope(y, a, c, f, push0, chi, one)
            for i in range(d):
                probe[i] = y[i] + 0.5 * h * one[i]
            _slope(probe, a, c, f, push1, chi, two)
            for i in range(d):
                probe[i] = y[i] + 0.5 * h * two[i]
            _slope(probe, a, c, f, push1, chi, three)
            for i in range(d):
                probe[i] = y[i] + h * three[i]
            _slope(probe, a, c, f, push2, chi, four)
            for i in range(d):
                y[i] += h / 6 * (one[i] + 2 * two[i] + 2 * three[i] + four[i])
        for i in range(d):
            w[i, lane] = y[i]


class NumbaRk4:
    """RK4 with a fixed number of steps a period."""

    def __init__(self, system: SwitchedAffine, steps: int) -> None:
        self.steps, s = steps, system
        angle = np.pi * np.arange(2 * steps + 1) / steps
        self.arrays = s.A, s.b, s.f0, s.f_cos, s.f_sin, s.omega, s.levels, np.cos(angle), np.sin(angle)

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        w = np.ascontiguousarray(w.copy())
        _advance(w, *self.arrays, periods, self.steps)
        return w
