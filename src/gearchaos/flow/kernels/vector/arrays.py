"""The arrays that kernels work on: tables of the parameter points, arguments and results of a call, the packs in
progress; and where each quantity begins in the two packed ones, the parameter array and the workspace.

Both of these are described by lists of (name, size). Offsets are the running sums of the sizes, so a new quantity needs
one line here. Offsets that depend on the number of coordinates d alone are constants for the compiler; those that
depend on the numbers of harmonics H and K and of stiffness levels N are passed to the kernels in `Harmonics`.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Iterator
from functools import cache
from itertools import accumulate
from math import prod
from typing import Any, NamedTuple

import numpy as np
from numba import config, typeof, types
from numba.extending import intrinsic

from gearchaos.flow.kernels.compilation import inlined
from gearchaos.flow.kernels.vector.constants import ORDER, PACKS, SLOTS, WIDTH
from gearchaos.flow.kernels.vector.measure import Measure

CACHE_LINE, PAGE = 64, 4096
"""Bytes in a line of the cache, which is also the size of a vector; bytes in a page of memory."""


def aligned(*shape: int, to: int = CACHE_LINE, allocate: Callable[[int], np.ndarray] = np.zeros) -> np.ndarray:
    """An array (float64) of this shape, by default of zeros, whose address is a multiple of ``to`` bytes.

    With a multiple of `CACHE_LINE` no vector lies in two lines of the cache.
    """
    size, step = prod(shape), to // 8
    padded = allocate(size + step)
    skip = -(padded.ctypes.data // 8) % step
    return padded[skip : skip + size].reshape(shape)


_TERMS = ORDER + 1  # coefficients of a Taylor polynomial


def _parameters(d: int, h: int, k: int, n: int) -> dict[str, int]:
    """Columns of the parameter array (P, total): the flattened arrays of the system, and those of `system.bounds`."""
    return {
        "A": d * d, "b": d, "f0": d, "levels": n, "omega": 1, "bound0": 2, "bound": d, "damping": 1, "velocity": d,
        "velocity0": 1, "f_cos": h, "f_sin": h, "chi_cos": k, "chi_sin": k, "velocity_cos": h, "velocity_sin": h,
    }


def _fixed_rows(d: int, law: str) -> dict[str, int]:
    """Rows of the workspace that do not depend on harmonics; a polynomial has `ORDER` + 1 coefficients.

    ``law`` is one of `DAMPING_LAWS`.
    """
    in_contact, releases = law != "always", law == "unilateral"
    return {
        "A": d * d,
        "minus_b": d,
        "f0": d,
        "omega": 1,  # mesh frequency
        "contact_damping": int(in_contact),  # damping coefficient of the mesh force
        "state": _TERMS * d,  # polynomials of the coordinates: coefficient k of coordinate i in row k * d + i
        "forcing": _TERMS,  # polynomial of the harmonic forcing of z''
        "stiffness": _TERMS,  # polynomial of the stiffness; zero in free flight
        "velocity": _TERMS,  # polynomial of x1', for the measures
        "force": _TERMS,  # polynomial of the mesh force, for the measures
        "start": d,  # state or tangent vector at the start of the segment
        "end": d,  # and at its end
        "stiffness_column": d,  # factor of z - σ: first column of A, less b times the stiffness at the start
        "full_stiffness": _TERMS * releases,  # polynomial of the stiffness, also in free flight
        "first_gap": _TERMS * releases,  # polynomials of the distances from the boundaries of the contact state
        "second_gap": _TERMS * releases,
        "velocity_column": d * in_contact,  # factor of z': second column of A, in contact less b times the damping
        "constant": d,  # constant forcing, with A[:, 0] σ
        "duration": 1,  # of the segment, in units of τ
        "level": 1,  # stiffness on the step, without its harmonics
        "sigma": 1,  # contact state
        "next_sigma": 1,  # contact state after the segment
        "end_fraction": 1,  # fraction of the segment at the contact switch, or 1
        # of the search for it: bound of |d³z/ds³|, s so far, the last touch, its probe's distance, the next window,
        "third": 1, "searched": 1, "touch": 1, "probe": 1, "window_limit": 1,
        "moved": 1, "slope": 1, "second": 1,  # z(s) - z(0) and its first two derivatives
        "amplitudes": 2,  # amplitudes of a cosine and a sine, for the step tables
    }


def _harmonic_rows(d: int, h: int, k: int) -> dict[str, int]:
    """Rows of the workspace after the fixed ones, whose number depends on the harmonics."""
    return {
        "cos_sin": 2 * max(h, k),  # cos jωτ and sin jωτ at the start of the segment, j = 1, 2, ...
        "forcing_amplitudes": 2 * h,  # their amplitudes in the forcing of z''
        "stiffness_amplitudes": 2 * k,  # their amplitudes in the stiffness
        "damping": 1,  # damping coefficient of the mesh force; rows from here on are for the measures
        "velocity": d,  # factors of the coordinates in x1'
        "velocity0": 1,  # constant in x1'
        "velocity_cos": h,  # amplitudes of the cosines and sines in x1'
        "velocity_sin": h,
    }


def _sensitivity_rows(d: int, h: int, k: int, q: int) -> dict[str, int]:
    """Rows of the workspace after those of the harmonics, for tangent vectors and derivatives by q parameters.

    Rows of a derivative are for one parameter at a time.
    """
    return {
        "motion": _TERMS * d,  # copy of the polynomials of the coordinates
        "A": d * d,  # derivative of A
        "b": d,
        "f0": d,
        "forcing_amplitudes": 2 * h,
        "stiffness_amplitudes": 2 * k,
        "level": 1,
        "damping": 1,
        "stretch": 1,  # derivative of the logarithm of the mesh period
        "forcing": _TERMS,  # polynomial of the derivative of the harmonic forcing
        "stiffness": _TERMS,  # polynomial of the derivative of the stiffness; zero in free flight
        "vectors": (1 + d + q) * d,  # the state, d tangent vectors, and its derivatives by the q parameters
    }


def _record(name: str, sizes: dict[str, int]) -> Any:
    """A named tuple of offsets, with one field for each quantity and ``total`` for the end of the last one."""
    return namedtuple(name, [*sizes, "total"])


ParameterColumns = _record("ParameterColumns", _parameters(1, 1, 1, 1))
Rows = _record("Rows", _fixed_rows(1, "unilateral"))
HarmonicRows = _record("HarmonicRows", _harmonic_rows(1, 1, 1))
SensitivityRows = _record("SensitivityRows", _sensitivity_rows(1, 1, 1, 1))


def _offsets(sizes: dict[str, int], first: int = 0) -> Iterator[int]:
    """Offset of each of these quantities, and the end of the last one."""
    return accumulate(sizes.values(), initial=first)


class Harmonics(NamedTuple):
    """How many harmonics a system has, and the offsets that depend on it and on the number of stiffness levels."""

    forcing: int  # H
    stiffness: int  # K
    highest: int  # the larger of both: highest harmonic whose cosine and sine are needed
    columns: Any  # `ParameterColumns` of the parameter array, see `_parameters`
    rows: Any  # `HarmonicRows` of the workspace, see `_harmonic_rows`
    point_rows: int  # rows that depend on a point alone: those before ``state``, and from ``forcing_amplitudes`` on


def harmonics(d: int, h: int, k: int, n: int, law: str) -> Harmonics:
    """The offsets for d coordinates, h harmonics of the forcing, and k harmonics and n levels of the stiffness."""
    fixed = row_offsets(d, law)
    rows = HarmonicRows(*_offsets(_harmonic_rows(d, h, k), fixed.total))
    point_rows = fixed.state + rows.total - rows.forcing_amplitudes
    return Harmonics(h, k, max(h, k), ParameterColumns(*_offsets(_parameters(d, h, k, n))), rows, point_rows)


def sensitivity_rows(d: int, harmonics: Harmonics, q: int) -> Any:
    """`SensitivityRows` of the workspace for d coordinates and derivatives by q parameters."""
    sizes = _sensitivity_rows(d, harmonics.forcing, harmonics.stiffness, q)
    return SensitivityRows(*_offsets(sizes, harmonics.rows.total))


@cache
def row_offsets(d: int, law: str) -> Any:
    """`Rows` of the workspace for d coordinates."""
    return Rows(*_offsets(_fixed_rows(d, law)))


DAMPING_LAWS: dict[str, Any] = {"always": 0, "contact": 0.0, "unilateral": 0j}
"""Where the mesh damping acts, and the number whose type tells the kernels: always, also across the gap; in contact; or
in contact that ends where the force does, so that it never pulls."""


def dimensions(d: int, law: str) -> tuple[Any, ...]:
    """The argument ``dims`` of the kernels: its length is d, and its type, for which they are compiled, the law."""
    return (DAMPING_LAWS[law],) * d


def _law(dims: Any) -> str:
    """The damping law of ``dims``, or of its Numba type."""
    element = dims.dtype if isinstance(dims, types.Type) else typeof(dims[0])
    return next(law for law, number in DAMPING_LAWS.items() if typeof(number) == element)


@intrinsic
def _constant_in_contact(typingctx, dims):
    return types.boolean(dims), _constant(types.boolean, _law(dims) != "always")


@intrinsic
def _constant_releases(typingctx, dims):
    return types.boolean(dims), _constant(types.boolean, _law(dims) == "unilateral")


@intrinsic
def _constant_rows(typingctx, dims):
    kind = types.NamedUniTuple(types.intp, len(Rows._fields), Rows)
    return kind(dims), _constant(kind, row_offsets(len(dims), _law(dims)))


def _constant(kind: Any, value: Any) -> Any:
    """The code of an intrinsic that is a constant."""
    return lambda context, builder, signature, args: context.get_constant_generic(builder, kind, value)


_PYTHON = config.DISABLE_JIT

damps_in_contact: Any = (lambda dims: _law(dims) != "always") if _PYTHON else _constant_in_contact
"""``damps_in_contact(dims)``: whether the mesh damping acts in contact alone, for kernels a compile-time constant."""

releases: Any = (lambda dims: _law(dims) == "unilateral") if _PYTHON else _constant_releases
"""``releases(dims)``: whether contact ends where the force does, before the gap opens, likewise."""

rows: Any = (lambda dims: row_offsets(len(dims), _law(dims))) if _PYTHON else _constant_rows
"""``rows(dims)``: `row_offsets` for kernels, as compile-time constants."""


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

    parameters: np.ndarray  # (P, total), columns as in `ParameterColumns`
    steps: Steps
    grids: Grids
    table: np.ndarray  # (entries of all points, 3, rows), see `step_tables.tabulate`
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
    sigma: np.ndarray  # (L,) contact states at the start, see `system.contact_states`


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
    sigma: np.ndarray  # (B,) contact state: 0 in free flight, 1 or -1 in contact, 1/2 or -1/2 where a flank is released
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
    stop: np.ndarray  # (S,) index, within the grid, of the next step before which housekeeping is due
    due: np.ndarray  # (S,) the tick of that step
    matrix_buffer: np.ndarray  # (S,) index of the matrix buffer in use
    matrices: np.ndarray  # (S,) index of its first vector, which holds a bound
    counters: np.ndarray  # (3,) numbers of slots in use, of packs loaded so far, and of the tick


class Workspace(NamedTuple):
    """Memory for the Taylor polynomials of one pack of lanes, and lists of lanes."""

    rows: np.ndarray  # (PACKS * rows * WIDTH,), see `Rows`
    listed: np.ndarray  # ((SLOTS + 1) * WIDTH,) indices of the lanes to be resolved
    suspects: np.ndarray  # (SLOTS,) suspects of each slot, one bit for each lane
    measures: np.ndarray  # (len(Measure) * WIDTH,) measures of the lanes of the pack
    points: np.ndarray  # (WIDTH,) indices of their parameter points
    steps: np.ndarray  # (WIDTH,) indices of their steps in `Steps`


def new_workspace(total: int) -> Workspace:
    """A workspace with this number of rows for each of `PACKS` packs.

    They start at a page of memory (4096 bytes). With addresses modulo 4096 of 0x600 to 0x9c0, like those of the
    most used part of the stack in worker threads, computations with d = 2 took 6 to 8 % longer. The likely cause is 4K
    aliasing: a load waits for an earlier store whose address has the same low 12 bits.
    """
    return Workspace(
        aligned(PACKS * total * WIDTH, to=PAGE), np.zeros((SLOTS + 1) * WIDTH, np.int64),
        np.zeros(SLOTS, np.int64), aligned(_MEASURES * WIDTH), np.zeros(WIDTH, np.int64), np.zeros(WIDTH, np.int64),
    )


def new_lanes(d: int, k: int, table_rows: int, buffers: int, slots: int, point_rows: int) -> Lanes:
    """Empty lanes for d coordinates, k tangent vectors, and ``slots`` slots with ``buffers`` matrix buffers each.

    ``table_rows`` is the length of the last axis of the step tables. ``point_rows`` is 0 if nothing is measured, else
    as in `Harmonics.point_rows`.
    """
    b = slots * WIDTH
    return Lanes._make([
        *np.zeros((5, b), np.int64), aligned(b), aligned(buffers, b),
        aligned(b * _MEASURES if point_rows else 0), aligned(b * point_rows),
        aligned(b * (2 * d + buffers * (d + table_rows))), aligned(slots, 2, k, d, WIDTH),
    ])


def new_slots(count: int) -> Slots:
    """``count`` empty slots, whose housekeeping, which loads their packs, is due at the first tick."""
    return Slots._make([*np.zeros((8, count), np.int64), np.array([count, 0, 0])])


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
