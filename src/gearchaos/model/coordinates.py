"""Conversion between the physical coordinates x, y of the wheels and the dynamic state w; all are dimensionless.

The dynamic state leaves out what has no effect on z: the mean rotation and, if both supports have the same κ/μ and
damping ratio, the mean lateral motion. Both have closed-form solutions of (2.12), by which all of x and y follow from w
at any time.

If β/J differs between the wheels, the rotation follows from a first integral of (2.12) divided by the bearing friction.
If that friction is too weak to divide by (`weakly_damped`), x2 is integrated along the motion instead.

Shapes: P points, S times, d coordinates of the dynamic state.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import numpy as np

from gearchaos.model.parameters import COORDINATES, transmission_error
from gearchaos.model.switched import Batch, SwitchedAffine, equal_ratios, rotation_decay

_WEAK_DECAY = 2e-3  # of the mean rotation, below which the first integral gives x2 with an error above 1e-11


@singledispatch
def initial_state(batch: Any, system: SwitchedAffine) -> np.ndarray:
    """The dynamic state w at τ = 0, (P, d), from the initial values of the batch; by default x1 = 1, all others 0."""
    w = from_physical(system.names, initial_values(batch), *transmission_error_at_start(batch))
    given = {**batch.model.initial, **batch.values}
    for i, name in enumerate(("z", "z_dot")):
        if batch.model.kind == "single" and given.keys() & {"z", "z_dot"}:
            w[:, i] = given.get(name, 0.0)
    return w


def initial_values(batch: Batch) -> dict[str, np.ndarray]:
    """All physical coordinates at τ = 0 by name, each (P,)."""
    given = {**batch.model.initial, **batch.values}
    return {
        n: np.broadcast_to(np.asarray(given.get(n, 1.0 if n == "x1" else 0.0), float), batch.size)
        for n in COORDINATES["full"]
    }


@singledispatch
def transmission_error_at_start(batch: Any) -> tuple[np.ndarray, np.ndarray]:
    """ε and ε' at the start of every mesh period, τ = 0, T, 2T, …; each (P,)."""
    a, p = batch.harmonics("eps", "theta")
    order = np.arange(1, len(a) + 1)[:, None]
    return (a * np.cos(p)).sum(axis=0), (order * np.asarray(batch["omega"]) * a * np.sin(p)).sum(axis=0)


@singledispatch
def mesh_rotation(batch: Any, names: tuple[str, ...], w: np.ndarray, share: np.ndarray, mesh: int) -> np.ndarray:
    """The rotation x1 − x2 of the wheels of a mesh along its line of action, (S,), in states w (S, d) of a batch of one
    point at shares (S,) of the period; 0 where the front flanks touch without error."""
    return relative_rotation(names, w, transmission_error(batch.model, share * batch.model.period)) - 1


@singledispatch
def prescribed_rates_at_start(batch: Any, names: tuple[str, ...]) -> np.ndarray:
    """What of the velocities in the states is prescribed at the start of every mesh period, (P, d): the rest follows
    from the velocities of the wheels."""
    out = np.zeros((batch.size, len(names)))
    out[:, 1] = -transmission_error_at_start(batch)[1]
    return out


def from_physical(names: tuple[str, ...], x: dict[str, np.ndarray], error: np.ndarray,
                  error_dot: np.ndarray) -> np.ndarray:
    """The dynamic state w (P, d) from all coordinates x by name, and from ε and ε' at the same time, each (P,)."""
    known = {
        "y": x["y1"] - x["y2"],
        "y_dot": x["y1_dot"] - x["y2_dot"],
        "z": x["x1"] - x["x2"] + x["y1"] - x["y2"] - error,
        "z_dot": x["x1_dot"] - x["x2_dot"] + x["y1_dot"] - x["y2_dot"] - error_dot,
    }
    return np.stack([known[n] if n in known else x[n] for n in names], axis=1).astype(float)


def bearings_differ(batch: Batch, names: tuple[str, ...]) -> np.ndarray:
    """Whether β/J differs between the wheels, so that the mean rotation depends on the relative motion; bool (P,)."""
    if "x2_dot" not in names:
        return np.zeros(batch.size, bool)
    return np.broadcast_to(~np.asarray(equal_ratios(batch, "beta", "J")), batch.size)


def weakly_damped(batch: Batch) -> np.ndarray:
    """Whether bearing friction is too weak for the first integral to give x2 to 1e-11; bool (P,)."""
    return rotation_decay(batch) < _WEAK_DECAY


def relative_rotation(names: tuple[str, ...], w: np.ndarray, error: np.ndarray, suffix: str = "") -> np.ndarray:
    """x1 − x2 of dynamic states w (..., d) where the error is ε; its velocity with ε' and the suffix "_dot"."""
    at = {name: w[..., i] for i, name in enumerate(names)}
    lateral = at[f"y{suffix}"] if "y" in at else at.get(f"y1{suffix}", 0.0) - at.get(f"y2{suffix}", 0.0)
    return _rotation_difference(at[f"z{suffix}"], error, lateral)


def _rotation_difference(z: np.ndarray, error: np.ndarray, *lateral: np.ndarray | float) -> np.ndarray:
    """x1 − x2 = z + ε − (y1 − y2), (2.14), or its velocity; ``lateral`` are terms whose sum is y1 − y2."""
    difference = z + error
    for term in lateral:
        difference = difference - term
    return difference


def rotation_drifts(batch: Batch, names: tuple[str, ...]) -> np.ndarray:
    """Whether the mean rotation can grow without bound, or does not follow from w to full precision; bool (P,)."""
    if batch.model.kind not in ("torsional", "full"):
        return np.zeros(batch.size, bool)
    unequal = np.asarray(batch["q1"]) != np.asarray(batch["q2"])
    return unequal | (bearings_differ(batch, names) & weakly_damped(batch))


def reset_mean_rotation(batch: Batch, names: tuple[str, ...], w: np.ndarray, error: np.ndarray,
                        error_dot: np.ndarray) -> dict[str, np.ndarray]:
    """x1 and x2 with their velocities, each (P,), with the mean rotation set back to its initial value.

    Such a state leads to the same relative motion as the state w (P, d): the mean rotation has no effect on z, and if
    both wheels have the same β/J, its velocity has none either.
    """
    x, share = initial_values(batch), _first_share(batch, "J")[:, 0]
    difference, difference_dot = relative_rotation(names, w, error), relative_rotation(names, w, error_dot, "_dot")
    mean, mean_dot = (share * x[f"x1{k}"] + (1 - share) * x[f"x2{k}"] for k in ("", "_dot"))
    x2, x2_dot = mean - share * difference, mean_dot - share * difference_dot
    if "x2_dot" in names:
        x2_dot = w[:, names.index("x2_dot")]
    return {"x1": x2 + difference, "x1_dot": x2_dot + difference_dot, "x2": x2, "x2_dot": x2_dot}


@singledispatch
def to_physical(batch: Any, names: tuple[str, ...], w: np.ndarray, tau: np.ndarray, error: np.ndarray,
                error_dot: np.ndarray, x2: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Physical coordinates of dynamic states by name, each (P, S): z and z_dot, and all of x and y that the model has.

    The states w (P, S, d) at the times tau (P, S) since the initial values of the batch are those of the motion from
    there, or of one that differs from it only in the relative motion; ε and ε' at those times broadcast to (P, S).
    x2 (P, S) is the rotation of wheel 2 if it was integrated along the motion, NaN where it is to be computed.
    """
    at = {name: w[..., i] for i, name in enumerate(names)}
    relative = {"z": at["z"], "z_dot": at["z_dot"]}
    if batch.model.kind == "single":
        return relative
    y = _lateral(batch, at, tau) if batch.model.kind == "full" else {}
    difference = _rotation_difference(at["z"], error, y.get("y1", 0.0), -y.get("y2", 0.0))
    difference_dot = _rotation_difference(at["z_dot"], error_dot, y.get("y1_dot", 0.0), -y.get("y2_dot", 0.0))
    mean, mean_dot = _mean_rotation(batch, tau)  # it follows from the sum of the first two rows of (2.12)
    share, integrated = _first_share(batch, "J"), x2
    x2, x2_dot = mean - share * difference, mean_dot - share * difference_dot
    if "x2_dot" in at:
        x2_dot = at["x2_dot"]
        # if β/J differs between the wheels, x2 follows from a first integral of (2.12): in its first two rows together
        # the mesh force cancels, and J1 x1' + J2 x2' + 2β1 x1 + 2β2 x2 − (q1 − q2) τ is constant
        start = initial_values(batch)
        J1, J2, b1, b2, q1, q2 = (_column(batch, batch[n]) for n in ("J1", "J2", "beta1", "beta2", "q1", "q2"))
        a, va, b, vb = (_column(batch, start[n]) for n in COORDINATES["torsional"])
        momentum = J1 * va + J2 * vb + 2 * b1 * a + 2 * b2 * b + (q1 - q2) * tau
        rest = momentum - J1 * (difference_dot + x2_dot) - J2 * x2_dot - 2 * b1 * difference
        friction = np.broadcast_to(2 * (b1 + b2), rest.shape)
        by_integral = np.divide(rest, friction, out=np.zeros(rest.shape), where=friction > 0)
        x2 = np.where(_column(batch, equal_ratios(batch, "beta", "J")), x2, by_integral)
    if integrated is not None:
        x2 = np.where(np.isnan(integrated), x2, integrated)
    return {"x1": x2 + difference, "x1_dot": x2_dot + difference_dot, "x2": x2, "x2_dot": x2_dot, **y, **relative}


def _mean_rotation(batch: Batch, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean rotation m = (J1 x1 + J2 x2)/(J1 + J2) and its velocity, each (P, S), if both wheels have the same β/J.

    It is the solution of m'' = a − r m' with constants a and r, the mean torque and damping:
    m = m(0) + τ m'(0) φ1(−rτ) + a τ² φ2(−rτ), with φ1(x) = (e^x − 1)/x and φ2(x) = (e^x − 1 − x)/x².
    """
    x, share = initial_values(batch), _first_share(batch, "J")[:, 0]
    inertia = _column(batch, batch["J1"]) + _column(batch, batch["J2"])
    a = (_column(batch, batch["q1"]) - _column(batch, batch["q2"])) / inertia
    r = 2 * (_column(batch, batch["beta1"]) + _column(batch, batch["beta2"])) / inertia
    m, m_dot = (_column(batch, share * x[f"x1{k}"] + (1 - share) * x[f"x2{k}"]) for k in ("", "_dot"))
    phi1 = phi2 = np.float64(1.0)  # without initial velocity and torque their factors are 0
    if np.any(m_dot) or np.any(a):
        from scipy.special import hyp1f1  # imported here, since it takes a tenth of a second

        phi1, phi2 = hyp1f1(1, 2, -r * tau), hyp1f1(1, 3, -r * tau) / 2
    return m + tau * (m_dot * phi1 + a * tau * phi2), m_dot * np.exp(-r * tau) + a * tau * phi1


def _lateral(batch: Batch, at: dict[str, np.ndarray], tau: np.ndarray) -> dict[str, np.ndarray]:
    """y1 and y2 with their velocities, each (P, S): from the state, or from y1 − y2 and the mean lateral motion.

    The mean is m = (μ1 y1 + μ2 y2)/(μ1 + μ2). If both supports have the same κ/μ and ζ, it is a free damped
    oscillation, m'' = −2ζ1 m' − (κ1/μ1) m.
    """
    if "y" not in at:
        return {n: at[n] for n in COORDINATES["full"][4:]}
    x, share = initial_values(batch), _first_share(batch, "mu")
    m, m_dot = (_column(batch, share[:, 0] * x[f"y1{k}"] + (1 - share[:, 0]) * x[f"y2{k}"]) for k in ("", "_dot"))
    damping = _column(batch, batch["zeta_support1"])
    square = _column(batch, batch["kappa1"]) / _column(batch, batch["mu1"])
    root = np.sqrt(damping**2 - square + 0j)
    decay, exponent = np.exp((root - damping) * tau), 2 * root * tau
    small = np.abs(exponent) < 1e-6  # (1 − e^(−2ρτ))/(2ρ) without cancellation; its limit for ρ → 0 is τ
    spread = tau * np.where(small, 1 - exponent / 2, -np.expm1(-exponent) / np.where(small, 1, exponent))
    cosine, sine = (decay * (1 + np.exp(-2 * root * tau)) / 2).real, (decay * spread).real
    mean, mean_dot = m * (cosine + damping * sine) + m_dot * sine, m_dot * (cosine - damping * sine) - square * m * sine
    y, y_dot = at["y"], at["y_dot"]
    return {"y1": mean + (1 - share) * y, "y1_dot": mean_dot + (1 - share) * y_dot,
            "y2": mean - share * y, "y2_dot": mean_dot - share * y_dot}


def _first_share(batch: Batch, inertia: str) -> np.ndarray:
    """J1/(J1 + J2) or μ1/(μ1 + μ2), (P, 1)."""
    first, second = (_column(batch, batch[f"{inertia}{n}"]) for n in (1, 2))
    return first / (first + second)


def _column(batch: Batch, value: np.ndarray | float) -> np.ndarray:
    """A value (P,), or one for all points, as a column (P, 1) that broadcasts with times (P, S)."""
    column = np.empty((batch.size, 1))
    column[:, 0] = value
    return column
