"""The commands: each reads its inputs, runs one study, and hands the result on.

Only typer and rich load with this module; a command imports the heavy rooms when it runs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.errors import Commands, say, tell_of_compiling
from gearchaos.cli.output import (
    PLOT_SUFFIXES,
    attractor_list,
    check_output,
    draw,
    print_json,
    save,
    section,
    section_units,
    summary,
)
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies import Axis
    from gearchaos.studyfile import Settings, Study

app = typer.Typer(
    cls=Commands,
    help="What will this gear mesh do? Exact flow, verdicts and maps for gear pairs with backlash.",
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

# readable=False: what a file must allow is checked, and said, in the words of the project
StudyPath = Annotated[Path | None, typer.Argument(metavar="STUDY", help="Study file, TOML.", readable=False)]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Set a value over the study file; may be repeated."),
]
AxisTexts = Annotated[
    list[str] | None,
    typer.Option("--axis", metavar="NAME=START:STOP:COUNT", help="E.g. eps1=0:0.3:400; first x, then y."),
]
Out = Annotated[Path, typer.Option("--out", metavar="FILE", help="NetCDF file to write.", readable=False)]
OutIfWanted = Annotated[
    Path | None, typer.Option("--out", metavar="FILE", help="NetCDF file to write.", readable=False)
]
Plot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Picture as well: .png, .pdf or .svg.", readable=False)
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")]
Physical = Annotated[bool, typer.Option("--physical", help="µm, mm/s, N, Hz; for a physical pair.")]


def main() -> None:
    """Entry point of the ``gearchaos`` command."""
    app(prog_name="gearchaos")


@app.command()
def warmup() -> None:
    """Compile all kernels now, so that no later run has to."""
    from gearchaos.studies.warmup import MODELS
    from gearchaos.studies.warmup import warmup as run

    say(f"compiling the kernels of models with {min(MODELS)} to {max(MODELS)} coordinates; this happens once")
    for dimension, seconds in run():
        say(f"{dimension} coordinates: ready after {seconds:.0f} s")


def _version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        print(f"gearchaos {version('gearchaos')}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""


@app.command()
def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.", readable=False)],
    figures: Annotated[str | None, typer.Option(metavar="2,6,9", help="Only these figures.")] = None,
    quality: Annotated[str, typer.Option(metavar="draft|paper", help="How finely to compute.")] = "paper",
) -> None:
    """Reproduce the 2008 paper: every figure, every claim judged, one report."""
    numbers = None if figures is None else _figure_numbers(figures)
    from gearchaos.paper.report import build
    from gearchaos.paper.settings import chosen_figures

    chosen_figures(numbers)  # checked before anything is compiled
    _compile_for_paper()
    raise typer.Exit(build(out, figures=numbers, quality=quality, progress=True))


def _compile_for_paper() -> None:
    """On a cold cache, compile for both of the paper's models at once: one core each."""
    from gearchaos.flow.jit import cold
    from gearchaos.studies.warmup import warmup as run

    if cold():
        say("compiling the kernels, once after an install or an update")
        list(run((2, 4)))


def _figure_numbers(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        rule = "must be numbers with commas between"
        raise InputError("--figures", rule, text, "E.g. --figures 2,6,9.") from None


@app.command()
def simulate(
    study: StudyPath = None,
    sets: Sets = None,
    periods: Annotated[int | None, typer.Option(min=1, help="Mesh periods to record.")] = None,
    transient: Annotated[int | None, typer.Option(min=0, help="Mesh periods to let pass before.")] = None,
    samples: Annotated[int | None, typer.Option(min=1, help="Instants per period, for --out.")] = None,
    json_out: Json = False,
    out: OutIfWanted = None,
    physical: Physical = False,
) -> None:
    """Follow one motion and show it once per mesh period."""
    if samples is not None and out is None:
        raise InputError("--samples", "needs --out", samples, "Stdout shows the stroboscopic section alone.")
    check_output("--out", out, DATA_SUFFIXES)
    loaded = load(study, sets, physical)
    length = _length(loaded.settings_for("simulate"), periods, transient, samples)
    if out is None:
        length["samples"] = None
    from gearchaos.studies import simulate as run

    dataset = in_units(run(loaded.model, **length, progress=True), loaded, physical)
    save(dataset, out)
    if json_out:
        print_json({**section(dataset), **({"units": section_units(dataset)} if physical else {})})
    else:
        from gearchaos.cli.pages import print_section

        print_section(dataset)


def _length(
    settings: Settings, periods: int | None, transient: int | None, samples: int | None
) -> dict[str, Any]:
    """How long to simulate and how finely: the command line first, then the study file."""
    periods = settings.periods if periods is None else periods
    if periods is None:
        raise InputError("--periods", "must be given", None, "E.g. --periods 100.")
    return {
        "periods": periods,
        "transient": settings.transient or 0 if transient is None else transient,
        "samples": settings.samples if samples is None else samples,
    }


@app.command()
def attractors(
    study: StudyPath = None,
    sets: Sets = None,
    starts: Annotated[
        int | None, typer.Option(help="Starts, 256 by default, spread over ±3 half backlashes and ±2 in velocity.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Another seed gives other starts.")] = None,
    sweep: Annotated[
        str | None, typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Also sweep this from both ends to its value.")
    ] = None,
    kicks: Annotated[
        int | None, typer.Option(help="Directions in which to look for the smallest kick out of a basin.")
    ] = None,
    out: OutIfWanted = None,
    json_out: Json = False,
) -> None:
    """Find all motions of one operating point, with the shares of the starts that lead to them."""
    check_output("--out", out, DATA_SUFFIXES)
    loaded = load(study, sets)
    from gearchaos.axis import parse_axis
    from gearchaos.studies import attractors as run

    path = parse_axis(sweep, "--sweep") if sweep else None
    options = options_of(loaded, "attractors", starts=starts, seed=seed, sweep=path, kicks=kicks)
    found = run(loaded.model, **options, progress=True)
    save(found, out)
    if json_out:
        print_json(attractor_list(found))
    else:
        from gearchaos.cli.pages import print_attractors

        print_attractors(found)


@app.command()
def bifurcation(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    points: Annotated[
        int | None, typer.Option(min=0, help="Stroboscopic points per column; 0 for the verdicts alone.")
    ] = None,
    mode: Annotated[
        str | None, typer.Option(metavar="fixed|up|down", help="Same start, or the state carried along.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Scan one parameter: stroboscopic points, verdicts and exponents."""
    target = _Target(out, plot, json_out, physical)
    loaded, axes = _map_inputs("bifurcation", study, sets, axis, target)
    options = options_of(loaded, "bifurcation", points=points, mode=mode)
    from gearchaos.studies import bifurcation as run

    _finish("bifurcation", run(loaded.model, *axes, progress=True, **options), axes, loaded, target)


@app.command()
def zones(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    starts: Annotated[int | None, typer.Option(help="Starts in each cell, to find all its motions.")] = None,
    refine: Annotated[
        int | None, typer.Option(metavar="N", help="Every N-th row and column first, finer where neighbours differ.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the kinds of motion over two parameters."""
    target = _Target(out, plot, json_out, physical)
    loaded, axes = _map_inputs("zones", study, sets, axis, target)
    from gearchaos.studies import zones as run

    options = options_of(loaded, "zones", starts=starts, refine=refine)
    _finish("zones", run(loaded.model, *axes, **options, progress=True), axes, loaded, target)


@app.command()
def basins(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the basins of attraction over two initial values."""
    target = _Target(out, plot, json_out, physical)
    loaded, axes = _map_inputs("basins", study, sets, axis, target)
    from gearchaos.studies import basins as run

    _finish("basins", run(loaded.model, *axes, **options_of(loaded, "basins"), progress=True), axes, loaded, target)


@dataclass(frozen=True)
class _Target:
    """Where a map goes, and in which form."""

    out: Path
    plot: Path | None
    json_out: bool
    physical: bool


def _map_inputs(
    kind: str, study: Path | None, sets: list[str] | None, axis: list[str] | None, target: _Target
) -> tuple[Study, tuple[Axis, ...]]:
    """Everything a map needs, checked before anything is computed."""
    check_output("--out", target.out, DATA_SUFFIXES)
    check_output("--plot", target.plot, PLOT_SUFFIXES)
    loaded = load(study, sets, target.physical)
    return loaded, _axes(kind, loaded.settings_for(kind).axes, axis or [])


def options_of(loaded: Study, kind: str, **given: Any) -> dict[str, Any]:
    """Arguments of a study by name: the command line first, then the study file; what neither says is left out."""
    said = {n: v for n, v in given.items() if v is not None}
    budget = {}
    if loaded.budget:
        from gearchaos.studies.budgets import budget_for

        budget = {"budget": budget_for(kind, loaded.budget)}
    return {**loaded.settings_for(kind).options(), **budget, **said}


def _axes(kind: str, from_file: tuple[Axis, ...], texts: list[str]) -> tuple[Axis, ...]:
    """The axes of the command line; fewer than needed replace those of the study file by name."""
    from gearchaos.axis import parse_axis
    from gearchaos.studyfile import AXIS_KEYS

    given = tuple(parse_axis(text, "--axis") for text in texts)
    needed, by_name = len(AXIS_KEYS[kind]), {a.name: a for a in given}
    if len(given) < needed and by_name.keys() <= {a.name for a in from_file}:
        given = tuple(by_name.get(a.name, a) for a in from_file)
    if len(given) != needed:
        examples = ("--axis z=-3:3:200", "--axis z_dot=-2:2:200")
        if kind != "basins":
            examples = ("--axis omega=0.2:3:200", "--axis eps1=0:0.3:200")
        times = "once" if needed == 1 else "twice"
        raise InputError("--axis", f"must be given {times}", texts, f"E.g. {' '.join(examples[:needed])}.")
    return given


def load(study: Path | None, sets: list[str] | None, physical: bool = False) -> Study:
    """The study of a file with the values set over it, checked; say so if kernels have to be compiled."""
    from gearchaos.studyfile import load_study, parse_set

    loaded = load_study(study, parse_set(sets or []))
    tell_of_compiling()
    if physical and loaded.pair is None:
        file = None if study is None else str(study)
        raise InputError("--physical", "needs a study file with a [gearpair] table", file)
    return loaded


def in_units(dataset: xr.Dataset, loaded: Study, physical: bool) -> xr.Dataset:
    """A result in the units of the pair, if it is to be in physical ones."""
    if not physical or loaded.pair is None:
        return dataset
    from gearchaos.gearpair import physical as scaled

    return scaled(dataset, loaded.pair)


def _finish(kind: str, dataset: xr.Dataset, axes: tuple[Axis, ...], loaded: Study, target: _Target) -> None:
    """Write the files, then say what is in them."""
    dataset = in_units(dataset, loaded, target.physical)
    save(dataset, target.out)
    draw(dataset, target.plot)
    if target.json_out:
        files = {"out": str(target.out), "plot": None if target.plot is None else str(target.plot)}
        scanned = [{"name": a.name, "start": a.start, "stop": a.stop, "count": a.count} for a in axes]
        print_json({"study": kind, **files, "axes": scanned, **summary(kind, dataset)})
