"""How much of the distance to the next change of contact differences from a motion use."""

from __future__ import annotations

from gearchaos.flow.kernels.compilation import inlined, kernel
from gearchaos.flow.kernels.many_contacts.contact_arrays import LEAP
from gearchaos.flow.kernels.many_contacts.contact_leaps import leap_in_contact
from gearchaos.flow.kernels.many_contacts.contact_motion import advance_tangents, closed_contacts
from gearchaos.flow.kernels.many_contacts.contact_sets import after_step, dot, fill_steps, find_set


@inlined
def _use_in_step(dims, points, tables, place, entry, w, after, vectors, moved, shares):
    """Take the shares of `contact_shares` of a step from ``w`` to ``after``; returns the least distance."""
    least, part = 1.0, tables.linear[place, entry]
    for m in range(len(points.row)):
        limits, bends, row = tables.clear[place, entry, m], tables.bends[place, part, m], points.row[m]
        bend = limits[3]
        for i in range(len(dims)):
            bend += bends[i] * abs(w[i] - limits[2] * points.unit[m, i])
        start, end = dot(dims, row, w), dot(dims, row, after)
        distance = min(min(start, end) - limits[0], limits[1] - max(start, end)) - bend
        least = min(least, distance)
        for c in range(len(vectors)):
            bend = 0.0
            for i in range(len(dims)):
                bend += bends[i] * abs(vectors[c, i])
            used = max(abs(dot(dims, row, vectors[c])), abs(dot(dims, row, moved[c])))
            shares[c] = max(shares[c], (used + bend) / distance)
    return least


@inlined
def _use_in_leap(dims, points, p, tables, place, leap, part, w, vectors, shares):
    """The same of a leap that is surely clear."""
    for m in range(len(points.row)):
        bends, row, first = tables.leap_bends[place, part, m], points.row[m], tables.leap_first[place, leap, m]
        clear, rows = tables.leap_clear[place, leap, m], tables.leap_rows[place, part, m]
        far, start = 0.0, dot(dims, row, w)
        for i in range(len(dims)):
            far += bends[i] * abs(w[i] - points.rest[p, i])
        distance = min(start - first[0], first[1] - start) - far
        for k in range(LEAP):
            at = clear[0, k]
            for i in range(len(dims)):
                at += rows[i, k] * w[i]
            distance = min(distance, at - clear[1, k] - far, clear[2, k] - at - far)
        for c in range(len(vectors)):
            used, far = abs(dot(dims, row, vectors[c])), 0.0
            for i in range(len(dims)):
                far += bends[i] * abs(vectors[c, i])
            for k in range(LEAP):
                at = 0.0
                for i in range(len(dims)):
                    at += rows[i, k] * vectors[c, i]
                used = max(used, abs(at))
            shares[c] = max(shares[c], (used + far) / distance)


@inlined
def _copy(vectors, to):
    for c in range(len(vectors)):
        for i in range(vectors.shape[1]):
            to[c, i] = vectors[c, i]


@kernel
def contact_shares(dims, points, p, tables, work, vectors, moved, shares):
    """Write to ``shares`` (C,) how much of the distance to a change of contact the differences ``vectors`` (C, d) from
    the motion from ``work.w`` use at most, over a period of point p; returns whether the contact of the motion surely
    changes with the pieces of the period alone. ``moved`` (C, d) is memory."""
    place, step, closed, entry, d = min(p, len(tables.point) - 1), 0, 0, -1, len(dims)
    if tables.point[place] != p:
        fill_steps(dims, points, p, tables, place, work)
    while step < tables.steps[place]:
        if tables.pause[place, step] == 1:
            closed = closed_contacts(dims, points, tables, place, step, work.w, closed)
        leap, part = tables.leap[place, step], -1
        if leap >= 0 and closed == tables.leap_closed[place, leap]:
            part = leap_in_contact(dims, points, p, tables, place, step, leap, work)
        if part >= 0:
            _use_in_leap(dims, points, p, tables, place, leap, part, work.w, vectors, shares)
            advance_tangents(dims, tables.leap_matrix[place, part], vectors, work.last)
            step += points.leap[p, tables.piece[place, step]]
        else:
            entry = find_set(dims, points, p, tables, place, step, closed, work)
            after_step(dims, tables, place, entry, work.w, work.after)
            _copy(vectors, moved)
            advance_tangents(dims, tables.matrix[place, tables.linear[place, entry]], moved, work.last)
            if not _use_in_step(dims, points, tables, place, entry, work.w, work.after, vectors, moved, shares) > 0.0:
                return False
            _copy(moved, vectors)
            step += 1
        for i in range(d):
            work.w[i] = work.after[i]
    return True
