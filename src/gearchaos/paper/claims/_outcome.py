"""The result of the check of a statement, and the registry of checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gearchaos.model import MeshModel

if TYPE_CHECKING:
    from gearchaos.paper.cache import ComputationCache

HOLDS = "holds"
DIGITS = "holds within the printed digits"
MISPRINT = "misprint"
CONTRADICTED = "contradicted"
VERDICTS = (HOLDS, DIGITS, MISPRINT, CONTRADICTED)
"""Verdicts on a statement of the paper, not to be confused with the verdict on a motion, its kind: the statement holds
as printed; it holds if its numbers are rounded or read off a diagram; it is a misprint; none of these."""


@dataclass(frozen=True)
class PeriodicMotion:
    """A periodic motion that a statement is about, to be proved.

    Attributes
    ----------
    period : minimal period that was found, in mesh periods.
    model : the model, with the initial state that leads to the motion.
    at : parameters by name that tell the motions of a statement apart.
    """

    period: int
    model: MeshModel
    at: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CheckResult:
    """The result of one check.

    Attributes
    ----------
    verdict : one of `VERDICTS`.
    computed : what was computed, as a sentence.
    evidence : the numbers computed in this run, ready for JSON.
    instead : what holds instead, if the statement does not hold exactly as printed.
    motions : the periodic motions that the statement, or what holds instead, is about.
    """

    verdict: str
    computed: str
    evidence: dict[str, Any] = field(default_factory=dict)
    instead: str = ""
    motions: Sequence[PeriodicMotion] = ()


Check = Callable[["ComputationCache"], CheckResult]
CHECKS: dict[str, Check] = {}
"""Checks by the id of the statement in `records.toml`."""


def check(*names: str) -> Callable[[Callable[..., CheckResult]], Callable[..., CheckResult]]:
    """Decorator that registers the check of a statement; with several ids, the id is its second argument."""

    def register(function: Callable[..., CheckResult]) -> Callable[..., CheckResult]:
        for name in names:
            CHECKS[name] = function if len(names) == 1 else _with_id(function, name)
        return function

    return register


def _with_id(function: Callable[..., CheckResult], name: str) -> Check:
    """A check with the id of the statement as its second argument."""
    return lambda cache: function(cache, name)


def graded(exact: bool, rounded: bool = False) -> str:
    """The verdict of a comparison: `HOLDS` if ``exact``, else `DIGITS` if ``rounded``, else `CONTRADICTED`."""
    return HOLDS if exact else DIGITS if rounded else CONTRADICTED
