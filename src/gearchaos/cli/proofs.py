"""The commands that prove and check: chaotic sets, certificates, scripts for other tools, the 2008 paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli import completion
from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, Sets, StudyPath, app, initial_values, load, read_study
from gearchaos.cli.output import check_output, print_json, say_written, write_certificate
from gearchaos.errors import InputError, unknown_name
from gearchaos.files import write_bytes

REFUSED = 1
"""Exit code where a certificate does not prove what it claims."""

TOOLS = {"scipy": ("scipy", ".py"), "julia": ("dynamicalsystems.jl", ".jl"), "opentorsion": ("opentorsion", ".py"),
         "ross": ("ross", ".py")}
"""The tools of `gearchaos.script` by the names of ``--for``, and the suffixes of their scripts."""


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
    from gearchaos.studies.proofs.chaos_proof import prove_chaos as proof

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
    from gearchaos.studies.proofs.proofs import check_installed, write_verifier

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
        say_written(script)
    if not files:
        return
    from gearchaos.proof.verifier import verify_file

    results = []
    for file in files:
        results.append(result := verify_file(file))
        print(f"{file}: {'proved' if result.proved else 'refused'}", *result.lines, sep="\n  ", flush=True)
    if not all(result.proved for result in results):
        raise typer.Exit(REFUSED)


@app.command(rich_help_panel="Proof")
def script(
    study: StudyPath = None,
    sets: Sets = None,
    tool: Annotated[
        str, typer.Option("--for", metavar="|".join(TOOLS), help="Tool that runs the script.",
                          autocompletion=completion.choices(*TOOLS))
    ] = "scipy",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Script to write; otherwise on stdout.", readable=False)
    ] = None,
) -> None:
    """Write the model as a stand-alone script for another tool, to check a result there or to go on."""
    if tool not in TOOLS:
        raise unknown_name("--for", tool, TOOLS)
    check_output("--out", out, (TOOLS[tool][1],))
    from gearchaos.interchange.scripts import script as text_of

    text = text_of(read_study(study, sets).model, TOOLS[tool][0])
    if out is None:
        print(text, end="")
    else:
        write_bytes(out, text.encode())
        say_written(out)


@app.command(rich_help_panel="Proof")
def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.", readable=False)],
    figures: Annotated[str | None, typer.Option(metavar="2,6,9", help="Only these figures.")] = None,
    quality: Annotated[str, typer.Option(
        metavar="draft|paper", help="Number of cells and columns.", autocompletion=completion.choices("draft", "paper"),
    )] = "paper",
) -> None:
    """Reproduce the 2008 paper: a report with every figure, and every claim compared with computed values."""
    try:
        numbers = None if figures is None else [int(part) for part in figures.split(",")]
    except ValueError:
        rule = "must be numbers with commas between"
        raise InputError("--figures", rule, figures, "E.g. --figures 2,6,9.") from None
    from gearchaos.flow import cache_is_empty
    from gearchaos.model import DEFAULT_LAW
    from gearchaos.paper.report import build
    from gearchaos.paper.settings import chosen_figures
    from gearchaos.studies.core.warmup import warmup as compile_kernels

    chosen_figures(numbers)  # checked before anything is compiled
    if cache_is_empty():
        say("compiling the kernels, once after an install or an update")
        list(compile_kernels((2, 4), (DEFAULT_LAW,)))  # both of the paper's models at the same time, one core each
    raise typer.Exit(build(out, figures=numbers, quality=quality, progress=True))
