"""SciPy's DOP853, stopped and restarted at every contact switch z = ±1 and at every stiffness jump.

Between stops the right side is smooth, so the method keeps its order. A switch is found on the polynomial that
passes through z at Chebyshev points of the step's dense output; the state there comes from a fresh step to that
time, never from the dense output, which is less accurate.
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

TOLERANCE = 1e-13
_DEGREE = 14
_NODES = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_SHORTEST = 1e-12
"""A contact interval shorter than this (in τ) changes the state by less than rounding."""


def section(model: MeshModel, periods: int, transient: int = 0) -> dict[str, np.ndarray]:
    """Physical coordinates by name at τ = T, 2T, ... after the transient, each (periods,)."""
    return _at(model, stops_of_section(periods, transient))


def trajectory(model: MeshModel, taus: Iterable[float]) -> dict[str, np.ndarray]:
    """Physical coordinates by name at the sorted times ``taus``, each (times,)."""
    return _at(model, stops_of_taus(model, taus))


def _at(model: MeshModel, stops: list[tuple[int, float]]) -> dict[str, np.ndarray]:
    return named(model, march(model, stops, partial(_segment, model)), stops)


def _segment(model: MeshModel, state: np.ndarray, t0: float, t1: float, level: float) -> np.ndarray:
    contact = _class(float(_z(model, np.array([t0]), state[:, None])[0]))
    while True:
        right_side = _right_side(model, contact, level)
        solver = _solver(right_side, t0, state, t1)
        switch = None
        while solver.status == "running" and switch is None:
            before = solver.t, solver.y.copy()
            _step(solver)
            switch = _first_switch(model, solver, contact)
        if switch is None:
            return solver.y
        t0, contact = switch
        state = _redo(right_side, *before, t0)
        if t0 >= t1:
            return state


def _solver(right_side: Callable, t0: float, state: np.ndarray, t1: float) -> DOP853:
    first = min(0.01, t1 - t0)
    return DOP853(right_side, t0, state, t1, rtol=TOLERANCE, atol=TOLERANCE, max_step=0.5, first_step=first)


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


def _first_switch(model: MeshModel, solver: DOP853, contact: int) -> tuple[float, int] | None:
    """Time and new contact state of the first interval of the step that belongs to another contact state."""
    middle, half = (solver.t + solver.t_old) / 2, (solver.t - solver.t_old) / 2
    z = _z(model, middle + half * _NODES, solver.dense_output()(middle + half * _NODES))
    spread = z.max() - z.min()
    inside = np.abs(z).max() + spread < 1 if contact == 0 else (contact * z).min() - spread > 1
    if inside:
        return None
    polynomial = chebyshev.chebfit(_NODES, z, _DEGREE)
    times = np.concatenate([[-1.0], _crossings(polynomial), [1.0]])
    for a, b in pairwise(times):
        found = _class(chebyshev.chebval((a + b) / 2, polynomial))
        if found != contact and (b - a) * half > _SHORTEST:
            return middle + half * a, found
    return None


def _crossings(polynomial: np.ndarray) -> np.ndarray:
    roots = np.concatenate([chebyshev.chebroots(_plus(polynomial, -side)) for side in (1.0, -1.0)])
    real = roots.real[np.abs(roots.imag) < 1e-6]
    return np.sort(real[np.abs(real) < 1])


def _plus(polynomial: np.ndarray, constant: float) -> np.ndarray:
    shifted = polynomial.copy()
    shifted[0] += constant
    return shifted


def _class(z: float) -> int:
    return int(z > 1) - int(z < -1)


def _series(amplitudes, phases, omega: float, t, derivative: int = 0):
    """Σ a_j cos(jωt − p_j), or a derivative of it: each turns the phase by a quarter and brings a factor jω."""
    total = 0.0
    for j, (a, p) in enumerate(zip(amplitudes, phases, strict=True), start=1):
        total = total + a * (j * omega) ** derivative * np.cos(j * omega * t - p + derivative * np.pi / 2)
    return total


def _z(model: MeshModel, t: np.ndarray, states: np.ndarray) -> np.ndarray:
    """z of (2.14) for states (n, times)."""
    if model.kind == "single":
        return states[0]
    error = _series(model.error.amplitudes, model.error.phases, model.omega, t)
    z = states[0] - states[2] - error
    return z + states[4] - states[6] if model.kind == "full" else z


def _right_side(model: MeshModel, contact: int, level: float) -> Callable[[float, np.ndarray], np.ndarray]:
    """The right side of (2.12) or (2.17) in one contact state and one stiffness level."""
    if model.kind == "single":
        return partial(_relative, model, contact, level)
    return partial(_wheels, model, contact, level)


def _spring(model: MeshModel, contact: int, level: float, t: float, z: float) -> float:
    """χ(τ) f(z), (2.13) with f = 0 inside the backlash."""
    if contact == 0:
        return 0.0
    chi = level
    if isinstance(model.stiffness, HarmonicStiffness):
        chi = chi + _series(model.stiffness.amplitudes, model.stiffness.phases, model.omega, t)
    return chi * (z - contact)


def _relative(model: MeshModel, contact: int, level: float, t: float, state: np.ndarray) -> np.ndarray:
    """(2.17) with the constants of (2.18)."""
    z, z_dot = state
    share = (model.J1 + model.J2) / (model.J1 * model.J2)
    q0 = model.q1 / model.J1 + model.q2 / model.J2
    error2 = _series(model.error.amplitudes, model.error.phases, model.omega, t, 2)
    spring = share * _spring(model, contact, level, t, z)
    return np.array([z_dot, q0 - error2 - 2 * share * model.zeta * z_dot - spring])


def _wheels(model: MeshModel, contact: int, level: float, t: float, state: np.ndarray) -> np.ndarray:
    """(2.12), all four rows or the first two; the right side of the second row is −q2."""
    m = model
    x1_dot, x2_dot = state[1], state[3]
    error1 = _series(m.error.amplitudes, m.error.phases, m.omega, t, 1)
    z, z_dot = _z(m, np.float64(t), state), x1_dot - x2_dot - error1
    if m.kind == "full":
        z_dot = z_dot + state[5] - state[7]
    force = 2 * m.zeta * z_dot + _spring(m, contact, level, t, z)
    x1_ddot = (m.q1 - 2 * m.beta1 * x1_dot - force) / m.J1
    x2_ddot = (-m.q2 - 2 * m.beta2 * x2_dot + force) / m.J2
    out = [x1_dot, x1_ddot, x2_dot, x2_ddot]
    if m.kind == "full":
        y1, y1_dot, y2, y2_dot = state[4:]
        out += [y1_dot, (-2 * m.mu1 * m.zeta_support1 * y1_dot - m.kappa1 * y1 - force) / m.mu1]
        out += [y2_dot, (-2 * m.mu2 * m.zeta_support2 * y2_dot - m.kappa2 * y2 + force) / m.mu2]
    return np.array(out)
