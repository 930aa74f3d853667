"""The command for decisions: which speeds gears are to avoid over the torque, which to use, and what it rests on."""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.avoided import (
    REVERSED,
    Factor,
    LoadChange,
    RootStress,
    Wide,
    criteria,
    print_avoided,
    say_lines,
)
from gearchaos.cli.errors import say, warn
from gearchaos.cli.gears import GearsPath
from gearchaos.cli.options import TORQUES, Json, Plot, Sets, app, operating_point, read_study
from gearchaos.cli.output import (
    DPI,
    PLOT_SUFFIXES,
    check_output,
    print_json,
    say_written,
    write_figure,
)
from gearchaos.cli.process import load_kernels
from gearchaos.errors import InputError
from gearchaos.files import write_bytes

if TYPE_CHECKING:
    from gearchaos.datasheet.report import Report
    from gearchaos.dynamics import Classification
    from gearchaos.studies.core.axis import Axis

_MOST_TABLES, _MOST_JUMPS = 6, 6
"""Torques of which the ranges are printed, and jumps."""

Speeds = Annotated[
    str, typer.Option(metavar="A:B[:N]", help="Speeds of wheel 1, rpm; begins with N of them, by default 40, and adds "
                      "others where needed.")
]
Torques = Annotated[
    list[str] | None,
    typer.Option("--torque", metavar=TORQUES,
                 help="At wheel 1, in N m or with a unit; by default that of the gears."),
]
Page = Annotated[Path | None, typer.Option("--out", metavar="FILE.html", help="Report as a page.", readable=False)]
Print = Annotated[Path | None, typer.Option("--pdf", metavar="FILE.pdf", help="Report for printing.", readable=False)]
Other = Annotated[
    Path | None,
    typer.Option("--against", metavar="OTHER", readable=False,
                 help="Other gears, assessed likewise; a --set of the torque holds for both."),
]


@app.command(rich_help_panel="Gears")
def assess(
    gears: GearsPath, speed: Speeds, torque: Torques = None, sets: Sets = None, factor: Factor = None,
    starts: Annotated[
        int | None,
        typer.Option(metavar="N", help="States after a load change at each speed; by default 128, 64 or 32, fewer for "
                     "more torques and speeds."),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(metavar="SHARE", help="Largest step between speeds with such states, as a share of the speed; by "
                     "default 0.0025, 0.01 or 0.025."),
    ] = None,
    seed: Annotated[int, typer.Option(metavar="S", help="Of the random initial states.")] = 0,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Assess again with each assumed input varied.")
    ] = False,
    improve: Annotated[
        bool, typer.Option("--improve", help="Assess again with each input that a designer can change.")
    ] = False,
    root_stress: RootStress = None, load_change: LoadChange = REVERSED, wide: Wide = False,
    every: Annotated[bool, typer.Option("--all", help="Also rows of ranges that are narrow or that few load changes "
                                        "lead to.")] = False,
    out: Page = None, pdf: Print = None, plot: Plot = None, against: Other = None, json_out: Json = False,
) -> None:
    """Decide over speed and torque: which speeds to avoid, which to use, and with what margin."""
    check_output("--out", out, (".html",))
    check_output("--pdf", pdf, (".pdf",))
    check_output("--plot", plot, PLOT_SUFFIXES)
    from gearchaos.datasheet.report import Report
    from gearchaos.gears.operation.operating import is_design
    from gearchaos.studies.core.operating_ranges import range_of_speeds, torques_of
    from gearchaos.studies.speeds.assess import assess as assessed

    axis, torques = range_of_speeds(speed, "--speed"), None if torque is None else torques_of(torque, "--torque")
    for text in operating_point(sets):
        name = text.partition("=")[0]
        if name == "speed" or torques is not None:
            raise InputError("--set", f"must leave out {name}", text, f"It is that of --{name}.")
    described = [_described(gears, sets, axis, torques)]
    if against is not None:
        described.append(_described(against, operating_point(sets), axis, torques))
    for option, given in (("--sensitivity", sensitivity), ("--improve", improve)):
        if given and not is_design(described[0][0]):
            raise InputError(option, "needs a [design]", str(gears), "Its inputs are varied by their names.")
    load_kernels()
    options: dict[str, Any] = {
        **criteria(factor, root_stress, load_change, wide), "starts": starts, "spacing": spacing, "seed": seed,
        "progress": True}
    names = [""] if against is None else [gears.name, against.name]
    begun = time.monotonic()
    reports = [Report(assessed(each, axis, torques, settings=settings, **options), name)
               for name, (each, settings) in zip(names, described, strict=True)]
    taken = (time.monotonic() - begun) / len(reports)
    for number, report in enumerate(() if json_out else reports):  # before changes, which take as long many times
        print(end="\n" * (number > 0))
        _print(report, every)
    if sensitivity or improve:
        options["settings"] = described[0][1]
        reports[0] = _with_changes(reports[0], (sensitivity, improve), axis, torques, options, taken)
        if not json_out:
            from gearchaos.datasheet.report import changed_in_words

            print()
            for words, changes in (("Input", reports[0].sensitivity), ("Change", reports[0].improvements)):
                say_lines(*(f"{words}: {changed_in_words(each, reports[0].found)}" for each in changes or ()))
    _write(reports, out, pdf, plot)
    if json_out:
        document = reports[0].document()
        print_json(document if against is None else document | {"against": reports[1].document()})


def _described(
    path: Path, sets: list[str] | None, axis: Axis, torques: tuple[float, ...] | None
) -> tuple[Any, Classification | None]:
    """The gears of a file, a design or a model, and its settings of the classification, if it has some."""
    from gearchaos.dynamics import Classification
    from gearchaos.gears.operation.operating import is_design
    from gearchaos.studies.core.axis import Axis
    from gearchaos.studyfile import load_design, load_study, parse_set

    at_start = [] if torques is None else [Axis("torque", torques[0], torques[0], 1)]
    loaded = load_study(path, parse_set(sets or []), axes=[axis, *at_start])
    if loaded.gears is None:
        raise InputError("study file", "must have a table [design], [gearpair] or [train]", str(path))
    settings = replace(Classification(), **loaded.classification) if loaded.classification else None
    if not is_design(loaded.design or loaded.gears):
        return read_study(path, sets, [axis, *at_start]).model, settings
    design = load_design(path, parse_set(sets or []))
    ends = [design] if torques is None else [design.at(torque=each) for each in {min(torques): 0, max(torques): 0}]
    for text in dict.fromkeys(text for each in ends for text in each.with_like_teeth().warnings):
        warn(text)
    return design, settings


def _with_changes(
    report: Report, asked: tuple[bool, bool], axis: Axis, torques: tuple[float, ...] | None, options: dict[str, Any],
    seconds: float,
) -> Report:
    """The report with the assessments of changed designs that are asked for: of what is assumed, of what can be better.

    ``seconds`` is how long one assessment took.
    """
    from gearchaos.studies.speeds.changed_designs import assess_changes, assumptions, improvements

    design = report.found.gears.at(torque=report.found.at[-1].torque)
    changes = [list(of(design)) if given else None
               for given, of in zip(asked, (assumptions, improvements), strict=True)]
    distinct = {(each.name, each.value): each for group in changes for each in group or ()}  # some are in both
    say(f"{len(distinct)} more assessments, about {len(distinct) * seconds:.0f} s")
    results = assess_changes(design, list(distinct.values()), axis, torques, **options)
    assessed = dict(zip(distinct, results, strict=True))
    found = [None if group is None else [assessed[each.name, each.value] for each in group] for group in changes]
    return replace(report, sensitivity=found[0], improvements=found[1])


def _write(reports: list[Report], out: Path | None, pdf: Path | None, plot: Path | None) -> None:
    """Write the page, the PDF and the picture, those that are asked for."""
    if out is not None:
        from gearchaos.datasheet.report import report_html

        write_bytes(out, report_html(*reports).encode())
    if pdf is not None:
        from gearchaos.datasheet.printed import report_pdf

        write_bytes(pdf, report_pdf(*reports))
    if plot is not None:
        import matplotlib

        matplotlib.use("Agg")
        from gearchaos.plot import assessment

        figure = assessment(reports[0].found).get_figure(root=True)
        assert figure is not None
        write_figure(figure, plot, dpi=DPI, bbox_inches="tight")
    say_written(*(path for path in (out, pdf) if path is not None))


def _print(report: Report, every: bool) -> None:
    """Print what to do, the ranges to avoid at each torque, the jumps, and what the answer rests on."""
    from gearchaos.datasheet import assessment as in_words

    found = report.found
    first, *others = in_words.decision(found)
    say_lines(f"{f'{report.name}: ' * bool(report.name)}{first}", *others, in_words.worst(found))
    for at in found.at if len(found.at) <= _MOST_TABLES else ():
        part = in_words.avoided(at, found.gears, every)
        print(f"\n{part.heading}")
        print_avoided(part)
        if len(found.at) > 1:
            say_lines(f"usable: {', '.join(in_words.usable_in_words(at.usable, found.speeds)) or 'nothing'}")
    print()
    if len(found.at) > _MOST_TABLES:
        say_lines(*(f"keep out of {text}" for text in in_words.keep_out(found)),
                  f"{len(found.avoid)} ranges to avoid at {len(found.at)} torques: --json or --out has all")
    met = in_words.jumps(found)
    say_lines(*met[:_MOST_JUMPS], *([f"and {len(met) - _MOST_JUMPS} more jumps"] if len(met) > _MOST_JUMPS else []),
              in_words.sentence(in_words.tried_in_words(found)).removesuffix("."),
              *(f"Assumed: {text}" for text in found.assumptions[:-1]))
    sys.stdout.flush()
