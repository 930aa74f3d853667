"""The settings of the 2008 study as data: `settings.toml`, read into small frozen objects."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.model import MeshModel


@dataclass(frozen=True)
class Range:
    """The range of one axis, and whether the paper gives it or it is assumed."""

    start: float
    stop: float
    range: str
    why: str = ""


@dataclass(frozen=True)
class FigureStudy:
    """One computation behind a figure.

    Attributes
    ----------
    kind : {"zones", "basins", "bifurcation", "portrait", "trajectory", "attractors"}
    model : mapping
        Values for `MeshModel.of`.
    axes : mapping of str to Range
        One or two axes by parameter or initial value.
    starts : str
        Of ``attractors``: figure and study whose basins find them, e.g. "3c".
    periods : tuple of int
        Of ``attractors``: the periods to show.
    """

    kind: str
    model: Mapping[str, Any]
    axes: Mapping[str, Range] = field(default_factory=dict)
    starts: str = ""
    periods: tuple[int, ...] = ()

    @property
    def mesh_model(self) -> MeshModel:
        return MeshModel.of(**self.model)


@dataclass(frozen=True)
class Figure:
    """One figure of the paper: how it is laid out, what it shows, and the studies behind it."""

    number: int
    layout: str
    title: str
    caption: str
    shows: str
    studies: Mapping[str, FigureStudy]


@dataclass(frozen=True)
class Quality:
    """How finely to compute: cells (x, y) and patience of maps, (columns, points) of diagrams, and so on."""

    name: str
    zones: tuple[int, int]
    basins: tuple[int, int]
    patience: int
    bifurcation: tuple[int, int]
    portrait: int
    trajectory: int
    dpi: int


@cache
def _document() -> dict[str, Any]:
    return tomllib.loads(files("gearchaos.paper").joinpath("settings.toml").read_text(encoding="utf-8"))


@cache
def all_figures() -> dict[int, Figure]:
    """Every figure of the paper by number, in order."""
    return {int(number): _figure(int(number), table) for number, table in _document()["figure"].items()}


def _figure(number: int, table: Mapping[str, Any]) -> Figure:
    studies = {name: _study(entry) for name, entry in table.get("study", {}).items()}
    text = {key: " ".join(table[key].split()) for key in ("layout", "title", "caption", "shows")}
    return Figure(number=number, studies=studies, **text)


def _study(entry: Mapping[str, Any]) -> FigureStudy:
    axes = {name: Range(**values) for name, values in entry.get("axes", {}).items()}
    rest = {key: value for key, value in entry.items() if key not in ("axes", "periods")}
    return FigureStudy(axes=axes, periods=tuple(entry.get("periods", ())), **rest)


def chosen_figures(numbers: Any = None) -> dict[int, Figure]:
    """The figures with these numbers (all if None), in order of number; `InputError` for one that does not exist."""
    known = all_figures()
    wanted = list(known if numbers is None else numbers)
    for number in wanted:
        if number not in known:
            raise InputError("figures", f"must be numbers from 1 to {max(known)}", number)
    if not wanted:
        raise InputError("figures", "must name at least one figure", wanted)
    return {n: known[n] for n in sorted(set(wanted))}


def quality(name: str) -> Quality:
    """The quality of that name; `InputError` with the nearest known one if there is none."""
    table = _document()["quality"]
    if name not in table:
        raise unknown_name("quality", name, table)
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in table[name].items()}
    return Quality(name=name, **values)
