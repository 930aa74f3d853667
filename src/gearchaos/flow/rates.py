"""Upper bounds of how fast motions change: the angular rate that sets the number of steps, and bounds of z'' and
z'''."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.system import SwitchedSystem

STEP_ANGLE = 0.45
"""Largest product of step length and `fastest_rate`, in radians.

The first omitted term of the Taylor polynomial of degree 14 is then 0.45^15 / 15! = 5e-18.
"""


def fastest_rate(system: SwitchedSystem) -> np.ndarray:
    """Upper bound of the angular rates of the motion.

    It covers the modes in free flight and in contact, and the highest harmonic of forcing and stiffness.

    Parameters
    ----------
    system : SwitchedSystem
        P parameter points.

    Returns
    -------
    (P,)
        In radians per unit of τ.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import fastest_rate
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> fastest_rate(initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1)).flow.system).round(3).tolist()
    [1.143]
    """
    contact = system.A.copy()
    contact[:, :, 0] -= system.b * stiffness_bound(system)[:, None]
    modes = np.maximum(_spectral_radius(system.A), _spectral_radius(contact))
    highest = max(system.f_cos.shape[1], system.chi_cos.shape[1], 1)
    return np.maximum(modes, highest * system.omega)


def min_steps_per_period(system: SwitchedSystem) -> np.ndarray:
    """Lower bound of the number of steps in a mesh period.

    Parameters
    ----------
    system : SwitchedSystem
        P parameter points.

    Returns
    -------
    (P,)
        Not rounded to integers.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import min_steps_per_period
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> min_steps_per_period(initial_value_problems(gc.MeshModel.of(q0=0.1)).flow.system).round(2).tolist()
    [15.95]
    """
    return 2 * np.pi / system.omega * fastest_rate(system) / STEP_ANGLE


def _spectral_radius(A: np.ndarray) -> np.ndarray:
    """Upper bound of the largest |eigenvalue| of matrices A (P, d, d): ‖A^16‖^(1/16) in the Frobenius norm.

    A is scaled first, so that its powers do not overflow.
    """
    scale = np.maximum(np.abs(A).max(axis=(1, 2)), 1e-300)
    power = A / scale[:, None, None]
    for _ in range(4):
        power = power @ power
    return scale * np.sqrt((power**2).sum(axis=(1, 2))) ** (1 / 16)


def stiffness_bound(system: SwitchedSystem) -> np.ndarray:
    """Upper bound of the stiffness χ(τ), (P,)."""
    return system.levels.max(axis=1) + np.hypot(system.chi_cos, system.chi_sin).sum(axis=1)


def bounds(system: SwitchedSystem) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of |z''| and |z'''| during a step in which z is near ±1 and z' is small.

    Returns constants (P, 2), one for each derivative, and factors (P, d) of |w_i| that hold for both; each bound is the
    constant plus the sum of factor times |w_i| over i >= 2. Near ±1 and at low speed the spring force and the damping
    force are small; a factor of 2 covers their contribution within a step.
    """
    A, order = system.A, np.arange(1, system.f_cos.shape[1] + 1)
    amplitudes = np.hypot(system.f_cos, system.f_sin)
    second = np.abs(system.f0[:, 1]) + amplitudes.sum(axis=1)
    longest_step = STEP_ANGLE / fastest_rate(system)
    spring = np.abs(A[:, 1, 1]) + system.b[:, 1] * stiffness_bound(system) * longest_step
    third = spring * second + (amplitudes * order * system.omega[:, None]).sum(axis=1)
    factors = np.maximum(np.abs(A[:, 1, :]), np.abs((A @ A)[:, 1, :]))
    return 2.0 * np.stack([second, third], axis=1), 2.0 * factors
