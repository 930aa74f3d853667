"""The commands that prove a chaotic set and check certificates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, Sets, StudyPath, app, initial_values, load
from gearchaos.cli.output import check_output, print_json
from gearchaos.cli.proof_options import write_certificate
from gearchaos.errors import InputError

REFUSED = 1
"""Exit code where a certificate does not prove what it claims."""


@app.command(rich_help_panel="Proof")
def prove_chaos(
    study: StudyPath = None,
    sets: Sets = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Prove it for all amplitudes, e.g. eps1, within VALUE."),
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write what is proved, JSON.", readable=False)
    ] = None,
    json_out: Json = False,
) -> None:
    """Prove that there is a chaotic set at one operating point; it need not attract."""
    check_output("--certificate", certificate, (".json",))
    tolerances = initial_values(tolerance or [], "--tolerance")
    loaded = load(study, sets)
    from gearchaos.studies.chaos_proof import prove_chaos as proof

    result = proof(loaded.model, tolerances=tolerances)
    write_certificate(result, certificate)
    if json_out:
        print_json(result.to_dict())
    else:
        print(result.in_words())


@app.command(rich_help_panel="Proof")
def verify(
    files: Annotated[
        list[Path] | None, typer.Argument(metavar="FILE...", help="Certificates, JSON.", readable=False)
    ] = None,
    script: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the verifier: one file, needs python-flint alone.", readable=False),
    ] = None,
) -> None:
    """Check certificates of periodic orbits and chaotic sets; exit code 0 if all are proved, 1 if any is refused."""
    from gearchaos.studies.proofs import check_installed, write_verifier

    check_output("--script", script, (".py",))
    if not files and script is None:
        raise InputError("FILE", "must be given", None, "Name certificates, or write the verifier by --script FILE.")
    if files:
        check_installed()
    for file in files or []:
        if not file.is_file():
            raise InputError("FILE", "must be a file", str(file))
    if script is not None:
        write_verifier(script)
        say(f"wrote {script}")
    if not files:
        return
    from gearchaos.proof.verifier import verify_file

    results = []
    for file in files:
        results.append(result := verify_file(file))
        print(f"{file}: {'proved' if result.proved else 'refused'}", *result.lines, sep="\n  ", flush=True)
    if not all(result.proved for result in results):
        raise typer.Exit(REFUSED)
