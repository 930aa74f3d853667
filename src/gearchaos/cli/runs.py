"""The commands for long runs: compute a study into a store, show its progress, draw, export and check it."""

from __future__ import annotations

import os
import re
from datetime import timedelta
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import completion, output
from gearchaos.cli.errors import say
from gearchaos.cli.interrupts import finish_what_is_under_way
from gearchaos.cli.options import AxisTexts, Json, Out, Physical, Sets, StudyPath, app, load, parse_axes, study_axes
from gearchaos.cli.output import PLOT_SUFFIXES, check_files, check_output, print_json, say_written
from gearchaos.errors import InputError
from gearchaos.formats import format_of

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.store.run import Outcome
    from gearchaos.store.store import Store

StorePath = Annotated[str, typer.Argument(metavar="DIR.zarr", help="A store that gearchaos run made, or its URL.")]
# paths of stores are text: Path would make s3:// into s3:/

FAILED, DAMAGED, UNFINISHED = 1, 1, 3
"""Exit codes if a tile failed, if anything is damaged, and if this shard is done but others are not."""

_NAMED, _NAMED_RANGES = 10, 20
"""Largest numbers of shards, and of ranges of tiles, that are named in a message."""

COARSE = 8
"""Spacing of the rows and columns of a refined map that are computed first, if the study file does not set it."""


@app.command(rich_help_panel="Runs")
def run(
    study: StudyPath,
    out: Annotated[str, typer.Option("--out", metavar="DIR.zarr", help="Store, new or of an earlier run, or s3://….")],
    sets: Sets = None,
    axis: AxisTexts = None,
    tile: Annotated[
        int | None, typer.Option(min=1, help="Largest number of cells, columns or starts in a tile.")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads; one per core by default.")] = None,
    processes: Annotated[int | None, typer.Option(min=1, help="Processes, instead of threads.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Dask workers here, instead of threads.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="tcp://…", help="Compute on a Dask cluster.")] = None,
    cluster: Annotated[str | None, typer.Option(metavar="slurm", help="Compute in Slurm jobs.")] = None,
    jobs: Annotated[int | None, typer.Option(min=1, help="Slurm jobs, with --cluster; 1 by default.")] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Compute a coarse map, and more cells only where neighbours differ.")
    ] = False,
    shard: Annotated[
        str | None, typer.Option(metavar="I/N", help="Only one of N parts; other processes compute the others.")
    ] = None,
    json_out: Json = False,
) -> None:
    """Compute the study of a file into a store, or continue an earlier run."""
    from gearchaos.execute.pools import pool_from_options
    from gearchaos.store.lock import Shard
    from gearchaos.store.run import WORKER_MODULES, run_into_store
    from gearchaos.studies.core.registry import study_class

    pool = pool_from_options(threads, processes, scheduler, cluster, jobs, workers, WORKER_MODULES)
    given_axes = parse_axes(axis)
    loaded = load(study, sets, axes=given_axes)
    if loaded.kind is None:
        raise InputError("study.kind", "must be given", None, "Write [study] with a kind in the study file.")
    axes = study_axes(loaded.kind, loaded, given_axes)
    if refine and loaded.kind != "zones":
        raise InputError("--refine", "must be left out for a study that is no map of zones", loaded.kind)
    coarse = {"refine": COARSE} if refine and loaded.options.get("refine", 1) == 1 else {}
    chosen = loaded.study(study_class(loaded.kind), **axes, **coarse)
    part = None if shard is None else Shard.parse(shard)
    finish_what_is_under_way()
    _report(out, run_into_store(chosen, out, tile=tile, pool=pool, shard=part, progress=True), json_out)


@app.command(rich_help_panel="Runs")
def finish(store: StorePath, json_out: Json = False) -> None:
    """Finish a store of which all tiles are done, or say which are missing; damaged tiles are computed again."""
    from gearchaos.store.run import finish_store

    finish_what_is_under_way()
    _report(store, finish_store(store, progress=True), json_out)


def _report(store: str, outcome: Outcome, json_out: bool) -> None:
    """Print what a run has done, and exit with its code."""
    from gearchaos.store.store import open_store

    for number, error in outcome.failed.items():
        say(f"tile {number} failed: {error}")
    say(f"{store}: {outcome.done} of {outcome.count} tiles are done")
    proofs: dict[str, Any] = {}
    if not outcome.finished:
        _say_missing(store, outcome)
    elif "proved" in (found := open_store(store)).arrays:
        from gearchaos.datasets import parts
        from gearchaos.store.read import dataset
        from gearchaos.studies.proofs.proved_cells import proof_counts

        maps = dataset(found)[["proved", "proof_reason"]]
        proofs = {"proofs": proof_counts(part for _, part in parts(maps, found.block))}
        output.say_proofs(proofs)
    if json_out:
        print_json({"store": store, "tiles": outcome.count, "done": outcome.done, "failed": len(outcome.failed),
                    "finished": outcome.finished, "missing": outcome.missing, **proofs})
    raise typer.Exit(FAILED if outcome.failed else 0 if outcome.finished else UNFINISHED)


def _say_missing(store: str, outcome: Outcome) -> None:
    """Print how many tiles are missing in a store that is not finished, and how to finish it."""
    shards = list(outcome.missing)
    if not shards:
        say(f"the store is not finished; missing tiles: none. To finish it: gearchaos finish {quote(store)}")
    elif shards == ["1/1"]:
        say(f"the store is not finished; missing tiles: {outcome.missing['1/1']}. To compute them: "
            f"gearchaos run STUDY.toml --out {quote(store)}")
    else:
        more = len(shards) - _NAMED
        parts = ", ".join(f"{outcome.missing[shard]} of shard {shard}" for shard in shards[:_NAMED])
        say(f"the store is not finished; missing tiles: {parts}{f' and of {more} more shards' if more > 0 else ''}")
        options = ", ".join(f"--shard {shard}" for shard in shards[:_NAMED])
        say(f"The last shard to end finishes it. Run those that are not running: {options}{', …' if more > 0 else ''}")


@app.command(rich_help_panel="Runs")
def info(store: StorePath, json_out: Json = False) -> None:
    """Show the progress of a run: whether it is running, tiles done, rate, failures, and how to continue it."""
    from gearchaos.store.check import summary
    from gearchaos.store.objects import Objects
    from gearchaos.store.store import open_store

    if not Objects(store).exists():
        raise InputError("store", "must exist", store,
                         "A run that has just begun compiles its kernels first, and then makes its store.")
    found = summary(open_store(store))
    if json_out:
        print_json(found)
    else:
        _print_run(found)


def _print_run(found: dict[str, Any]) -> None:
    """Print the progress of a run from `gearchaos.store.check.summary`; its ``pieces`` are work items."""
    from gearchaos.store.check import listed

    table = output.facts_table()
    table.add_row("study", found["study"])
    table.add_row("state", _state(found))
    lost, share, missing = found["tiles_lost"], found["pieces_done"] / found["pieces"], found["missing"]
    whole = f"; {found['tiles_done']} are whole" if lost else ""
    done = f"{found['tiles_done'] + lost} of {found['tiles']}{whole}"
    table.add_row("tiles done", f"{done} ({share:.1%} of the work items)")
    if lost:
        table.add_row("to be computed again", f"{lost} tiles that were done: files of {listed(missing['arrays'])} are "
                                              "missing or damaged")
    if found["pieces_per_second"] is not None and found["seconds_left"]:
        table.add_row("rate", f"{found['pieces_per_second']:,.0f} work items a second")
        table.add_row("left, at that rate", f"{timedelta(seconds=round(found['seconds_left']))}")
    table.add_row("computed", f"{timedelta(seconds=round(found['seconds']))}, added up over all workers")
    table.add_row("machines", ", ".join(found["machines"]) or "none yet")
    table.add_row("on disk", f"{found['bytes'] / 1e6:,.1f} MB")
    for number, error in found["failed"].items():
        table.add_row(f"tile {number} failed", error)
    if found["tiles_done"] and missing["pieces"]:
        table.add_row("without results,\nby position from 0", "\n".join(
            ", ".join(f"{name} {first}:{stop}" for name, (first, stop) in block.items())
            for block in missing["pieces"]))
    if missing["files"]:
        more = missing["file_count"] - len(missing["files"])
        table.add_row("missing or damaged", "\n".join([*missing["files"], *[f"and {more} more files"] * (more > 0)]))
    output.print_table(table)


def _state(found: dict[str, Any]) -> str:
    """Whether a run is finished or running, and otherwise the command that continues it."""
    if found["finished"]:
        return "finished"
    if found["running"]:
        return f"running: {'; '.join(found['running'])}"
    return f"{'damaged' if found['missing']['files'] else 'not finished'}; to continue: {found['command']}"


@app.command(rich_help_panel="Runs")
def plot(
    result: Annotated[
        str, typer.Argument(metavar="FILE.nc|DIR.zarr", help="Saved data, or a store of a run, or its URL.")
    ],
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Picture: .png, .pdf or .svg.")] = None,
    colour: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="What a map or a diagram shows: motion, v_rms, contact, …",
                     autocompletion=completion.colours),
    ] = None,
    style: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="For what it is: paper, slides or dark.",
                     autocompletion=completion.choices("paper", "slides", "dark")),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(metavar="WIDTH", help="With --style: column (90 mm), double (190 mm) or mm.",
                     autocompletion=completion.choices("column", "double")),
    ] = None,
    hatch: Annotated[
        bool, typer.Option("--hatch", help="Hatching instead of colours in maps of classes and basins.")
    ] = False,
    mesh: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a train: the mesh that is shown; by default the worst.")
    ] = None,
    over: Annotated[
        str | None,
        typer.Option(metavar="FILE.nc", help="Draw this over it: curves over a map, or a sweep over another."),
    ] = None,
    physical: Physical = False,
) -> None:
    """Draw any saved result, or the store of a finished or unfinished run."""
    target = out or _default_picture(result, "_".join(filter(None, [colour, over and f"with_{Path(over).stem}"])))
    check_output("--out", target, PLOT_SUFFIXES)
    if width is not None and style is None:
        raise InputError("--width", "needs --style", width, "E.g. --style paper --width column.")
    from gearchaos.store.read import is_store
    from gearchaos.studies import load as read_file

    if is_store(result):
        dataset, options = _from_store(result, colour, physical)
    else:
        dataset, options = _in_units(read_file(result), physical), {}
    if mesh is not None:
        from gearchaos.datasets import of_mesh

        dataset = of_mesh(dataset, mesh)
    _say_dimensionless(dataset)
    options["over"] = None if over is None else _in_units(read_file(over), physical)
    output.draw(dataset, target, colour=colour, style=style, width=width, hatch=hatch, **options)


def _in_units(dataset: xr.Dataset, physical: bool) -> xr.Dataset:
    """A result, with ``physical`` in the units of the gears that it carries."""
    if not physical:
        return dataset
    from gearchaos.gears.operation.results import physical as scaled

    if "gears" not in dataset.attrs:
        raise InputError("--physical", "needs the result of a study of gears, which carries them",
                         str(dataset.attrs.get("study")), "gearchaos.physical(dataset, pair) scales any other.")
    return scaled(dataset)


def _say_dimensionless(dataset: xr.Dataset) -> None:
    """Tell how to get the units of the gears that a result carries, unless it is in them."""
    from gearchaos.gears.operation.results import is_physical

    if "gears" in dataset.attrs and not is_physical(dataset):
        say("results of these gears are dimensionless; --physical gives them in µm, mm/s, N and Hz")


def _from_store(path: str, colour: str | None, physical: bool) -> tuple[xr.Dataset, dict[str, Any]]:
    """The Dataset of a store for a picture, a large map reduced to its pixels, and options of `draw`.

    They are a note of how much of it is computed and how it was reduced, and the resolution of a reduced map.
    """
    from gearchaos.plot.reduced import DPI, is_larger, reduced
    from gearchaos.plot.results import check_colour, default_colour
    from gearchaos.store.blocks import State
    from gearchaos.store.read import dataset as stored
    from gearchaos.store.store import open_store

    found = open_store(path)
    state = State.of(found)
    done = sum(state.done(found, block) for block in range(found.grid.block_count))
    if done == 0:
        raise InputError("store", "must hold at least one tile for a picture", path)
    notes = [] if found.finished else [f"{done} of {found.grid.count} tiles computed"]
    _say_not_done(path, found)
    dataset = stored(found)
    if not is_larger(dataset):
        return _in_units(dataset, physical), {"note": "".join(notes)}
    check_colour(dataset, colour)
    shown = default_colour(dataset) if colour is None else colour
    small, note = reduced(dataset, found.block, partial(_in_units, physical=physical), shown, progress=True)
    return small, {"note": "\n".join([*notes, note]), "dpi": DPI}


def _say_not_done(path: str, store: Store) -> None:
    """Print what is missing of a store, unless nothing is."""
    from gearchaos.store.check import in_words

    if missing := in_words(store):
        say(f"{path}: {missing}")


def _default_picture(result: str, colour: str) -> Path:
    """The path of the picture of a result: in the same folder, with the same name and that of the colour, if given.

    The picture of a store in an object store is in the working directory.
    """
    from gearchaos.store.objects import is_url

    path = Path(result.rstrip("/").rpartition("/")[2] if is_url(result) else result)
    absolute = Path(os.path.normpath(path.absolute()))  # "." and ".." have no name of their own
    if not absolute.name:
        raise InputError("result", "must be a saved file, or a folder that gearchaos run made", result)
    named = absolute if path.name != absolute.name else path
    suffix = f"_{re.sub(r'[^a-z0-9_]', '_', colour)}" if colour else ""
    return named.with_name(f"{named.stem}{suffix}.png")


@app.command(rich_help_panel="Runs")
def export(store: StorePath, out: Out, physical: Physical = False) -> None:
    """Write the result in a store as NetCDF, or as tables of text."""
    check_files(out)
    from gearchaos.store.read import dataset as stored
    from gearchaos.store.store import open_store

    found = open_store(store)
    _say_not_done(store, found)
    dataset = stored(found)
    if not physical:
        _say_dimensionless(dataset)
    in_units = partial(_in_units, physical=physical)
    write_blocks = format_of("--out", out).write_blocks
    if write_blocks is None or not found.study.gridded:
        output.save(in_units(dataset), out)
    else:
        say_written(*write_blocks(dataset, found.arrays, found.block, out, in_units))


@app.command(rich_help_panel="Runs")
def check(store: StorePath, json_out: Json = False) -> None:
    """Verify all checksums of a store; exit code 0 if it is undamaged, 1 if anything is damaged.

    Nothing is changed: the next run, or gearchaos finish, verifies results too, and computes again what is damaged.
    """
    from gearchaos.store.check import check as verify
    from gearchaos.store.check import consecutive
    from gearchaos.store.store import open_store

    opened = open_store(store)
    files, found = verify(opened)
    for file in files:
        say(f"damaged: {file}")
    tiles = sorted([*found.lost_tiles, *(int(name.rpartition("/")[2]) for name in found.tiles)])
    if tiles:
        ranges = [str(first) if first == last else f"{first}–{last}" for first, last in consecutive(tiles)]
        more = [f"and {len(ranges) - _NAMED_RANGES} more ranges"] if len(ranges) > _NAMED_RANGES else []
        say(f"tiles to be computed again, {len(tiles)} in all: {', '.join([*ranges[:_NAMED_RANGES], *more])}")
    if files:
        say(f"To repair it: {found.repair}")
    if json_out:
        print_json({"store": store, "damaged": bool(files), "files": files, "tiles": tiles,
                    "command": found.repair if files else None})
    elif not files:
        unfinished = "" if opened.finished else f"; the store is not finished: {found.repair}"
        missing = f"; {len(found.never)} of {opened.grid.count} tiles are not computed" if found.never else unfinished
        print(f"{store}: all checksums are right{missing}")
    raise typer.Exit(DAMAGED if files else 0)
