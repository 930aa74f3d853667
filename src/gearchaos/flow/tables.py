"""Step matrices, tabulated once per parameter point: E and g of w(k+1) = E w(k) + g, free and in contact."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.jit import kernel
from gearchaos.flow.layout import BLOCK, STEP_ANGLE, Nodes, Physics, Steps, piece_workspace
from gearchaos.flow.resolve import gather
from gearchaos.flow.taylor import evaluate, expand, stiffness, waves
from gearchaos.switched import SwitchedAffine

_MOST_SHARED_HARMONICS = 3
"""With more harmonics it is cheaper to tabulate the forcing at every node than to sum its waves in every step."""


def physics(system: SwitchedAffine) -> Physics:
    """The system's arrays with points last."""
    def last(a: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(a.reshape(len(a), -1).T)

    bound0, bound = bounds(system)
    return Physics(
        A=last(system.A), b=last(system.b), f0=last(system.f0), f_cos=last(system.f_cos), f_sin=last(system.f_sin),
        levels=last(system.levels), chi_cos=last(system.chi_cos), chi_sin=last(system.chi_sin),
        velocity=last(system.velocity), velocity0=system.velocity0, velocity_cos=last(system.velocity_cos),
        velocity_sin=last(system.velocity_sin), damping=system.damping, omega=system.omega,
        bound0=bound0, bound=bound,
    )


def stiffest(system: SwitchedAffine) -> np.ndarray:
    """An upper bound of the mesh stiffness χ(τ), (P,)."""
    return system.levels.max(axis=1) + np.hypot(system.chi_cos, system.chi_sin).sum(axis=1)


def bounds(system: SwitchedAffine) -> tuple[np.ndarray, np.ndarray]:
    """How large z'' and z''' can be where z is near a boundary and slow: constants (2, P), factors of |w_i| (d, P).

    There the spring force and the damping force are small; half as much again covers what they add on a step.
    """
    A, order = system.A, np.arange(1, system.f_cos.shape[1] + 1)
    waves = np.hypot(system.f_cos[:, :, 1], system.f_sin[:, :, 1])
    second = np.abs(system.f0[:, 1]) + waves.sum(axis=1)
    reach = STEP_ANGLE / rate(system)
    spring = np.abs(A[:, 1, 1]) + system.b[:, 1] * stiffest(system) * reach
    third = spring * second + (waves * order * system.omega[:, None]).sum(axis=1)
    rows = np.maximum(np.abs(A[:, 1, :]), np.abs((A @ A)[:, 1, :]))
    return 1.5 * np.stack([second, third]), np.ascontiguousarray(1.5 * rows.T)


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
    """Steps a period needs, (P,), rounded up to few distinct numbers so that points can share them."""
    needed = np.ceil(2 * np.pi / system.omega * rate(system) / STEP_ANGLE)
    grain = 2.0 ** np.floor(np.log2(np.maximum(needed, 16)) - 3)
    return (np.ceil(needed / grain) * grain).astype(int)


def two_lengths(count: int, split: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths and starts (N, Q) of the steps as shares of the period, the stiffness jump among the nodes."""
    first = int(np.ceil(count * split.max())) or 1
    second = int(np.ceil(count * (1 - split.min()))) or 1
    length = np.concatenate([np.tile(split / first, (first, 1)), np.tile((1 - split) / second, (second, 1))])
    start = np.concatenate([np.arange(first)[:, None] * (split / first),
                            split + np.arange(second)[:, None] * ((1 - split) / second)])
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


def nodes(system: SwitchedAffine, length: np.ndarray, start: np.ndarray) -> Nodes:
    """The steps of a period for points that share a node count.

    Equal steps on one stiffness level share their matrices, unless the stiffness has harmonics, the split differs
    from point to point, or the harmonics of the forcing are many: then every step has its own.
    """
    split = system.split if length.shape[1] > 1 else system.split[:1]
    level = (start >= split - 1e-12).all(axis=1).astype(np.int64)
    harmonics = np.arange(1, max(system.f_cos.shape[1], system.chi_cos.shape[1]) + 1)
    phase = 2 * np.pi * start[:, None, :] * harmonics[:, None]
    shared = (
        length.shape[1] == 1 and system.chi_cos.shape[1] == 0 and system.f_cos.shape[1] <= _MOST_SHARED_HARMONICS
    )
    piece = _stretches(level, length[:, 0]) if shared else np.arange(len(length))
    return Nodes(piece, level, np.ascontiguousarray(length), np.cos(phase), np.sin(phase))


def _stretches(level: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Number the runs of equal steps on one level."""
    new = (np.diff(level) != 0) | (np.abs(np.diff(length)) > 1e-15)
    return np.concatenate([[0], np.cumsum(new)]).astype(np.int64)


def steps(system: SwitchedAffine, phys: Physics, node: Nodes) -> Steps:
    """Tabulate the affine steps of all points."""
    d, points = system.dimension, system.points
    pieces = int(node.piece[-1]) + 1
    shared = pieces < len(node.piece)
    h = system.f_cos.shape[1]
    waves_kept = h if shared else 0
    rows = d * d + 2 * d + 2 * waves_kept * d
    table = np.zeros((pieces, 2, rows, points))
    first = np.searchsorted(node.piece, np.arange(pieces))
    workspace = piece_workspace(d, h, system.chi_cos.shape[1])
    tabulate((0,) * d, phys, node, first, waves_kept, workspace, table)
    return Steps(table, waves_kept)


@kernel
def _prepare(phys, node, step, contact, p, points, n):
    """Fill the workspace for one step of n points in free flight (0) or contact (1)."""
    shared = node.length.shape[1] == 1
    for l in range(n):
        q = points[l]
        p.angle[l] = 2 * np.pi * node.length[step, 0 if shared else q]
        p.h[l] = p.angle[l] / phys.omega[q]
        p.sigma[l] = 0.0
        p.level[l] = contact * phys.levels[node.level[step], q]
        for j in range(node.cos.shape[1]):
            p.cos[0, j, l] = node.cos[step, j, 0 if shared else q]
            p.sin[0, j, l] = node.sin[step, j, 0 if shared else q]
    waves(p, node.cos.shape[1], n)
    stiffness(p, n)


@kernel
def _respond(dims, p, forced, ones, out, n):
    expand(dims, p, forced, n)
    evaluate(dims, p, ones, out, n)


@kernel
def _columns(dims, p, ones, out, table, base, n):
    """E, column by column, and the response to the sign of the contact state."""
    d = len(dims)
    for j in range(d):
        p.start[:, :n] = 0.0
        p.start[j, :n] = 1.0
        _respond(dims, p, 0.0, ones, out, n)
        for i in range(d):
            table[i * d + j, base : base + n] = out[i, :n]
    rows = table.shape[0]
    p.start[:, :n] = 0.0
    p.sigma[:n] = 1.0
    p.f0[:, :n] = 0.0
    p.f_cos[:, :n] = 0.0
    p.f_sin[:, :n] = 0.0
    _respond(dims, p, 1.0, ones, out, n)
    p.sigma[:n] = 0.0
    table[rows - d : rows, base : base + n] = out[:, :n]


@kernel
def _wave_responses(dims, phys, p, points, waves_kept, ones, out, table, base, n):
    """Responses to cos jωτ and sin jωτ that start at phase 0, one harmonic at a time."""
    d = len(dims)
    h = p.f_cos.shape[0] // d
    for j in range(h):
        for quarter in range(2):
            for i in range(d):
                for l in range(n):
                    c, s = phys.f_cos[j * d + i, points[l]], phys.f_sin[j * d + i, points[l]]
                    p.f_cos[j * d + i, l] = c if quarter == 0 else s
                    p.f_sin[j * d + i, l] = s if quarter == 0 else -c
            _respond(dims, p, 1.0, ones, out, n)
            row = d * d + d + (quarter * h + j) * d
            table[row : row + d, base : base + n] = out[:, :n]
            p.f_cos[j * d : j * d + d, :n] = 0.0
            p.f_sin[j * d : j * d + d, :n] = 0.0


@kernel
def tabulate(dims, phys, node, first, waves_kept, p, table):
    """Fill table (pieces, 2, rows, P); ``first`` (pieces,) is the first step of each piece."""
    d = len(dims)
    total = table.shape[3]
    points = np.zeros(BLOCK, np.int64)
    ones = np.ones(BLOCK)
    out = np.zeros((d, BLOCK))
    for base in range(0, total, BLOCK):
        n = min(BLOCK, total - base)
        for l in range(n):
            points[l] = base + l
        for piece in range(table.shape[0]):
            for contact in range(2):
                part = table[piece, contact]
                gather(phys, p, points, n)
                _prepare(phys, node, first[piece], float(contact), p, points, n)
                p.start[:, :n] = 0.0
                if waves_kept > 0:
                    p.f_cos[:, :n] = 0.0
                    p.f_sin[:, :n] = 0.0
                _respond(dims, p, 1.0, ones, out, n)
                part[d * d : d * d + d, base : base + n] = out[:, :n]
                _columns(dims, p, ones, out, part, base, n)
                if waves_kept > 0:
                    p.cos[0, :, :n] = 1.0
                    p.sin[0, :, :n] = 0.0
                    waves(p, node.cos.shape[1], n)
                    _wave_responses(dims, phys, p, points, waves_kept, ones, out, part, base, n)
