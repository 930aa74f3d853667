"""The verdicts on many motions, as a table of columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from gearchaos.dynamics.columns import MOTION, Column, Columns
from gearchaos.dynamics.response import Response

COORDINATE = "coordinate"
"""Name of the dimension of the d coordinates of the dynamic state."""

_EXPONENT_DIMS = (COORDINATE, MOTION)


def _largest(exponents: np.ndarray) -> np.ndarray:
    """The largest exponent (L,) of exponents (d, L)."""
    return exponents[0]


def _largest_modulus(multipliers: np.ndarray) -> np.ndarray:
    """The largest modulus (L,) of multipliers (L, d)."""
    return np.abs(multipliers).max(axis=1)


@dataclass
class Verdicts(Columns):
    """Verdicts on L motions of a system with d coordinates.

    Arrays are (L,) unless the declaration names other dimensions: "motion" is L, "coordinate" is d. The names and types
    of the variables in results are part of the file format. Variables that need no more are stored in single precision,
    so that a map of ten million cells fits into the memory of a laptop.

    Attributes
    ----------
    label : (L,) of int
        Kind of motion, a `Label`; 0 while unresolved.
    period : (L,) of int
        Minimal period in mesh periods; 0 where there is none.
    reason : (L,) of int
        `Reason` for the label; 0 while unresolved.
    exponent, exponent_low, exponent_high : (d, L)
        Lyapunov exponents per unit of τ, largest first, and the ends of their intervals; NaN where not computed.
    trace_error : (L,)
        Difference of the sum of all exponents and the trace of the linear part, per unit of τ.
    residual : (L,)
        Largest change of a coordinate over one period of the orbit; NaN without an orbit.
    multipliers : (L, d) of complex
        Floquet multipliers of the orbit, largest modulus first; NaN without an orbit.
    rotation : (L,)
        Dominant frequency of the stroboscopic points of a torus, in cycles per mesh period; NaN for other motions.
    transient_chaos : (L,) of bool
        Whether the largest exponent of a run was positive before the motion settled.
    periods_run : (L,) of int
        Mesh periods of the transient and exponent runs.
    w : (d, L)
        A point of the orbit, or the last state of another motion, at phase 0.
    response : Response
        The response measures.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.dynamics import classify
    >>> from gearchaos.studies.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> verdicts = classify(problem.flow, problem.w)
    >>> verdicts.label.tolist(), verdicts.period.tolist(), verdicts.multipliers.shape
    ([1], [2], (1, 2))
    """

    label: Annotated[np.ndarray, Column(
        "kind of motion, a `Label`; 0 while unresolved", np.int8, missing=0, variable="label")]
    period: Annotated[np.ndarray, Column(
        "minimal period in mesh periods; 0 where there is none", np.int32, missing=0, variable="period")]
    reason: Annotated[np.ndarray, Column(
        "`Reason` for the label; 0 while unresolved", np.int8, missing=0, variable="reason")]
    exponent: Annotated[np.ndarray, Column(
        "Lyapunov exponents per unit of τ, largest first: exact for an orbit, weighted Birkhoff averages for a torus, "
        "means over a run for other motions. If only the largest was computed, the others are NaN.",
        dims=_EXPONENT_DIMS, variable="lyapunov", reduce=_largest)]
    exponent_low: Annotated[np.ndarray, Column(
        "lower end of the interval: the exponent itself for an orbit, the smaller of the averages over the two halves "
        "of the run for a torus, the end of the 99 % confidence interval for other motions",
        dims=_EXPONENT_DIMS, variable="lyapunov_lo", reduce=_largest)]
    exponent_high: Annotated[np.ndarray, Column(
        "upper end of the interval", dims=_EXPONENT_DIMS, variable="lyapunov_hi", reduce=_largest)]
    trace_error: Annotated[np.ndarray, Column(
        "|sum of all exponents − trace of the linear part|, per unit of τ", variable="trace_error", stored=np.float32)]
    residual: Annotated[np.ndarray, Column(
        "largest change of a coordinate over one period of the orbit; NaN without an orbit",
        variable="residual", stored=np.float32)]
    multipliers: Annotated[np.ndarray, Column(
        "Floquet multipliers of the orbit, largest modulus first; NaN without an orbit", complex,
        dims=(MOTION, COORDINATE), variable="multiplier", stored=float, reduce=_largest_modulus)]
    rotation: Annotated[np.ndarray, Column(
        "dominant frequency of the stroboscopic points of a torus, in cycles per mesh period; NaN for other motions",
        variable="rotation", stored=np.float32)]
    transient_chaos: Annotated[np.ndarray, Column(
        "whether the largest exponent of a run was positive before the motion settled", bool, missing=False,
        variable="transient_chaos", stored=np.int8)]
    periods_run: Annotated[np.ndarray, Column(
        "mesh periods of the transient and exponent runs", np.int64, missing=0, variable="periods_spent",
        stored=np.int32)]
    w: Annotated[np.ndarray, Column(
        "a point of the orbit, or the last state of another motion, at phase 0", dims=(COORDINATE, MOTION))]
    response: Response

    @classmethod
    def unresolved(cls, w: np.ndarray) -> Verdicts:
        """The table of L unresolved motions that start from w (d, L)."""
        verdicts = cls.empty(dict(zip((COORDINATE, MOTION), w.shape, strict=True)))
        verdicts.w[:] = w
        return verdicts
