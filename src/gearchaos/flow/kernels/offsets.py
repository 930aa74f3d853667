"""Where each quantity begins in the two packed arrays of the kernels: the parameter array and the workspace.

Both are described by lists of (name, size). Offsets are the running sums of the sizes, so a new quantity needs one line
here. Offsets that depend on the number of coordinates d alone are constants for the compiler; those that depend on the
numbers of harmonics H and K and of stiffness levels N are passed to the kernels in `Harmonics`.
"""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from itertools import accumulate
from typing import Any, NamedTuple

from numba import config, types
from numba.extending import intrinsic

from gearchaos.flow.kernels.constants import ORDER

_TERMS = ORDER + 1
"""Coefficients of a Taylor polynomial."""


def _parameters(d: int, h: int, k: int, n: int) -> dict[str, int]:
    """Columns of the parameter array (P, total): the flattened arrays of the system, and those of `rates.bounds`."""
    return {
        "A": d * d, "b": d, "f0": d, "levels": n, "omega": 1, "bound0": 2, "bound": d, "damping": 1, "velocity": d,
        "velocity0": 1, "f_cos": h, "f_sin": h, "chi_cos": k, "chi_sin": k, "velocity_cos": h, "velocity_sin": h,
    }


def _fixed_rows(d: int) -> dict[str, int]:
    """Rows of the workspace whose number depends on d alone; a polynomial has `ORDER` + 1 coefficients."""
    return {
        "A": d * d,
        "minus_b": d,
        "f0": d,
        "omega": 1,  # mesh frequency
        "state": _TERMS * d,  # polynomials of the coordinates: coefficient k of coordinate i in row k * d + i
        "forcing": _TERMS,  # polynomial of the harmonic forcing of z''
        "stiffness": _TERMS,  # polynomial of the stiffness; zero in free flight
        "velocity": _TERMS,  # polynomial of x1', for the measures
        "force": _TERMS,  # polynomial of the mesh force, for the measures
        "start": d,  # state or tangent vector at the start of the segment
        "end": d,  # and at its end
        "stiffness_column": d,  # factor of z - σ: first column of A, less b times the stiffness at the start
        "constant": d,  # constant forcing, with A[:, 0] σ
        "duration": 1,  # of the segment, in units of τ
        "level": 1,  # stiffness on the step, without its harmonics
        "sigma": 1,  # contact state
        "next_sigma": 1,  # contact state after the segment
        "end_fraction": 1,  # fraction of the segment at the contact switch, or 1
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
        "stretch": 1,  # derivative of the logarithm of the mesh period
        "forcing": _TERMS,  # polynomial of the derivative of the harmonic forcing
        "stiffness": _TERMS,  # polynomial of the derivative of the stiffness; zero in free flight
        "vectors": (1 + d + q) * d,  # the state, d tangent vectors, and its derivatives by the q parameters
    }


def _offsets(sizes: dict[str, int], first: int = 0) -> list[int]:
    """Offset of each of these quantities, and the end of the last one."""
    return list(accumulate(sizes.values(), initial=first))


def _record(name: str, sizes: dict[str, int]) -> Any:
    """A named tuple of offsets, with one field for each quantity and ``total`` for the end of the last one."""
    return namedtuple(name, [*sizes, "total"])


ParameterColumns = _record("ParameterColumns", _parameters(1, 1, 1, 1))
Rows = _record("Rows", _fixed_rows(1))
HarmonicRows = _record("HarmonicRows", _harmonic_rows(1, 1, 1))
SensitivityRows = _record("SensitivityRows", _sensitivity_rows(1, 1, 1, 1))


class Harmonics(NamedTuple):
    """How many harmonics a system has, and the offsets that depend on it and on the number of stiffness levels."""

    forcing: int  # H
    stiffness: int  # K
    highest: int  # the larger of both: highest harmonic whose cosine and sine are needed
    columns: Any  # `ParameterColumns` of the parameter array, see `_parameters`
    rows: Any  # `HarmonicRows` of the workspace, see `_harmonic_rows`
    point_rows: int  # rows that depend on a point alone: those before ``state``, and from ``forcing_amplitudes`` on


def harmonics(d: int, h: int, k: int, n: int) -> Harmonics:
    """The offsets for d coordinates, h harmonics of the forcing, and k harmonics and n levels of the stiffness."""
    fixed = row_offsets(d)
    rows = HarmonicRows(*_offsets(_harmonic_rows(d, h, k), fixed.total))
    point_rows = fixed.state + rows.total - rows.forcing_amplitudes
    return Harmonics(h, k, max(h, k), ParameterColumns(*_offsets(_parameters(d, h, k, n))), rows, point_rows)


def sensitivity_rows(d: int, harmonics: Harmonics, q: int) -> Any:
    """`SensitivityRows` of the workspace for d coordinates and derivatives by q parameters."""
    sizes = _sensitivity_rows(d, harmonics.forcing, harmonics.stiffness, q)
    return SensitivityRows(*_offsets(sizes, harmonics.rows.total))


@cache
def row_offsets(d: int) -> Any:
    """`Rows` of the workspace for d coordinates."""
    return Rows(*_offsets(_fixed_rows(d)))


@intrinsic
def _constant_rows(typingctx, dims):
    kind, value = types.NamedUniTuple(types.intp, len(Rows._fields), Rows), row_offsets(len(dims))

    def codegen(context, builder, signature, args):
        return context.get_constant_generic(builder, kind, value)

    return kind(dims), codegen


def _plain_rows(dims) -> Any:
    return row_offsets(len(dims))


rows: Any = _plain_rows if config.DISABLE_JIT else _constant_rows
"""``rows(dims)``: `row_offsets` for kernels, as compile-time constants."""
