"""The settings of the 2008 study as data: `settings.toml`, read into small frozen objects."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.model import MeshModel


@dataclass(frozen=True)
class AxisRange:
    """The range of one axis: "given" by the paper or "assumed", and ``why`` it is assumed so."""

    start: float
    stop: float
    range: str
    why: str = ""


@dataclass(frozen=True)
class FigureStudy:
    """One computation behind a figure: zones, basins, bifurcation, portrait, trajectory or attractors."""

    kind: str
    model: Mapping[str, Any]  # values for `MeshModel.of`
    axes: Mapping[str, AxisRange] = field(default_factory=dict)  # one or two, by parameter or initial value
    found_in: str = ""  # for attractors: the panel of the basins in which they are found, "3c"
    periods: tuple[int, ...] = ()  # for attractors: those of the motions to show

    @property
    def mesh_model(self) -> MeshModel:
        """The model of the study."""
        return MeshModel.of(**self.model)


@dataclass(frozen=True)
class FigureSettings:
    """The settings of one figure of the paper: its layout, a key of `gearchaos.paper.figures.LAYOUTS`, and its studies.

    ``title`` stands in the report, ``caption`` in the paper; ``shows`` describes the contents. ``studies`` are the
    computations behind the figure by panel: "a", "b", ...
    """

    number: int
    layout: str
    title: str
    caption: str
    shows: str
    studies: Mapping[str, FigureStudy]


@dataclass(frozen=True)
class Quality:
    """The resolution of the figures; `settings.toml` says what each number is."""

    name: str
    zones: tuple[int, int]
    basins: tuple[int, int]
    longest_transient: int
    bifurcation: tuple[int, int]
    portrait: int
    trajectory: int
    dpi: int


def symbol(name: str) -> str:
    """The paper's symbol of a parameter or initial value in plain text."""
    return {"omega": "ω", "eps1": "ε1", "kappa": "κ", "beta": "β", "z": "z(0)", "z_dot": "z'(0)"}.get(name, name)


@cache
def _document() -> dict[str, Any]:
    return tomllib.loads(files("gearchaos.paper").joinpath("settings.toml").read_text(encoding="utf-8"))


@cache
def all_figures() -> dict[int, FigureSettings]:
    """Every figure of the paper by number, in order."""
    figures = {}
    for number, table in _document()["figure"].items():
        text = {key: " ".join(table[key].split()) for key in ("layout", "title", "caption", "shows")}
        studies = {}
        for name, entry in table.get("study", {}).items():
            axes = {axis: AxisRange(**values) for axis, values in entry.get("axes", {}).items()}
            studies[name] = FigureStudy(**{**entry, "axes": axes, "periods": tuple(entry.get("periods", ()))})
        figures[int(number)] = FigureSettings(number=int(number), studies=studies, **text)
    return figures


def study_of(panel: str) -> FigureStudy:
    """The study of a panel, named by the number of its figure and its own name: "3c", "13a_section"."""
    number, name = re.fullmatch(r"(\d+)(\w+)", panel).groups()  # type: ignore[union-attr]  # panels are our own
    return all_figures()[int(number)].studies[name]


def chosen_figures(numbers: Any = None) -> dict[int, FigureSettings]:
    """The figures with these numbers, in order, all if None; raises an `InputError` for an unknown number."""
    known = all_figures()
    wanted = list(known if numbers is None else numbers)
    for number in wanted:
        if number not in known:
            raise InputError("figures", f"must be numbers from 1 to {max(known)}", number)
    if not wanted:
        raise InputError("figures", "must name at least one figure", wanted)
    return {n: known[n] for n in sorted(set(wanted))}


def quality(name: str) -> Quality:
    """The quality of this name; raises an `InputError`, with the most similar name, if there is none."""
    table = _document()["quality"]
    if name not in table:
        raise unknown_name("quality", name, table)
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in table[name].items()}
    return Quality(name=name, **values)
