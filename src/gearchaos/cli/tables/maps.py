"""What maps, bifurcation diagrams, basins and any other result have found, as JSON and in a few lines."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from gearchaos.cli.tables.text import plain_table, print_table, shown, unit_after
from gearchaos.datasets import motions
from gearchaos.dynamics.response import CONTACTS
from gearchaos.quantities import quantity
from gearchaos.studies.proved_cells import proof_counts

if TYPE_CHECKING:
    import xarray as xr

_WIDTH = 80
"""Longest line, in characters."""

_TEETH = {"permanent": "in contact", "one-sided": "separate", "two-sided": "hit both flanks", "none": "no contact"}
"""Contact states in words."""


def map_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON summary of a map: the numbers of cells with each motion and each contact state, and the largest dynamic
    factor; for basins, the attractors and their shares, and how finely the basins are mixed."""
    if "basin_entropy" in dataset:
        shares = dataset["attractor_fraction"].values.tolist()
        names = motions(dataset["attractor_label"], dataset["attractor_period"])
        measures = {name: dataset[name].item() for name in ("basin_entropy", "uncertainty_exponent")}
        return {"attractors": [{"label": n, "fraction": s} for n, s in zip(names, shares, strict=True)], **measures}
    names = motions(dataset["label"], dataset["period"])
    codes = dataset["contact_worst" if "contact_worst" in dataset else "contact"].values.ravel().tolist()
    return {
        "cells": {name: names.count(name) for name in sorted(set(names))},
        "contact": {CONTACTS[code]: codes.count(code) for code in sorted({code for code in codes if code >= 0})},
        "largest": _largest(dataset), **({"proofs": proof_counts([dataset])} if "proved" in dataset else {}),
    }


def _largest(dataset: xr.Dataset) -> dict[str, Any] | None:
    """The largest dynamic factor, or without static load V_RMS, of a map, and where; None if all diverge."""
    for name in ("dynamic_factor", "v_rms"):
        known = dataset[name].where(abs(dataset[name]) < math.inf)
        if known.notnull().any():
            at, names = dataset[name].isel(known.argmax(...)), reversed(dataset[name].dims)
            return {"quantity": name, "value": at.item(), "at": {str(n): at[n].item() for n in names}}
    return None


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
        counts = sorted(found["cells"].items(), key=lambda item: -item[1])
        _print_shares("motions", [(name, count / size) for name, count in counts], cells)
    print(_largest_in_words(found["largest"], dataset))


def result_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of any result: its dimensions, and smallest and largest value and unit of each variable."""
    known = {str(n): v for n, v in dataset.data_vars.items() if v.dtype.kind in "fiub" and v.notnull().any()}
    ranges = {n: {"least": v.min().item(), "most": v.max().item(), "units": v.attrs.get("units", "")}
              for n, v in known.items()}
    return {"sizes": {str(n): size for n, size in dataset.sizes.items()}, "variables": ranges}


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


def _largest_in_words(largest: Mapping[str, Any] | None, dataset: xr.Dataset) -> str:
    """The largest dynamic factor, or V_RMS, and where it is."""
    if largest is None:
        return "no motion is bounded"
    name = largest["quantity"]
    value = f"{quantity(name).symbol or quantity(name).long_name} {largest['value']:.4g}{unit_after(dataset, name)}"
    place = ", ".join(f"{n} {v:.4g}{unit_after(dataset, n)}" for n, v in largest["at"].items())
    which = " (initial values)" if "attractors" in dataset else ""  # other motions of a cell may have a larger one
    return f"largest {value}{which}, at {place}"
