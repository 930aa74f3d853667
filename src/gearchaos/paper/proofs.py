"""Proofs of the periodic motions that statements are about, as certificates in files and as lines of the page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

from gearchaos.errors import InputError
from gearchaos.paper.claims import CONTRADICTED, MISPRINT, Claim, PeriodicMotion
from gearchaos.paper.settings import symbol
from gearchaos.proof.certificate import Unproved
from gearchaos.studies.proofs import check_installed, prove, write_verifier
from gearchaos.studies.regime import regime

FOLDER = "certificates"
"""Folder of the certificates, beside the page."""

MISSING = "python-flint is not installed"
"""The reason of every motion where proofs cannot be made."""

_ONE_BY_ONE = 3
"""Up to this number the motions of a statement are listed one by one; more are values of a scan, and share a line."""


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


def summary(claims: Sequence[Claim]) -> str:
    """How many periodic motions are proved, in a sentence; empty if there are none."""
    proofs = [proof for claim in claims for proof in claim.proofs]
    if not proofs:
        return ""
    if any(proof.get("reason") == MISSING for proof in proofs):
        return f'Periodic motions were not proved, since {MISSING} (pip install "gearchaos[proof]").'
    count = sum(proof["proved"] for proof in proofs)
    return f"Proved in ball arithmetic: {count} of {len(proofs)} periodic motions behind the statements."


def mark(claim: Claim) -> str:
    """What is marked beside the verdict on a claim: "theorem", or at how many values of a scan a period is proved.

    Empty if the claim does not hold as printed or within its digits, or if one of its motions is not proved.
    """
    count = len(claim.proofs)
    if not count or not all(proof["proved"] for proof in claim.proofs):
        return ""
    if count > _ONE_BY_ONE:
        periods = sorted({proof["period"] for proof in claim.proofs})
        return f"{', '.join(f'{n}T' for n in periods)} proved at {count} values"
    return "" if claim.verdict in (CONTRADICTED, MISPRINT) else "theorem"


def lines(claim: Claim) -> list[dict[str, str]]:
    """What is proved of a claim with the files, and what is not and why: ``text`` and ``file``, empty if there is none.

    One line for each motion, or for the values of a scan.
    """
    proofs = [proof for proof in claim.proofs if proof.get("reason") != MISSING]
    if len(proofs) <= _ONE_BY_ONE:
        return [_line([proof]) for proof in proofs]

    def shared(proof: dict[str, Any]) -> tuple[int, str]:  # by the values of a scan on one line
        return proof["period"], proof.get("reason", "")

    return [_line(list(same)) for _, same in groupby(sorted(proofs, key=shared), key=shared)]


def _line(proofs: list[dict[str, Any]]) -> dict[str, str]:
    """The line of one motion, or of several that differ in the value of one parameter."""
    first, where = proofs[0], ""
    for name in first["at"]:
        values = [proof["at"][name] for proof in proofs]
        where = f" at {symbol(name)} = {values[0]:.8g}" if len(values) == 1 else (
            f" at {len(values)} of the values of {symbol(name)} computed, from {min(values):.8g} to {max(values):.8g}")
    text = f"{first['period']}T{where}"
    if not first["proved"]:
        return {"text": f"{text}: not proved, {first['reason']}", "file": ""}
    radius, bits = max(proof["radius"] for proof in proofs), max(proof["bits"] for proof in proofs)
    file = first["file"]
    if len(proofs) > 1:
        (name,) = first["at"]
        file = f"{file[: file.index(name)]}{name}-*.json"
    return {"text": f"{text}: radius {radius:g}, {bits} bits,", "file": file}
