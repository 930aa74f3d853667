"""What maps, bifurcation diagrams and basins have found, in two lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from gearchaos.cli.tables.text import plain_table, print_table, shown, unit_after
from gearchaos.quantities import quantity

if TYPE_CHECKING:
    import xarray as xr

_WIDTH = 80
"""Longest line, in characters."""

_TEETH = {"permanent": "in contact", "one-sided": "separate", "two-sided": "hit both flanks", "none": "no contact"}
"""Contact states in words."""


def print_map(found: Mapping[str, Any], dataset: xr.Dataset) -> None:
    """Print the JSON summary of a map in two lines: the shares of what was found, and its extreme.

    The first line of given gears has the shares of the contact states, that of others the shares of the motions.
    """
    if "attractors" in found:
        _print_shares("basins", [(each["label"], each["fraction"]) for each in found["attractors"]], "initial values")
        print(f"basin entropy {shown(found['basin_entropy'])} nat, "
              f"uncertainty exponent {shown(found['uncertainty_exponent'])}")
        return
    cells = "columns" if dataset["label"].ndim == 1 else "cells"
    size = dataset["label"].size
    contact = [(_TEETH[state], count / size) for state, count in found["contact"].items()]
    if "gears" in dataset.attrs:
        one = "" if "contact_worst" in dataset else ", one motion each"  # another one may separate where this does not
        _print_shares(f"teeth{one}", contact, cells)
    else:
        motions = sorted(found["cells"].items(), key=lambda item: -item[1])
        _print_shares("motions", [(name, count / size) for name, count in motions], cells)
    print(_largest(found["largest"], dataset))


def print_result(found: Mapping[str, Any]) -> None:
    """Print the sizes of a result, and the range of each of its variables."""
    print(", ".join(f"{name} {size}" for name, size in found["sizes"].items()) or "a single value")
    table = plain_table()
    for title in ("variable", "least", "most", "unit"):
        table.add_column(title, justify="right" if title in ("least", "most") else "left")
    for name, each in found["variables"].items():
        table.add_row(name, shown(each["least"]), shown(each["most"]), each["units"])
    print_table(table)


def _print_shares(what: str, shares: Iterable[tuple[str, float]], whole: str) -> None:
    """Print shares in a line, as many as have room in it."""
    parts = [f"{name} {100 * share:.3g} %" for name, share in shares]
    lines = [f"{what}: {', '.join([*parts[:n], *(['…'] if n < len(parts) else [])])} of the {whole}"
             for n in range(len(parts), -1, -1)]
    print(next((line for line in lines if len(line) <= _WIDTH), lines[-1]))


def _largest(largest: Mapping[str, Any] | None, dataset: xr.Dataset) -> str:
    """The largest dynamic factor, or V_RMS, and where it is."""
    if largest is None:
        return "no motion is bounded"
    name = largest["quantity"]
    value = f"{quantity(name).symbol or quantity(name).long_name} {largest['value']:.4g}{unit_after(dataset, name)}"
    place = ", ".join(f"{n} {v:.4g}{unit_after(dataset, n)}" for n, v in largest["at"].items())
    which = " (initial values)" if "attractors" in dataset else ""  # other motions of a cell may have a larger one
    return f"largest {value}{which}, at {place}"
