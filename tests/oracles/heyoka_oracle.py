"""heyoka's Taylor integrator with located events: one compiled integrator for each contact state.

Equations (2.12)-(2.18) are written as heyoka expressions with every number a runtime parameter, so an integrator is
compiled once for a kind of model, a count of harmonics and a contact state, and then serves any parameters. A
contact switch z = ±1 is a terminal event; stiffness jumps are times at which the integration stops. The peers of
``benchmarks/`` are built for speed instead and stand there.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache, partial
from typing import Any

import heyoka as hy
import numpy as np
from scipy.optimize import brentq

from gearchaos.model import HarmonicStiffness, MeshModel
from tests.oracles.march import NAMES, march, named, stops_of_section, stops_of_taus
from tests.oracles.stored import stored

TOLERANCE = 1e-18
"""Per-step error asked for; below the rounding unit, so that truncation never counts."""
_NUDGE = 1e-7
"""A motion near the boundary first moves by steps of this length, doubling, without events: heyoka can lose the
crossing that follows when its event function is 0 to rounding at the start of a step."""
_NEAR = 1e-12
"""This close to |z| = 1 a motion counts as on the boundary. The wrong contact state there errs by 1e-12 in force, and
only over the time spent there."""
_LOST = 1e-11
"""A step that ends this far on the wrong side of the boundary has lost a contact switch."""


@stored("march")
def section(model: MeshModel, periods: int, transient: int = 0) -> dict[str, np.ndarray]:
    """Physical coordinates by name at τ = T, 2T, ... after the transient, each (periods,)."""
    return _at(model, stops_of_section(periods, transient))


@stored("march")
def trajectory(model: MeshModel, taus: Iterable[float]) -> dict[str, np.ndarray]:
    """Physical coordinates by name at the sorted times ``taus``, each (times,)."""
    return _at(model, stops_of_taus(model, taus))


@stored("march")
def summit(model: MeshModel) -> np.ndarray:
    """The first maximum of z after the start, ()."""
    def at(*taus: float) -> dict[str, np.ndarray]:
        return _at(model, stops_of_taus(model, taus))

    taus = np.linspace(0, model.period, 200)[1:-1]
    slope = at(*taus)["z_dot"]
    first = np.flatnonzero((slope[:-1] > 0) & (slope[1:] <= 0))[0]
    top = brentq(lambda tau: at(tau)["z_dot"][0], taus[first], taus[first + 1], xtol=1e-14)
    return at(top)["z"][0]


def _at(model: MeshModel, stops: list[tuple[int, float]]) -> dict[str, np.ndarray]:
    return named(model, march(model, stops, partial(_segment, model)), stops)


def _segment(model: MeshModel, state: np.ndarray, t0: float, t1: float, level: float) -> np.ndarray:
    while t0 < t1:
        state, t0, contact = _off_boundary(model, level, state, t0, t1)
        integrator = _loaded(_integrator(*_shape(model), contact, True), model, level, state, t0)
        _run(integrator, contact, t1)
        state, t0 = integrator.state.copy(), integrator.time
    return state


def _off_boundary(
    model: MeshModel, level: float, state: np.ndarray, t0: float, t1: float
) -> tuple[np.ndarray, float, int]:
    """State, time and contact state as soon as the motion is clear of the boundary."""
    integrator = _loaded(_integrator(*_shape(model), 0, False), model, level, state, t0)
    nudge = _NUDGE
    while abs(abs(_relative(integrator)) - 1) < _NEAR and integrator.time < t1:
        integrator.propagate_until(min(integrator.time + nudge, t1))
        nudge *= 2
    z = _relative(integrator)
    return integrator.state.copy(), integrator.time, int(z > 1) - int(z < -1)


def _run(integrator: Any, contact: int, t1: float) -> None:
    """Step to t1 or to the next contact switch."""
    while integrator.time < t1:
        outcome, _ = integrator.step(max_delta_t=t1 - integrator.time)
        if -3 < int(outcome) < 0:
            return
        if outcome not in (hy.taylor_outcome.success, hy.taylor_outcome.time_limit):
            raise ArithmeticError(str(outcome))
        if _lost(_relative(integrator), contact):
            raise ArithmeticError(f"heyoka lost a contact switch before {integrator.time}")


def _lost(z: float, contact: int) -> bool:
    return abs(z) > 1 + _LOST if contact == 0 else contact * z < 1 - _LOST


def _relative(integrator: Any) -> float:
    """z of the state, (2.14)."""
    kind, errors = integrator.shape
    if kind == "single":
        return float(integrator.state[0])
    pars = integrator.pars[: 1 + len(_SCALARS) + 2 * errors]
    return float(_compiled_z(kind, errors)(integrator.state, pars=pars, time=integrator.time)[0])


@cache
def _compiled_z(kind: str, errors: int) -> Any:
    s = _Symbols(kind, errors, 0)
    return hy.cfunc([_z(s, kind)[0]], list(s.states.values()))


def _loaded(integrator: Any, model: MeshModel, level: float, state: np.ndarray, t0: float) -> Any:
    integrator.time = t0
    integrator.state[:] = state
    integrator.pars[:] = _parameters(model, level)[: len(integrator.pars)]
    if integrator.with_events:
        integrator.reset_cooldowns()
    return integrator


def _shape(model: MeshModel) -> tuple[str, int, int]:
    """What an integrator is compiled for: kind, harmonics of ε, harmonics of χ."""
    harmonic = isinstance(model.stiffness, HarmonicStiffness)
    return model.kind, len(model.error.amplitudes), len(model.stiffness.amplitudes) if harmonic else 0


_SCALARS = (
    "omega", "zeta", "J1", "J2", "q1", "q2", "beta1", "beta2", "mu1", "mu2", "kappa1", "kappa2",
    "zeta_support1", "zeta_support2",
)


def _parameters(model: MeshModel, level: float) -> list[float]:
    values = [level, *(getattr(model, name) for name in _SCALARS)]
    values += [*model.error.amplitudes, *model.error.phases]
    if isinstance(model.stiffness, HarmonicStiffness):
        values += [*model.stiffness.amplitudes, *model.stiffness.phases]
    return values


class _Symbols:
    """heyoka expressions by the paper's names, for a given kind and numbers of harmonics."""

    def __init__(self, kind: str, errors: int, stiffnesses: int) -> None:
        self.states = dict(zip(NAMES[kind], hy.make_vars(*NAMES[kind]), strict=True))
        self.level = hy.par[0]
        self.scalars = {name: hy.par[i] for i, name in enumerate(_SCALARS, start=1)}
        base = 1 + len(_SCALARS)
        self.error = self._series(base, errors)
        self.stiffness = self._series(base + 2 * errors, stiffnesses)

    def __getattr__(self, name: str) -> Any:
        found = {**self.__dict__.get("scalars", {}), **self.__dict__.get("states", {})}
        if name not in found:
            raise AttributeError(name)
        return found[name]

    def _series(self, base: int, count: int) -> list[tuple[Any, Any]]:
        """(amplitude, argument jωτ − phase) of each harmonic."""
        argument = [j * self.omega * hy.time - hy.par[base + count + j - 1] for j in range(1, count + 1)]
        return [(hy.par[base + j], argument[j]) for j in range(count)]


def _z(s: _Symbols, kind: str) -> tuple[Any, Any]:
    """z and z' of (2.14), (2.15)."""
    if kind == "single":
        return s.z, s.z_dot
    z = s.x1 - s.x2 - sum(a * hy.cos(g) for a, g in s.error)
    z_dot = s.x1_dot - s.x2_dot + sum(a * j * s.omega * hy.sin(g) for j, (a, g) in enumerate(s.error, 1))
    return (z + s.y1 - s.y2, z_dot + s.y1_dot - s.y2_dot) if kind == "full" else (z, z_dot)


def _force(s: _Symbols, z: Any, z_dot: Any, contact: int) -> Any:
    """The mesh force 2ζz' + χ(τ) f(z), with f of (2.13) in one contact state."""
    chi = s.level + sum(c * hy.cos(g) for c, g in s.stiffness)
    spring = chi * (z - contact) if contact else 0.0
    return 2.0 * s.zeta * z_dot + spring


def _equations(s: _Symbols, kind: str, contact: int) -> list[tuple[Any, Any]]:
    z, z_dot = _z(s, kind)
    force = _force(s, z, z_dot, contact)
    if kind == "single":
        excitation = sum(a * j * j * s.omega * s.omega * hy.cos(g) for j, (a, g) in enumerate(s.error, 1))
        q0 = s.q1 / s.J1 + s.q2 / s.J2
        return [(s.z, s.z_dot), (s.z_dot, q0 + excitation - (s.J1 + s.J2) / (s.J1 * s.J2) * force)]
    rows = [
        (s.x1, s.x1_dot), (s.x1_dot, (s.q1 - 2.0 * s.beta1 * s.x1_dot - force) / s.J1),
        (s.x2, s.x2_dot), (s.x2_dot, (-s.q2 - 2.0 * s.beta2 * s.x2_dot + force) / s.J2),
    ]
    return rows + (_lateral(s, force) if kind == "full" else [])


def _lateral(s: _Symbols, force: Any) -> list[tuple[Any, Any]]:
    """The last two rows of (2.12)."""
    left = -2.0 * s.zeta_support1 * s.y1_dot - (s.kappa1 * s.y1 + force) / s.mu1
    right = -2.0 * s.zeta_support2 * s.y2_dot - (s.kappa2 * s.y2 - force) / s.mu2
    return [(s.y1, s.y1_dot), (s.y1_dot, left), (s.y2, s.y2_dot), (s.y2_dot, right)]


@cache
def _integrator(kind: str, errors: int, stiffnesses: int, contact: int, events: bool) -> Any:
    s = _Symbols(kind, errors, stiffnesses)
    z, _ = _z(s, kind)
    rows = _equations(s, kind, contact)
    t_events = _events(z, contact) if events else []
    integrator = hy.taylor_adaptive(rows, np.zeros(len(rows)), tol=TOLERANCE, t_events=t_events)
    integrator.shape = kind, errors
    return integrator


def _events(z: Any, contact: int) -> list[Any]:
    """The switches out of a contact state; the direction keeps an entry from being taken for an exit."""
    up, down = hy.event_direction.positive, hy.event_direction.negative
    if contact == 0:
        return [hy.t_event(z - 1.0, direction=up), hy.t_event(z + 1.0, direction=down)]
    return [hy.t_event(z - float(contact), direction=down if contact == 1 else up)]
