"""A statement of the paper as a claim: its record in `records.toml`, the registry of checks, and its verdict."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from gearchaos.model import MeshModel
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._read import evidence_of

HOLDS = "holds"
DIGITS = "holds within the printed digits"
MISPRINT = "misprint"
CONTRADICTED = "contradicted"
VERDICTS = (HOLDS, DIGITS, MISPRINT, CONTRADICTED)
"""Verdicts on a statement of the paper, not on a motion: the statement holds as printed; it holds if its numbers are
rounded or read off a diagram; it is a misprint; none of these."""


@dataclass(frozen=True)
class PeriodicMotion:
    """A periodic motion behind a statement, to be proved.

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


Check = Callable[..., CheckResult]
CHECKS: dict[str, Check] = {}
"""Checks by the name that `records.toml` calls them: functions of the cache and of what stands in ``with`` there."""


def check(function: Check) -> Check:
    """Decorator that registers a check under the function's name."""
    CHECKS[function.__name__] = function
    return function


def graded(exact: bool, rounded: bool = False) -> str:
    """The verdict of a comparison: `HOLDS` if ``exact``, else `DIGITS` if ``rounded``, else `CONTRADICTED`."""
    return HOLDS if exact else DIGITS if rounded else CONTRADICTED


@dataclass(frozen=True)
class Claim:
    """One statement of the paper with its verdict; its fields but ``motions`` are those of claims.json.

    Attributes
    ----------
    id, figure, where, statement, setting, criterion, expected
        From the record of the statement in `records.toml`.
    verdict, computed, evidence, instead, motions
        From the `CheckResult` of its check; ``evidence`` also has the verdicts on all motions computed for it.
    proofs : list of dict
        For each of ``motions`` its proof, or why it is not proved; see `gearchaos.paper.proofs`.
    """

    id: str
    figure: int
    where: str
    statement: str
    setting: str
    criterion: str
    computed: str
    verdict: str
    instead: str
    evidence: dict[str, Any]
    expected: str = ""
    motions: Sequence[PeriodicMotion] = ()
    proofs: list[dict[str, Any]] = field(default_factory=list)

    def to_dict(self) -> dict[str, Any]:
        """The fields by name, ready for JSON."""
        return {name: value for name, value in vars(self).items() if name != "motions"}


@cache
def records() -> dict[str, dict[str, Any]]:
    """Every record of `records.toml` by id, with line breaks of its texts joined."""
    text = files("gearchaos.paper.claims").joinpath("records.toml").read_text(encoding="utf-8")
    return {
        name: {key: " ".join(value.split()) if isinstance(value, str) else value for key, value in record.items()}
        for name, record in tomllib.loads(text).items()
    }


def claims_of(figures: Iterable[int]) -> list[str]:
    """Ids of the statements that belong to these figures."""
    wanted = set(figures)
    return [name for name, record in records().items() if record["figure"] in wanted]


def check_all(cache: ComputationCache, names: Iterable[str]) -> list[Claim]:
    """Check the statements with these ids."""
    out = []
    for name in names:
        record = dict(records()[name])
        check_of, data = CHECKS[record.pop("check")], record.pop("with", {})
        with cache.requested_keys() as keys:
            result = check_of(cache, **data)
        outcome = {**vars(result), "evidence": {**result.evidence, "verdicts": evidence_of(cache, keys)}}
        out.append(Claim(id=name, **record, **outcome))
    return out


def failed(claims: Iterable[Claim]) -> list[Claim]:
    """Claims that should hold but do not: those contradicted, and misprints that are not expected."""
    return [c for c in claims if c.verdict == CONTRADICTED or (c.verdict == MISPRINT and c.expected != MISPRINT)]
