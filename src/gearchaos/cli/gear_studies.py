"""The commands of studies of gears with options of their own: run-ups, order spectra, fits, tolerances."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from gearchaos import catalogue
from gearchaos.cli import options
from gearchaos.cli.avoided import LoadChange, Wide, change_of
from gearchaos.cli.errors import say
from gearchaos.cli.gears import GearsPath
from gearchaos.cli.options import TORQUES, Json, OutIfWanted, Plot, Sets, StudyPath
from gearchaos.cli.output import check_files, check_output, save
from gearchaos.errors import InputError
from gearchaos.formats import UFF

Column = Annotated[
    list[str] | None, typer.Option(metavar="NAME=HEADER", help="A column of the table and its unit: "
                                   "amplitude=\"Force [N]\"; may be repeated.")
]
_OF_FIT = catalogue.STUDIES["fit"]["options"]
_OF_SCATTER = catalogue.STUDIES["scatter"]["options"]
_OF_RUNUP = catalogue.STUDIES["runup"]["options"]
_OF_ORDERS = catalogue.STUDIES["orders"]["options"]


def runup(
    gears: GearsPath,
    sets: Sets = None,
    speed: Annotated[
        str | None, typer.Option(metavar="START:STOP", help="First and last speed of wheel 1, rpm, or with units: "
                                 "500:6000; by default that of the file.")
    ] = None,
    duration: Annotated[
        str | None, typer.Option(metavar="TIME", help="Of the run-up, in s or with a unit; 60 s by default.")
    ] = None,
    down: Annotated[bool, typer.Option("--down", help="Run down again as well, in the same time.")] = False,
    torque: Annotated[
        str | None, typer.Option(metavar="TORQUE|TABLE", help="At wheel 1, in N m or with a unit, or a table over time "
                                 "or speed, .csv; by default that given.")
    ] = None,
    mesh: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a train: the mesh whose force it is; by default the first.")
    ] = None,
    events: Annotated[bool, typer.Option("--events", help=_OF_RUNUP["events"]["help"])] = False,
    out: options.SpectrumOut = None,
    plot: Plot = None,
    wav: Annotated[
        Path | None, typer.Option(metavar="FILE.wav", help="The mesh force as sound, full scale its largest deviation.",
                                  readable=False)
    ] = None,
    uff: Annotated[
        Path | None, typer.Option(metavar="FILE.uff", readable=False,
                                  help="The mesh force and the speed over the time, for programs of test benches.")
    ] = None,
    against: Annotated[
        Path | None, typer.Option(metavar="MEASURED", readable=False, help="A measured run-up: speed, order and "
                                  "amplitude, or time, speed and force, .csv or .uff.")
    ] = None,
    column: Column = None,
    sampling_rate: Annotated[
        str | None, typer.Option(metavar="FREQUENCY", help="Samples a second of a measured signal without a time: "
                                 "25.6 kHz.")
    ] = None,
    json_out: Json = False,
) -> None:
    """Run gears up through a range of speeds: where the motion jumps, its peaks, and the orders of the mesh force."""
    check_files(out, plot, spectra=True)
    for option, path, suffixes in (("--wav", wav, (".wav",)), ("--uff", uff, UFF.suffixes)):
        check_output(option, path, suffixes)
    if uff is not None:
        UFF.check("--uff")
    for option, path, others in (("--out", out, (against,)), ("--uff", uff, (out, against))):
        if path is not None and path.resolve() in {each.resolve() for each in others if each is not None}:
            raise InputError(option, "must be a file of its own", str(path))
    from gearchaos.cli.summaries import Found, report
    from gearchaos.gears.io.units import DURATION, to_si
    from gearchaos.studies.core.operating_ranges import operating_axis
    from gearchaos.studies.runup.runup import RunUp
    from gearchaos.studies.runup.torque_profile import largest_torque, read_profile
    from gearchaos.studyfile import parse_value

    if speed is not None and speed.count(":") != 1:
        raise InputError("--speed", "must read START:STOP", speed, "E.g. 500:6000.")
    axes = [] if speed is None else [operating_axis("speed", speed, "--speed", options.RANGE)]
    seconds = None if duration is None else to_si("--duration", parse_value(duration), DURATION)
    profile = None
    if torque is not None and (Path(torque).is_file() or not re.match(r"\s*[-+]?\.?\d", torque)):
        profile, notes = read_profile(torque)
        for note in notes:
            say(note)
        torque = repr(largest_torque(profile))
    chosen = [*(sets or []), *([] if torque is None else [f"torque={torque}"])]
    loaded = options.load(gears, chosen, physical=True, axes=axes)
    if not axes and "speed" not in loaded.options_for("runup"):
        raise InputError("--speed", "must be given", None, "E.g. --speed 500:6000, in rpm.")
    given = options.given(duration=seconds, mesh=mesh, down=down or None, torque=profile, events=events or None,
                          **({"speed": axes[0]} if axes else {}))
    study = loaded.study(RunUp, **given, signal=wav is not None or uff is not None)
    if wav is not None:
        from gearchaos.sound import check_sound

        check_sound((1 + study.down) * study.duration)
    for option, value in {"--column": column, "--sampling-rate": sampling_rate}.items():
        if against is None and value:
            raise InputError(option, "needs --against", value)
    bench = None
    if against is not None:
        from gearchaos.studies.runup.measured_runup import read_measured_runup

        headers = dict(text.partition("=")[::2] for text in column or [])
        bench = read_measured_runup(against, study.mesh_order, (study.speed.start, study.speed.stop), headers or None,
                                    None if sampling_rate is None else parse_value(sampling_rate))
        for note in bench.notes:
            say(note)
    journal = None if out is None or study.signal else Path(f"{out}.part")  # the signal is not kept
    found = Found("runup", study.run(progress=True, journal=journal), loaded, True, study.axes, out, plot)
    save(found.dataset.drop_dims("instant", errors="ignore"), out)
    if journal is not None:
        journal.unlink(missing_ok=True)
    if wav is not None:
        from gearchaos.sound import write_wav

        largest = write_wav(found.dataset, wav)
        say(f"wrote {wav}: the mesh force less its mean, full scale {largest:.4g} N")
    if uff is not None:
        save(found.dataset.drop_vars("order_force"), uff)
    if bench is not None:
        found = replace(found, over=bench.beside(found.dataset))
    report(found, "runup", json_out)


def orders(
    gears: GearsPath,
    sets: Sets = None,
    mesh: Annotated[
        str | None, typer.Option(metavar="NAME", help="Of a train: the mesh that is looked at; by default the first.")
    ] = None,
    of: options.study_option("of", _OF_ORDERS["quantity"]) = None,  # type: ignore[valid-type]
    against: Annotated[
        Path | None, typer.Option(metavar="OTHER.toml", readable=False, help="Compare with gears of the same teeth and "
                                  "speed; --set of speed or torque holds for both, any other for the first.")
    ] = None,
    rms: Annotated[bool, typer.Option("--rms", help=_OF_ORDERS["rms"]["help"])] = False,
    out: options.SpectrumOut = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Show the order spectrum of a steady motion: mesh harmonics, their sidebands, and whose they are."""
    check_files(out, plot, spectra=True)
    loaded = options.load(gears, sets, physical=True)
    other = None if against is None else options.load(against, options.operating_point(sets), physical=True).model
    from gearchaos.cli.summaries import Found, report
    from gearchaos.studies.vibration.orders import Orders

    given = options.given(mesh=mesh, quantity=of, against=other, rms=rms or None)
    found = Found("orders", loaded.study(Orders, **given).run(progress=True), loaded, True, (), out, plot)
    save(found.dataset, out)
    report(found, "orders", json_out)


def fit(
    gears: GearsPath,
    measured: Annotated[
        Path, typer.Argument(metavar="MEASURED", help="Table with speed, order and amplitude, .csv, or "
                             "such spectra, .uff.", readable=False)
    ],
    vary: Annotated[
        list[str] | None, typer.Option(metavar="NAME=LOW:HIGH", help="A parameter and its bounds: damping_ratio="
                                       "0.02:0.15, backlash=0.05:0.25 mm, error1=1:20 um; may be repeated.")
    ] = None,
    of: options.study_option("of", _OF_FIT["quantity"]) = None,  # type: ignore[valid-type]
    uncertainty: Annotated[
        str | None, typer.Option(metavar="SIZE", help="Standard deviation of an amplitude: 5 %, 2 N.")
    ] = None,
    column: Column = None,
    starts: options.study_option("starts", _OF_FIT["starts"]) = None,  # type: ignore[valid-type]
    seed: options.study_option("seed", _OF_FIT["seed"]) = None,  # type: ignore[valid-type]
    sets: Sets = None,
    out: OutIfWanted = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Fit damping, backlash and transmission error of a gear pair to measured orders over the speed."""
    check_files(out, plot)
    from gearchaos.cli.summaries import Found, report
    from gearchaos.studies.fit.fit import Fit

    chosen = dict(text.partition("=")[::2] for text in column or [])
    loaded = options.load(gears, sets, True, options.parse_axes(["speed=1000:1000:1"]))  # any: those measured count
    if not vary and "vary" not in loaded.options_for("fit"):
        raise InputError("--vary", "must be given", None, "E.g. --vary damping_ratio=0.02:0.15.")
    given = options.given(vary=vary, quantity=of, uncertainty=uncertainty, starts=starts, seed=seed,
                          columns=chosen or None)
    study = loaded.study(Fit, measured=str(measured), **given)
    for note in study.spectrum.notes:
        say(note)
    found = Found("fit", study.run(progress=True), loaded, True, (), out, plot)
    save(found.dataset, out)
    report(found, "fit", json_out)


def scatter(
    study: StudyPath = None,
    vary: Annotated[
        list[str] | None, typer.Option(metavar="NAME=DISTRIBUTION", help="An uncertain input: backlash=0.10:0.25 mm, "
                                       "damping_ratio=0.05±0.01, quality.grade=6:8; may be repeated.")
    ] = None,
    speed: Annotated[
        str | None, typer.Option(metavar="START:STOP:COUNT", help="Speeds of wheel 1, rpm, or with units; of a "
                                 "dimensionless model omega=START:STOP:COUNT.")
    ] = None,
    torque: Annotated[
        list[str] | None, typer.Option(metavar=TORQUES, help="At wheel 1, in N m or with a unit; by default that "
                                       "given.")
    ] = None,
    samples: options.study_option("samples", _OF_SCATTER["samples"]) = None,  # type: ignore[valid-type]
    factor: options.study_option("factor", _OF_SCATTER["factor"]) = None,  # type: ignore[valid-type]
    start: options.study_option("start", _OF_SCATTER["start"]) = None,  # type: ignore[valid-type]
    load_change: LoadChange = None,
    wide: Wide = False,
    indices: Annotated[bool | None, typer.Option("--indices/--no-indices", help=_OF_SCATTER["indices"]["help"])] = None,
    correlation: Annotated[
        list[str] | None, typer.Option(metavar="NAME,NAME=VALUE", help="Of two inputs: backlash,damping_ratio=0.5; "
                                       "may be repeated.")
    ] = None,
    seed: options.study_option("seed", _OF_SCATTER["seed"]) = None,  # type: ignore[valid-type]
    budget: options.study_option("budget", _OF_SCATTER["budget"]) = None,  # type: ignore[valid-type]
    sets: Sets = None,
    out: OutIfWanted = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Say how likely contact is lost where inputs are uncertain, which input matters, and what tightening it brings."""
    check_files(out, plot)
    from gearchaos.cli.summaries import Found, report
    from gearchaos.studies.core.axis import Axis
    from gearchaos.studies.core.operating_ranges import operating_axis, torques_of
    from gearchaos.studies.uncertainty.scatter import Scatter

    torques = None if torque is None else torques_of(torque, "--torque")
    along = "omega" if speed is not None and speed.partition("=")[0].strip() == "omega" else "speed"
    axes = [] if speed is None else [operating_axis(along, speed, "--speed")]
    axes += [Axis("torque", each, each, 1) for each in torques or ()]
    loaded = options.load(study, sets, axes=axes)
    of_file = loaded.options_for("scatter")
    if speed is None and "speed" not in of_file:
        raise InputError("--speed", "must be given", None, "E.g. --speed 500:6000:60.")
    given = options.given(
        vary=vary or (None if "vary" in of_file else []), torque=torques, samples=samples, factor=factor, start=start,
        indices=indices, seed=seed, budget=budget, wide=wide or None,
        correlations=None if not correlation else [_correlation(text) for text in correlation],
        **({} if speed is None else {"speed": axes[0]}))
    if load_change is not None:
        given["load_change"] = change_of(load_change)
    chosen = loaded.study(Scatter, **given)
    if given.get("vary") == []:
        say(f"varied, since --vary is left out: {'; '.join(chosen.vary)}")
    found = Found("scatter", chosen.run(progress=True), loaded, False, chosen.axes, out, plot)
    save(found.dataset, out)
    report(found, "scatter", json_out)


def _correlation(text: str) -> tuple[str, str, float]:
    """A correlation of two inputs from a text NAME,NAME=VALUE."""
    names, _, value = text.partition("=")
    first, _, second = (part.strip() for part in names.partition(","))
    try:
        return first, second, float(value)
    except ValueError:
        raise InputError("--correlation", "must read NAME,NAME=VALUE", text,
                         "E.g. --correlation backlash,damping_ratio=0.5.") from None
