"""Proofs of periodic motions: the options of ``regime``, and the command that checks certificates."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import app
from gearchaos.cli.output import check_output
from gearchaos.errors import InputError

if TYPE_CHECKING:
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.studies import Verdict

REFUSED = 1
"""Exit code where a certificate does not prove what it claims."""


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
    from gearchaos.proof.certificate import Certificate
    from gearchaos.studies.proofs import prove

    result = prove(verdict)
    if path is not None and isinstance(result, Certificate):
        result.write(path)
        say(f"wrote {path}")
    elif path is not None:
        say(f"no certificate: {result.in_words()}")
    return result


@app.command()
def verify(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Certificates, JSON.", readable=False)],
) -> None:
    """Check certificates of periodic orbits; exit code 0 if all are proved, 1 if any is refused."""
    from gearchaos.studies.proofs import check_installed

    check_installed()
    for file in files:
        if not file.is_file():
            raise InputError("FILE", "must be a file", str(file))
    from gearchaos.proof.verifier import verify_file

    results = [(file, verify_file(file)) for file in files]
    for file, result in results:
        print(f"{file}: {'proved' if result.proved else 'refused'}")
        print("\n".join(f"  {line}" for line in result.lines))
    if not all(result.proved for _, result in results):
        raise typer.Exit(REFUSED)
