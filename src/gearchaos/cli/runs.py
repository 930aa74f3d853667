"""Commands for long studies: run them into a store, look at it, draw and export it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, Sets, StudyPath, app, load
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.execute.engines import Engine
    from gearchaos.store.resolved import Resolved

StorePath = Annotated[Path, typer.Argument(metavar="DIR.zarr", help="A store that gearchaos run made.", readable=False)]
FAILED = 1
COARSE = 8
"""Where the study file does not say how coarsely a map that is refined begins."""


@app.command()
def run(
    study: StudyPath,
    out: Annotated[Path, typer.Option("--out", metavar="DIR.zarr", help="The store, new or to go on with.")],
    sets: Sets = None,
    tile: Annotated[int | None, typer.Option(min=1, help="Most cells, columns or starts in a tile.")] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Tiles computed at once; one per core by default.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Compute in so many processes instead.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="tcp://…", help="Compute on a Dask cluster.")] = None,
    cluster: Annotated[str | None, typer.Option(metavar="slurm", help="Compute in Slurm jobs.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Slurm jobs, with --cluster; 1 by default.")] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Compute a map coarsely, and finer only where neighbours differ.")
    ] = False,
    shard: Annotated[str | None, typer.Option(metavar="I/N", help="Only every N-th tile, from the I-th.")] = None,
    json_out: Json = False,
) -> None:
    """Compute the study of a file into a store, or go on where an earlier run stopped."""
    places = {"--threads": threads, "--processes": processes, "--scheduler": scheduler, "--cluster": cluster}
    engine = _engine(places, jobs)
    resolved = _resolved(study, sets, refine)
    from gearchaos.store.run import run as compute
    from gearchaos.store.writers import Shard

    part = None if shard is None else Shard.parse(shard)
    outcome = compute(resolved, out, tile=tile, engine=engine, shard=part, say=say, progress=True)
    for number, error in outcome.failed.items():
        say(f"tile {number} failed: {error}")
    say(f"{out}: {outcome.done} of {outcome.count} tiles are done")
    if json_out:
        print_json({"store": str(out), "tiles": outcome.count, "done": outcome.done, "failed": len(outcome.failed)})
    raise typer.Exit(FAILED if outcome.failed else 0)


def _resolved(path: Path | None, sets: list[str] | None, refine: bool) -> Resolved:
    """The study of a file, in full."""
    loaded = load(path, sets)
    kind = loaded.settings.kind
    if kind is None:
        raise InputError("study.kind", "must be given", None, "Write [study] with a kind in the study file.")
    from gearchaos.store.resolved import Resolved
    from gearchaos.studies.defaults import settings_for_kind
    from gearchaos.studyfile import AXIS_KEYS

    keys = AXIS_KEYS.get(kind, ())
    if len(loaded.settings.axes) != len(keys):
        raise InputError("study", f"must give {' and '.join(keys)}", kind, 'E.g. x = "omega=0.2:3:400".')
    options = loaded.settings.options()
    if refine and kind != "zones":
        raise InputError("--refine", "must be left out for a study that is no map of zones", kind)
    if refine and options.get("refine", 1) == 1:
        options["refine"] = COARSE
    settings = settings_for_kind(kind, loaded.classification) if loaded.classification else None
    return Resolved(kind, loaded.model, loaded.settings.axes, options, settings)


def _engine(asked: dict[str, Any], jobs: int | None) -> Engine:
    """Where to compute; at most one of the options may be given."""
    from gearchaos.execute import engines

    if jobs is not None and asked["--cluster"] is None:
        raise InputError("--jobs", "must be left out without --cluster", jobs)
    given = {name: value for name, value in asked.items() if value is not None}
    if len(given) > 1:
        raise InputError(" and ".join(given), "must not be given together", list(given.values()))
    if asked["--cluster"] not in (None, "slurm"):
        advice = "For others start a scheduler and give --scheduler."
        raise InputError("--cluster", "must be slurm", asked["--cluster"], advice)
    makers: dict[str, Callable[[Any], Engine]] = {
        "--threads": engines.threads, "--processes": engines.processes, "--scheduler": engines.scheduler,
        "--cluster": lambda _: engines.slurm(jobs or 1),
    }
    name, value = next(iter(given.items()), ("--threads", None))
    return makers[name](value)


@app.command()
def info(store: StorePath, json_out: Json = False) -> None:
    """Say how far a run is: tiles done, rate, failures."""
    from gearchaos.store.info import summary
    from gearchaos.store.store import read

    found = summary(read(store))
    if json_out:
        print_json(found)
    else:
        from gearchaos.cli.pages import print_run

        print_run(found)


@app.command()
def plot(
    result: Annotated[
        Path, typer.Argument(metavar="FILE.nc|DIR.zarr", help="Saved data, or a store of a run.", readable=False)
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture: .png, .pdf or .svg.")] = None,
    colour: Annotated[
        str | None, typer.Option(metavar="NAME", help="What a map is coloured by: motion, v_rms, contact, …")
    ] = None,
) -> None:
    """Draw any saved result, or what a store holds, also of a run that is not done."""
    target = out or _beside(result, colour)
    check_output("--out", target, PLOT_SUFFIXES)
    dataset, note = _from_store(result) if result.is_dir() else (_from_file(result), "")
    draw(dataset, target, colour=colour, note=note)


def _from_file(path: Path) -> xr.Dataset:
    from gearchaos.studies import load as read_file

    return read_file(path)


def _from_store(path: Path) -> tuple[xr.Dataset, str]:
    """What a store holds, and how much of it is computed, if not all."""
    from gearchaos.store.info import summary
    from gearchaos.store.store import read

    found = read(path)
    state = summary(found)
    if state["tiles_done"] == 0:
        raise InputError("store", "must hold at least one tile for a picture", str(path))
    note = "" if found.finished else f"{state['tiles_done']} of {state['tiles']} tiles computed"
    return found.dataset(), note


def _beside(result: Path, colour: str | None) -> Path:
    """The picture of a result, beside it and of its name, even where that is given as "."; a colour is named too."""
    whole = Path(os.path.normpath(result.absolute()))
    if not whole.name:
        raise InputError("result", "must be a saved file, or a folder that gearchaos run made", str(result))
    named = whole if result.name != whole.name else result
    suffix = f"_{re.sub(r'[^a-z0-9_]', '_', colour)}" if colour else ""
    return named.with_name(f"{named.stem}{suffix}.png")


@app.command()
def export(
    store: StorePath,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="NetCDF file to write.", readable=False)],
) -> None:
    """Write what a store holds as NetCDF."""
    check_output("--out", out, DATA_SUFFIXES)
    from gearchaos.store.store import read

    found = read(store)
    if not found.finished:
        say(f"{store} is not done: what is not computed is NaN, 0 in whole numbers, or -1 for contact")
    save(found.dataset(), out)
