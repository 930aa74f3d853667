"""The interface of a switched affine system, and upper bounds of how fast its motions change."""

from __future__ import annotations

from typing import Any, Protocol, Self

import numpy as np


class DampingLaw(Protocol):
    """Where the mesh damping acts."""

    @property
    def name(self) -> str: ...  # the kernels' number follows from it: one of "always", "contact", "unilateral"
    @property
    def in_contact(self) -> bool: ...  # whether in contact alone
    @property
    def releases(self) -> bool: ...  # whether contact ends where its force does


class MeshForce(Protocol):
    """What of a `SwitchedSystem` says whether its flanks touch."""

    @property
    def law(self) -> DampingLaw: ...
    @property
    def levels(self) -> np.ndarray: ...
    @property
    def chi_cos(self) -> np.ndarray: ...
    @property
    def damping(self) -> np.ndarray: ...


class SwitchedSystem(MeshForce, Protocol):
    """A batch of switched affine systems: P parameter points, d coordinates, H harmonics of the forcing, N levels and K
    harmonics of the stiffness.

    The first two coordinates are z and z', the displacement in half backlashes and its velocity, so that the contact
    state σ follows from w[0] alone:

        w' = A w + f(τ) − b (χ(τ) (w[0] − σ) + D w[1]) [σ ≠ 0],    σ = 0 if |z| <= 1, 1 if z > 1, −1 if z < −1

    with f(τ) = f0, to whose second element Σ_j (f_cos[j] cos jωτ + f_sin[j] sin jωτ), j = 1, ..., H, is added, and
    χ(τ) = level + Σ_j (chi_cos[j] cos jωτ + chi_sin[j] sin jωτ), j = 1, ..., K. With the damping law ``always`` D = 0,
    and the mesh damping is a part of A; with ``contact`` D = ``damping``; with ``unilateral`` too, and σ = 0 also
    where the force χ (z − σ) + D z' would pull.
    Any object with these attributes can be used.

    Attributes
    ----------
    omega : (P,)
        Frequency ω; the period of the system is 2π/ω.
    A : (P, d, d)
        Linear part in free flight; its first row is (0, 1, 0, ...).
    b : (P, d)
        Direction of the spring force; b[:, 0] = 0 and b[:, 1] > 0.
    f0 : (P, d)
        Constant forcing; f0[:, 0] = 0.
    f_cos, f_sin : (P, H)
        Harmonic forcing of z''.
    levels : (P, N)
        Stiffness level in each of the N parts of the period.
    starts : (P, N)
        Where each part begins, as a fraction of the period, in ascending order; ``starts[:, 0]`` = 0. The last part
        ends with the period.
    same_starts : bool
        Whether ``starts`` are the same at all points.
    chi_cos, chi_sin : (P, K)
        Harmonics of the stiffness, added to its level.
    damping : (P,)
        Damping coefficient in the mesh force, damping z' + χ (z − σ), whose extremes are measured.
    law : object
        Where the mesh damping acts, with the fields of `DampingLaw`.
    velocity, velocity0, velocity_cos, velocity_sin : (P, d), (P,), (P, H), (P, H)
        The measured velocity: velocity · w + velocity0 + Σ_j (velocity_cos[j] cos jωτ + velocity_sin[j] sin jωτ).
    trace : (P,)
        Trace of A.
    contact_trace : (P, K)
        What contact of each mesh adds to the trace, of one spring −b[:, 1] D.
    period : (P,)
        2π/ω.
    contacts : object or None
        None for one spring; else the one-sided contacts of K meshes that take its place, and the forcing, with the
        fields of `gearchaos.model.contacts.MeshContacts`. z is the displacement of the first mesh then.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> system = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1)).flow.system
    >>> system.A.shape, system.levels.tolist()
    ((1, 2, 2), [[1.25, 0.75]])
    """

    @property
    def omega(self) -> np.ndarray: ...
    @property
    def A(self) -> np.ndarray: ...
    @property
    def b(self) -> np.ndarray: ...
    @property
    def f0(self) -> np.ndarray: ...
    @property
    def f_cos(self) -> np.ndarray: ...
    @property
    def f_sin(self) -> np.ndarray: ...
    @property
    def starts(self) -> np.ndarray: ...
    @property
    def same_starts(self) -> bool: ...
    @property
    def chi_sin(self) -> np.ndarray: ...
    @property
    def velocity(self) -> np.ndarray: ...
    @property
    def velocity0(self) -> np.ndarray: ...
    @property
    def velocity_cos(self) -> np.ndarray: ...
    @property
    def velocity_sin(self) -> np.ndarray: ...
    @property
    def trace(self) -> np.ndarray: ...
    @property
    def contact_trace(self) -> np.ndarray: ...
    @property
    def period(self) -> np.ndarray: ...
    @property
    def contacts(self) -> Any: ...
    @property
    def points(self) -> int: ...
    @property
    def dimension(self) -> int: ...

    def take(self, index: np.ndarray) -> Self:
        """The system at the points with indices ``index``, in that order."""
        ...


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
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> fastest_rate(initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1)).flow.system).round(3).tolist()
    [1.143]
    """
    if (several := system.contacts) is not None:
        damped = several.damping * several.in_contact
        forces = several.stiffest[..., None] * several.rows + damped[..., None] * several.rates  # (P, K, d)
        contact = system.A - np.einsum("pki,pkj->pij", several.pushes, forces)
    else:
        contact = _damped(system)
        contact[:, :, 0] -= system.b * stiffness_bound(system)[:, None]
    return np.maximum(rate_in_flight(system), _spectral_radius(contact))


def rate_in_flight(system: SwitchedSystem) -> np.ndarray:
    """The `fastest_rate` (P,) without contact."""
    several = system.contacts
    highest = max(system.f_cos.shape[1], system.chi_cos.shape[1], 1) if several is None else several.orders.max(
        initial=1)
    return np.maximum(_spectral_radius(system.A), highest * system.omega)


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
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> min_steps_per_period(initial_value_problems(gc.MeshModel.of(q0=0.1)).flow.system).round(2).tolist()
    [15.95]
    """
    return 2 * np.pi / system.omega * fastest_rate(system) / STEP_ANGLE


def contact_states(system: MeshForce, w: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The contact states (L,) of trajectories in the states w (d, L) at phase 0, at these points (L,).

    They are 0 in free flight, 1 or −1 in contact with the front or back flank, and 1/2 or −1/2 where a flank is
    released: z is beyond the boundary, but the force would pull.
    """
    side = (w[0] > 1).astype(float) - (w[0] < -1)
    if not system.law.releases:
        return side
    stiffness = system.levels[points, 0] + system.chi_cos[points].sum(axis=1)
    force = stiffness * (w[0] - side) + system.damping[points] * w[1]
    return np.where(side * force > 0, side, side / 2)


def _damped(system: SwitchedSystem) -> np.ndarray:
    """A, with the mesh damping that acts in contact, (P, d, d)."""
    A = system.A.copy()
    if system.law.in_contact:
        A[:, :, 1] -= system.b * system.damping[:, None]
    return A


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
    A, damped, order = system.A, _damped(system), np.arange(1, system.f_cos.shape[1] + 1)
    amplitudes = np.hypot(system.f_cos, system.f_sin)
    second = np.abs(system.f0[:, 1]) + amplitudes.sum(axis=1)
    longest_step = STEP_ANGLE / fastest_rate(system)
    damping = np.maximum(np.abs(A[:, 1, 1]), np.abs(damped[:, 1, 1]))
    spring = damping + system.b[:, 1] * stiffness_bound(system) * longest_step
    third = spring * second + (amplitudes * order * system.omega[:, None]).sum(axis=1)
    factors = np.maximum(np.abs(A[:, 1, :]), np.abs((A @ A)[:, 1, :]))
    if system.law.in_contact:
        factors = np.maximum(factors, np.maximum(np.abs(damped[:, 1, :]), np.abs((damped @ damped)[:, 1, :])))
    return 2.0 * np.stack([second, third], axis=1), 2.0 * factors
