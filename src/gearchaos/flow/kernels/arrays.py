"""The arrays that kernels work on: tables of the parameter points, arguments and results of a call, and the packs in
progress."""

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

    Steps with the same matrices have the same entry in the step tables.
    """

    entry: np.ndarray  # (T,) index of the step's matrices within the tables of a point
    entry_end: np.ndarray  # (T,) index, within its grid, of the next step that has another entry
    sample: np.ndarray  # (T,) index of the sample taken at the start of the step, or -1
    values: np.ndarray  # (T, 2 + 2 * harmonics) see `LENGTH`, `LEVEL` and `COS_SIN`


LENGTH, LEVEL, COS_SIN = range(3)
"""Columns of `Steps.values`: length as a fraction of the period; index of the stiffness level; and from `COS_SIN` on
cos jωτ and sin jωτ at the start of the step, in turn, for each harmonic j."""


class Grids(NamedTuple):
    """The step grid of each of P points."""

    first_step: np.ndarray  # (P,) its first step in `Steps`
    step_count: np.ndarray  # (P,) steps in a period
    orthonormalise_every: np.ndarray  # (P,) steps between two orthonormalisations of the tangent vectors
    first_entry: np.ndarray  # (P,) its first entry in the step tables


class Points(NamedTuple):
    """Data of P parameter points that are computed once, before trajectories are advanced."""

    parameters: np.ndarray  # (P, total), columns as in `offsets.Columns`
    steps: Steps
    grids: Grids
    table: np.ndarray  # (entries of all points, 3, rows), see `tables.tabulate`
    harmonics: Harmonics
    tabulated: int  # harmonics of the forcing whose responses have separate rows in the step tables


class Call(NamedTuple):
    """Arguments and result arrays for L trajectories in C packs; see `ExactFlow.advance` and `FlowResult`."""

    packs: np.ndarray  # (C, WIDTH) trajectories in each pack, those with most periods first; -1 for none
    periods: np.ndarray  # (L,) mesh periods to advance
    points: np.ndarray  # (L,) index of the parameter point of each
    w: np.ndarray  # (d, L) states: those at the start are overwritten by the final ones
    tangent: np.ndarray  # (K, d, L) tangent vectors, likewise
    growth: np.ndarray  # (periods, K, L)
    sections: np.ndarray  # (S, d, L)
    measures: np.ndarray  # (len(Measure), L), or (0, L) if not requested
    samples: np.ndarray  # (periods, samples, d + 1, L)
    status: np.ndarray  # (L,)


class Lanes(NamedTuple):
    """The B = slots * `WIDTH` trajectories that are being advanced.

    The R vectors of a slot are, in order: d of the states at even ticks, d of those at odd ticks, and for each matrix
    buffer d bounds for `affine.find_suspects`, followed by the step matrices for the lanes' contact states, in the
    order of the step tables. There is one matrix buffer for each entry of the step tables, or a single one.
    """

    trajectory: np.ndarray  # (B,) index in the arrays of the call
    point: np.ndarray  # (B,) index of its parameter point
    first_step: np.ndarray  # (B,) its first step, as in `Grids`
    first_entry: np.ndarray  # (B,) its first entry of the step tables, as in `Grids`
    status: np.ndarray  # (B,)
    sigma: np.ndarray  # (B,) contact state
    matrix_sigma: np.ndarray  # (buffers, B) contact state to which the matrices of a buffer belong; NaN for none
    measures: np.ndarray  # (slots * len(Measure) * WIDTH,), empty if nothing is measured
    point_rows: np.ndarray  # (slots * rows * WIDTH,) workspace rows saved for the measures, see `Harmonics.point_rows`
    vectors: np.ndarray  # (slots * R * WIDTH,)
    tangents: np.ndarray  # (slots, 2, K, d, WIDTH) tangent vectors at even and at odd ticks


class Slots(NamedTuple):
    """The progress of the pack in each of S slots. Used slots come first. At every tick each pack makes one
    step."""

    active: np.ndarray  # (S,) number of lanes of the pack with unfinished periods; they have the first positions
    period: np.ndarray  # (S,) periods completed
    step_minus_tick: np.ndarray  # (S,) index of the step within its grid, minus the tick
    row_minus_tick: np.ndarray  # (S,) index of the first lane's step in `Steps`, minus the tick
    stop: np.ndarray  # (S,) index, within the grid, of the next step before which the slot must be served
    due: np.ndarray  # (S,) the tick of that step
    matrix_buffer: np.ndarray  # (S,) index of the matrix buffer in use
    matrices: np.ndarray  # (S,) index of its first vector, which holds a bound
    counters: np.ndarray  # (3,) numbers of slots in use, of packs loaded so far, and of the tick


class Workspace(NamedTuple):
    """Memory for the Taylor polynomials of one pack of lanes, and lists of lanes."""

    rows: np.ndarray  # (rows * WIDTH,), see `offsets.Rows`
    listed: np.ndarray  # ((SLOTS + 1) * WIDTH,) indices of the lanes to be resolved
    suspects: np.ndarray  # (SLOTS,) suspects of each slot, one bit for each lane
    measures: np.ndarray  # (len(Measure) * WIDTH,) measures of the lanes of the pack
    points: np.ndarray  # (WIDTH,) indices of their parameter points
    steps: np.ndarray  # (WIDTH,) indices of their steps in `Steps`


def new_workspace(harmonics: Harmonics) -> Workspace:
    """A workspace for systems with these harmonics.

    Its rows start at a page of memory (4096 bytes). With addresses modulo 4096 of 0x600 to 0x9c0, like those of the
    most used part of the stack in worker threads, computations with d = 2 took 6 to 8 % longer. The likely cause is 4K
    aliasing: a load waits for an earlier store whose address has the same low 12 bits.
    """
    return Workspace(
        aligned(harmonics.rows.total * WIDTH, to=PAGE), np.zeros((SLOTS + 1) * WIDTH, np.int64),
        np.zeros(SLOTS, np.int64), aligned(_MEASURES * WIDTH), np.zeros(WIDTH, np.int64), np.zeros(WIDTH, np.int64),
    )


def new_lanes(d: int, k: int, table_rows: int, buffers: int, slots: int, point_rows: int) -> Lanes:
    """Empty lanes for d coordinates, k tangent vectors, and ``slots`` slots with ``buffers`` matrix buffers each.

    ``table_rows`` is the length of the last axis of the step tables. ``point_rows`` is 0 if nothing is measured, else
    as in `Harmonics.point_rows`.
    """
    b = slots * WIDTH
    trajectory, point, first_step, first_entry, status = np.zeros((5, b), np.int64)
    return Lanes(
        trajectory, point, first_step, first_entry, status, aligned(b), aligned(buffers, b),
        aligned(b * _MEASURES if point_rows else 0), aligned(b * point_rows),
        aligned(b * (2 * d + buffers * (d + table_rows))), aligned(slots, 2, k, d, WIDTH),
    )


def new_slots(count: int) -> Slots:
    """``count`` empty slots, all to be served at the first tick."""
    active, period, step_minus_tick, row_minus_tick, stop, due, matrix_buffer, matrices = np.zeros((8, count), np.int64)
    return Slots(
        active, period, step_minus_tick, row_minus_tick, stop, due, matrix_buffer, matrices, np.array([count, 0, 0])
    )


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
