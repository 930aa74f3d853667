"""Checks of the statements: from the records in `records.toml` and the functions in `CHECKS` to claims."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims import _attractors, _maps, _motions, _windows  # noqa: F401 - they register their checks
from gearchaos.paper.claims._evidence import evidence_of
from gearchaos.paper.claims._outcome import CHECKS, CONTRADICTED, MISPRINT, PeriodicMotion


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
    return [_checked(cache, name) for name in names]


def _checked(cache: ComputationCache, name: str) -> Claim:
    with cache.requested_keys() as keys:
        result = CHECKS[name](cache)
    outcome = {**vars(result), "evidence": {**result.evidence, "verdicts": evidence_of(cache, keys)}}
    return Claim(id=name, **records()[name], **outcome)


def failed(claims: Iterable[Claim]) -> list[Claim]:
    """Claims that should hold but do not: those contradicted, and misprints that are not expected."""
    return [
        c for c in claims
        if c.verdict == CONTRADICTED or (c.verdict == MISPRINT and c.expected != MISPRINT)
    ]
