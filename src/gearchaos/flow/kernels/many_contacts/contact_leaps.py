"""Leaps in contact: many steps of a piece of the period as one, with the contact set that the gears have at rest there.

The displacements after all of its steps are linear in the state with which a leap begins. It is taken where none of
them, with a bound of how far it is from its chord on a step, comes near a limit of its contact set.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.compilation import inlined, subroutine
from gearchaos.flow.kernels.many_contacts.contact_arrays import LEAP
from gearchaos.flow.kernels.many_contacts.contact_sets import (
    after_step,
    apply_affine,
    bend_bound,
    dot,
    find_set,
    forget_sets,
)
from gearchaos.flow.kernels.vector.constants import WIDTH
from gearchaos.flow.kernels.vector.simd import bits, broadcast, fma, load, vfma


@subroutine
def _make_leap_part(dims, points, tables, place, part, count, power, moved):
    """Write what leaps of ``count`` steps with a linear part have in common; ``power`` (d, d) and ``moved`` (d,) are
    memory."""
    d, matrix, bends = len(dims), tables.matrix[place, part], tables.leap_bends[place, part]
    tables.leap_made[place, part] = 1
    bends[:] = tables.leap_rows[place, part] = 0.0
    for j in range(d):
        for i in range(d):
            power[j, i] = 1.0 if i == j else 0.0
    for k in range(count):
        for j in range(d):
            for m in range(len(points.row)):
                bend = 0.0
                for i in range(d):
                    bend += tables.bends[place, part, m, i] * abs(power[j, i])
                bends[m, j] = max(bends[m, j], bend)
            for i in range(d):
                moved[i] = 0.0
                for n in range(d):
                    moved[i] = fma(matrix[n, i], power[j, n], moved[i])
            for i in range(d):
                power[j, i] = tables.leap_matrix[place, part, j, i] = moved[i]
            for m in range(len(points.row)):
                tables.leap_rows[place, part, m, j, k] = dot(dims, points.row[m], moved)


@subroutine
def _add_leap(dims, points, p, tables, place, step, leap, work):
    """Make a leap in contact that begins with a step.

    Its limits are those of the steps with ``clear``, less how far the displacement is from the chord of each step in
    the motion that begins at rest; ``leap_bends`` are, for each coordinate, that for a difference of 1 from there.
    """
    d, closed, count = len(dims), tables.leap_closed[place, leap], points.leap[p, tables.piece[place, step]]
    if tables.entries[place] + LEAP > tables.step.shape[1]:
        forget_sets(tables, place)
    clear, first, states = tables.leap_clear[place, leap], tables.leap_first[place, leap], work.states
    for i in range(d):
        states[0, i], states[1, i] = points.rest[p, i], 0.0
    clear[:, 0], clear[:, 1], clear[:, 2] = 0.0, -np.inf, np.inf
    for k in range(count):
        entry = find_set(dims, points, p, tables, place, step + k, closed, work)
        part = tables.linear[place, entry]
        for m in range(len(points.row)):
            bend = bend_bound(dims, tables.outputs[place, part, m], tables.shift_outputs[place, entry, m], states[0],
                              1.0, work.shifted)
            low, high = tables.clear[place, entry, m, 0] + bend, tables.clear[place, entry, m, 1] - bend
            if k == 0:
                first[m, 0], first[m, 1] = low, high
            else:
                clear[m, 1, k - 1], clear[m, 2, k - 1] = max(clear[m, 1, k - 1], low), min(clear[m, 2, k - 1], high)
            clear[m, 1, k], clear[m, 2, k] = low, high
        for n in range(2):
            after_step(dims, tables, place, entry, states[n], work.after)
            for i in range(d):
                states[n, i] = work.after[i]
        for m in range(len(points.row)):
            clear[m, 0, k] = dot(dims, points.row[m], states[1])
    for i in range(d):
        tables.leap_shift[place, leap, i] = states[1, i]
    if tables.leap_made[place, part] < 0:
        _make_leap_part(dims, points, tables, place, part, count, work.power, work.after)
    tables.leap_part[place, leap] = part


@inlined
def leap_in_contact(dims, points, p, tables, place, step, leap, work):
    """Write the state after the leap that begins with a step to ``work.after``; returns its linear part, or −1 where a
    contact may switch."""
    part = tables.leap_part[place, leap]
    if part < 0:
        _add_leap(dims, points, p, tables, place, step, leap, work)
        part = tables.leap_part[place, leap]
    stays, ones, vectors = True, (1 << WIDTH) - 1, LEAP // WIDTH
    for m in range(len(points.row)):
        far, z = 0.0, 0.0
        for j in range(len(dims)):
            far += tables.leap_bends[place, part, m, j] * abs(work.w[j] - points.rest[p, j])
            z += points.row[m, j] * work.w[j]
        first, clear, rows = tables.leap_first[place, leap, m], tables.leap_clear[place, leap, m], tables.leap_rows[
            place, part, m]
        stays &= (first[0] + far < z) & (z < first[1] - far)
        for v in range(vectors):
            at = load(clear, v)
            for j in range(len(dims)):
                at = vfma(broadcast(work.w[j]), load(rows, j * vectors + v), at)
            low, high = load(clear, vectors + v), load(clear, 2 * vectors + v)
            stays &= bits((low + broadcast(far) < at) & (at < high - broadcast(far))) == ones
    if not stays:
        return -1
    apply_affine(dims, tables.leap_matrix[place, part], tables.leap_shift[place, leap], work.w, work.after)
    return part
