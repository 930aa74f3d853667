"""What both oracles share: where a motion starts, where its stiffness jumps, what is read off a state."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from gearchaos.model import MeshModel, SteppedStiffness, TwoLevelStiffness

NAMES = {
    "single": ("z", "z_dot"),
    "torsional": ("x1", "x1_dot", "x2", "x2_dot"),
    "full": ("x1", "x1_dot", "x2", "x2_dot", "y1", "y1_dot", "y2", "y2_dot"),
}
Segment = Callable[[np.ndarray, float, float, float], np.ndarray]
"""(state, from, to, stiffness level) -> state; times counted from the start of a mesh period."""


def error_at(model: MeshModel, tau: float) -> tuple[float, float]:
    """ε and ε' of (2.15) at τ."""
    series = list(enumerate(zip(model.error.amplitudes, model.error.phases, strict=True), start=1))
    w = model.omega
    value = sum(a * math.cos(j * w * tau - p) for j, (a, p) in series)
    slope = sum(-j * w * a * math.sin(j * w * tau - p) for j, (a, p) in series)
    return value, slope


def start(model: MeshModel) -> np.ndarray:
    """The state at τ = 0 in the order of NAMES: x1 = 1 and the rest 0 where the model says nothing."""
    given = dict(model.initial)
    if model.kind != "single":
        return np.array([given.get(n, 1.0 if n == "x1" else 0.0) for n in NAMES[model.kind]])
    if given.keys() & {"z", "z_dot"}:
        return np.array([given.get("z", 0.0), given.get("z_dot", 0.0)])
    error, error_dot = error_at(model, 0.0)
    z = given.get("x1", 1.0) - given.get("x2", 0.0) - error
    return np.array([z, given.get("x1_dot", 0.0) - given.get("x2_dot", 0.0) - error_dot])


def levels(model: MeshModel) -> list[tuple[float, float, float]]:
    """(from, to, stiffness level) over one mesh period, (2.16); the level of a Fourier series (2.7) is 1."""
    period = 2 * math.pi / model.omega
    if isinstance(model.stiffness, SteppedStiffness):
        values, begins = model.stiffness.levels, [start * period for start in model.stiffness.starts]
        pieces = [(0.0, begins[0], values[-1]), *zip(begins, [*begins[1:], period], values, strict=True)]
        return [p for p in pieces if p[1] > p[0]]
    if not isinstance(model.stiffness, TwoLevelStiffness):
        return [(0.0, period, 1.0)]
    s = model.stiffness
    jump = (s.contact_ratio - 1) * period
    pieces = [(0.0, jump, 1 + s.chi1), (jump, period, 1 - s.chi2)]
    return [p for p in pieces if p[1] > p[0]]


def march(model: MeshModel, stops: Iterable[tuple[int, float]], segment: Segment) -> np.ndarray:
    """States (stops, n) at the sorted ``stops`` (period index from 0, time in that period)."""
    state, at, out = start(model), (0, 0.0), []
    for stop in stops:
        while at[0] < stop[0]:
            state = _within_period(model, state, at[1], math.inf, segment)
            at = (at[0] + 1, 0.0)
        state = _within_period(model, state, at[1], stop[1], segment)
        at = stop
        out.append(state)
    return np.array(out)


def _within_period(model: MeshModel, state: np.ndarray, t0: float, t1: float, segment: Segment) -> np.ndarray:
    for begin, end, level in levels(model):
        a, b = max(begin, t0), min(end, t1)
        if b > a:
            state = segment(state, a, b, level)
    return state


def stops_of_taus(model: MeshModel, taus: Iterable[float]) -> list[tuple[int, float]]:
    """Sorted times τ as (period, time in it)."""
    period = 2 * math.pi / model.omega
    return [(int(tau // period), tau - int(tau // period) * period) for tau in taus]


def stops_of_section(periods: int, transient: int) -> list[tuple[int, float]]:
    """The instants T, 2T, ... after the transient, each the start of the period that follows."""
    return [(k, 0.0) for k in range(transient + 1, transient + periods + 1)]


def named(model: MeshModel, states: np.ndarray, stops: Iterable[tuple[int, float]]) -> dict[str, np.ndarray]:
    """Physical coordinates by name, each (stops,), with z and z_dot of (2.14) always."""
    out = dict(zip(NAMES[model.kind], states.T, strict=True))
    if model.kind == "single":
        return out
    error, error_dot = np.array([error_at(model, t) for _, t in stops]).T
    y = out["y1"] - out["y2"] if "y1" in out else 0.0
    y_dot = out["y1_dot"] - out["y2_dot"] if "y1" in out else 0.0
    out["z"] = out["x1"] - out["x2"] + y - error
    out["z_dot"] = out["x1_dot"] - out["x2_dot"] + y_dot - error_dot
    return out
