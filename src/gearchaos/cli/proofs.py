"""The commands that prove a chaotic set and check certificates."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearchaos.cli.options import Json, Sets, StudyPath, app, load
from gearchaos.cli.output import check_output, print_json
from gearchaos.cli.proof_options import write_certificate
from gearchaos.errors import InputError

UNVERIFIED = {
    "gearchaos event certificate":
        "there is no verifier of events; those of the orbits at both ends can be checked: certificates() of the event",
    "gearchaos box certificate": "there is no verifier of boxes of parameters",
}
"""Why files of these formats are refused."""

REFUSED = 1
"""Exit code where a certificate does not prove what it claims."""


@app.command()
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
    tolerances = _tolerances(tolerance or [])
    loaded = load(study, sets)
    from gearchaos.studies.chaos_proof import prove_chaos as proof

    result = proof(loaded.model, tolerances=tolerances)
    write_certificate(result, certificate)
    if json_out:
        print_json(result.to_dict())
    else:
        print(result.in_words())


def _tolerances(texts: list[str]) -> dict[str, float]:
    """The values of ``--tolerance`` by name."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError("--tolerance", "must read NAME=VALUE", text, "E.g. --tolerance eps1=1e-6.")
    return out


@app.command()
def verify(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Certificates, JSON.", readable=False)],
) -> None:
    """Check certificates of periodic orbits and chaotic sets; exit code 0 if all are proved, 1 if any is refused."""
    from gearchaos.studies.proofs import check_installed

    check_installed()
    for file in files:
        if not file.is_file():
            raise InputError("FILE", "must be a file", str(file))
    results = [(file, _verified(file)) for file in files]
    for file, result in results:
        print(f"{file}: {'proved' if result.proved else 'refused'}")
        print("\n".join(f"  {line}" for line in result.lines))
    if not all(result.proved for _, result in results):
        raise typer.Exit(REFUSED)


def _verified(file: Path) -> Any:
    """The result of the check of a file: whether it is ``proved``, and ``lines`` of text."""
    from gearchaos.proof import chaos_file

    if chaos_file.is_chaotic_set(file):
        return chaos_file.verify_file(file)
    if chaos_file.format_of(file) in UNVERIFIED:
        return chaos_file.Result(False, [UNVERIFIED[chaos_file.format_of(file)]])
    from gearchaos.proof.verifier import verify_file

    return verify_file(file)
