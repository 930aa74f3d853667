"""The interface of a switched affine system: the arrays that the flow reads."""

from __future__ import annotations

from typing import Protocol, Self

import numpy as np


class SwitchedSystem(Protocol):
    """A batch of switched affine systems: P parameter points, d coordinates, H harmonics of the forcing, N levels and K
    harmonics of the stiffness.

    The first two coordinates are z and z', the displacement in half backlashes and its velocity, so that the contact
    state σ follows from w[0] alone:

        w' = A w + f(τ) − b χ(τ) (w[0] − σ) [σ ≠ 0],    σ = 0 if |z| <= 1, 1 if z > 1, −1 if z < −1

    with f(τ) = f0, to whose second element Σ_j (f_cos[j] cos jωτ + f_sin[j] sin jωτ), j = 1, ..., H, is added, and
    χ(τ) = level + Σ_j (chi_cos[j] cos jωτ + chi_sin[j] sin jωτ), j = 1, ..., K.
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
    velocity, velocity0, velocity_cos, velocity_sin : (P, d), (P,), (P, H), (P, H)
        The measured velocity: velocity · w + velocity0 + Σ_j (velocity_cos[j] cos jωτ + velocity_sin[j] sin jωτ).
    trace : (P,)
        Trace of A.
    period : (P,)
        2π/ω.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
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
    def levels(self) -> np.ndarray: ...
    @property
    def starts(self) -> np.ndarray: ...
    @property
    def same_starts(self) -> bool: ...
    @property
    def chi_cos(self) -> np.ndarray: ...
    @property
    def chi_sin(self) -> np.ndarray: ...
    @property
    def damping(self) -> np.ndarray: ...
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
    def period(self) -> np.ndarray: ...
    @property
    def points(self) -> int: ...
    @property
    def dimension(self) -> int: ...

    def take(self, index: np.ndarray) -> Self:
        """The system at the points with indices ``index``, in that order."""
        ...
