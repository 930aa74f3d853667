"""The options of commands that prove what they find."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gearchaos.cli.errors import say
from gearchaos.cli.output import check_output
from gearchaos.errors import InputError

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.proof.families.chaos import ChaoticSet
    from gearchaos.studies import Verdict


def check_proof(prove: bool, certificate: Path | None) -> None:
    """Raise `InputError` unless a proof can be made and its certificate be written; before any work."""
    if certificate is not None and not prove:
        raise InputError("--certificate", "needs --prove", str(certificate))
    check_output("--certificate", certificate, (".json",))
    if prove:
        from gearchaos.studies.proofs import check_installed

        check_installed()


def proof_of(verdict: Verdict, path: Path | None) -> Certificate | Unproved:
    """The proof of a periodic verdict; the certificate is written to a path, if there are both."""
    from gearchaos.studies.proofs import prove

    result = prove(verdict)
    write_certificate(result, path)
    return result


def write_certificate(result: Certificate | ChaoticSet | Unproved, path: Path | None) -> None:
    """Write a certificate to a path, if there are both, and say so."""
    from gearchaos.proof.certificate import Unproved

    if path is None:
        return
    if isinstance(result, Unproved):
        say(f"no certificate: {result.in_words()}")
    else:
        result.write(path)
        say(f"wrote {path}")
