"""``gearchaos modes``: natural frequencies of given gears, where their energy is, and which speeds meet them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from gearchaos.cli.errors import warn
from gearchaos.cli.gears import GearsPath
from gearchaos.cli.options import Json, Sets, app
from gearchaos.cli.output import (
    DPI,
    check_files,
    plain_table,
    print_json,
    print_table,
    print_wrapped,
    save,
    write_figure,
)
from gearchaos.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

_SAID = 3  # springs that are named, those with most of the energy of a mode
_LEAST = 0.05  # share of the energy of a spring that is named
_HARMONICS = 3  # of a mesh frequency whose speeds are told
NEAR = 0.1  # of a single speed, relative
_FORMS = "E.g. 3000 or 500:4000."


@app.command(rich_help_panel="Gears")
def modes(
    gears: GearsPath, sets: Sets = None,
    speed: Annotated[
        str | None,
        typer.Option("--speed", metavar="A:B|A", help="Only what meets modes within these speeds of the first body, "
                     "rpm, or within 10 % of one."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", readable=False, help="Modes: .nc or .csv."),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FILE", readable=False, help="Campbell diagram: .png, .pdf or .svg."),
    ] = None,
    json_out: Json = False,
) -> None:
    """Show the natural frequencies of gears in contact, where their energy is, and at which speeds meshes meet them."""
    check_files(out, plot)
    limits = None if speed is None else _limits(speed)
    from gearchaos.model import MeshModel
    from gearchaos.studies.vibration.natural_frequencies import natural_frequencies
    from gearchaos.studyfile import open as open_file
    from gearchaos.studyfile import parse_set

    found = open_file(gears, parse_set(sets or []))
    if isinstance(found, MeshModel):
        raise InputError("study file", "must have a table [design], [gearpair] or [train]", str(gears),
                         "A dimensionless model has no frequencies in Hz.")
    for text in found.warnings:
        warn(text)
    dataset = natural_frequencies(found)
    save(dataset, out)
    if plot is not None:
        import matplotlib

        matplotlib.use("Agg")
        from gearchaos.plot import campbell

        figure: Any = campbell(dataset, speed=limits and limits[1]).figure
        write_figure(figure, plot, dpi=DPI, bbox_inches="tight")
    if json_out:
        print_json(modes_document(dataset, limits))
    elif limits is None:
        print_modes(dataset)
    else:
        _print_meetings(dataset, limits)


def _limits(text: str) -> tuple[float, float]:
    """The least and the largest of the speeds of ``--speed``, rpm."""
    from gearchaos.gears.io.units import SPEED, to_si
    from gearchaos.quantities import POSITIVE
    from gearchaos.studies.core.operating_ranges import operating_axis

    if ":" not in text:
        plain = text.replace(".", "", 1).isdigit()
        value = to_si("--speed", float(text) if plain else text, SPEED, POSITIVE)
        return (1 - NEAR) * value, (1 + NEAR) * value
    if text.count(":") > 1:
        raise InputError("--speed", "must be a speed or a range", text, _FORMS)
    try:
        axis = operating_axis("speed", text, "--speed", 2)
    except InputError as error:  # its forms have a number of speeds
        raise InputError(error.field, error.rule, error.value, _FORMS) from None
    return axis.start, axis.stop


class Meeting(NamedTuple):
    """A speed of the first body, rpm, at which an excitation or a harmonic of a mesh has a natural frequency."""

    speed: float
    excitation: str
    harmonic: int
    mode: int


def _meetings(modes: list[dict[str, Any]]) -> list[Meeting]:
    """All meetings of modes as in `modes_document`, in the order of speeds."""
    return sorted(Meeting(speed / n, name, n, number) for number, mode in enumerate(modes, 1)
                  for name, speed in mode["met_at"].items()
                  for n in range(1, (_HARMONICS if name.startswith("mesh ") else 1) + 1))


def modes_document(dataset: xr.Dataset, limits: tuple[float, float] | None = None) -> dict[str, Any]:
    """The JSON document of modes: of each its frequency, Hz, its damping ratio, None of one that deflects nothing, the
    shares of bodies in the kinetic and of springs in the strain energy, and the speeds of the first body, rpm, at which
    meshes and other excitations meet it; which contacts are closed; with ``limits`` of the speed also each meeting
    within them."""
    found = []
    for mode in dataset["mode"].values.tolist():
        at = dataset.sel(mode=mode)
        rigid, frequency = bool(at["rigid"]), float(at["natural_frequency"])
        shares = {str(name): float(share) for part in ("body", "element") for name, share in zip(
            at[part].values, at["kinetic_energy" if part == "body" else "strain_energy"].values, strict=True)}
        met = {str(name): 60 * frequency / float(order) for name, order in zip(
            at["excitation"].values, at["order"].values, strict=True)}
        found.append({"frequency": frequency, "damping_ratio": None if rigid else float(at["damping_ratio"]),
                      "rigid": rigid, "shares": shares, "met_at": {} if rigid else met})
    within = {} if limits is None else {"speeds": list(limits), "meetings": [
        each._asdict() for each in _meetings(found) if limits[0] <= each.speed <= limits[1]]}
    return {"speed": float(dataset["speed"]), "first_body": str(dataset["body"].values[0]),
            "contacts": dataset.attrs["contacts"], "modes": found, **within}


def _energy_in(dataset: xr.Dataset, mode: dict[str, Any]) -> str:
    """The springs with most of the strain energy of a mode, and their shares."""
    springs = sorted(dataset["element"].values.tolist(), key=lambda name: -mode["shares"][name])
    return ", ".join(f"{name} {100 * mode['shares'][name]:.0f} %" for name in springs[:_SAID]
                     if mode["shares"][name] >= _LEAST)


def _excitations(dataset: xr.Dataset) -> dict[str, str]:
    """What excites a train, one of each order, with its name without the word mesh."""
    orders = dict(zip(reversed(dataset["order"].values.tolist()), reversed(dataset["excitation"].values.tolist()),
                      strict=True))
    return {name: name.removeprefix("mesh ") for name in reversed(orders.values())}


def print_modes(dataset: xr.Dataset) -> None:
    """Print the lowest frequency with the speeds at which meshes meet it, and a table of modes with the springs that
    hold most of their energy and the body that moves most."""
    from gearchaos.studies.speeds.speed_windows import speed_in_words

    content = modes_document(dataset)
    excitations = _excitations(dataset)
    meshes = {name: short for name, short in excitations.items() if name.startswith("mesh ")}
    elastic = [mode for mode in content["modes"] if not mode["rigid"]]
    if not elastic:
        print("no mode deflects anything")
        return
    many, harmonics = len(meshes) > 1, range(1, (_HARMONICS if meshes else 1) + 1)
    by = f"the mesh frequency{':' * many}" if meshes else "excitations:"
    names = meshes or excitations
    met = [f"{f'that of {short} ' * (many or not meshes)}at {elastic[0]['met_at'][name]:.5g} rpm"
           for name, short in names.items()]
    print_wrapped(f"lowest natural frequency {elastic[0]['frequency']:.5g} Hz, met by {by} "
                  f"{', '.join(met)} of {content['first_body']}; {dataset.attrs['contacts']}")
    title = f"met at rpm by\n{', '.join(f'{n}×' for n in harmonics)}"
    table = plain_table("mode", "Hz", "ζ", title, "energy in", "moves most", left=("energy in", "moves most"))
    for number, mode in enumerate(content["modes"], 1):
        moving = max(dataset["body"].values.tolist(), key=mode["shares"].__getitem__)
        values = ["rigid", "", ""] if mode["rigid"] else [
            f"{mode['frequency']:.5g}", f"{mode['damping_ratio']:.2g}", "\n".join(
                ", ".join(speed_in_words(mode["met_at"][name] / n, 0) for n in harmonics) for name in names)]
        table.add_row(str(number), *values, _energy_in(dataset, mode), moving)
    print_table(table)


def _print_meetings(dataset: xr.Dataset, limits: tuple[float, float]) -> None:
    """Print which excitations and harmonics of meshes meet which modes within limits of the speed, those of one order
    once."""
    content, names = modes_document(dataset, limits), _excitations(dataset)
    found = [each for each in content["meetings"] if each["excitation"] in names]
    print_wrapped(f"{len(found) or 'no'} meeting{'s' * (len(found) != 1)} of excitations with natural frequencies from "
                  f"{limits[0]:.5g} to {limits[1]:.5g} rpm of {content['first_body']}, meshes by their first "
                  f"{_HARMONICS} harmonics; {dataset.attrs['contacts']}")
    table = plain_table("rpm", "by", "mode", "Hz", "ζ", "energy in", left=("by", "energy in"))
    for each in found:
        mode = content["modes"][each["mode"] - 1]
        by = f"{each['harmonic']}× " * each["excitation"].startswith("mesh ") + names[each["excitation"]]
        table.add_row(f"{each['speed']:.0f}", by, str(each["mode"]), f"{mode['frequency']:.5g}",
                      f"{mode['damping_ratio']:.2g}", _energy_in(dataset, mode))
    if found:
        print_table(table)
