"""The equations of one trajectory as plain arrays, for peers that take a right-hand side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.model.switched import SwitchedAffine


class Equations(NamedTuple):
    """w' = A w + f0 − b χ(τ) f(z) + (0, f_cos cos ωτ + f_sin sin ωτ, 0, …), two levels of χ, half a period each."""

    A: np.ndarray
    b: np.ndarray
    f0: np.ndarray
    f_cos: float
    f_sin: float
    omega: float
    levels: np.ndarray

    @property
    def flat(self) -> np.ndarray:
        """All of it but the stiffness, as one array."""
        return np.concatenate([self.A.ravel(), self.b, self.f0, [self.f_cos, self.f_sin, self.omega]])


def equations(system: SwitchedAffine, point: int) -> Equations:
    """The equations of one parameter point; the contact ratio must be 1.5 and the forcing of one harmonic."""
    return Equations(
        system.A[point], system.b[point], system.f0[point], float(system.f_cos[point, 0]),
        float(system.f_sin[point, 0]), float(system.omega[point]), system.levels[point],
    )


def halves(e: Equations, periods: int) -> list[tuple[float, float, float]]:
    """Begin, end and stiffness of every half period."""
    half = np.pi / e.omega
    return [(k * half, (k + 1) * half, float(e.levels[k % 2])) for k in range(2 * periods)]
