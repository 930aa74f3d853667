"""What a check of a statement returns: a verdict, what was computed, and the periodic motions that are to be proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.model import MeshModel

HOLDS, DIGITS, MISPRINT, CONTRADICTED = "holds", "holds within the printed digits", "misprint", "contradicted"
VERDICTS = (HOLDS, DIGITS, MISPRINT, CONTRADICTED)
"""Verdicts on a statement of the paper, not on a motion: the statement holds as printed; it holds if its numbers are
rounded or read off a diagram; it is a misprint; none of these."""


@dataclass(frozen=True)
class PeriodicMotion:
    """A periodic motion behind a statement, to be proved."""

    period: int  # minimal, in mesh periods, as it was found
    model: MeshModel  # with the initial state that leads to the motion
    at: Mapping[str, float] = field(default_factory=dict)  # parameters that tell the motions of a statement apart


@dataclass(frozen=True)
class CheckResult:
    """The result of one check: a verdict, a sentence, and numbers of this run, ready for JSON."""

    verdict: str
    computed: str
    evidence: dict[str, Any] = field(default_factory=dict)
    instead: str = ""  # what holds instead, if the statement does not hold exactly as printed
    motions: Sequence[PeriodicMotion] = ()  # that the statement, or what holds instead, is about


def graded(exact: Any, rounded: Any = False, misprint: Any = False) -> str:
    """The verdict of a comparison: that of the first argument that is true, `CONTRADICTED` if none is."""
    return HOLDS if exact else DIGITS if rounded else MISPRINT if misprint else CONTRADICTED


def is_kind(ds: xr.Dataset, kind: str) -> np.ndarray:
    """Whether each cell is "chaotic", "periodic" or "quasi_periodic"; an array of bool with the shape of ``label``."""
    return ds["label"].values == Label[kind.upper()]


LOCKED_FROM = 9
"""A periodic motion in a range of quasi-periodic ones counts as locked on the torus from this period on."""


def on_torus(ds: xr.Dataset, locked_from: int = LOCKED_FROM) -> np.ndarray:
    """Whether each cell is quasi-periodic, or periodic with at least this period."""
    return is_kind(ds, "quasi_periodic") | (is_kind(ds, "periodic") & (ds["period"].values >= locked_from))


def number(value: float | None) -> float | None:
    """A value ready for JSON: rounded to six digits, None if it is not finite."""
    return None if value is None or not np.isfinite(value) else round(float(value), 6)
