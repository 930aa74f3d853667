"""Step matrices, tabulated once per parameter point: E and g of w(k+1) = E w(k) + g, for each contact state."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import ORDER, STEP_ANGLE, WIDTH, Nodes, chunk, parameters, rows
from gearchaos.flow.simd import load, splat
from gearchaos.flow.taylor import add_wave, drive, expand, finish, set_gains
from gearchaos.flow.workspace import fill_point, fill_step
from gearchaos.model.switched import SwitchedAffine

_MOST_SHARED_HARMONICS = 4
"""With more harmonics it is cheaper to tabulate the forcing at every node than to sum its waves in every step."""


def parameter_array(system: SwitchedAffine) -> np.ndarray:
    """The system's arrays side by side, one row per point, in the order of `layout.Parameters`."""
    bound0, bound = bounds(system)
    columns = [
        system.A, system.b, system.f0, system.levels, system.omega, bound0, bound, system.damping, system.velocity,
        system.velocity0, system.f_cos, system.f_sin, system.chi_cos, system.chi_sin, system.velocity_cos,
        system.velocity_sin,
    ]
    return np.ascontiguousarray(np.concatenate([c.reshape(system.points, -1) for c in columns], axis=1))


def stiffest(system: SwitchedAffine) -> np.ndarray:
    """An upper bound of the mesh stiffness χ(τ), (P,)."""
    return system.levels.max(axis=1) + np.hypot(system.chi_cos, system.chi_sin).sum(axis=1)


def bounds(system: SwitchedAffine) -> tuple[np.ndarray, np.ndarray]:
    """How large z'' and z''' can be where z is near a boundary and slow: constants (P, 2), factors of |w_i| (P, d).

    There the spring force and the damping force are small; twice as much covers what they add on a step.
    """
    A, order = system.A, np.arange(1, system.f_cos.shape[1] + 1)
    waves = np.hypot(system.f_cos, system.f_sin)
    second = np.abs(system.f0[:, 1]) + waves.sum(axis=1)
    reach = STEP_ANGLE / rate(system)
    spring = np.abs(A[:, 1, 1]) + system.b[:, 1] * stiffest(system) * reach
    third = spring * second + (waves * order * system.omega[:, None]).sum(axis=1)
    factors = np.maximum(np.abs(A[:, 1, :]), np.abs((A @ A)[:, 1, :]))
    return 2.0 * np.stack([second, third], axis=1), 2.0 * factors


def rate(system: SwitchedAffine) -> np.ndarray:
    """The fastest angular rate of the motion, (P,): free and contact modes, and the highest harmonics."""
    contact = system.A.copy()
    contact[:, :, 0] -= system.b * stiffest(system)[:, None]
    modes = np.maximum(_spectral_radius(system.A), _spectral_radius(contact))
    highest = max(system.f_cos.shape[1], system.chi_cos.shape[1], 1)
    return np.maximum(modes, highest * system.omega)


def _spectral_radius(A: np.ndarray) -> np.ndarray:
    """A close upper bound of the largest |eigenvalue|: the Frobenius norm of A^16, rooted; scaled against overflow."""
    scale = np.maximum(np.abs(A).max(axis=(1, 2)), 1e-300)
    power = A / scale[:, None, None]
    for _ in range(4):
        power = power @ power
    return scale * np.sqrt((power**2).sum(axis=(1, 2))) ** (1 / 16)


def shared(system: SwitchedAffine) -> bool:
    """Whether equal steps on one stiffness level share their matrices.

    Where the stiffness has harmonics, the split differs from point to point, or the harmonics of the forcing are many,
    every step has its own.
    """
    return system.one_split and system.chi_cos.shape[1] == 0 and system.f_cos.shape[1] <= _MOST_SHARED_HARMONICS


def kept(system: SwitchedAffine) -> int:
    """How many harmonics of the forcing keep their own rows in the step tables: where steps have their own matrices,
    the forcing is part of the constant."""
    return system.f_cos.shape[1] if shared(system) else 0


def tabulate(system: SwitchedAffine, phys: np.ndarray, node: Nodes, steps: int) -> np.ndarray:
    """The affine steps (P, pieces, 3, rows) of points with so many steps.

    Contact states in the order back, free, front. Rows: E (d*d), constant (d), then responses to cos jωτ and to
    sin jωτ (d each) for the harmonics that keep their own.
    """
    d, (h, k), own = system.dimension, (system.f_cos.shape[1], system.chi_cos.shape[1]), kept(system)
    first = np.searchsorted(node.piece[:steps], np.arange(node.piece[steps - 1] + 1))
    table = np.zeros((system.points, len(first), 3, d * d + d + 2 * own * d))
    course = steps * np.arange(system.points) if len(node.piece) > steps else np.zeros(system.points, np.int64)
    _tabulate((0,) * d, phys, h, k, node.values, course, first, own, chunk(d, h, k), table)
    return table


@kernel
def _clear(ws, first, count):
    for i in range(first * WIDTH, (first + count) * WIDTH):
        ws[i] = 0.0


@kernel
def _respond(dims, ws, forced, varying, table, points, piece, state, first, stride):
    """Run the step for the chunk and store its end as rows ``first``, ``first + stride``, ... of the table."""
    end = rows(len(dims)).end
    expand(dims, ws, forced, varying)
    finish(dims, ws)
    for l in range(WIDTH):
        for i in range(len(dims)):
            table[points[l], piece, state, first + i * stride] = ws[(end + i) * WIDTH + l]


@kernel
def _tabulate_step(dims, phys, h, k, nodes, piece, state, kept, work, points, table):
    """All rows of one step in one contact state for a chunk of points."""
    d = len(dims)
    at, ws = rows(d), work.ws
    fill_point(dims, phys, h, k, points, False, ws)
    fill_step(dims, h, k, nodes, work.nodes, ws)
    for l in range(WIDTH):
        ws[at.sigma * WIDTH + l] = state - 1.0
        ws[at.share * WIDTH + l] = 1.0
    drive(dims, h, k, ws)
    _clear(ws, at.start, d)
    if kept > 0:
        _clear(ws, at.forcing, ORDER + 1)
    _respond(dims, ws, True, k > 0, table, points, piece, state, d * d, 1)
    for j in range(d):
        _clear(ws, at.start, d)
        for l in range(WIDTH):
            ws[(at.start + j) * WIDTH + l] = 1.0
        _respond(dims, ws, False, k > 0, table, points, piece, state, j, d)
    if kept > 0:
        _tabulate_waves(dims, phys, h, k, piece, state, work, points, table)


@kernel
def _tabulate_waves(dims, phys, h, k, piece, state, work, points, table):
    """Responses to cos jωτ and sin jωτ from rest: a wave that starts at phase 0 and one a quarter turn ahead."""
    d = len(dims)
    at, ws, par = rows(d), work.ws, parameters(d, h, k)
    _clear(ws, at.start, d)
    _clear(ws, at.push, d)
    _clear(ws, at.sigma, 1)
    for j in range(h):
        angle = load(ws, at.h) * load(ws, at.omega) * splat(j + 1.0)
        for l in range(WIDTH):
            ws[at.phase * WIDTH + l] = 1.0
            ws[(at.phase + 1) * WIDTH + l] = 0.0
        for quarter in range(2):
            cos, sin = par.f_cos + j, par.f_sin + j
            if quarter == 0:
                set_gains(phys, points, cos, sin, 1.0, ws, at.gain)
            else:
                set_gains(phys, points, sin, cos, -1.0, ws, at.gain)
            add_wave(ws, at.forcing, load(ws, at.gain), load(ws, at.gain + 1), at.phase, angle, True)
            _respond(dims, ws, True, False, table, points, piece, state, d * d + d + (quarter * h + j) * d, 1)


@kernel
def _tabulate(dims, phys, h, k, nodes, course, first, kept, work, table):
    for base in range(0, table.shape[0], WIDTH):
        for l in range(WIDTH):
            work.points[l] = min(base + l, table.shape[0] - 1)
        for piece in range(table.shape[1]):
            for l in range(WIDTH):
                work.nodes[l] = course[work.points[l]] + first[piece]
            for state in range(3):
                _tabulate_step(dims, phys, h, k, nodes, piece, state, kept, work, work.points, table)
