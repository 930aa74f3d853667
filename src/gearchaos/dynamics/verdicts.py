"""What `labelling.py` and `transients.py` decide about motions: codes and texts of the kinds of motion and of the
reasons, and the table of many motions.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from operator import itemgetter
from typing import Annotated

import numpy as np

from gearchaos.dynamics.response import MESH, MOTION, Column, Columns, Deflections, MeshResponse, Response


class Label(IntEnum):
    """Kind of motion. 0 stands for a motion that is not classified yet.

    Examples
    --------
    >>> from gearchaos.dynamics import Label
    >>> Label(3).name
    'CHAOTIC'
    """

    PERIODIC = 1
    QUASI_PERIODIC = 2
    CHAOTIC = 3
    UNDECIDED = 4
    DIVERGED = 5


ON_ATTRACTOR = (Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC)
"""Labels of motions that are on an attractor."""


class Reason(IntEnum):
    """Reason for a verdict; `REASONS` has the texts.

    Names and texts are part of the files of results. ``BUDGET`` means that the runs of the lengths in
    `gearchaos.Classification` decided nothing.

    Examples
    --------
    >>> from gearchaos.dynamics import REASONS, Reason
    >>> REASONS[Reason.SMOOTH_CURVE]
    'the largest exponent is zero and weighted Birkhoff averages converge as on a smooth curve'
    """

    ORBIT = 1
    POSITIVE_EXPONENT = 2
    SMOOTH_CURVE = 3
    BUDGET = 4
    OUT_OF_RANGE = 5
    CHATTER = 6
    NEUTRAL = 7
    INCONSISTENT = 8
    INFERRED = 9
    LINEAR = 10


def motion_name(label: Label, period: int) -> str:
    """The name of a motion: "3T" for a period of three mesh periods, "quasi-periodic" for a kind without a period.

    Parameters
    ----------
    label : Label
        Kind of motion.
    period : int
        Period in mesh periods; read for a periodic motion alone.

    Returns
    -------
    str

    Examples
    --------
    >>> from gearchaos.dynamics import Label, motion_name
    >>> motion_name(Label.PERIODIC, 3), motion_name(Label.QUASI_PERIODIC, 0)
    ('3T', 'quasi-periodic')
    """
    return f"{period}T" if label == Label.PERIODIC else label.name.lower().replace("_", "-")


def label_and_period(name: str) -> tuple[Label, int]:
    """The inverse of `motion_name`; the period is 0 where there is none."""
    for label in Label:
        if label != Label.PERIODIC and motion_name(label, 0) == name:
            return label, 0
    return Label.PERIODIC, int(name.removesuffix("T"))


REASONS = {
    Reason.ORBIT: "a stable periodic orbit converged and the trajectory approaches it",
    Reason.POSITIVE_EXPONENT: "the largest Lyapunov exponent is positive by its 99 % confidence interval",
    Reason.SMOOTH_CURVE: "the largest exponent is zero and weighted Birkhoff averages converge as on a smooth curve",
    Reason.BUDGET: "no return within the budget, and the largest exponent is not clearly positive",
    Reason.OUT_OF_RANGE: "|z| or |z'| passed 1e8 half backlashes",
    Reason.NEUTRAL: "the motion repeats exactly, and its neighbours neither approach nor leave it",
    Reason.INCONSISTENT: "the exponents do not sum to the trace of the linear part, so the run is not to be trusted",
    Reason.INFERRED: "not computed: the same as at all corners of the block of a coarser lattice in which it lies",
    Reason.LINEAR: "no contact changes, so that the motion is linear, and its slowest modes are too slow for the runs",
    Reason.CHATTER: "more contact switches within one step than can be followed",
}
"""The text of each reason, as printed tables and files have it."""


COORDINATE = "coordinate"
"""Name of the dimension of the d coordinates of the dynamic state."""

_EXPONENT_DIMS = (COORDINATE, MOTION)
_LARGEST = itemgetter(0)  # of exponents (d, L), which are in falling order


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
    meshes : MeshResponse
        Those of the K meshes of a train.
    deflections : Deflections
        How far the teeth of the first mesh are deflected.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.dynamics import classify
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
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
        dims=_EXPONENT_DIMS, variable="lyapunov", reduce=_LARGEST)]
    exponent_low: Annotated[np.ndarray, Column(
        "lower end of the interval: the exponent itself for an orbit, the smaller of the averages over the two halves "
        "of the run for a torus, the end of the 99 % confidence interval for other motions",
        dims=_EXPONENT_DIMS, variable="lyapunov_lo", reduce=_LARGEST)]
    exponent_high: Annotated[np.ndarray, Column(
        "upper end of the interval", dims=_EXPONENT_DIMS, variable="lyapunov_hi", reduce=_LARGEST)]
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
    meshes: MeshResponse
    deflections: Deflections

    @classmethod
    def unresolved(cls, w: np.ndarray, meshes: int = 0) -> Verdicts:
        """The table of L unresolved motions that start from w (d, L), of a train with this number of meshes."""
        verdicts = cls.empty({COORDINATE: len(w), MOTION: w.shape[1], MESH: meshes})
        verdicts.w[:] = w
        return verdicts
