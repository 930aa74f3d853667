"""The commands of studies, made from the catalogue: options, computation, files, picture, and what they print."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any

import typer

from gearchaos import catalogue
from gearchaos.cli import options
from gearchaos.cli.errors import Commands, say
from gearchaos.cli.gear_studies import fit, orders, runup, scatter
from gearchaos.cli.options import Json, Out, OutIfWanted, Physical, Plot, Sets, SpectrumOut, StudyPath, app
from gearchaos.cli.output import PLOT_SUFFIXES, check_files, check_output, draw, print_json, save, write_certificate
from gearchaos.errors import InputError, unknown_name
from gearchaos.formats import format_of
from gearchaos.plugins import is_offered


def study_command(kind: str, entry: dict[str, Any]) -> Callable[..., None]:
    """The command of a study, with the signature from which Typer makes its options."""

    def command(**values: Any) -> None:
        run_study(kind, entry, values)

    of_study = [(name, options.study_option(name, option), None)
                for name, option in {**entry["options"], **entry["run_options"]}.items() if option["type"] != "part"]
    axes = [("axis", options.axes_option(list(entry["axes"].values())), None)] * bool(entry["axes"])
    wanted = SpectrumOut if "samples" in entry["options"] else OutIfWanted
    out = [("out", Out, Parameter.empty)] if entry["needs_out"] else []
    parameters = [
        *out, ("study", StudyPath, None), ("sets", Sets, None), *axes, *of_study,
        *([] if out else [("out", wanted, None)]), ("plot", Plot, None), ("json_out", Json, False),
        ("physical", Physical, False),
    ]
    command.__doc__, command.__annotations__ = entry["help"], {name: type_ for name, type_, _ in parameters}
    command.__signature__ = Signature([  # type: ignore[attr-defined]
        Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=each) for name, each, default in parameters
    ])
    return command


def run_study(kind: str, entry: dict[str, Any], values: dict[str, Any]) -> None:
    """Check everything, compute the study, write its files and print what it found.

    ``entry`` is that of the catalogue, ``values`` what was given on the command line by parameter of the command.
    """
    out, plot, physical = values.pop("out"), values.pop("plot"), values.pop("physical")
    path, sets, json_out = values.pop("study"), values.pop("sets"), values.pop("json_out")
    for name, option in entry["options"].items():
        if option.get("file_only") and values[name] is not None and out is None:
            raise InputError(f"--{name}", "needs --out", values[name], option["file_only"])
    signals = "samples" in entry["options"]  # of a motion over time
    check_files(out, plot, spectra=signals)
    given_axes = options.parse_axes(values.pop("axis", None), [*entry["axes"].values()])
    loaded = options.load(path, sets, physical, given_axes)
    axes = options.study_axes(kind, loaded, given_axes)
    of_run = {name: values.pop(name, None) for name in entry["run_options"]}
    part = Path(f"{out}.part") if any(o["type"] == "part" for o in entry["run_options"].values()) else None
    if part is not None:
        of_run["journal"] = part
    from gearchaos.cli.summaries import Found, report
    from gearchaos.studies.core.registry import study_class

    chosen = loaded.study(study_class(kind), **axes, **_options(entry, values, loaded.options_for(kind), out))
    found = Found(kind, chosen.run(progress=True, **of_run), loaded, physical, tuple(axes.values()), out, plot)
    save(found.in_units if signals and out and format_of("--out", out).spectra_only else found.dataset, out)
    if part is not None:
        part.unlink(missing_ok=True)
    report(found, entry["summary"], json_out)


def _options(
    entry: dict[str, Any], values: dict[str, Any], of_file: dict[str, Any], out: Path | None
) -> dict[str, Any]:
    """The options of a study that are given on the command line, in the types of the study."""
    from gearchaos.studies.core.axis import parse_axis

    read: dict[str, Callable[[Any, str], Any]] = {"axis": parse_axis, "values": options.initial_values}
    given: dict[str, Any] = {}
    for name, option in entry["options"].items():
        if values[name] is not None and values[name] is not False and values[name] != []:
            given[name] = read.get(option["type"], lambda value, _: value)(values[name], f"--{name}")
        elif option.get("file_only") and out is None:
            given[name] = None
        elif option.get("required") and name not in of_file:
            if option.get("choices"):
                raise unknown_name(f"--{name}", "", option["choices"])
            example = "z=1.2" if option["type"] == "values" else "100"
            raise InputError(f"--{name}", "must be given", None, f"E.g. --{name} {example}.")
    return given


def regime(
    study: StudyPath = None,
    sets: Sets = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
    prove: Annotated[bool, typer.Option("--prove", help="Prove a periodic motion in ball arithmetic.")] = False,
    certificate: Annotated[
        Path | None, typer.Option(metavar="FILE", help="With --prove: write the certificate, JSON.", readable=False)
    ] = None,
) -> None:
    """Classify the motion at one operating point, and print the evidence."""
    from gearchaos.studies.proofs import proofs

    check_output("--plot", plot, PLOT_SUFFIXES)
    if certificate is not None and not prove:
        raise InputError("--certificate", "needs --prove", str(certificate))
    check_output("--certificate", certificate, (".json",))
    loaded = options.load(study, sets, physical)
    if prove:
        proofs.check_can_prove(loaded.model)
    from gearchaos.studies.core.price import announce
    from gearchaos.studies.motion.regime import Regime

    chosen = loaded.study(Regime)
    announce(chosen)
    verdict = chosen.verdict()
    proof = proofs.prove(verdict) if prove else None
    if proof is not None:
        write_certificate(proof, certificate)
    if json_out:
        document = verdict.to_dict()
        if physical and loaded.pair is not None:
            from gearchaos.gears.operation.results import scaled_numbers

            values, units = scaled_numbers({**document, "omega": loaded.model.omega}, loaded.pair.scales)
            document = {**values, "units": units}
        print_json(document if proof is None else {**document, "proof": proof.to_dict()})
    else:
        from gearchaos.cli.summaries import print_regime

        print_regime(verdict, loaded, proof)
    if plot and not verdict.section:
        say(f"no picture: the motion {verdict.label}")
    elif plot:
        from gearchaos.studies import steady

        motion = options.in_units(steady(loaded.model, verdict), loaded, physical)
        draw(motion, plot, title=f"{verdict.label}: {verdict.reason}")


_OWN: dict[str, Callable[..., None]] = {
    "regime": regime, "runup": runup, "orders": orders, "fit": fit, "scatter": scatter}
"""Commands that print a verdict and not a Dataset, or have options of their own."""


def command_of(name: str) -> Any:
    """The command of a study of another package; None if none offers one of this name."""
    kind = name.replace("-", "_")
    if not is_offered("gearchaos.studies", kind):
        return None
    from gearchaos.studies.core.generate import entry_of
    from gearchaos.studies.core.registry import study_class

    entry, own = entry_of(study_class(kind)), typer.Typer(add_completion=False)
    own.command(name)(study_command(kind, entry))
    return typer.main.get_command(own)


Commands.more = command_of
for _kind, _entry in catalogue.STUDIES.items():
    app.command(_kind.replace("_", "-"), rich_help_panel=_entry["group"])(
        _OWN.get(_kind) or study_command(_kind, _entry))
