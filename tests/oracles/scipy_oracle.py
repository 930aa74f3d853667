"""SciPy's DOP853, stopped and restarted at every contact switch and at every stiffness jump.

Contact begins at z = ±1, and ends there, or, with the damping law ``unilateral``, where the mesh force vanishes.
Between stops the right side is smooth, so the method keeps its order. A switch is found on the polynomials that
pass through z and the force at Chebyshev points of the step's dense output, and refined by Newton steps on states
from fresh steps; the state there, too, comes from a fresh step to that time, never from the dense output, which is less
accurate.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.polynomial import chebyshev
from scipy.integrate import DOP853

from gearchaos.model import HarmonicStiffness, MeshModel
from tests.oracles.march import march, named, stops_of_section, stops_of_taus
from tests.oracles.stored import stored

TOLERANCE = 1e-13
_DEGREE = 14
_NODES = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_SHORTEST = 1e-12
"""Over a shorter time (in τ) the tangent of the motion is exact to rounding."""
_SHALLOWEST = 1e-14
"""A motion that is beyond a switch by less than this, in z or in force, may be rounding; missing it changes the state
by less than this."""


@stored("march")
def section(model: MeshModel, periods: int, transient: int = 0) -> dict[str, np.ndarray]:
    """Physical coordinates by name at τ = T, 2T, ... after the transient, each (periods,)."""
    return _at(model, stops_of_section(periods, transient))


@stored("march")
def trajectory(model: MeshModel, taus: Iterable[float]) -> dict[str, np.ndarray]:
    """Physical coordinates by name at the sorted times ``taus``, each (times,)."""
    return _at(model, stops_of_taus(model, taus))


def _at(model: MeshModel, stops: list[tuple[int, float]]) -> dict[str, np.ndarray]:
    return named(model, march(model, stops, partial(_segment, model)), stops)


def _segment(model: MeshModel, state: np.ndarray, t0: float, t1: float, level: float) -> np.ndarray:
    contact = _contact(*(g[0] for g in _gaps(model, level, np.array([t0]), state[:, None])))
    while True:
        right_side = _right_side(model, contact, level)
        solver = _solver(right_side, t0, state, t1)
        switch = None
        while solver.status == "running" and switch is None:
            before = solver.t, solver.y.copy()
            _step(solver)
            switch = _first_switch(model, level, solver, contact)
        if switch is None:
            return solver.y
        t0, contact, slope, which = switch
        if slope:
            t0 = _refined(model, level, right_side, before, t0, slope, which)
        state = _redo(right_side, *before, t0)
        if t0 >= t1:
            return state


def _refined(model: MeshModel, level: float, right_side: Callable, before: tuple, t: float, slope: float,
             which: int) -> float:
    """The time of a switch, a root of one of the `_gaps` with this slope, by Newton steps."""
    for _ in range(3):
        gap = _gaps(model, level, np.array([t]), _redo(right_side, *before, t)[:, None])[which][0]
        t -= gap / slope if abs(gap) < 1e-9 and abs(slope) > 1e-5 else 0.0
    return max(t, before[0])


def _solver(right_side: Callable, t0: float, state: np.ndarray, t1: float) -> DOP853:
    first = min(0.01, t1 - t0)
    return DOP853(right_side, t0, state, t1, rtol=TOLERANCE, atol=TOLERANCE, max_step=0.1, first_step=first)


def _step(solver: DOP853) -> None:
    message = solver.step()
    if solver.status == "failed":
        raise ArithmeticError(message)


def _redo(right_side: Callable, t0: float, state: np.ndarray, t1: float) -> np.ndarray:
    """The state at t1 by steps that end there; over a time too short for the solver the tangent is exact."""
    if t1 - t0 < _SHORTEST:
        return state + (t1 - t0) * right_side(t0, state)
    solver = _solver(right_side, t0, state, t1)
    while solver.status == "running":
        _step(solver)
    return solver.y


def _first_switch(
    model: MeshModel, level: float, solver: DOP853, contact: int
) -> tuple[float, int, float, int] | None:
    """Time and new contact state of the first interval of the step that belongs to another contact state, with the
    slope and the number of the one of the `_gaps` that vanishes there; the slope is 0 at the start of the step."""
    middle, half = (solver.t + solver.t_old) / 2, (solver.t - solver.t_old) / 2
    gaps = _gaps(model, level, middle + half * _NODES, solver.dense_output()(middle + half * _NODES))
    if all(np.abs(g).min() > np.ptp(g) for g in gaps):
        return None
    polynomials = [chebyshev.chebfit(_NODES, g, _DEGREE) for g in gaps]
    roots = sorted((root, which) for which, p in enumerate(polynomials) for root in _roots(p))
    for (a, which), (b, _) in pairwise([(-1.0, -1), *roots, (1.0, -1)]):
        values = [float(chebyshev.chebval((a + b) / 2, p)) for p in polynomials]
        found, depth = _contact(*values), min(values[::2] if 1 in (contact, _contact(*values)) else values[1::2])
        if found != contact and abs(depth) > _SHALLOWEST:
            slope = float(chebyshev.chebval(a, chebyshev.chebder(polynomials[which])) / half) if which >= 0 else 0.0
            return middle + half * a, found, slope, which
    return None


def _roots(polynomial: np.ndarray) -> np.ndarray:
    if np.abs(polynomial[1:]).sum() < np.abs(polynomial[0]):
        return np.empty(0)
    roots = chebyshev.chebroots(polynomial)
    real = roots.real[np.abs(roots.imag) < 1e-6]
    return real[np.abs(real) < 1]


def _gaps(model: MeshModel, level: float, t: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, ...]:
    """How far z of states (n, times) is beyond the front and the back flank; with the law ``unilateral`` also the
    forces with which these flanks would push."""
    z, z_dot = _motion(model, t, states)
    if model.damping_law != "unilateral":
        return z - 1, -1 - z
    return z - 1, -1 - z, *(side * _element(model, side, level, t, z, z_dot) for side in (1, -1))


def _contact(front: float, back: float, front_force: float = 1.0, back_force: float = 1.0) -> int:
    return int(front > 0 and front_force > 0) - int(back > 0 and back_force > 0)


def _series(amplitudes, phases, omega: float, t, derivative: int = 0):
    """Σ a_j cos(jωt − p_j), or a derivative of it: each turns the phase by a quarter and brings a factor jω."""
    total = 0.0
    for j, (a, p) in enumerate(zip(amplitudes, phases, strict=True), start=1):
        total = total + a * (j * omega) ** derivative * np.cos(j * omega * t - p + derivative * np.pi / 2)
    return total


def _motion(model: MeshModel, t: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """z and z' of (2.14), (2.15) for states (n, times)."""
    if model.kind == "single":
        return states[0], states[1]
    error, error1 = (_series(model.error.amplitudes, model.error.phases, model.omega, t, n) for n in (0, 1))
    z, z_dot = states[0] - states[2] - error, states[1] - states[3] - error1
    return (z + states[4] - states[6], z_dot + states[5] - states[7]) if model.kind == "full" else (z, z_dot)


def _right_side(model: MeshModel, contact: int, level: float) -> Callable[[float, np.ndarray], np.ndarray]:
    """The right side of (2.12) or (2.17) in one contact state and one stiffness level."""
    if model.kind == "single":
        return partial(_relative, model, contact, level)
    return partial(_wheels, model, contact, level)


def _element(model: MeshModel, contact: int, level: float, t, z, z_dot):
    """The mesh force 2ζz' + χ(τ) f(z) in contact with one flank."""
    chi = level
    if isinstance(model.stiffness, HarmonicStiffness):
        chi = chi + _series(model.stiffness.amplitudes, model.stiffness.phases, model.omega, t)
    return 2 * model.zeta * z_dot + chi * (z - contact)


def _force(model: MeshModel, contact: int, level: float, t: float, z: float, z_dot: float) -> float:
    """The mesh force; in the gap there is none, but for the damper that the law ``always`` has there."""
    if contact == 0:
        return 2 * model.zeta * z_dot if model.damping_law == "always" else 0.0
    return _element(model, contact, level, t, z, z_dot)


def _relative(model: MeshModel, contact: int, level: float, t: float, state: np.ndarray) -> np.ndarray:
    """(2.17) with the constants of (2.18)."""
    z, z_dot = state
    share = (model.J1 + model.J2) / (model.J1 * model.J2)
    q0 = model.q1 / model.J1 + model.q2 / model.J2
    error2 = _series(model.error.amplitudes, model.error.phases, model.omega, t, 2)
    return np.array([z_dot, q0 - error2 - share * _force(model, contact, level, t, z, z_dot)])


def _wheels(model: MeshModel, contact: int, level: float, t: float, state: np.ndarray) -> np.ndarray:
    """(2.12), all four rows or the first two; the right side of the second row is −q2."""
    m = model
    x1_dot, x2_dot = state[1], state[3]
    force = _force(m, contact, level, t, *_motion(m, t, state))
    x1_ddot = (m.q1 - 2 * m.beta1 * x1_dot - force) / m.J1
    x2_ddot = (-m.q2 - 2 * m.beta2 * x2_dot + force) / m.J2
    out = [x1_dot, x1_ddot, x2_dot, x2_ddot]
    if m.kind == "full":
        y1, y1_dot, y2, y2_dot = state[4:]
        out += [y1_dot, (-2 * m.mu1 * m.zeta_support1 * y1_dot - m.kappa1 * y1 - force) / m.mu1]
        out += [y2_dot, (-2 * m.mu2 * m.zeta_support2 * y2_dot - m.kappa2 * y2 + force) / m.mu2]
    return np.array(out)
