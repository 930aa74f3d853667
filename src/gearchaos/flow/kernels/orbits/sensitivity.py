"""One mesh period with everything that continuation needs: the monodromy matrix, the derivatives of the final state by
parameters, and the contact switches and extrema of z on the way.

With s in [0, 1] the fraction of a segment of duration h and F the right-hand side of the equations of motion,
dw/ds = h F, so that the derivative v of w by a parameter p at constant s solves

    dv/ds = h (∂F/∂w v + ∂F/∂p) + (∂h/∂p) F.

∂h/∂p = −h/ω ∂ω/∂p. At a contact switch v jumps if F does, see `contact.saltate`. Where the stiffness jumps at an
instant that depends on p, v jumps by the difference of F before and after, times the derivative of that instant.

Every step is computed from Taylor polynomials. The results agree with those of `advance.advance_packs` to rounding.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import kernel, subroutine
from gearchaos.flow.kernels.one_spring.contact import find_exits, saltate, switch_contact
from gearchaos.flow.kernels.orbits.recording import extremum_derivatives, record_extrema, record_switches
from gearchaos.flow.kernels.vector.arrays import COS_SIN, LENGTH, LEVEL, damps_in_contact, releases, rows
from gearchaos.flow.kernels.vector.constants import CHATTER, DIVERGED, DIVERGED_AT, MAX_SWITCHES, ORDER, TWO_PI, WIDTH
from gearchaos.flow.kernels.vector.simd import broadcast, load, store, vfma
from gearchaos.flow.kernels.vector.taylor import (
    add_sinusoid,
    end_state,
    excitation_series,
    fill_level,
    fill_point,
    fill_step,
    in_contact,
    state_series,
    stiffness_variation,
)


class SensitivityCall(NamedTuple):
    """Arguments and results for L trajectories over one mesh period, with derivatives by Q parameters."""

    parameters: np.ndarray  # (P, total), columns as in `ParameterColumns`
    derivatives: np.ndarray  # (P, Q, total) their derivatives
    start_derivatives: np.ndarray  # (P, Q, N) derivatives of the starts of the parts of the period
    values: np.ndarray  # (T, 2 + 2 * harmonics), see `arrays.Steps`
    point: np.ndarray  # (L,) index of the parameter point
    first_step: np.ndarray  # (L,) index of the first step in ``values``
    w: np.ndarray  # (L, d) states: those at the start are overwritten by the final ones
    tangent: np.ndarray  # (L, d, d) row c: derivative of the final state by coordinate c of the start
    sensitivity: np.ndarray  # (L, Q, d) derivatives of the final state by the parameters
    switches: np.ndarray  # (L, S, 4) fraction of the period; boundary 1 or -1; 1 into contact, 0 out of it; z'
    switch_count: np.ndarray  # (L,)
    extrema: np.ndarray  # (L, E, 3 + d + Q) fraction of the period; z; 1 maximum, -1 minimum; derivatives of z
    extremum_count: np.ndarray  # (L,)
    status: np.ndarray  # (L,)
    sigma: np.ndarray  # (L,) contact states at the start, see `system.contact_states`


@subroutine
def _fill_derivatives(dims, harmonics, call, q, points, steps, ws, row):
    """Write the rows of the derivatives by parameter q for the lanes' points and steps."""
    d, h, k, column = len(dims), harmonics.forcing, harmonics.stiffness, harmonics.columns
    for l in range(WIDTH):
        values = call.derivatives[points[l], q]
        for i in range(d * d):
            ws[(row.A + i) * WIDTH + l] = values[column.A + i]
        for i in range(d):
            ws[(row.b + i) * WIDTH + l] = values[column.b + i]
            ws[(row.f0 + i) * WIDTH + l] = values[column.f0 + i]
        for j in range(h):
            ws[(row.forcing_amplitudes + 2 * j) * WIDTH + l] = values[column.f_cos + j]
            ws[(row.forcing_amplitudes + 2 * j + 1) * WIDTH + l] = values[column.f_sin + j]
        for j in range(k):
            ws[(row.stiffness_amplitudes + 2 * j) * WIDTH + l] = values[column.chi_cos + j]
            ws[(row.stiffness_amplitudes + 2 * j + 1) * WIDTH + l] = values[column.chi_sin + j]
        ws[row.damping * WIDTH + l] = values[column.damping]
        ws[row.level * WIDTH + l] = values[column.levels + int(call.values[steps[l], LEVEL])]
        ws[row.stretch * WIDTH + l] = -values[column.omega] / call.parameters[points[l], column.omega]


@subroutine
def _derivative_series(dims, harmonics, ws, row):
    """Polynomials of the derivatives of the harmonic forcing and, for lanes in contact, of the stiffness."""
    at, cos_sin = rows(dims), harmonics.rows.cos_sin
    angle = load(ws, at.duration) * load(ws, at.omega)
    contact = in_contact(dims, load(ws, at.sigma))
    for m in range(ORDER + 1):
        store(ws, row.forcing + m, broadcast(0.0))
        store(ws, row.stiffness + m, broadcast(0.0))
    store(ws, row.stiffness, contact * load(ws, row.level))
    for j in range(harmonics.forcing):
        a, b = load(ws, row.forcing_amplitudes + 2 * j), load(ws, row.forcing_amplitudes + 2 * j + 1)
        add_sinusoid(ws, row.forcing, a, b, cos_sin + 2 * j, angle * broadcast(j + 1.0), False)
    for j in range(harmonics.stiffness):
        a = contact * load(ws, row.stiffness_amplitudes + 2 * j)
        b = contact * load(ws, row.stiffness_amplitudes + 2 * j + 1)
        add_sinusoid(ws, row.stiffness, a, b, cos_sin + 2 * j, angle * broadcast(j + 1.0), False)


@subroutine
def _extension(ws, row, d, k, sigma):
    """Coefficient k of z − σ of the motion."""
    z = load(ws, row.motion + k * d)
    return z - sigma if k == 0 else z


@subroutine
def _spring(ws, stiffness, row, d, k, sigma):
    """Coefficient k of the product of a polynomial, from row ``stiffness`` on, and z − σ of the motion."""
    total = broadcast(0.0)
    for m in range(k + 1):
        total = vfma(load(ws, stiffness + m), _extension(ws, row, d, k - m, sigma), total)
    return total


@subroutine
def _source(dims, ws, row, k, i, weakening, spring):
    """Coefficient k of row i of ∂F/∂p; ``weakening`` and ``spring`` are the spring force's terms."""
    d, at = len(dims), rows(dims)
    total = vfma(load(ws, at.minus_b + i), weakening, broadcast(-1.0) * load(ws, row.b + i) * spring)
    if k == 0:
        total = total + load(ws, row.f0 + i)
    if i == 1:
        total = total + load(ws, row.forcing + k)
    for j in range(d):
        total = vfma(load(ws, row.A + i * d + j), load(ws, row.motion + k * d + j), total)
    if damps_in_contact(dims):
        contact = in_contact(dims, load(ws, at.sigma))
        force = load(ws, at.minus_b + i) * load(ws, row.damping) - load(ws, row.b + i) * load(ws, at.contact_damping)
        total = vfma(contact * force, load(ws, row.motion + k * d + 1), total)
    return total


@subroutine
def _sensitivity_series(dims, harmonics, ws, row):
    """Polynomials of the derivative of the motion by one parameter, from the start rows."""
    d, at = len(dims), rows(dims)
    h, sigma, stretch, zero = load(ws, at.duration), load(ws, at.sigma), load(ws, row.stretch), broadcast(0.0)
    for i in range(d):
        store(ws, at.state + i, load(ws, at.start + i))
    for k in range(ORDER):
        scale, now, after = h * broadcast(1.0 / (k + 1)), at.state + k * d, at.state + (k + 1) * d
        weakening = _spring(ws, row.stiffness, row, d, k, sigma)
        spring = _spring(ws, at.stiffness, row, d, k, sigma)
        store(ws, after, vfma(scale, load(ws, now + 1), stretch * load(ws, row.motion + (k + 1) * d)))
        for i in range(1, d):
            source = _source(dims, ws, row, k, i, weakening, spring)
            total = vfma(load(ws, at.stiffness_column + i), load(ws, now), source)
            if harmonics.stiffness > 0:
                total = vfma(load(ws, at.minus_b + i), stiffness_variation(ws, at, d, k, zero), total)
            for j in range(1, d):
                factor = at.velocity_column + i if damps_in_contact(dims) and j == 1 else at.A + i * d + j
                total = vfma(load(ws, factor), load(ws, now + j), total)
            store(ws, after + i, vfma(scale, total, stretch * load(ws, row.motion + (k + 1) * d + i)))


@subroutine
def _advance_vector(dims, ws, row, number):
    """Evaluate the polynomials of a vector at the end of the segment, and keep the result as its new value; the first
    one is the state, which is continuous."""
    d, at = len(dims), rows(dims)
    end_state(dims, ws)
    if damps_in_contact(dims) and number > 0:
        saltate(dims, ws)
    for i in range(d):
        store(ws, row.vectors + number * d + i, load(ws, at.end + i))


@subroutine
def _load_vector(dims, ws, row, number):
    """Copy the value of a vector to the start rows."""
    d, at = len(dims), rows(dims)
    for i in range(d):
        store(ws, at.start + i, load(ws, row.vectors + number * d + i))


@subroutine
def _run_segment(dims, harmonics, call, lanes, count, work, row, segment):
    """Advance state, tangent vectors and sensitivities of a pack to the next switch or the end of the step."""
    ws, at, d = work.rows, rows(dims), len(dims)
    _load_vector(dims, ws, row, 0)
    excitation_series(dims, harmonics, ws)
    state_series(dims, ws, True, harmonics.stiffness > 0)
    find_exits(dims, harmonics, ws, len(ws), 1)
    for i in range((ORDER + 1) * d):
        store(ws, row.motion + i, load(ws, at.state + i))
    record_extrema(dims, ws, row, call, lanes, count, segment)
    _advance_vector(dims, ws, row, 0)
    for c in range(d):
        _load_vector(dims, ws, row, 1 + c)
        state_series(dims, ws, False, harmonics.stiffness > 0)
        extremum_derivatives(dims, ws, call, lanes, count, segment, c)
        _advance_vector(dims, ws, row, 1 + c)
    for q in range(call.derivatives.shape[1]):
        _fill_derivatives(dims, harmonics, call, q, work.points, work.steps, ws, row)
        _derivative_series(dims, harmonics, ws, row)
        _load_vector(dims, ws, row, 1 + d + q)
        _sensitivity_series(dims, harmonics, ws, row)
        extremum_derivatives(dims, ws, call, lanes, count, segment, d + q)
        _advance_vector(dims, ws, row, 1 + d + q)
    _load_vector(dims, ws, row, 0)
    record_switches(ws, at, call, lanes, count, segment)


@subroutine
def _shorten_segments(ws, at, segment):
    """Let the segments begin where the last ones have ended."""
    for l in range(WIDTH):
        elapsed = segment.length[l] * ws[at.end_fraction * WIDTH + l]
        segment.start[l] += elapsed
        segment.length[l] -= elapsed


@subroutine
def _force_drop(dims, harmonics, values, step, before, after, sigma, z, velocity):
    """How much the mesh force falls where the stiffness level ``before`` is followed by ``after`` at the start of a
    step; contact that cannot pull may end or begin there. ``values`` are the parameters, ``step`` the row of
    `Steps.values`."""
    column = harmonics.columns
    drop = values[column.levels + before] - values[column.levels + after]
    if not releases(dims):
        return drop * (z - sigma)
    side, stiffness = 1.0 if sigma > 0.0 else -1.0, values[column.levels + after]
    for j in range(harmonics.stiffness):
        cos, sin = step[COS_SIN + 2 * j], step[COS_SIN + 2 * j + 1]
        stiffness += values[column.chi_cos + j] * cos + values[column.chi_sin + j] * sin
    extension = side * z - 1.0
    push = stiffness * extension + values[column.damping] * side * velocity
    return side * (max(push + drop * extension, 0.0) - max(push, 0.0))


@subroutine
def _jump_sensitivities(dims, harmonics, call, work, row):
    """Change the sensitivities at the start of a step on which the stiffness has another level than before, by (F
    before − F after) times the derivative of that instant."""
    ws, at, d, column = work.rows, rows(dims), len(dims), harmonics.columns
    for l in range(WIDTH):
        step, point, sigma = work.steps[l], work.points[l], ws[at.sigma * WIDTH + l]
        level, old = int(call.values[step, LEVEL]), int(call.values[step - 1, LEVEL])
        if sigma == 0.0 or level == old:
            continue
        values, z, velocity = call.parameters[point], ws[row.vectors * WIDTH + l], ws[(row.vectors + 1) * WIDTH + l]
        drop = _force_drop(dims, harmonics, values, call.values[step], old, level, sigma, z, velocity)
        force = drop * TWO_PI / values[column.omega]
        for q in range(call.derivatives.shape[1]):
            for i in range(1, d):
                jump = -values[column.b + i] * force * call.start_derivatives[point, q, level]
                ws[(row.vectors + (1 + d + q) * d + i) * WIDTH + l] += jump


@subroutine
def _run_step(dims, harmonics, call, lanes, count, work, row, segment):
    """Advance a pack over one step, with all contact switches in it."""
    ws, at = work.rows, rows(dims)
    fill_point(dims, call.parameters, harmonics, work.points, False, ws)
    fill_level(dims, call.parameters, harmonics, call.values, work.points, work.steps, ws)
    fill_step(dims, harmonics, call.values, work.steps, ws)
    for l in range(WIDTH):
        segment.length[l] = call.values[work.steps[l], LENGTH]
    switching, segments = True, 0
    while switching and segments < MAX_SWITCHES:
        _run_segment(dims, harmonics, call, lanes, count, work, row, segment)
        _shorten_segments(ws, at, segment)
        switching = switch_contact(dims, harmonics, ws)
        store(ws, row.vectors, load(ws, at.start))
        segments += 1
    for l in range(count):
        if switching and ws[at.duration * WIDTH + l] > 0.0:
            call.status[lanes[l]] = CHATTER


@subroutine
def _begin_pack(dims, call, lanes, work, row, segment):
    """Write the initial states, unit tangent vectors and zero sensitivities of a pack to the workspace."""
    ws, at, d = work.rows, rows(dims), len(dims)
    for i in range((1 + d + call.derivatives.shape[1]) * d):
        store(ws, row.vectors + i, broadcast(0.0))
    for l in range(WIDTH):
        lane = lanes[l]
        work.points[l] = call.point[lane]
        ws[at.sigma * WIDTH + l] = call.sigma[lane]
        segment.start[l] = 0.0
        for i in range(d):
            ws[(row.vectors + i) * WIDTH + l] = call.w[lane, i]
            ws[(row.vectors + d + i * d + i) * WIDTH + l] = 1.0


@subroutine
def _end_pack(dims, call, lanes, count, work, row):
    """Write the results of a pack to the arrays of the call."""
    ws, d = work.rows, len(dims)
    for l in range(count):
        lane = lanes[l]
        for i in range(d):
            call.w[lane, i] = ws[(row.vectors + i) * WIDTH + l]
            for c in range(d):
                call.tangent[lane, c, i] = ws[(row.vectors + (1 + c) * d + i) * WIDTH + l]
            for q in range(call.derivatives.shape[1]):
                call.sensitivity[lane, q, i] = ws[(row.vectors + (1 + d + q) * d + i) * WIDTH + l]
        if not (abs(call.w[lane, 0]) < DIVERGED_AT and abs(call.w[lane, 1]) < DIVERGED_AT):
            call.status[lane] = DIVERGED


@subroutine
def advance_lanes(dims, harmonics, row, call, step_count, lanes, work, segment):
    """See `advance_with_sensitivities`."""
    pack = work.listed
    for first in range(0, len(lanes), WIDTH):
        count = min(WIDTH, len(lanes) - first)
        for l in range(WIDTH):
            pack[l] = lanes[first + (l if l < count else 0)]
        _begin_pack(dims, call, pack, work, row, segment)
        for step in range(step_count):
            for l in range(WIDTH):
                work.steps[l] = call.first_step[pack[l]] + step
            if step > 0:
                _jump_sensitivities(dims, harmonics, call, work, row)
            _run_step(dims, harmonics, call, pack, count, work, row, segment)
        _end_pack(dims, call, pack, count, work, row)


@kernel
def advance_with_sensitivities(dims, harmonics, row, call, step_count, lanes, work, segment):
    """Advance trajectories by one mesh period, `WIDTH` at a time, and overwrite the results of the call.

    ``lanes`` (B,) are their indices in its arrays; all have the same number of steps in the period. The `Workspace` has
    rows up to ``row.total``, with ``row`` the `SensitivityRows`.
    """
    advance_lanes(dims, harmonics, row, call, step_count, lanes, work, segment)
