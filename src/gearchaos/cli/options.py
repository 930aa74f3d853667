"""The application, and the options that its commands share.

This module imports only typer and rich; a command imports slow-loading modules when it runs.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos import catalogue
from gearchaos.cli import completion
from gearchaos.cli.errors import Commands, say, warn
from gearchaos.cli.process import load_kernels
from gearchaos.errors import InputError
from gearchaos.formats import help_words
from gearchaos.quantities import OPERATION

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.core.axis import Axis
    from gearchaos.studyfile import LoadedStudy

RANGE = 2
"""Number of values of an axis of which only the ends count, as `gearchaos.studies.core.options` says."""

TORQUES = "T1,T2,…|A:B:N"
"""Several torques in one text, as `gearchaos.studies.core.operating_ranges` reads it."""

app = typer.Typer(cls=Commands,
                  help="What will this gear mesh do? Exact flow, verdicts and maps for gear pairs with backlash.",
                  no_args_is_help=True, pretty_exceptions_enable=False)

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


def study_option(name: str, option: dict[str, Any]) -> Any:
    """The type of an option of a study, from its entry in the catalogue.

    It is None if it is left out: the study file or the study itself says its value then.
    """
    kind, choices = option["type"], option.get("choices")
    completed = completion.choices(*choices) if choices else _COMPLETED.get(kind)
    repeated = " May be repeated." * (kind == "values")
    described = typer.Option(
        f"--{name.replace('_', '-')}", help=option["help"] + repeated, autocompletion=completed,
        metavar=option.get("metavar") or _METAVARS.get(kind))
    return Annotated[_TYPES[kind] | None, described]


_TYPES: dict[str, Any] = {
    "int": int, "float": float, "bool": bool, "str": str, "axis": str, "values": list[str],
    "tuple[int, int]": tuple[int, int],
}
_METAVARS = {"axis": "NAME=START:STOP:COUNT", "values": "NAME=VALUE"}
_COMPLETED = {"axis": completion.axes, "values": completion.starts}

_OF_ZONES = catalogue.STUDIES["zones"]["options"]
StartsPerCell = Annotated[int | None, typer.Option("--starts", help=_OF_ZONES["starts"]["help"])]
StatesAfter = Annotated[str | None, typer.Option("--load-change", metavar="LAMBDA|none",
                                                 help=_OF_ZONES["load_change"]["help"])]
Refine = Annotated[int | None, typer.Option("--refine", metavar="N", help=_OF_ZONES["refine"]["help"])]
_OUT = typer.Option("--out", metavar="FILE", help=f"File to write: {help_words()}.", readable=False)
Out = Annotated[Path, _OUT]
OutIfWanted = Annotated[Path | None, _OUT]
SpectrumOut = Annotated[Path | None, typer.Option(
    "--out", metavar="FILE", help=f"File to write: {help_words(spectra=True)}.",
    readable=False)]
Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Picture as well: .png, .pdf or .svg.", readable=False)]
Json = Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")]
Physical = Annotated[bool, typer.Option("--physical", help="µm, mm/s, N, Hz; for gears given with units.")]


def axes_option(counts: Sequence[int | None]) -> Any:
    """The type of ``--axis``; ``counts`` as in `parse_axes`."""
    if None in counts:
        return AxisTexts
    metavar, words = "NAME=START:STOP", ("The parameter and its range." if len(counts) == 1 else
                                         "A parameter and its range; first x, then y.")
    if any(count > RANGE for count in counts if count):
        metavar, left_out = f"{metavar}:COUNT", " and ".join(map(str, counts))
        words = f"First x, then y; COUNT places, {left_out} if left out."
    return Annotated[
        list[str] | None, typer.Option("--axis", metavar=metavar, help=words, autocompletion=completion.ranges)]


def load(study: Path | None, sets: list[str] | None, physical: bool = False, axes: Iterable[Axis] = ()) -> LoadedStudy:
    """The content of a study file with the values of ``--set``; also lets the user know when kernels are compiled.

    ``physical`` says that it must describe gears; ``axes`` are those of the command line.
    """
    load_kernels()
    loaded = read_study(study, sets, axes)
    if physical and loaded.pair is None:
        file = None if study is None else str(study)
        raise InputError("--physical", "needs a study file with a table [gearpair], [design] or [train]", file)
    return loaded


def read_study(study: Path | None, sets: list[str] | None, axes: Iterable[Axis] = ()) -> LoadedStudy:
    """The content of a study file with the values of ``--set``; prints the warnings of its gears, and of a train as
    what it is computed, its coordinates and its common period, and what is assumed."""
    from gearchaos.studyfile import load_study, parse_set

    loaded = load_study(study, parse_set(sets or []), axes=axes)
    for text in loaded.warnings:
        warn(text)
    if words := loaded.model.in_words:
        say(textwrap.fill(words, 80, subsequent_indent="  ", break_on_hyphens=False))
    if assumed := loaded.model.assumptions:
        say(textwrap.fill(f"assumed: {'; '.join(assumed)}", 80, subsequent_indent="  ", break_on_hyphens=False))
    return loaded


def operating_point(sets: list[str] | None) -> list[str]:
    """Those values of ``--set`` that are speed or torque of gears, by names that all kinds of gears have."""
    found = []
    for text in sets or []:
        owner, _, name = text.partition("=")[0].strip().rpartition(".")
        common = "torque" if (owner, name) == ("gearpair", "M10") else name
        if common in {q.name for q in OPERATION} and owner in ("", "operation", "gearpair"):
            found.append(f"{common}={text.partition('=')[2]}")
    return found


def parse_axes(texts: list[str] | None, counts: Sequence[int | None] = ()) -> list[Axis]:
    """The axes of ``--axis``.

    ``counts`` are the numbers of values of those of which the text has none; None where it must have one. Where only
    the ends of an axis count, a number that is given is named as of no effect.
    """
    from gearchaos.studies.core.axis import as_range, parse_axis

    found = []
    for number, text in enumerate(texts or []):
        count = counts[min(number, len(counts) - 1)] if counts else None
        found.append(parse_axis(text, "--axis") if count is None else as_range(text, "--axis", count))
        if count == RANGE and text.count(":") > 1:
            warn(f"the number of values in {text} has no effect: points are as close as the curve needs them")
    return found


def study_axes(kind: str, loaded: LoadedStudy, given_axes: list[Axis]) -> dict[str, Axis]:
    """The axes by field of the study. Axes of the command line replace those of the study file with the same name.

    Those of another study in the file are taken, too: of a map for a curve or a skeleton over its plane, but initial
    values of basins for nothing else.
    Raises `InputError` unless there are as many as the study has: one along a parameter, two over a plane, or none.
    """
    from gearchaos.studies.core.axis import axis_example
    from gearchaos.studies.core.registry import study_class

    names = study_class(kind).axis_fields
    others = loaded.options if "basins" not in (kind, loaded.kind) else {}
    from_file = [axis for name, axis in (loaded.options_for(kind) or others).items() if name in names]
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


def given(**options: Any) -> dict[str, Any]:
    """The options that are given on the command line, i.e. are not None."""
    return {name: value for name, value in options.items() if value is not None}


def in_units(dataset: xr.Dataset, loaded: LoadedStudy, physical: bool) -> xr.Dataset:
    """A result, with ``physical`` in the units of the gear pair."""
    if not physical or loaded.pair is None:
        return dataset
    from gearchaos.gears.operation.results import physical as scaled

    return scaled(dataset, loaded.gears)


def initial_values(texts: list[str], option: str = "--start") -> dict[str, float]:
    """Values by name from texts NAME=VALUE."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            equals = ""
        if not equals:
            example = "z=1.2" if option == "--start" else "eps1=1e-6"
            raise InputError(option, "must read NAME=VALUE", text, f"E.g. {option} {example}.")
    return out
