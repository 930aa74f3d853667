"""What a judge returns, and the register of judges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gearchaos.paper.cache import ComputationCache

HOLDS = "holds"
DIGITS = "holds within the printed digits"
MISPRINT = "misprint"
CONTRADICTED = "contradicted"
VERDICTS = (HOLDS, DIGITS, MISPRINT, CONTRADICTED)
"""As printed; with numbers read as rounded or read off a diagram; printed wrongly, with what does hold; neither."""


@dataclass(frozen=True)
class Outcome:
    """The verdict of one judge.

    Attributes
    ----------
    verdict : one of `VERDICTS`.
    computed : what was computed, in words.
    evidence : the numbers computed in this run, ready for JSON.
    instead : what does hold, where the printed numbers do not exactly.
    """

    verdict: str
    computed: str
    evidence: dict[str, Any] = field(default_factory=dict)
    instead: str = ""


Judge = Callable[["ComputationCache"], Outcome]
JUDGES: dict[str, Judge] = {}
"""Judges by the id of the statement in `records.toml`."""


def judge(*names: str) -> Callable[[Callable[..., Outcome]], Callable[..., Outcome]]:
    """Register a judge; with several ids it is called with the id as a second argument."""

    def register(function: Callable[..., Outcome]) -> Callable[..., Outcome]:
        for name in names:
            JUDGES[name] = function if len(names) == 1 else _for(function, name)
        return function

    return register


def _for(function: Callable[..., Outcome], name: str) -> Judge:
    return lambda cache: function(cache, name)


def graded(exact: bool, rounded: bool = False) -> str:
    """The verdict of a plain comparison: as printed, within the printed digits, or neither."""
    return HOLDS if exact else DIGITS if rounded else CONTRADICTED
