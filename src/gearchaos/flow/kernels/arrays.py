"""The arrays that kernels work on: tables of the parameter points, the request of a call, and the packs in progress."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearchaos.flow.kernels.compilation import inlined
from gearchaos.flow.kernels.constants import SLOTS, WIDTH, Measure
from gearchaos.flow.kernels.memory import PAGE, aligned
from gearchaos.flow.kernels.offsets import Harmonics

_SHIFT = WIDTH.bit_length() - 1
_MEASURES = len(Measure)


class Steps(NamedTuple):
    """The steps of all grids, one grid after the other, T in all.

    A *grid* divides a mesh period into steps. Steps with the same matrices have the same entry in the step tables.
    """

    entry: np.ndarray  # (T,) number of the step's matrices within the tables of a point
    entry_end: np.ndarray  # (T,) number, within its grid, of the next step that has another entry
    sample: np.ndarray  # (T,) number of the sample taken at the start of the step, or -1
    values: np.ndarray  # (T, 2 + 2 * harmonics) see `LENGTH`, `LEVEL` and `WAVES`


LENGTH, LEVEL, WAVES = range(3)
"""Columns of `Steps.values`: length as a share of the period; stiffness level, 0 or 1; and from `WAVES` on cos jωτ and
sin jωτ at the start of the step, in turn, for each harmonic j."""


class Grids(NamedTuple):
    """Which steps each of P points takes in a mesh period."""

    first_step: np.ndarray  # (P,) its first step in `Steps`
    step_count: np.ndarray  # (P,) steps in a period
    stride: np.ndarray  # (P,) steps between two orthonormalisations of the tangent vectors
    first_entry: np.ndarray  # (P,) its first entry in the step tables


class Points(NamedTuple):
    """All that is computed of P parameter points before any trajectory is advanced."""

    parameters: np.ndarray  # (P, total), columns as in `offsets.Columns`
    steps: Steps
    grids: Grids
    table: np.ndarray  # (entries of all points, 3, rows), see `tables.tabulate`
    harmonics: Harmonics
    tabulated: int  # harmonics of the forcing whose responses have rows of their own in the step tables


class Call(NamedTuple):
    """What is asked for L trajectories, in C packs, and the arrays that take the results; see `Flowed`."""

    packs: np.ndarray  # (C, WIDTH) trajectories in each pack, those with most periods first; -1 for none
    periods: np.ndarray  # (L,) mesh periods to advance
    points: np.ndarray  # (L,) parameter point of each
    w: np.ndarray  # (d, L) states: at the start, and in the end
    tangent: np.ndarray  # (K, d, L) tangent vectors, likewise
    growth: np.ndarray  # (periods, K, L)
    sections: np.ndarray  # (S, d, L)
    measures: np.ndarray  # (len(Measure), L), or (0, L) if not asked for
    samples: np.ndarray  # (periods, samples, d + 1, L)
    status: np.ndarray  # (L,)


class Lanes(NamedTuple):
    """The B = slots * `WIDTH` trajectories that are being advanced.

    The R vectors of a slot are, in order: d of the states at even ticks, d of those at odd ticks, and for each matrix
    set d bounds that recognise a harmless step, followed by the step matrices for the lanes' contact states, in the
    order of the step tables. There is one matrix set for each entry of the step tables, or a single one.
    """

    trajectory: np.ndarray  # (B,) number in the call
    point: np.ndarray  # (B,) parameter point
    first_step: np.ndarray  # (B,) its first step, as in `Grids`
    first_entry: np.ndarray  # (B,) its first entry of the step tables, as in `Grids`
    status: np.ndarray  # (B,)
    sigma: np.ndarray  # (B,) contact state
    matrix_sigma: np.ndarray  # (sets, B) the contact state for which the matrices of a set are; NaN for none
    measures: np.ndarray  # (slots * len(Measure) * WIDTH,), empty if nothing is measured
    point_rows: np.ndarray  # (slots * rows * WIDTH,) workspace rows saved for the measures, see `Harmonics.point_rows`
    vectors: np.ndarray  # (slots * R * WIDTH,)
    tangents: np.ndarray  # (slots, 2, K, d, WIDTH) tangent vectors at even and at odd ticks


class Slots(NamedTuple):
    """The progress of the pack in each of S slots. Used slots come first. One clock counts the ticks of all slots; in a
    tick every pack makes one step."""

    active: np.ndarray  # (S,) lanes of the pack that still have periods to go; they come first
    period: np.ndarray  # (S,) periods completed
    ahead: np.ndarray  # (S,) number of the step within its grid, less the tick
    step: np.ndarray  # (S,) number of the first lane's step in `Steps`, less the tick
    stop: np.ndarray  # (S,) number, within the grid, of the next step before which the slot must be served
    due: np.ndarray  # (S,) the tick of that step
    matrix_set: np.ndarray  # (S,) the set in use
    matrices: np.ndarray  # (S,) its first vector: of the bounds
    counters: np.ndarray  # (3,) slots in use; packs begun; the tick


class Workspace(NamedTuple):
    """Memory for resolving a pack of lanes, and lists of lanes."""

    rows: np.ndarray  # (rows * WIDTH,), see `offsets.Rows`
    listed: np.ndarray  # ((SLOTS + 1) * WIDTH,) numbers of lanes
    suspects: np.ndarray  # (SLOTS,) the lanes of each slot that must be resolved, one bit each
    measures: np.ndarray  # (len(Measure) * WIDTH,) measures of the lanes of the pack
    points: np.ndarray  # (WIDTH,) their parameter points
    steps: np.ndarray  # (WIDTH,) their steps in `Steps`


def new_workspace(harmonics: Harmonics) -> Workspace:
    """A workspace for systems with these harmonics.

    Its rows begin with a page of memory. Where their address modulo 4096 was 0x600 to 0x9c0, like that of the hot part
    of the stack in worker threads, d = 2 took 6 to 8 % more time: loads that wait for a store whose address has the
    same low 12 bits (4K aliasing) are the likely cause.
    """
    return Workspace(
        aligned(harmonics.rows.total * WIDTH, to=PAGE), np.zeros((SLOTS + 1) * WIDTH, np.int64),
        np.zeros(SLOTS, np.int64), aligned(_MEASURES * WIDTH), np.zeros(WIDTH, np.int64), np.zeros(WIDTH, np.int64),
    )


def new_lanes(d: int, k: int, table_rows: int, sets: int, slots: int, point_rows: int) -> Lanes:
    """Lanes for d coordinates, k tangent vectors and so many slots, each with so many sets of step matrices.

    ``table_rows`` is the length of the last axis of the step tables. ``point_rows`` is 0 if nothing is measured, else
    as in `Harmonics.point_rows`.
    """
    b = slots * WIDTH
    trajectory, point, first_step, first_entry, status = np.zeros((5, b), np.int64)
    return Lanes(
        trajectory, point, first_step, first_entry, status, aligned(b), aligned(sets, b),
        aligned(b * _MEASURES if point_rows else 0), aligned(b * point_rows),
        aligned(b * (2 * d + sets * (d + table_rows))), aligned(slots, 2, k, d, WIDTH),
    )


def new_slots(count: int) -> Slots:
    """So many empty slots, all due to receive their first pack."""
    active, period, ahead, step, stop, due, matrix_set, matrices = np.zeros((8, count), np.int64)
    return Slots(active, period, ahead, step, stop, due, matrix_set, matrices, np.array([count, 0, 0]))


@inlined
def rows_per_slot(lanes):
    """Vectors of a slot, R in `Lanes`."""
    return len(lanes.vectors) // len(lanes.trajectory)


@inlined
def slot_of(lane):
    """The slot of a lane."""
    return lane >> _SHIFT


@inlined
def position_of(lane):
    """The position of a lane in its pack."""
    return lane & (WIDTH - 1)


@inlined
def state_index(lanes, d, lane, parity):
    """Index into the floats of ``lanes.vectors`` of a lane's first coordinate; the next ones follow `WIDTH` apart."""
    return (slot_of(lane) * rows_per_slot(lanes) + parity * d) * WIDTH + position_of(lane)


@inlined
def measure_index(lane, row):
    """Index into ``lanes.measures`` of one measure of a lane."""
    return (slot_of(lane) * _MEASURES + row) * WIDTH + position_of(lane)
