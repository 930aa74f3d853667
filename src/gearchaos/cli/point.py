"""The commands for one operating point: one motion, its verdict, and all attractors."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import completion
from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, OutIfWanted, Physical, Plot, Sets, StudyPath, app, given, in_units, load
from gearchaos.cli.output import (
    PLOT_SUFFIXES,
    attractor_list,
    attractor_units,
    check_output,
    draw_dossier,
    print_json,
    save,
    section,
    section_units,
)
from gearchaos.cli.proof_options import check_proof, proof_of
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    from gearchaos.studies import Verdict
    from gearchaos.studyfile import LoadedStudy


@app.command()
def simulate(
    study: StudyPath = None,
    sets: Sets = None,
    periods: Annotated[int | None, typer.Option(min=1, help="Mesh periods to record.")] = None,
    transient: Annotated[int | None, typer.Option(min=0, help="Mesh periods before these.")] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Instants per period of the trajectory in --out.")] = None,
    json_out: Json = False,
    out: OutIfWanted = None,
    physical: Physical = False,
) -> None:
    """Integrate one motion and show its stroboscopic section, one state per mesh period."""
    if samples is not None and out is None:
        raise InputError("--samples", "needs --out", samples, "Stdout shows only the stroboscopic section.")
    check_output("--out", out, DATA_SUFFIXES)
    loaded = load(study, sets, physical)
    if periods is None and "periods" not in loaded.options_for("simulate"):
        raise InputError("--periods", "must be given", None, "E.g. --periods 100.")
    options = given(periods=periods, transient=transient, samples=samples)
    from gearchaos.studies.simulate import Simulate

    chosen = loaded.study(Simulate, **options | ({"samples": None} if out is None else {}))
    dataset = in_units(chosen.run(progress=True), loaded, physical)
    save(dataset, out)
    if json_out:
        print_json({**section(dataset), **({"units": section_units(dataset)} if physical else {})})
    else:
        from gearchaos.cli.tables.motions import print_section

        print_section(in_units(dataset, loaded, physical=True))


@app.command()
def regime(
    study: StudyPath = None,
    sets: Sets = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
    prove: Annotated[bool, typer.Option("--prove", help="Prove a periodic motion in ball arithmetic.")] = False,
    certificate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --prove: write the certificate, JSON.", readable=False)
    ] = None,
) -> None:
    """Classify the motion at one operating point, and print the evidence."""
    check_output("--plot", plot, PLOT_SUFFIXES)
    check_proof(prove, certificate)
    loaded = load(study, sets, physical)
    from gearchaos.studies.regime import Regime

    chosen = loaded.study(Regime)
    chosen.cost.announce()
    verdict = chosen.verdict()
    proof = proof_of(verdict, certificate) if prove else None
    if json_out:
        document = _regime_document(verdict, loaded, physical)
        print_json(document if proof is None else {**document, "proof": proof.to_dict()})
    else:
        from gearchaos.cli.tables.motions import print_regime

        print_regime(verdict, loaded, proof)
    if plot:
        _draw_steady(loaded, verdict, plot, physical)


def _regime_document(verdict: Verdict, loaded: LoadedStudy, physical: bool) -> dict[str, Any]:
    """The JSON document of a verdict; in physical units it also has the mesh frequency, and the units by name."""
    if not physical or loaded.pair is None:
        return verdict.to_dict()
    from gearchaos.gears.scales import scaled_numbers

    values, units = scaled_numbers({**verdict.to_dict(), "omega": loaded.model.omega}, loaded.pair.scales)
    return {**values, "units": units}


def _draw_steady(loaded: LoadedStudy, verdict: Verdict, path: Path, physical: bool) -> None:
    """Write the picture of the motion of a verdict, if it is bounded."""
    if not verdict.section:
        say(f"no picture: the motion {verdict.label}")
        return
    from gearchaos.studies import steady

    motion = in_units(steady(loaded.model, verdict), loaded, physical)
    draw_dossier(motion, f"{verdict.label}: {verdict.reason}", path)


@app.command()
def attractors(
    study: StudyPath = None,
    sets: Sets = None,
    starts: Annotated[
        int | None,
        typer.Option(help="Number of initial states, 256 by default, within ±3 half backlashes and ±2 in velocity."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the initial states.")] = None,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="NAME=START:STOP:COUNT", help="Also sweep this parameter from both ends to its value.",
                     autocompletion=completion.axes),
    ] = None,
    kicks: Annotated[
        int | None, typer.Option(help="Directions in which to search the smallest perturbation that leaves a basin.")
    ] = None,
    out: OutIfWanted = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Find all attractors of one operating point, with the share of the initial states that lead to each."""
    check_output("--out", out, DATA_SUFFIXES)
    loaded = load(study, sets, physical)
    from gearchaos.studies.attractors import Attractors
    from gearchaos.studies.axis import parse_axis

    path = parse_axis(sweep, "--sweep") if sweep else None
    options = given(starts=starts, seed=seed, sweep=path, kicks=kicks)
    found = in_units(loaded.study(Attractors, **options).run(progress=True), loaded, physical)
    save(found, out)
    if json_out:
        print_json({**attractor_list(found), **({"units": attractor_units(found)} if physical else {})})
    else:
        from gearchaos.cli.tables.motions import print_attractors

        print_attractors(in_units(found, loaded, physical=True), loaded.model)
