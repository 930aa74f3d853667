"""The statements of the paper, checked: `check_all` computes, compares and returns one `Claim` for each statement.

Their periodic motions are then proved, with certificates in files.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.errors import InputError
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims import _maps, _motions
from gearchaos.paper.claims._claim import CONTRADICTED, MISPRINT, PeriodicMotion, number
from gearchaos.proof.certificate import Unproved
from gearchaos.studies import Verdict, motions
from gearchaos.studies.motion.regime import regime
from gearchaos.studies.proofs.proofs import check_installed, prove, write_verifier

CHECKS = {check.__name__: check for check in (*_maps.CHECKS, *_motions.CHECKS)}
"""Checks as `records.toml` calls them: functions of the cache and of what stands in ``with`` there to a CheckResult."""

FOLDER = "certificates"
"""Folder of the certificates, beside the page."""

MISSING = "python-flint is not installed"
"""The reason of every motion where proofs cannot be made."""


@dataclass(frozen=True)
class Claim:
    """One statement of the paper with its verdict: its record in `records.toml`, and the `CheckResult` of its check.

    Its fields but ``motions`` are those of claims.json. ``evidence`` also has the verdicts on all motions computed for
    it; ``proofs`` for each of ``motions`` its proof, or why it is not proved, see `prove_claims`.
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
        found = {key: _verdicts_in(cache.known(key)) for key in dict.fromkeys(keys)}
        evidence = {**result.evidence, "verdicts": {key: value for key, value in found.items() if value}}
        out.append(Claim(id=name, **record, **{**vars(result), "evidence": evidence}))
    return out


def failed(claims: Iterable[Claim]) -> list[Claim]:
    """Claims that should hold but do not: those contradicted, and misprints that are not expected."""
    return [c for c in claims if c.verdict == CONTRADICTED or (c.verdict == MISPRINT and c.expected != MISPRINT)]


def _verdicts_in(result: Any) -> dict[str, Any]:
    """Multipliers and exponents of all motions in a result as evidence, empty if it has no verdicts."""
    if isinstance(result, Verdict):
        out: dict[str, Any] = {"label": result.label}
        if result.multipliers:
            out["largest_multiplier"] = number(max(map(abs, result.multipliers)))
        if result.lyapunov:
            out["largest_exponent"] = number(result.lyapunov[0])
            out["interval"] = [number(end) for end in result.lyapunov_ci[0]]
        return out
    if isinstance(result, xr.Dataset) and "lyapunov_lo" in result:
        # of a map or scan for each kind of motion the largest multiplier, or the union of the confidence intervals
        label, kinds = result["label"].values, {}
        for kind in (kind for kind in Label if (label == kind).any()):
            cells = label == kind
            found: dict[str, Any] = {"cells": int(cells.sum())}
            if kind == Label.PERIODIC:
                found["largest_multiplier"] = number(np.nanmax(result["multiplier"].values[cells]))
            elif kind != Label.DIVERGED:
                ends = np.nanmin(result["lyapunov_lo"].values[cells]), np.nanmax(result["lyapunov_hi"].values[cells])
                found["exponents_between"] = [number(end) for end in ends]
            kinds[kind.name.lower()] = found
        return kinds
    if not isinstance(result, xr.Dataset) or "attractor_multiplier" not in result:
        return {}
    names = motions(result["attractor_label"], result["attractor_period"])
    facts = zip(names, result["attractor_multiplier"].values, result["attractor_lyapunov"].values, strict=True)
    return {
        f"{i}: {name}": {"largest_multiplier": number(multiplier), "largest_exponent": number(exponent)}
        for i, (name, multiplier, exponent) in enumerate(facts, start=1)
    }


def prove_claims(claims: Iterable[Claim], folder: Path) -> list[Claim]:
    """Prove the periodic motions of claims; write the certificates, and the script that verifies them.

    Each of ``proofs`` of a claim, in the order of ``motions``, has ``period``, ``at`` (values by name) and ``proved``.
    If proved, it also has ``file``, the path of the certificate relative to the folder, and the other values of
    `gearchaos.proof.certificate.Certificate.to_dict`; if not, ``reason``.
    """
    out = [replace(claim, proofs=[_proof(motion, claim.id, folder) for motion in claim.motions]) for claim in claims]
    if any(proof["proved"] for claim in out for proof in claim.proofs):
        write_verifier(folder / FOLDER / "verifier.py")
    return out


def _proof(motion: PeriodicMotion, claim_id: str, folder: Path) -> dict[str, Any]:
    """The proof of one motion; its certificate is written to a file."""
    stated = {"period": motion.period, "at": dict(motion.at)}
    try:
        check_installed()
    except InputError:
        return {**stated, "proved": False, "reason": MISSING}
    verdict = regime(motion.model)
    if verdict.period != motion.period:
        return {**stated, "proved": False, "reason": f"computed again, the motion is {verdict.label}"}
    result = prove(verdict)
    if isinstance(result, Unproved):
        margin = result.margin if math.isfinite(result.margin) else None
        return {**stated, **result.to_dict(), "margin": margin}
    name = "-".join([claim_id, f"{motion.period}T", *(f"{key}-{value:.8g}" for key, value in motion.at.items())])
    (folder / FOLDER).mkdir(exist_ok=True)
    result.write(folder / FOLDER / f"{name}.json")
    return {**stated, **result.to_dict(), "file": f"{FOLDER}/{name}.json"}
