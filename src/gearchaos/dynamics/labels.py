"""Codes and texts of a verdict: the kind of motion, and the reason for the verdict."""

from __future__ import annotations

from enum import IntEnum


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
    Reason.CHATTER: "more contact switches within one step than can be followed",
}
"""The text of each reason, as printed tables and files have it."""
