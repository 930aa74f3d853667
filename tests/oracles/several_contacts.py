"""Motions with several one-sided contacts by SciPy's DOP853: stopped where a gap vanishes and where a piece ends.

z'' + 2ζz' [law: always, or some contact closed] + Σ κ_e(φ) side_e max(0, side_e z − 1 − o_e(φ)) = f(φ), with the phase
φ = τ/T, the stiffness κ_e constant and the gap o_e a polynomial on pieces of the period. All contacts whose gap is 0 at
a stop change together.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.oracles.stored import stored

_SAME = 1e-11  # gaps that are smaller at a stop are 0


@dataclass
class Contacts:
    sides: np.ndarray  # (M,)
    edges: np.ndarray  # (N,) ascending from 0
    stiffness: np.ndarray  # (M, N), 0 where a contact is absent
    gap: np.ndarray  # (M, N, 3) in the time since the piece began, in periods


@dataclass
class Mesh:
    contacts: Contacts
    omega: float
    zeta: float
    force: float
    error: float  # amplitude of cos φ, whose second derivative drives
    law: str


@stored()
def after_periods(mesh: Mesh, state: np.ndarray, periods: int) -> np.ndarray:
    """(z, z') after whole mesh periods from phase 0."""
    period, edges = 2 * np.pi / mesh.omega, np.append(mesh.contacts.edges, 1.0)
    for n in range(periods):
        for piece in range(len(edges) - 1):
            if edges[piece + 1] - edges[piece] > 1e-12:
                state = _piece(mesh, state, piece, (n + edges[piece]) * period, (n + edges[piece + 1]) * period)
    return state


def _gaps(mesh: Mesh, piece: int, start: float, t: float, z: float) -> np.ndarray:
    u = (t - start) * mesh.omega / (2 * np.pi)
    return mesh.contacts.sides * z - 1 - mesh.contacts.gap[:, piece] @ np.array([1.0, u, u * u])


def _piece(mesh: Mesh, state: np.ndarray, piece: int, start: float, end: float) -> np.ndarray:
    stiffness, sides = mesh.contacts.stiffness[:, piece], mesh.contacts.sides
    closed, t = (_gaps(mesh, piece, start, start, state[0]) > 0) & (stiffness > 0), start
    while t < end:
        def right_side(t: float, w: np.ndarray, closed: np.ndarray = closed) -> list[float]:
            spring = np.sum((stiffness * sides * _gaps(mesh, piece, start, t, w[0]))[closed])
            damping = 2 * mesh.zeta * w[1] if mesh.law == "always" or closed.any() else 0.0
            drive = mesh.force + mesh.error * mesh.omega**2 * np.cos(mesh.omega * t)
            return [w[1], drive - spring - damping]

        switch = _first_switch(mesh, right_side, state, piece, start, t, end, closed)
        if switch is None:
            return _advance(right_side, state, t, end)
        state, t = _advance(right_side, state, t, switch), switch
        gaps = _gaps(mesh, piece, start, t, state[0])
        closed = np.where(np.abs(gaps) < _SAME, ~closed, closed) & (stiffness > 0)
    return state


def _advance(right_side, state: np.ndarray, t: float, end: float) -> np.ndarray:
    if end - t < 1e-14:
        return state
    return solve_ivp(right_side, (t, end), state, method="DOP853", rtol=1e-13, atol=1e-14, max_step=0.05).y[:, -1]


def _first_switch(mesh: Mesh, right_side, state: np.ndarray, piece: int, start: float, t: float, end: float,
                  closed: np.ndarray) -> float | None:
    """The first instant after t at which a contact's gap has the wrong sign, from short steps and then Brent's
    method."""
    inside = np.where(closed, 1.0, -1.0)
    present = mesh.contacts.stiffness[:, piece] > 0
    count = max(2, int(np.ceil((end - t) / 0.01)))
    times, before = np.linspace(t, end, count), state
    for left, right in pairwise(times):
        after = _advance(right_side, before, left, right)
        found = []
        for e in np.flatnonzero(present & (inside * _gaps(mesh, piece, start, right, after[0]) < 0)):
            def gap(s: float, e: int = e, left: float = left, before: np.ndarray = before) -> float:
                return inside[e] * _gaps(mesh, piece, start, s, _advance(right_side, before, left, s)[0])[e]

            first = left if gap(left) > 0 else left + 1e-9
            found.append(brentq(gap, first, right, xtol=1e-15, rtol=1e-15) if gap(first) > 0 else left)
        if found:
            return min(found)
        before = after
    return None
