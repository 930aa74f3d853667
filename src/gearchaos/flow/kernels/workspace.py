"""Filling the workspace: what the Taylor polynomials of a pack need of its lanes' points and steps."""

from __future__ import annotations

from gearchaos.flow.kernels.arrays import LENGTH, LEVEL, WAVES
from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.constants import WIDTH
from gearchaos.flow.kernels.offsets import rows
from gearchaos.flow.kernels.simd import broadcast, load, load_scalar, store, store_scalar

_TWO_PI = 6.283185307179586


@inlined
def _copy(values, first, count, ws, row, position):
    """Copy ``count`` floats of an array, from index ``first`` on, to one position of as many rows."""
    for i in range(count):
        store_scalar(ws, (row + i) * WIDTH + position, load_scalar(values, first + i))


@subroutine
def fill_point(dims, parameters, harmonics, points, measuring, ws):
    """Write to the workspace what depends on the lanes' points alone.

    ``parameters`` is the array (P, total) of all points, ``points`` (WIDTH,) says which one each lane has. What only
    the measures need is written if ``measuring``.
    """
    d, h, k = len(dims), harmonics.forcing, harmonics.stiffness
    at, column, row = rows(dims), harmonics.columns, harmonics.rows
    for l in range(WIDTH):
        own = points[l] * column.total
        _copy(parameters, own + column.A + d, d * d - d, ws, at.A + d, l)  # the first row of A is not used
        for i in range(1, d):
            store_scalar(ws, (at.minus_b + i) * WIDTH + l, -load_scalar(parameters, own + column.b + i))
        _copy(parameters, own + column.f0, d, ws, at.f0, l)
        _copy(parameters, own + column.levels, 2, ws, at.levels, l)
        _copy(parameters, own + column.omega, 1, ws, at.omega, l)
        for j in range(h):
            _copy(parameters, own + column.f_cos + j, 1, ws, row.forcing_gains + 2 * j, l)
            _copy(parameters, own + column.f_sin + j, 1, ws, row.forcing_gains + 2 * j + 1, l)
        for j in range(k):
            _copy(parameters, own + column.chi_cos + j, 1, ws, row.stiffness_gains + 2 * j, l)
            _copy(parameters, own + column.chi_sin + j, 1, ws, row.stiffness_gains + 2 * j + 1, l)
        if measuring:
            _copy(parameters, own + column.damping, 1, ws, row.damping, l)
            _copy(parameters, own + column.velocity, d, ws, row.velocity, l)
            _copy(parameters, own + column.velocity0, 1, ws, row.velocity0, l)
            _copy(parameters, own + column.velocity_cos, h, ws, row.velocity_cos, l)
            _copy(parameters, own + column.velocity_sin, h, ws, row.velocity_sin, l)


@subroutine
def fill_step(dims, harmonics, values, steps, ws):
    """Write to the workspace what depends on the lanes' steps, after `fill_point`.

    ``values`` is `Steps.values`, ``steps`` (WIDTH,) says which step each lane is at.
    """
    at, width = rows(dims), values.shape[1]
    for l in range(WIDTH):
        own = steps[l] * width
        level = at.levels + int(load_scalar(values, own + LEVEL))
        store_scalar(ws, at.level * WIDTH + l, load_scalar(ws, level * WIDTH + l))
        store_scalar(ws, at.duration * WIDTH + l, load_scalar(values, own + LENGTH))
        _copy(values, own + WAVES, 2 * harmonics.waves, ws, harmonics.rows.waves, l)
    store(ws, at.duration, broadcast(_TWO_PI) * load(ws, at.duration) / load(ws, at.omega))


@inlined
def save_point_rows(dims, harmonics, ws, saved, slot):
    """Save for a slot what `fill_point` has written: to its part of ``saved``, `Lanes.point_rows`."""
    at, gains = rows(dims), harmonics.rows.forcing_gains
    count = harmonics.point_rows
    for i in range(at.state):
        store(saved, slot * count + i, load(ws, i))
    for i in range(count - at.state):
        store(saved, slot * count + at.state + i, load(ws, gains + i))


@inlined
def restore_point_rows(dims, harmonics, saved, slot, ws):
    """Write to the workspace what was saved for a slot."""
    at, gains = rows(dims), harmonics.rows.forcing_gains
    count = harmonics.point_rows
    for i in range(at.state):
        store(ws, i, load(saved, slot * count + i))
    for i in range(count - at.state):
        store(ws, gains + i, load(saved, slot * count + at.state + i))
