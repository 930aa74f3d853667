"""``gearchaos modes``: natural frequencies of given gears, where their energy is, and which speeds meet them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.errors import warn
from gearchaos.cli.gears import GearsPath
from gearchaos.cli.options import Json, Sets, app
from gearchaos.cli.output import (
    check_files,
    draw,
    plain_table,
    print_json,
    print_table,
    print_wrapped,
    save,
)
from gearchaos.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

_SAID = 3  # springs that are named, those with most of the energy of a mode
_LEAST = 0.05  # share of the energy of a spring that is named


@app.command(rich_help_panel="Gears")
def modes(
    gears: GearsPath, sets: Sets = None,
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
    draw(dataset, plot)
    if json_out:
        print_json(modes_document(dataset))
    else:
        print_modes(dataset)


def modes_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of modes: of each its frequency, Hz, its damping ratio, None of one that deflects nothing, the
    shares of bodies in the kinetic and of springs in the strain energy, and the speeds of the first body, rpm, at which
    meshes and other excitations meet it."""
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
    return {"speed": float(dataset["speed"]), "first_body": str(dataset["body"].values[0]), "modes": found}


def print_modes(dataset: xr.Dataset) -> None:
    """Print the lowest frequency with the speeds at which meshes meet it, and a table of modes with the springs that
    hold most of their energy and the body that moves most."""
    content = modes_document(dataset)
    orders = dict(zip(dataset["excitation"].values.tolist(), dataset["order"].values.tolist(), strict=True))
    meshes = dict[float, str]()  # one of each order
    for name, order in orders.items():
        if name.startswith("mesh "):
            meshes.setdefault(order, name.removeprefix("mesh "))
    elastic = [mode["frequency"] for mode in content["modes"] if not mode["rigid"]]
    if not elastic:
        print("no mode deflects anything")
        return
    many = len(meshes) > 1
    met = [f"{f'that of {name} ' * many}at {60 * elastic[0] / order:.5g} rpm" for order, name in meshes.items()]
    print_wrapped(f"lowest natural frequency {elastic[0]:.5g} Hz, met by the mesh frequency{':' * many} "
                  f"{', '.join(met)} of {content['first_body']}; all meshes in contact at their mean stiffnesses")
    table = plain_table("mode", "Hz", "ζ", "met at rpm", "energy in", "moves most", left=("energy in", "moves most"))
    for number, mode in enumerate(content["modes"], 1):
        most = sorted(mode["shares"].items(), key=lambda each: -each[1])
        springs, moving = ([name for name, _ in most if name in dataset[part].values] for part in ("element", "body"))
        energy = ", ".join(f"{name} {100 * mode['shares'][name]:.0f} %" for name in springs[:_SAID]
                           if mode["shares"][name] >= _LEAST)
        values = ["rigid", "", ""] if mode["rigid"] else [
            f"{mode['frequency']:.5g}", f"{mode['damping_ratio']:.2g}",
            ", ".join(f"{60 * mode['frequency'] / order:.0f}" for order in meshes)]
        table.add_row(str(number), *values, energy, moving[0])
    print_table(table)
