"""How fast the motions of a system can be: the rate that sets the number of steps, and the bounds of z'' and z'''."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.system import SwitchedSystem

STEP_ANGLE = 0.45
"""Largest length of a step times the rate of the motion, in radians: 0.45^15 / 15! is 5e-18."""


def rate(system: SwitchedSystem) -> np.ndarray:
    """Upper bound of the angular rates of the motion, (P,): free and contact modes, and the highest harmonics."""
    contact = system.A.copy()
    contact[:, :, 0] -= system.b * stiffness_bound(system)[:, None]
    modes = np.maximum(_spectral_radius(system.A), _spectral_radius(contact))
    highest = max(system.f_cos.shape[1], system.chi_cos.shape[1], 1)
    return np.maximum(modes, highest * system.omega)


def least_steps(system: SwitchedSystem) -> np.ndarray:
    """Steps that a mesh period needs at least, (P,), not rounded."""
    return 2 * np.pi / system.omega * rate(system) / STEP_ANGLE


def _spectral_radius(A: np.ndarray) -> np.ndarray:
    """Upper bound of the largest |eigenvalue| of matrices A (P, d, d): ‖A^16‖^(1/16) in the Frobenius norm.

    Scaled against overflow.
    """
    scale = np.maximum(np.abs(A).max(axis=(1, 2)), 1e-300)
    power = A / scale[:, None, None]
    for _ in range(4):
        power = power @ power
    return scale * np.sqrt((power**2).sum(axis=(1, 2))) ** (1 / 16)


def stiffness_bound(system: SwitchedSystem) -> np.ndarray:
    """An upper bound of the stiffness χ(τ), (P,)."""
    return system.levels.max(axis=1) + np.hypot(system.chi_cos, system.chi_sin).sum(axis=1)


def bounds(system: SwitchedSystem) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of |z''| and |z'''| where z is near a boundary and slow: constants (P, 2), factors of |w_i| (P, d).

    There the spring force and the damping force are small; a factor of 2 covers what they add on a step.
    """
    A, order = system.A, np.arange(1, system.f_cos.shape[1] + 1)
    waves = np.hypot(system.f_cos, system.f_sin)
    second = np.abs(system.f0[:, 1]) + waves.sum(axis=1)
    reach = STEP_ANGLE / rate(system)
    spring = np.abs(A[:, 1, 1]) + system.b[:, 1] * stiffness_bound(system) * reach
    third = spring * second + (waves * order * system.omega[:, None]).sum(axis=1)
    factors = np.maximum(np.abs(A[:, 1, :]), np.abs((A @ A)[:, 1, :]))
    return 2.0 * np.stack([second, third], axis=1), 2.0 * factors
