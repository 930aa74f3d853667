"""Step tables: the affine step of each parameter point in each contact state, from Taylor polynomials."""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import kernel, subroutine
from gearchaos.flow.kernels.constants import ORDER, WIDTH
from gearchaos.flow.kernels.offsets import rows
from gearchaos.flow.kernels.simd import broadcast, load
from gearchaos.flow.kernels.taylor import add_sinusoid, end_state, excitation_series, set_amplitudes, state_series
from gearchaos.flow.kernels.workspace import fill_level, fill_point, fill_step


@subroutine
def _clear(ws, first, count):
    """Set ``count`` rows to zero."""
    for i in range(first * WIDTH, (first + count) * WIDTH):
        ws[i] = 0.0


@subroutine
def _respond(dims, ws, forced, varying, table, points, entry, state, first, stride):
    """Advance the pack from the start rows over the step; write coordinate i at its end to ``table[point, entry, state,
    first + i * stride]``. ``points`` (WIDTH,) are the indices of the lanes' points."""
    end = rows(dims).end
    state_series(dims, ws, forced, varying)
    end_state(dims, ws)
    for l in range(WIDTH):
        for i in range(len(dims)):
            table[points[l], entry, state, first + i * stride] = ws[(end + i) * WIDTH + l]


@subroutine
def _tabulate_step(dims, parameters, harmonics, values, entry, state, tabulated, work, table):
    """Compute all rows of one entry in one contact state, for the pack of points ``work.points`` at ``work.steps``."""
    d, varying = len(dims), harmonics.stiffness > 0
    at, ws = rows(dims), work.rows
    fill_point(dims, parameters, harmonics, work.points, False, ws)
    fill_level(dims, parameters, harmonics, values, work.points, work.steps, ws)
    fill_step(dims, harmonics, values, work.steps, ws)
    for l in range(WIDTH):
        ws[at.sigma * WIDTH + l] = state - 1.0
        ws[at.end_fraction * WIDTH + l] = 1.0
    excitation_series(dims, harmonics, ws)
    _clear(ws, at.start, d)
    if tabulated > 0:
        _clear(ws, at.forcing, ORDER + 1)
    _respond(dims, ws, True, varying, table, work.points, entry, state, d * d, 1)
    for j in range(d):
        _clear(ws, at.start, d)
        for l in range(WIDTH):
            ws[(at.start + j) * WIDTH + l] = 1.0
        _respond(dims, ws, False, varying, table, work.points, entry, state, j, d)
    if tabulated > 0:
        _tabulate_responses(dims, parameters, harmonics, entry, state, work, table)


@subroutine
def _tabulate_responses(dims, parameters, harmonics, entry, state, work, table):
    """Compute the responses, from rest, to the forcing harmonics as factors of cos jωτ and sin jωτ at the start of the
    step: to the forcing at phase 0, and to the forcing a quarter period later."""
    d = len(dims)
    at, ws, column, cos_sin = rows(dims), work.rows, harmonics.columns, harmonics.rows.cos_sin
    _clear(ws, at.start, d)
    _clear(ws, at.constant, d)
    _clear(ws, at.sigma, 1)
    for j in range(harmonics.forcing):
        angle = load(ws, at.duration) * load(ws, at.omega) * broadcast(j + 1.0)
        for l in range(WIDTH):
            ws[cos_sin * WIDTH + l] = 1.0
            ws[(cos_sin + 1) * WIDTH + l] = 0.0
        for quarter in range(2):
            cos, sin = column.f_cos + j, column.f_sin + j
            if quarter == 0:
                set_amplitudes(parameters, work.points, cos, sin, 1.0, ws, at.amplitudes)
            else:
                set_amplitudes(parameters, work.points, sin, cos, -1.0, ws, at.amplitudes)
            add_sinusoid(ws, at.forcing, load(ws, at.amplitudes), load(ws, at.amplitudes + 1), cos_sin, angle, True)
            first = d * d + d + (quarter * harmonics.forcing + j) * d
            _respond(dims, ws, True, False, table, work.points, entry, state, first, 1)


@kernel
def tabulate_steps(dims, parameters, harmonics, values, first, first_of_entry, tabulated, work, table):
    """Compute the step tables of the points of one grid, `WIDTH` points at a time.

    Parameters
    ----------
    parameters : (P, total)
        Columns as in `Harmonics.columns`.
    values : (T, 2 + 2 * harmonics)
        `Steps.values` of the grid.
    first : (P,)
        Index in ``values`` of each point's first step.
    first_of_entry : (entries,)
        Index within the grid of the first step with each entry.
    tabulated : int
        `Points.tabulated`.
    table : (P, entries, 3, rows)
        Overwritten; see `tables.tabulate`.
    """
    for base in range(0, table.shape[0], WIDTH):
        for l in range(WIDTH):
            work.points[l] = min(base + l, table.shape[0] - 1)
        for entry in range(table.shape[1]):
            for l in range(WIDTH):
                work.steps[l] = first[work.points[l]] + first_of_entry[entry]
            for state in range(3):
                _tabulate_step(dims, parameters, harmonics, values, entry, state, tabulated, work, table)
