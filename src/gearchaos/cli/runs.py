"""The commands for long runs: compute a study into a store, show its progress, draw and export what is computed."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import Json, Physical, Sets, StudyPath, app, load
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, proof_summary, save, say_proofs
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.study import Study

StorePath = Annotated[Path, typer.Argument(metavar="DIR.zarr", help="A store that gearchaos run made.", readable=False)]
FAILED = 1
"""Exit code if a tile failed."""

COARSE = 8
"""Spacing of the rows and columns of a refined map that are computed first, if the study file does not set it."""


@app.command()
def run(
    study: StudyPath,
    out: Annotated[Path, typer.Option("--out", metavar="DIR.zarr", help="Store, new or of an earlier run.")],
    sets: Sets = None,
    tile: Annotated[
        int | None, typer.Option(min=1, help="Largest number of cells, columns or starts in a tile.")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; one per core by default.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Processes, instead of threads.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="tcp://…", help="Compute on a Dask cluster.")] = None,
    cluster: Annotated[str | None, typer.Option(metavar="slurm", help="Compute in Slurm jobs.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Slurm jobs, with --cluster; 1 by default.")] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Compute a coarse map, and more cells only where neighbours differ.")
    ] = False,
    shard: Annotated[str | None, typer.Option(metavar="I/N", help="Only every N-th tile, from the I-th.")] = None,
    json_out: Json = False,
) -> None:
    """Compute the study of a file into a store, or continue an earlier run."""
    from gearchaos.execute.pools import pool_from_options
    from gearchaos.store.run import run_into_store
    from gearchaos.store.writers import Shard

    pool = pool_from_options(threads, processes, scheduler, cluster, jobs)
    chosen = _study(study, sets, refine)
    part = None if shard is None else Shard.parse(shard)
    outcome = run_into_store(chosen, out, tile=tile, pool=pool, shard=part, say=say, progress=True)
    for number, error in outcome.failed.items():
        say(f"tile {number} failed: {error}")
    say(f"{out}: {outcome.done} of {outcome.count} tiles are done")
    proofs = _proofs(out) if outcome.done == outcome.count else {}
    if json_out:
        counts = {"tiles": outcome.count, "done": outcome.done, "failed": len(outcome.failed)}
        print_json({"store": str(out), **counts, **proofs})
    raise typer.Exit(FAILED if outcome.failed else 0)


def _proofs(store: Path) -> dict[str, Any]:
    """The summary of the proofs in a finished store, which is printed; empty if no proofs were asked for."""
    import xarray as xr

    with xr.open_zarr(store) as dataset:
        say_proofs(dataset)
        return proof_summary(dataset)


def _study(path: Path | None, sets: list[str] | None, refine: bool) -> Study:
    """The study that a file describes; raises `InputError` unless it is complete."""
    loaded = load(path, sets)
    if loaded.kind is None:
        raise InputError("study.kind", "must be given", None, "Write [study] with a kind in the study file.")
    from gearchaos.studies.registry import study_class

    study_type = study_class(loaded.kind)
    if not all(key in loaded.options for key in study_type.axis_fields):
        keys = ' and '.join(study_type.axis_fields)
        raise InputError("study", f"must give {keys}", loaded.kind, 'E.g. x = "omega=0.2:3:400".')
    if refine and loaded.kind != "zones":
        raise InputError("--refine", "must be left out for a study that is no map of zones", loaded.kind)
    coarse = {"refine": COARSE} if refine and loaded.options.get("refine", 1) == 1 else {}
    return loaded.study(study_type, **coarse)


@app.command()
def info(store: StorePath, json_out: Json = False) -> None:
    """Show the progress of a run: tiles done, rate, failures."""
    from gearchaos.store.info import summary
    from gearchaos.store.store import open_store

    found = summary(open_store(store))
    if json_out:
        print_json(found)
    else:
        from gearchaos.cli.tables import print_run

        print_run(found)


@app.command()
def plot(
    result: Annotated[
        Path, typer.Argument(metavar="FILE.nc|DIR.zarr", help="Saved data, or a store of a run.", readable=False)
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture: .png, .pdf or .svg.")] = None,
    colour: Annotated[
        str | None, typer.Option(metavar="NAME", help="What a map or a diagram shows: motion, v_rms, contact, …")
    ] = None,
    style: Annotated[str | None, typer.Option(metavar="NAME", help="For what it is: paper, slides or dark.")] = None,
    width: Annotated[
        str | None, typer.Option(metavar="WIDTH", help="With --style: column (90 mm), double (190 mm) or mm.")
    ] = None,
    hatch: Annotated[
        bool, typer.Option("--hatch", help="Hatching instead of colours in maps of classes and basins.")
    ] = False,
    physical: Physical = False,
) -> None:
    """Draw any saved result, or the store of a finished or unfinished run."""
    target = out or _default_picture(result, colour)
    check_output("--out", target, PLOT_SUFFIXES)
    if width is not None and style is None:
        raise InputError("--width", "needs --style", width, "E.g. --style paper --width column.")
    dataset, note = _from_store(result) if result.is_dir() else (_from_file(result), "")
    draw(_in_units(dataset, physical), target, colour=colour, note=note, style=style, width=width, hatch=hatch)


def _in_units(dataset: xr.Dataset, physical: bool) -> xr.Dataset:
    """A result, with ``physical`` in the units of the gears that it carries."""
    if not physical:
        return dataset
    from gearchaos.gears.results import physical as scaled

    if "gears" not in dataset.attrs:
        raise InputError("--physical", "needs the result of a study of gears, which carries them",
                         str(dataset.attrs.get("study")), "gearchaos.physical(dataset, pair) scales any other.")
    return scaled(dataset)


def _from_file(path: Path) -> xr.Dataset:
    """The Dataset of a saved file."""
    from gearchaos.studies import load as read_file

    return read_file(path)


def _from_store(path: Path) -> tuple[xr.Dataset, str]:
    """The Dataset of a store, and a note of how much of it is computed, empty if all is."""
    from gearchaos.store.info import summary
    from gearchaos.store.store import open_store

    found = open_store(path)
    state = summary(found)
    if state["tiles_done"] == 0:
        raise InputError("store", "must hold at least one tile for a picture", str(path))
    note = "" if found.finished else f"{state['tiles_done']} of {state['tiles']} tiles computed"
    return found.dataset(), note


def _default_picture(result: Path, colour: str | None) -> Path:
    """The path of the picture of a result: in the same folder, with the same name and that of the colour, if given."""
    absolute = Path(os.path.normpath(result.absolute()))  # "." and ".." have no name of their own
    if not absolute.name:
        raise InputError("result", "must be a saved file, or a folder that gearchaos run made", str(result))
    named = absolute if result.name != absolute.name else result
    suffix = f"_{re.sub(r'[^a-z0-9_]', '_', colour)}" if colour else ""
    return named.with_name(f"{named.stem}{suffix}.png")


@app.command()
def export(
    store: StorePath,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="NetCDF file to write.", readable=False)],
    physical: Physical = False,
) -> None:
    """Write the result in a store as NetCDF."""
    check_output("--out", out, DATA_SUFFIXES)
    from gearchaos.store.store import open_store

    found = open_store(store)
    if not found.finished:
        say(f"{store} is not done: values not yet computed are NaN, 0 in integers, -1 for contact, -2 for attractors")
    save(_in_units(found.dataset(), physical), out)
