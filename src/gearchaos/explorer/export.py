"""What a visitor can take along: Python, TOML, pictures and data, made in memory of what the page shows."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Generator
from dataclasses import fields
from typing import Any

import tomlkit
import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.datasets import netcdf
from gearchaos.explorer.pair import pair_at
from gearchaos.explorer.state import View, stiffness_name
from gearchaos.gears.pair import GearPair
from gearchaos.model import SCALARS, MeshModel, TwoLevelStiffness
from gearchaos.studies.axis import Axis

_DPI = 150
_TYPES = {"png": "image/png", "svg": "image/svg+xml", "nc": "application/x-netcdf"}
_CLASSES = re.compile(r"\b(MeshModel|TransmissionError|TwoLevelStiffness|HarmonicStiffness)\(")


def as_python(view: View, pair: GearPair | None = None) -> str:
    """A script that computes what the page shows, in the units of the pair if there is one."""
    model = _CLASSES.sub(r"gc.\1(", repr(view.point))
    x, y = (f'gc.Axis("{a.name}", {a.start!r}, {a.stop!r}, {a.count})' for a in (view.x, view.y))
    return (
        "import gearchaos as gc\n\n"
        f"model = {model}\n"
        "verdict = gc.regime(model)\n"
        "motion = gc.steady(model, verdict)\n"
        f"zones = gc.zones(model, {x}, {y}, progress=True)\n"
        f"{_scaled(pair)}"
        "print(verdict.label, verdict.reason)\n"
        "gc.plot.dossier(motion)\n"
        "gc.plot.zones(zones)\n"
    )


def _scaled(pair: GearPair | None) -> str:
    if pair is None:
        return ""
    return f"pair = gc.{pair!r}\nmotion, zones = gc.physical(motion, pair), gc.physical(zones, pair)\n"


def as_toml(view: View, pair: GearPair | None = None) -> str:
    """A study file of the point and its map: of the pair that has this model, if there is one."""
    model, document = view.point, tomlkit.document()
    physical = pair and pair_at(pair, model)
    if physical:
        document.add(tomlkit.comment("The pair at the point chosen; numbers without a unit are in SI."))
        document["gearpair"] = {"kind": model.kind, **_fields(physical)}
    else:
        if pair:
            document.add(tomlkit.comment("No pair of the same mass and kind of supports has these values."))
        document["model"] = _model(model)
    if model.initial:
        document["initial"] = dict(model.initial)
    document["study"] = {"kind": "zones", "x": _axis(view.x), "y": _axis(view.y)}
    return tomlkit.dumps(document)


def _fields(pair: GearPair) -> dict[str, Any]:
    """What a pair was given; the rest is left out."""
    values = {f.name: getattr(pair, f.name) for f in fields(pair)}
    return {n: list(v) if isinstance(v, tuple) else v for n, v in values.items() if v not in (None, ())}


def _model(model: MeshModel) -> dict[str, Any]:
    return {
        "kind": model.kind, **{n: getattr(model, n) for n in SCALARS},
        "error": {"amplitudes": list(model.error.amplitudes), "phases": list(model.error.phases)},
        "stiffness": {"kind": stiffness_name(model), **_stiffness(model.stiffness)},
    }


def _stiffness(stiffness: Any) -> dict[str, Any]:
    if isinstance(stiffness, TwoLevelStiffness):
        return {n: getattr(stiffness, n) for n in ("chi1", "chi2", "contact_ratio")}
    return {"amplitudes": list(stiffness.amplitudes), "phases": list(stiffness.phases)}


def _axis(axis: Axis) -> str:
    return f"{axis.name}={axis.start!r}:{axis.stop!r}:{axis.count}"


def picture(kind: str, suffix: str, dataset: xr.Dataset, colour: str, title: str) -> tuple[bytes, str]:
    """A picture of a map or of a motion by `gearchaos.plot`, and its media type."""
    figure = _DRAW[kind](dataset, colour, title)
    out = io.BytesIO()
    figure.savefig(out, format=suffix, dpi=_DPI, bbox_inches="tight")
    return out.getvalue(), _TYPES[suffix]


def _draw_map(dataset: xr.Dataset, colour: str, title: str) -> Figure:
    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    ax = figure.subplots()
    plot.zones(dataset, ax) if colour == "motion" else plot.level(dataset, colour, ax)
    return figure


def _draw_dossier(dataset: xr.Dataset, _: str, title: str) -> Figure:
    return plot.dossier(dataset, title=title, figure=Figure(figsize=(9.6, 7.2), layout="constrained"))


_DRAW: dict[str, Callable[[xr.Dataset, str, str], Figure]] = {"map": _draw_map, "motion": _draw_dossier}


def data(dataset: xr.Dataset) -> tuple[bytes, str]:
    """A Dataset as NetCDF (HDF5) with checksums, and its media type."""
    return bytes(netcdf(dataset)), _TYPES["nc"]


def exported(kind: str, suffix: str, dataset: xr.Dataset, colour: str, title: str) -> Generator[tuple[bytes, str, str]]:
    """One file as (content, media type, name): the single step of a job."""
    content, media = data(dataset) if suffix == "nc" else picture(kind, suffix, dataset, colour, title)
    yield content, media, f"gearchaos-{kind}.{suffix}"
