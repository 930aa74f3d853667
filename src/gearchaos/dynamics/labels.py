"""The kinds of motion and why a verdict stands."""

from __future__ import annotations

from enum import IntEnum


class Label(IntEnum):
    """Kinds of motion."""

    PERIODIC = 1
    QUASI_PERIODIC = 2
    CHAOTIC = 3
    UNDECIDED = 4
    DIVERGED = 5


class Reason(IntEnum):
    """Why a verdict stands."""

    ORBIT = 1
    POSITIVE_EXPONENT = 2
    SMOOTH_CURVE = 3
    BUDGET = 4
    OUT_OF_RANGE = 5
    CHATTER = 6
    NEUTRAL = 7
    INCONSISTENT = 8
    INFERRED = 9


def motion_name(label: Label, period: int) -> str:
    """A label as text: the period of a periodic motion, "3T", else the kind, "quasi-periodic"."""
    return f"{period}T" if label == Label.PERIODIC else label.name.lower().replace("_", "-")


REASONS = {
    Reason.ORBIT: "a stable periodic orbit converged and the trajectory approaches it",
    Reason.POSITIVE_EXPONENT: "the largest Lyapunov exponent is positive by its 99 % confidence interval",
    Reason.SMOOTH_CURVE: "the largest exponent is zero and weighted Birkhoff averages converge as on a smooth curve",
    Reason.BUDGET: "no return within the settings, and the largest exponent is not clearly positive",
    Reason.OUT_OF_RANGE: "|z| or |z'| passed 1e8 half backlashes",
    Reason.NEUTRAL: "the motion repeats exactly, and its neighbours neither approach nor leave it",
    Reason.INCONSISTENT: "the exponents do not sum to the trace of the linear part, so the run is not to be trusted",
    Reason.INFERRED: "not computed: the same as at all corners of the block of a coarser lattice in which it lies",
    Reason.CHATTER: "more contact switches within one step than can be followed",
}
