"""Points of systems with several one-sided contacts, for the kernels; see `kernels.many_contacts.contact_arrays`."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.flow.kernels.many_contacts.contact_arrays import (
    LEAP,
    MOST_UNROLLED,
    OFFSETS,
    ContactPoints,
    StepTables,
    new_tables,
    vectors_of,
)
from gearchaos.flow.kernels.vector.arrays import aligned, dimensions
from gearchaos.flow.kernels.vector.constants import WIDTH
from gearchaos.flow.step_tables import orthonormalisations
from gearchaos.flow.system import SwitchedSystem, fastest_rate, min_steps_per_period, rate_in_flight

MEMORY = 128 << 20  # bytes of step tables and matrices that are kept for points
_SETS = 12  # most contact sets with room at each step on the average; when it is used up it is used anew
_LARGEST = 2 << 30  # bytes of what these take at one point, of many coordinates and a long period
_LONGEST_LEAP, _SHORTEST_LEAP = 16, 8
"""Steps that free flight takes as one. The longest leap saves the most where a flank is met every few hundred steps."""

_ITERATIONS = 10  # in which rest under load is sought
_SAME_INSTANT = 1e-12  # a sample and a change of stiffness that are closer, as fractions of the period, coincide


def contact_dimensions(system: SwitchedSystem) -> Any:
    """The argument ``dims`` of the kernels: that of `dimensions` with the law ``unilateral`` if a contact releases, and
    another one if none does. Of more than `MOST_UNROLLED` coordinates it is an array (d,), whose length they take when
    they run. So one kernel serves all; the bits of the results are the same."""
    dims = dimensions(system.dimension, "unilateral" if system.contacts.releases.any() else "always")
    return dims if len(dims) <= MOST_UNROLLED else np.array(dims)


def prepare_contacts(system: SwitchedSystem, samples: int) -> tuple[ContactPoints, StepTables]:
    """The points of a system with several contacts, and empty tables for their steps.

    If ``samples`` > 0, a step starts at each of ``samples`` equidistant instants of the period.
    """
    contacts, (points, d) = system.contacts, system.b.shape
    edges, stiffness, offset = contacts.edges, contacts.stiffness, contacts.offset
    edges = np.hstack([edges, np.ones((points, 1))])
    sample = np.full(edges.shape[1] - 1, -1)
    if samples:
        if np.ptp(edges, axis=0).any():
            raise ValueError("samples need the same contact ratio and relief lengths at all points")
        edges, piece, begin, sample = _split(edges[0], samples)
        edges = np.repeat(edges[None], points, axis=0)
        stiffness, offset = stiffness[:, :, piece], offset[:, :, piece]
        a, b, c = (offset[..., k] for k in range(OFFSETS))
        offset = np.stack([a + begin * (b + begin * c), b + 2 * begin * c, c], axis=-1)
    counts = np.ceil(min_steps_per_period(system)[:, None] * np.diff(edges, axis=1) - 1e-9).astype(np.int64)
    counts, leap = np.maximum(counts, 1), np.zeros_like(counts)
    releasing, row, unit, mesh, side = _gaps(contacts)
    if d > MOST_UNROLLED and len(releasing) == 0:  # each piece in leaps of the same length
        of_piece = -(-counts // LEAP)
        leap = -(-counts // of_piece)
        counts = of_piece * leap
    stiffness, offset = (np.hstack([each, each[:, releasing]]) for each in (stiffness, offset))
    sides = aligned(vectors_of(len(side)) * WIDTH)
    sides[: len(side)] = side
    found = ContactPoints(*map(np.ascontiguousarray, (
        system.omega, system.A, system.f0, contacts.orders, contacts.f_cos, contacts.f_sin,
        contacts.rows[row], unit, contacts.rates[row], contacts.pushes, contacts.damping[:, row],
        contacts.in_contact.astype(np.int64), releasing, mesh, side, sides, edges,
        stiffness.transpose(0, 2, 1), offset.transpose(0, 2, 1, 3), counts, leap, sample,
        np.maximum(1, counts.sum(axis=1) // orthonormalisations(system)), _spans(system),
        _rest(system) if d > MOST_UNROLLED else np.zeros_like(system.f0),
        system.velocity, system.velocity0, system.velocity_cos, system.velocity_sin)))
    steps = counts.sum(axis=1)
    both = int((steps + np.where(found.span > 1, steps // found.span, 0)).max())  # with the leaps
    leaps = int((counts // np.maximum(leap, 1)).sum(axis=1).max()) if leap.any() else 0
    fixed = leaps, len(sample), d, len(side), len(row)
    sets = min(_SETS, 2 ** len(side))
    entries, parts = max(sets * both, LEAP), sets * len(sample) * (2 if np.any(found.span > 1) else 1)
    least, entry, part = (_size(new_tables(1, 1, *room, *fixed)) for room in ((1, 1), (2, 1), (1, 2)))
    share = min(1.0, _LARGEST / (entries * (entry - least) + parts * (part - least)))
    entries, parts = max(LEAP, int(share * entries)), max(1, int(share * parts))
    places = min(points, max(1, MEMORY // _size(new_tables(1, both, entries, parts, *fixed))))
    return found, new_tables(places, both, entries, parts, *fixed)


def _gaps(contacts: Any) -> tuple[np.ndarray, ...]:
    """The contacts that release (U,); of each row its mesh and coordinates at which it is 1, (R,) and (R, d); of each
    contact its row and side, (C,): behind those of displacements are those of the forces of contacts that release."""
    count, releasing = len(contacts.rows), np.flatnonzero(contacts.releases[contacts.meshes])
    row = np.append(np.arange(count), contacts.meshes[releasing])
    unit = (contacts.rows / (contacts.rows**2).sum(axis=1, keepdims=True))[row]
    unit[count:] = 0.0
    mesh = np.append(contacts.meshes, count + np.arange(len(releasing)))
    return releasing, row, unit, mesh, np.append(contacts.sides, contacts.sides[releasing]).astype(float)


def _size(tables: StepTables) -> int:
    return sum(array.nbytes for array in tables)


def _rest(system: SwitchedSystem) -> np.ndarray:
    """Equilibria (P, d) with the mean stiffness and offsets, and the contacts that close under the load."""
    contacts, lengths = system.contacts, np.diff(system.contacts.edges, axis=1, append=1.0)[:, None]
    stiffness = (contacts.stiffness * lengths).sum(axis=2)
    offset = (contacts.stiffness * contacts.offset[..., 0] * lengths).sum(axis=2) / np.maximum(stiffness, 1e-300)
    rows, pushes = contacts.rows[contacts.meshes], contacts.pushes[:, contacts.meshes]
    closed, rest = np.broadcast_to(contacts.sides > 0, stiffness.shape), np.zeros_like(system.f0)
    for _ in range(_ITERATIONS):
        springs = np.where(closed, stiffness, 0.0)[..., None] * pushes  # (P, M, d)
        force = system.f0 + ((contacts.sides * offset)[..., None] * springs).sum(axis=1)
        matrix = system.A - np.einsum("pmi,mj->pij", springs, rows)
        rest = -np.einsum("pij,pj->pi", np.linalg.pinv(matrix), force)
        before, closed = closed, contacts.sides * (rest @ rows.T) > offset
        if np.array_equal(before, closed):
            break
    return rest


def _spans(system: SwitchedSystem) -> np.ndarray:
    """The steps of a leap (P,): 1, but of one mesh with one spring on each flank, which may fly for thousands."""
    if system.dimension != 2 or len(system.contacts.sides) != 2 or system.contacts.releases.any():
        return np.ones(len(system.omega), np.int64)
    longest = fastest_rate(system) / rate_in_flight(system)
    span = 2 ** np.log2(np.clip(longest, 1, _LONGEST_LEAP)).astype(np.int64)
    return np.where(span < _SHORTEST_LEAP, 1, span)


def _split(edges: np.ndarray, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Pieces with ``edges`` (N + 1,) split at ``samples`` equidistant instants.

    Returns the new edges, of each new piece the old one and how far within it it begins, and the index of the sample
    at its start or −1.
    """
    instants = np.arange(samples) / samples
    after = np.searchsorted(edges, instants)  # the edge at or after each instant; the last one is 1
    near = np.minimum(edges[after] - instants, np.abs(instants - edges[after - 1])) < _SAME_INSTANT
    new = np.sort(np.concatenate([edges, instants[~near]]))
    piece = np.searchsorted(edges, new[:-1], side="right") - 1
    piece = np.minimum(piece, len(edges) - 2)
    sample, first = np.full(len(new) - 1, -1), np.searchsorted(new, instants - _SAME_INSTANT)
    long = np.diff(new) > _SAME_INSTANT
    for i, n in enumerate(first.tolist()):
        while not long[n]:  # a piece of no length has no steps
            n += 1
        sample[n] = i
    return new, piece, new[:-1] - edges[piece], sample
