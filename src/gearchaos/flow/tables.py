"""Step matrices, tabulated once per parameter point: E and g of w(k+1) = E w(k) + g, for each contact state."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import (
    LENGTH, LEVEL, ORDER, STEP_ANGLE, WAVES, WIDTH, Nodes, chunk, parameters, rows,
)
from gearchaos.flow.resolve import fill
from gearchaos.flow.simd import load, splat
from gearchaos.flow.taylor import add_wave, drive, expand, finish, set_gains
from gearchaos.switched import SwitchedAffine

_MOST_SHARED_HARMONICS = 4
"""With more harmonics it is cheaper to tabulate the forcing at every node than to sum its waves in every step."""

_SHARES = 8
"""Where the contact ratio differs from point to point, shares of the period are rounded up to eighths."""

_SPREAD = 8.0
"""Tangent vectors may part by this factor, in ln, before they are orthonormalised."""


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


def node_count(system: SwitchedAffine) -> np.ndarray:
    """Steps (P, 2) that both shares of a period need, rounded up to few distinct numbers so that points share them.

    They and `runs` depend on a point alone, so that a result does not depend on what else is computed beside it.
    """
    needed = np.ceil(2 * np.pi / system.omega * rate(system) / STEP_ANGLE)
    grain = 2.0 ** np.floor(np.log2(np.maximum(needed, 16)) - 3)
    whole, share = np.ceil(needed / grain) * grain, np.stack([system.split, 1 - system.split], axis=1)
    if not system.one_split:
        share = np.ceil(_SHARES * share) / _SHARES
    return np.maximum(np.ceil(whole[:, None] * share), 1).astype(int)


def runs(system: SwitchedAffine) -> np.ndarray:
    """In how many runs of steps a period must be cut, (P,), between which tangent vectors are orthonormalised."""
    spread = (np.abs(system.trace) + 1.0) * system.period  # of ln|v| in a period, at the very most
    return 2 ** np.ceil(np.log2(np.maximum(spread / _SPREAD, 1.0))).astype(int)


def two_lengths(first: int, second: int, split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths and starts (N, Q) of the steps as shares of the period, the stiffness jump among the nodes."""
    length = np.concatenate([np.tile(split / first, (first, 1)), np.tile((1 - split) / second, (second, 1))])
    start = np.concatenate(
        [np.arange(first)[:, None] * (split / first), split + np.arange(second)[:, None] * ((1 - split) / second)]
    )
    return length, start


def sampled(count: int, split: float, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lengths and starts (N, 1) of steps that include equidistant samples, and which nodes the samples are."""
    fine = samples * int(np.ceil(count / samples))
    start = np.arange(fine) / fine
    nearest = np.argmin(np.abs(start - split))
    if abs(start[nearest] - split) < 1e-12:
        start[nearest] = split
    elif 0 < split < 1:
        start = np.sort(np.append(start, split))
    length = np.diff(np.append(start, 1.0))
    which = np.searchsorted(start, np.arange(samples) / samples - 1e-9)
    return length[:, None], start[:, None], which


def _shared(system: SwitchedAffine) -> bool:
    """Whether equal steps on one stiffness level share their matrices.

    Where the stiffness has harmonics, the split differs from point to point, or the harmonics of the forcing are many,
    every step has its own.
    """
    return system.one_split and system.chi_cos.shape[1] == 0 and system.f_cos.shape[1] <= _MOST_SHARED_HARMONICS


def kept(system: SwitchedAffine) -> int:
    """How many harmonics of the forcing keep their own rows in the step tables: where steps have their own matrices,
    the forcing is part of the constant."""
    return system.f_cos.shape[1] if _shared(system) else 0


def nodes(system: SwitchedAffine, length: np.ndarray, start: np.ndarray, sample_at: np.ndarray) -> Nodes:
    """The steps of a period for points with as many of them: one period if lengths and starts (N, Q) have Q = 1, else
    one for each point."""
    split = system.split[:1] if system.one_split else system.split
    level = np.all(start >= split - 1e-12, axis=1).astype(np.int64)
    harmonics = np.arange(1, max(system.f_cos.shape[1], system.chi_cos.shape[1]) + 1)
    phase = 2 * np.pi * start.T.ravel()[:, None] * harmonics
    piece: np.ndarray = _stretches(level, length[:, 0]) if _shared(system) else np.arange(len(length))
    sample = np.full(len(length), -1)
    sample[sample_at] = np.arange(len(sample_at))
    periods = length.shape[1]
    values = np.empty((phase.shape[0], 2 + 2 * len(harmonics)))
    values[:, LENGTH], values[:, LEVEL] = length.T.ravel(), np.tile(level, periods)
    values[:, WAVES::2], values[:, WAVES + 1 :: 2] = np.cos(phase), np.sin(phase)
    whole = (np.tile(a, periods) for a in (piece, np.searchsorted(piece, piece, side="right"), sample))
    return Nodes(*whole, values)


def _stretches(level: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Number the runs of equal steps on one level."""
    new = (np.diff(level) != 0) | (np.abs(np.diff(length)) > 1e-15)
    return np.concatenate([[0], np.cumsum(new)]).astype(np.int64)


def tabulate(system: SwitchedAffine, phys: np.ndarray, node: Nodes, steps: int) -> np.ndarray:
    """The affine steps (P, pieces, 3, rows) of points with so many steps.

    Contact states in the order back, free, front. Rows: E (d*d), constant (d), then responses to cos jωτ and to
    sin jωτ (d each) for the harmonics that keep their own.
    """
    d, (h, k), own = system.dimension, (system.f_cos.shape[1], system.chi_cos.shape[1]), kept(system)
    first = np.searchsorted(node.piece[:steps], np.arange(node.piece[steps - 1] + 1))
    table = np.zeros((system.points, len(first), 3, d * d + d + 2 * own * d))
    course = steps * np.arange(system.points) if len(node.piece) > steps else np.zeros(system.points, np.int64)
    _tabulate((0,) * d, phys, h, k, node, course, first, own, chunk(d, h, k), table)
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
def _tabulate_step(dims, phys, h, k, node, piece, state, kept, work, points, table):
    """All rows of one step in one contact state for a chunk of points."""
    d = len(dims)
    at, ws = rows(d), work.ws
    fill(dims, phys, h, k, node, work.nodes, points, ws)
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
def _tabulate(dims, phys, h, k, node, course, first, kept, work, table):
    for base in range(0, table.shape[0], WIDTH):
        for l in range(WIDTH):
            work.points[l] = min(base + l, table.shape[0] - 1)
        for piece in range(table.shape[1]):
            for l in range(WIDTH):
                work.nodes[l] = course[work.points[l]] + first[piece]
            for state in range(3):
                _tabulate_step(dims, phys, h, k, node, piece, state, kept, work, work.points, table)
