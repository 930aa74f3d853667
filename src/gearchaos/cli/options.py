"""The application, and the options that its commands share.

This module imports only typer and rich; a command imports slow-loading modules when it runs.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import completion, startup
from gearchaos.cli.errors import Commands, announce_compilation, say
from gearchaos.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.axis import Axis
    from gearchaos.studyfile import LoadedStudy

app = typer.Typer(
    cls=Commands,
    help="What will this gear mesh do? Exact flow, verdicts and maps for gear pairs with backlash.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

# readable=False: typer does not check files; gearchaos does, with its own error messages
StudyPath = Annotated[Path | None, typer.Argument(metavar="STUDY", help="Study file, TOML.", readable=False)]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="Set a value over the study file; may be repeated.",
                 autocompletion=completion.values),
]
AxisTexts = Annotated[
    list[str] | None,
    typer.Option("--axis", metavar="NAME=START:STOP:COUNT", help="E.g. eps1=0:0.3:400; first x, then y.",
                 autocompletion=completion.axes),
]
Starts = Annotated[
    list[str] | None,
    typer.Option("--start", metavar="NAME=VALUE", help="An initial value; may be repeated.",
                 autocompletion=completion.starts),
]
StartsPerCell = Annotated[
    int | None, typer.Option("--starts", help="Number of initial states in each cell, to find all its motions.")
]
Refine = Annotated[
    int | None,
    typer.Option("--refine", metavar="N", help="Every N-th row and column; more cells only where neighbours differ."),
]
_OUT = typer.Option("--out", metavar="FILE", help="File to write: NetCDF, or .csv for tables.", readable=False)
Out = Annotated[Path, _OUT]
OutIfWanted = Annotated[Path | None, _OUT]
Plot = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Picture as well: .png, .pdf or .svg.", readable=False)
]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")]
Physical = Annotated[bool, typer.Option("--physical", help="µm, mm/s, N, Hz; for a physical pair.")]


def main() -> None:
    """Entry point of the ``gearchaos`` command, in a process of its own."""
    startup.own_process = True
    if sys.stdout is not None:  # it may be closed
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    completion.join_words()
    app(prog_name="gearchaos")


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="With --version: packages, processor, kernel cache, for error reports.")
    ] = False,
    json_out: Annotated[bool, typer.Option("--json", help="With --version: as one JSON document.")] = False,
) -> None:
    """Options before the command."""
    if version:
        from gearchaos.cli.version import print_version

        print_version(verbose, json_out)
        raise typer.Exit()
    for option, given in {"--verbose": verbose, "--json": json_out}.items():
        if given:
            raise InputError(option, "needs --version before the command", True,
                             "Options of a command are given after its name.")
    if context.invoked_subcommand is None:
        context.fail("Missing command.")


def load(
    study: Path | None, sets: list[str] | None, physical: bool = False, axes: Iterable[Axis] = ()
) -> LoadedStudy:
    """The content of a study file with the values of ``--set``; also lets the user know when kernels are compiled.

    ``physical`` says that it must describe gears; ``axes`` are those of the command line.
    """
    startup.load_numba()
    loaded = read_study(study, sets, axes)
    announce_compilation()
    if physical and loaded.pair is None:
        file = None if study is None else str(study)
        raise InputError("--physical", "needs a study file with a table [gearpair] or [design]", file)
    return loaded


def read_study(study: Path | None, sets: list[str] | None, axes: Iterable[Axis] = ()) -> LoadedStudy:
    """The content of a study file with the values of ``--set``; prints the warnings of its design."""
    from gearchaos.studyfile import load_study, parse_set

    loaded = load_study(study, parse_set(sets or []), axes=axes)
    for text in loaded.warnings:
        say(f"warning: {text}")
    return loaded


def parse_axes(texts: list[str] | None) -> list[Axis]:
    """The axes of ``--axis``."""
    from gearchaos.studies.axis import parse_axis

    return [parse_axis(text, "--axis") for text in texts or []]


def study_axes(kind: str, loaded: LoadedStudy, given_axes: list[Axis]) -> dict[str, Axis]:
    """The axes by field of the study. Axes of the command line replace those of the study file with the same name.

    Raises `InputError` unless there are as many as the study has: one along a parameter, two over a plane, or none.
    """
    from gearchaos.studies.axis import axis_example
    from gearchaos.studies.registry import study_class

    names = study_class(kind).axis_fields
    from_file = [axis for name, axis in loaded.options_for(kind).items() if name in names]
    by_name = {a.name: a for a in given_axes}
    if len(given_axes) < len(names) and by_name.keys() <= {a.name for a in from_file}:
        given_axes = [by_name.get(a.name, a) for a in from_file]
    if not names and given_axes:
        raise InputError("--axis", f"must be left out for kind {kind!r}", sorted(by_name))
    if len(given_axes) != len(names):
        parameters = ("omega", "eps1") if loaded.gears is None else ("speed", "torque")
        suitable = ("z", "z_dot") if kind == "basins" else parameters
        examples = " ".join(f"--axis {axis_example(name)}" for name in suitable[: len(names)])
        raise InputError("--axis", f"must be given {'once' if len(names) == 1 else 'twice'}", sorted(by_name),
                         f"E.g. {examples}, or {' and '.join(names)} in [study].")
    return dict(zip(names, given_axes, strict=True))


def load_over(
    texts: list[str] | None, examples: Iterable[str], study: Path | None, sets: list[str] | None, physical: bool
) -> tuple[list[Axis], LoadedStudy]:
    """The ranges of ``--axis`` for a command that follows something along them, and the content of a study file.

    Raises `InputError` unless there are as many axes as ``examples``, the texts of which are shown to the user.
    """
    from gearchaos.studies.axis import as_range

    texts, examples = texts or [], list(examples)
    if len(texts) != len(examples):
        times = {1: "once", 2: "twice"}[len(examples)]
        raise InputError("--axis", f"must be given {times}", texts, f"E.g. --axis {' --axis '.join(examples)}.")
    axes = [as_range(text, "--axis") for text in texts]
    for text, example in zip(texts, examples, strict=True):
        if text.count(":") > example.count(":"):
            say(f"warning: the number of values in {text} has no effect: points are as close as the curve needs them")
    return axes, load(study, sets, physical, axes)


def given(**options: Any) -> dict[str, Any]:
    """The options that are given on the command line, i.e. are not None."""
    return {name: value for name, value in options.items() if value is not None}


def in_units(dataset: xr.Dataset, loaded: LoadedStudy, physical: bool) -> xr.Dataset:
    """A result, with ``physical`` in the units of the gear pair."""
    if not physical or loaded.pair is None:
        return dataset
    from gearchaos.gears.results import physical as scaled

    return scaled(dataset, loaded.gears)


def initial_values(texts: list[str]) -> dict[str, float] | None:
    """Initial values by name; None if there are none."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise InputError("--start", "must read NAME=VALUE", text, "E.g. --start z=1.2.")
    return out or None
