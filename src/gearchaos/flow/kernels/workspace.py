"""Filling the workspace: the parameters and step data from which the Taylor polynomials of a pack are computed."""

from __future__ import annotations

from gearchaos.flow.kernels.arrays import COS_SIN, LENGTH, LEVEL
from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.constants import TWO_PI, WIDTH
from gearchaos.flow.kernels.offsets import rows
from gearchaos.flow.kernels.simd import broadcast, load, load_scalar, store, store_scalar


@inlined
def _copy(values, first, count, ws, row, position):
    """Copy ``count`` floats of an array, from index ``first`` on, to one position of ``count`` rows from ``row`` on."""
    for i in range(count):
        store_scalar(ws, (row + i) * WIDTH + position, load_scalar(values, first + i))


@subroutine
def fill_point(dims, parameters, harmonics, points, measuring, ws):
    """Write the workspace rows that depend only on the lanes' points.

    ``parameters`` is the array (P, total) of all points, ``points`` (WIDTH,) the index of each lane's point. Rows
    that only the measures use are written if ``measuring``.
    """
    d, h, k = len(dims), harmonics.forcing, harmonics.stiffness
    at, column, row = rows(dims), harmonics.columns, harmonics.rows
    for l in range(WIDTH):
        offset = points[l] * column.total
        _copy(parameters, offset + column.A + d, d * d - d, ws, at.A + d, l)  # the first row of A is not used
        for i in range(1, d):
            store_scalar(ws, (at.minus_b + i) * WIDTH + l, -load_scalar(parameters, offset + column.b + i))
        _copy(parameters, offset + column.f0, d, ws, at.f0, l)
        _copy(parameters, offset + column.omega, 1, ws, at.omega, l)
        for j in range(h):
            _copy(parameters, offset + column.f_cos + j, 1, ws, row.forcing_amplitudes + 2 * j, l)
            _copy(parameters, offset + column.f_sin + j, 1, ws, row.forcing_amplitudes + 2 * j + 1, l)
        for j in range(k):
            _copy(parameters, offset + column.chi_cos + j, 1, ws, row.stiffness_amplitudes + 2 * j, l)
            _copy(parameters, offset + column.chi_sin + j, 1, ws, row.stiffness_amplitudes + 2 * j + 1, l)
        if measuring:
            _copy(parameters, offset + column.damping, 1, ws, row.damping, l)
            _copy(parameters, offset + column.velocity, d, ws, row.velocity, l)
            _copy(parameters, offset + column.velocity0, 1, ws, row.velocity0, l)
            _copy(parameters, offset + column.velocity_cos, h, ws, row.velocity_cos, l)
            _copy(parameters, offset + column.velocity_sin, h, ws, row.velocity_sin, l)


@inlined
def fill_level(dims, parameters, harmonics, values, points, steps, ws):
    """Write the stiffness level on each lane's step. The arguments are those of `fill_point` and `fill_step`."""
    row = rows(dims).level * WIDTH
    for l in range(WIDTH):
        level = harmonics.columns.levels + int(load_scalar(values, steps[l] * values.shape[1] + LEVEL))
        store_scalar(ws, row + l, load_scalar(parameters, points[l] * harmonics.columns.total + level))


@subroutine
def fill_step(dims, harmonics, values, steps, ws):
    """Write the workspace rows that depend on the lanes' steps, except the stiffness level; `fill_point` must have been
    called before.

    ``values`` is `Steps.values`, ``steps`` (WIDTH,) the index in it of each lane's step.
    """
    at, width = rows(dims), values.shape[1]
    for l in range(WIDTH):
        offset = steps[l] * width
        store_scalar(ws, at.duration * WIDTH + l, load_scalar(values, offset + LENGTH))
        _copy(values, offset + COS_SIN, 2 * harmonics.highest, ws, harmonics.rows.cos_sin, l)
    store(ws, at.duration, broadcast(TWO_PI) * load(ws, at.duration) / load(ws, at.omega))


@inlined
def save_point_rows(dims, harmonics, ws, saved, slot):
    """Copy the rows that `fill_point` has written to the slot's part of ``saved``, `Lanes.point_rows`."""
    at, amplitudes = rows(dims), harmonics.rows.forcing_amplitudes
    count = harmonics.point_rows
    for i in range(at.state):
        store(saved, slot * count + i, load(ws, i))
    for i in range(count - at.state):
        store(saved, slot * count + at.state + i, load(ws, amplitudes + i))


@inlined
def restore_point_rows(dims, harmonics, saved, slot, ws):
    """Copy the rows that `save_point_rows` has saved for a slot back to the workspace."""
    at, amplitudes = rows(dims), harmonics.rows.forcing_amplitudes
    count = harmonics.point_rows
    for i in range(at.state):
        store(ws, i, load(saved, slot * count + i))
    for i in range(count - at.state):
        store(ws, amplitudes + i, load(saved, slot * count + at.state + i))
