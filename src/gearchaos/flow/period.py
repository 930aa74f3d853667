"""A block of lanes through many mesh periods: the loop that everything else serves."""

from __future__ import annotations

from math import log, sqrt

import numpy as np

from gearchaos.flow.jit import fma, inlined, kernel
from gearchaos.flow.layout import DIVERGED, DIVERGED_AT, OK
from gearchaos.flow.resolve import measure, resolve
from gearchaos.flow.step import affine, collect, load_bounds, load_matrices, matvec, stale, suspects

_NOBODY = np.nan
"""The contact state of matrices that are nobody's: unequal to any."""


@kernel
def contact_state(w, sigma, n):
    """The contact state of each lane from z alone."""
    for l in range(n):
        z = w[0, l]
        sigma[l] = 1.0 if z > 1.0 else (-1.0 if z < -1.0 else 0.0)


@kernel
def orthonormalise(dims, v, growth, n):
    """Gram-Schmidt on the tangent vectors v (K, d, n), adding the logarithms of their lengths to growth (K, n)."""
    d = len(dims)
    for l in range(n):
        for c in range(v.shape[0]):
            for e in range(c):
                dot = 0.0
                for i in range(d):
                    dot = fma(v[c, i, l], v[e, i, l], dot)
                for i in range(d):
                    v[c, i, l] = fma(-dot, v[e, i, l], v[c, i, l])
            square = 0.0
            for i in range(d):
                square = fma(v[c, i, l], v[c, i, l], square)
            length = sqrt(square)
            if length > 0.0:
                growth[c, l] += log(length)
                for i in range(d):
                    v[c, i, l] /= length


@inlined
def _one_step(
    dims, phys, h, k, nodes, table, kept, step, lanes, work, active, loaded, bounds, flags, now, measuring, n
):
    """One step of all lanes: affine for most, resolved for the suspects."""
    new = 1 - now
    affine(dims, kept, nodes.wave[step], active, lanes.w[now], lanes.w[new], n)
    suspects(dims, bounds, lanes.sigma, lanes.w[now], lanes.w[new], flags, n)
    if measuring:
        count = collect(flags, 0.0, work.lane, n)
        measure(dims, phys, h, k, nodes, step, lanes, work, count, now)
    for c in range(lanes.v.shape[1]):
        matvec(dims, active, lanes.v[now, c], lanes.v[new, c], n)
    count = collect(flags, 1.0, work.lane, n)
    if count > 0:
        resolve(dims, phys, h, k, nodes, step, lanes, work, count, now, measuring)
        load_matrices(table, nodes.piece[step], lanes.point, lanes.sigma, active, loaded, work.lane, count)


@kernel
def _mark_diverged(w, status, n):
    for l in range(n):
        inside = (abs(w[0, l]) < DIVERGED_AT) & (abs(w[1, l]) < DIVERGED_AT)
        if not inside and status[l] == OK:
            status[l] = DIVERGED


@kernel
def _copy(source, target, n):
    for i in range(source.shape[0]):
        for l in range(n):
            target[i, l] = source[i, l]


@kernel
def _retire(ends, period, lanes, now, w, v, n):
    """Let lanes go that have had their periods, and keep their final state; returns how many go on."""
    while n > 0 and ends[n - 1] <= period:
        n -= 1
        for i in range(lanes.w.shape[1]):
            w[i, n] = lanes.w[now, i, n]
            for c in range(lanes.v.shape[1]):
                v[c, i, n] = lanes.v[now, c, i, n]
    return n


@kernel
def _record(w, ends, done, sections, n):
    """Keep the states (d, n) after so many periods where they are among the last of their lanes."""
    last = sections.shape[0] - 1
    if ends[n - 1] - done > last:
        return
    for i in range(w.shape[0]):
        for l in range(n):
            left = ends[l] - done
            if left <= last:
                sections[last - left, i, l] = w[i, l]


@kernel
def _sample(lanes, now, target, n):
    _copy(lanes.w[now], target, n)
    for l in range(n):
        target[target.shape[0] - 1, l] = lanes.sigma[l]


@kernel
def advance_block(
    dims, phys, h, k, nodes, table, kept, lanes, work, active, loaded, bounds, flags, ends, measuring, stride,
    w, v, growth, sections, samples, sample_at,
):
    """Advance n lanes from phase 0, each by so many whole periods as ``ends`` (n,) says, the longest first.

    ``w`` (d, n) and ``v`` (K, d, n) take the final states and tangent vectors. ``growth`` (periods, K, n) takes the
    logarithms of the tangent vectors' growth in each period if ``stride`` > 0, the number of steps between
    orthonormalisations. ``sections`` (S, d, n) takes the state after each of a lane's last S periods, ``samples``
    (periods, number of samples, d + 1, n) the state and contact state at the nodes ``sample_at``. ``active``
    (slots, rows, B) holds the step matrices of each lane's contact state for every piece if there is a slot for it,
    with the contact states ``loaded`` (slots, B) they are of; with one slot they are loaded anew for each piece.
    ``bounds`` (slots, d, B) tell a harmless step.
    """
    n = len(ends)
    now = np.int64(0)  # a literal 0 would compile everything below twice
    last = len(nodes.piece) - 1
    contact_state(lanes.w[0], lanes.sigma, n)
    for period in range(ends[0]):
        n = _retire(ends, period, lanes, now, w, v, n)
        wanted = 0
        for step in range(last + 1):
            if wanted < len(sample_at) and sample_at[wanted] == step:
                _sample(lanes, now, samples[period, wanted], n)
                wanted += 1
            slot = nodes.piece[step] if len(active) > 1 else np.int64(0)
            if step == 0 or nodes.piece[step] != nodes.piece[step - 1]:
                if len(active) == 1:
                    loaded[0, :n] = _NOBODY
                if len(active) == 1 or period == 0:
                    load_bounds(dims, phys, nodes, step, lanes.point, bounds[slot], n)
                count = stale(loaded[slot], lanes.sigma, work.lane, n)
                load_matrices(
                    table, nodes.piece[step], lanes.point, lanes.sigma, active[slot], loaded[slot], work.lane, count
                )
            _one_step(
                dims, phys, h, k, nodes, table, kept, step, lanes, work, active[slot], loaded[slot], bounds[slot],
                flags, now, measuring, n,
            )
            now = 1 - now
            if stride > 0 and ((step + 1) % stride == 0 or step == last):
                orthonormalise(dims, lanes.v[now], growth[period], n)
        _mark_diverged(lanes.w[now], lanes.status, n)
        _record(lanes.w[now], ends, period + 1, sections, n)
    _retire(ends, ends[0], lanes, now, w, v, n)
