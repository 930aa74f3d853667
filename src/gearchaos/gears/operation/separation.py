"""The torque below which a gear pair with constant mesh stiffness loses contact, in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.gears.io.units import RPM

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign

_SAMPLES_PER_ORDER = 64
_NEWTON_STEPS = 6


def separation_torque(
    speed: Any, *, teeth1: int, base_radius1: float, stiffness: float, mass: float, damping_ratio: float,
    amplitudes: tuple[float, ...], phases: tuple[float, ...] = (), unilateral: bool = False,
) -> np.ndarray:
    """Torque of wheel 1, N m, above which the flanks stay in contact at constant mesh stiffness, at speeds of any
    shape, rpm.

    In contact, m δ″ + 2 ζ ω0 m δ′ + c0 δ = T1/r_b1 − m e″ for the deflection δ of the teeth. Its steady solution is δ =
    T1/(r_b1 c0) + Σ e_j ρ_j cos(jω_z t − θ_j − ψ_j) with ρ_j = s²/√((1 − s²)² + 4 ζ² s²), s = jω_z/ω0, and tan ψ_j = 2
    ζ s/(1 − s²). Permanent contact exists where δ > 0 throughout. For one harmonic this is

        T1 > r_b1 c0 e1 ω²/√((1 − ω²)² + 4 ζ² ω²),  ω = ω_z/ω0;

    for several, T1 > r_b1 c0 max over a period of −Σ e_j ρ_j cos(…). Where contact ends with its force, ``unilateral``,
    the force has to be positive throughout instead: ρ_j is larger by √(1 + 4 ζ² s²), ψ_j smaller by arctan 2 ζ s.
    Phases left out are 0. The torque is that of the
    mesh, without bearing friction, and infinite at resonance without damping.

    Above the line a motion in permanent contact exists and is stable; a motion with impacts may exist beside it. Below
    the line there is no motion in permanent contact. With varying stiffness the line is only a first estimate.
    """
    frequency = np.asarray(speed, dtype=float) * RPM * teeth1 * np.sqrt(mass / stiffness)
    e, theta = np.asarray(amplitudes, dtype=float), np.zeros(len(amplitudes))
    theta[: len(phases)] = phases
    s = frequency[..., None] * np.arange(1, len(e) + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        height = e * s**2 / np.hypot(1 - s**2, 2 * damping_ratio * s)
    height = np.where(e == 0, 0.0, height)
    lag = theta + np.arctan2(2 * damping_ratio * s, 1 - s**2)
    if unilateral:
        height, lag = height * np.hypot(1, 2 * damping_ratio * s), lag - np.arctan(2 * damping_ratio * s)
    unbounded = np.isinf(height)
    height, orders = np.where(unbounded, 0.0, height), np.arange(1, len(e) + 1)
    drop = np.abs(height).sum(axis=-1)
    if np.count_nonzero(height.any(axis=tuple(range(height.ndim - 1)))) > 1:  # the maximum over θ, by Newton's method
        grid = np.linspace(0, 2 * np.pi, _SAMPLES_PER_ORDER * len(orders), endpoint=False)
        samples = -(height[..., None, :] * np.cos(grid[:, None] * orders - lag[..., None, :])).sum(axis=-1)
        angles = grid[np.argmax(samples, axis=-1)]
        for _ in range(_NEWTON_STEPS):
            angle = angles[..., None] * orders - lag
            slope = (height * orders * np.sin(angle)).sum(axis=-1)
            curvature = (height * orders**2 * np.cos(angle)).sum(axis=-1)
            step = np.where(curvature < 0, -slope / np.where(curvature < 0, curvature, 1.0), 0.0)
            angles = angles + np.clip(step, -grid[1], grid[1])
        refined = -(height * np.cos(angles[..., None] * orders - lag)).sum(axis=-1)
        drop = np.maximum(samples.max(axis=-1), refined)
    return base_radius1 * stiffness * np.where(unbounded.any(axis=-1), np.inf, drop)


def separation_margin(design: GearDesign, speeds: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Torque less the separation torque, N m, over torques (Q,) in N m and speeds (P,) in rpm of wheel 1: (Q, P).

    Where it is positive, a motion in permanent contact exists. The stiffness is the time mean of the design's mesh
    stiffness at each torque, on which it depends by the rule of ISO 6336-1 for low loads; that of helical pairs, and
    their error, by what touches under load. Raises `InputError` if an input of the model is missing, or a torque is 0
    and the stiffness is by ISO 6336-1.
    """
    radius = design.geometry.base_diameter[0] / 2
    return np.array([
        torque - separation_torque(
            speeds, teeth1=design.teeth[0], base_radius1=radius, stiffness=there.mesh_stiffness.reference,
            mass=there.equivalent_mass, damping_ratio=there.given("damping_ratio"), amplitudes=error.amplitudes,
            phases=error.phases, unilateral=there.law.releases)
        for torque in torques.tolist() for there in [design.at(speed=float(speeds.flat[0]), torque=torque)]
        for error in [there.mesh_error]])
