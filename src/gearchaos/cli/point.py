"""The command that judges one operating point."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.cli.commands import Json, Physical, Plot, Sets, StudyPath, app, in_units, load, options_of
from gearchaos.cli.errors import say
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw_dossier, print_json

if TYPE_CHECKING:
    from gearchaos.studies import Regime
    from gearchaos.studyfile import Study


@app.command()
def regime(
    study: StudyPath = None, sets: Sets = None, plot: Plot = None, json_out: Json = False, physical: Physical = False
) -> None:
    """Say what the mesh does at one operating point, with the evidence."""
    check_output("--plot", plot, PLOT_SUFFIXES)
    loaded = load(study, sets, physical)
    from gearchaos.studies import regime as run

    verdict = run(loaded.model, **options_of(loaded, "regime"), progress=True)
    if json_out:
        print_json(_regime_document(verdict, loaded, physical))
    else:
        from gearchaos.cli.pages import print_regime

        print_regime(verdict, loaded, physical)
    if plot:
        _draw_steady(loaded, verdict, plot, physical)


def _regime_document(verdict: Regime, loaded: Study, physical: bool) -> dict[str, Any]:
    """The verdict with all its evidence; in physical units also the mesh frequency, and the units by name."""
    if not physical or loaded.pair is None:
        return verdict.to_dict()
    from gearchaos.scaling import scaled_numbers

    values, units = scaled_numbers({**verdict.to_dict(), "omega": loaded.model.omega}, loaded.pair.scales)
    return {**values, "units": units}


def _draw_steady(loaded: Study, verdict: Regime, path: Path, physical: bool) -> None:
    """The picture of the motion behind a verdict, if it stays bounded."""
    if not verdict.section:
        say(f"no picture: the motion {verdict.label}")
        return
    from gearchaos.studies import steady

    motion = in_units(steady(loaded.model, verdict), loaded, physical)
    draw_dossier(motion, f"{verdict.label}: {verdict.reason}", path)
