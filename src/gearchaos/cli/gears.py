"""The commands for given gears: the datasheet of a design, and the map of motions over speed and torque."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearchaos.cli.avoided import REVERSED, Factor, LoadChange, RootStress, Wide, criteria, states_after
from gearchaos.cli.errors import warn
from gearchaos.cli.options import TORQUES, Json, Out, Plot, Refine, Sets, StartsPerCell, StatesAfter, app, given, load
from gearchaos.cli.output import PLOT_SUFFIXES, check_files, check_output, draw, print_json, save, say_written
from gearchaos.cli.process import load_kernels
from gearchaos.errors import InputError
from gearchaos.files import write_bytes

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign

GearsPath = Annotated[
    Path, typer.Argument(metavar="GEARS", help="File with \\[design], \\[gearpair] or \\[train], TOML.", readable=False)
]
DesignPath = Annotated[Path, typer.Argument(metavar="DESIGN", help="File with \\[design], TOML.", readable=False)]
Page = Annotated[
    Path | None, typer.Option("--out", metavar="FILE.html", help="Page with drawing and curves.", readable=False)
]
Speeds = Annotated[
    str | None,
    typer.Option(metavar="A:B[:N]",
                 help="Speeds of wheel 1, rpm; begins with N of them, by default 40, and adds others where needed. "
                 "Without it 10 to 150 % of the main resonance, up to 60 m/s."),
]
Torques = Annotated[
    list[str] | None,
    typer.Option("--torque", metavar=TORQUES,
                 help="At wheel 1, in N m or with a unit; an answer for each. By default that of the design."),
]
FactorAlone = Annotated[
    bool, typer.Option("--factor-alone", help="With --factor: its speeds alone, whether the teeth separate or not.")
]
FactorPlot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", readable=False,
                 help="Picture of the dynamic factor along the speed, of one torque: .png, .pdf or .svg."),
]
All = Annotated[bool, typer.Option("--all", help="Also every range to avoid, every quantity with its formula and "
                                   "source, and every warning.")]


@app.command(rich_help_panel="Gears")
def gear(
    design: DesignPath, sets: Sets = None, out: Page = None, speed: Speeds = None, torque: Torques = None,
    plot: FactorPlot = None, factor: Factor = None, factor_alone: FactorAlone = False, root_stress: RootStress = None,
    load_change: LoadChange = REVERSED, wide: Wide = False, every: All = False, json_out: Json = False,
) -> None:
    """Show which speeds a gear pair is to avoid, and with --all every quantity that follows from its drawing."""
    check_output("--out", out, (".html",))
    check_output("--plot", plot, PLOT_SUFFIXES)
    if factor is not None and not 0 < factor < math.inf:
        raise InputError("--factor", "must be a finite number greater than 0", factor)
    if factor_alone and factor is None:
        raise InputError("--factor-alone", "needs --factor", True, "It lists the speeds with a higher dynamic factor.")
    from gearchaos.studies.core.operating_ranges import range_of_speeds, torques_of

    torques = (None,) if torque is None else torques_of(torque, "--torque")
    if plot is not None and len(torques) > 1:
        raise InputError("--plot", "needs a single --torque", list(torques),
                         "The page of --out has a picture for each.")
    from gearchaos.datasheet.answer import LEFT_OUT, DesignAnswer, default_speeds
    from gearchaos.studies.speeds.speeds_to_avoid import speeds_to_avoid

    axis = None if speed is None else range_of_speeds(speed, "--speed")
    options = criteria(factor, root_stress, load_change, wide)
    asked = wide or load_change != REVERSED or any(
        option is not None for option in (axis, plot, factor, root_stress))
    scanned = asked or out is not None or not json_out
    if scanned:
        load_kernels()
    answers = []
    for each in [_design(design, sets, torque) for torque in torques]:  # all of them, before any work
        speeds = problem = None
        try:
            if scanned:
                speeds = speeds_to_avoid(each, axis or default_speeds(each), separation=not factor_alone, progress=True,
                                         **options)
        except InputError as error:
            problem = error
        answers.append(DesignAnswer.of(each, speeds, problem))
    # what was left out of a design is a problem only if speeds were asked for: the answer names it otherwise
    problems = [p for p in (each.problem for each in answers) if p is not None and (asked or p.rule != LEFT_OUT)]
    if out is not None:
        from gearchaos.datasheet.page import sheet_html

        write_bytes(out, sheet_html(answers).encode())
        say_written(out)
    if plot is not None and answers[0].speeds is not None:
        draw(answers[0].speeds.dataset, plot)
    if json_out:
        for text in dict.fromkeys(t for each in answers for t in each.notes if t in each.design.warnings):
            warn(text)
        documents = [each.document() for each in answers]
        print_json(documents[0] if len(documents) == 1 else {"torques": documents})
    else:
        from gearchaos.cli.datasheets import print_answers, print_datasheets

        print_answers(answers, every, warn=every or not problems)
        if every:
            print_datasheets(answers)
    for problem in problems:
        raise problem


def _design(path: Path, sets: list[str] | None, torque: float | None) -> GearDesign:
    """The design of a file with the values of ``--set`` and ``--torque``."""
    from gearchaos.studyfile import load_design, parse_set

    values = parse_set(sets or [])
    if torque is not None:
        values.pop("torque", None)
        values["torque"] = torque  # last, so that it replaces operation.torque too
    return load_design(path, values)


@app.command("map", rich_help_panel="Gears")
def operating_map(
    gears: GearsPath,
    speed: Annotated[
        str, typer.Option(metavar="START:STOP:COUNT", help="Speeds of wheel 1 in rpm, or with units: 500:4500:200.")
    ],
    torque: Annotated[
        str, typer.Option(metavar="START:STOP:COUNT", help="Torques at wheel 1 in N m, or with units: 20:400:150.")
    ],
    out: Out,
    sets: Sets = None,
    starts: StartsPerCell = None,
    load_change: StatesAfter = None,
    wide: Wide = False,
    refine: Refine = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Map where the teeth of given gears separate, and their motions, over speed and torque in rpm and N m."""
    check_files(out, plot)
    from gearchaos.cli.summaries import Found, report
    from gearchaos.studies.core.operating_ranges import operating_axis
    from gearchaos.studies.maps.zones import Zones
    from gearchaos.studies.speeds.speed_and_torque import checked_operating_model, in_operating_units

    change = states_after(load_change, starts)
    axes = {"x": operating_axis("speed", speed, "--speed"), "y": operating_axis("torque", torque, "--torque")}
    loaded = load(gears, sets, physical=True, axes=axes.values())
    study = loaded.study(Zones, **axes, **given(
        starts=starts, load_change=change, wide=wide or None, refine=refine))
    dataset = in_operating_units(study.run(progress=True), checked_operating_model(study.model))
    save(dataset, out)
    report(Found("map", dataset, loaded, False, tuple(axes.values()), out, plot), "map", json_out)
