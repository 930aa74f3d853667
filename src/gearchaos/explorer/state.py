"""What a page shows, whole: the model, the map, the point. To the address bar and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from urllib.parse import parse_qsl, urlencode

from gearchaos.errors import InputError, unknown_name
from gearchaos.explorer.bounds import CELLS, HARMONICS, QUERY, bounded, neat, number, span
from gearchaos.model import (
    COORDINATES,
    KINDS,
    HarmonicStiffness,
    MeshModel,
    TwoLevelStiffness,
    expand,
    known_names,
    state_names,
)
from gearchaos.studies.axis import Axis
from gearchaos.studies.plane import check_plane

COLOURS = {
    "motion": "kind of motion", "v_rms": "rms velocity", "contact_fraction": "share of the time in contact",
    "dynamic_factor": "dynamic factor", "attractors": "number of attractors",
}
"""By what the map can be coloured, in words."""

LINES = {"x": "horizontal", "y": "vertical"}
STIFFNESSES = ("two-level", "harmonics")
_FIXED = ("kind", "stiffness", "x", "y", "at", "colour", "line", "start", "units")
_UNITS = ("dimensionless", "physical")


@dataclass(frozen=True)
class View:
    """All that decides what a page shows.

    Attributes
    ----------
    model : MeshModel
        Everything but the two parameters of the map.
    x, y : Axis
        Of the map, as far as it is in view.
    at : (float, float)
        The point chosen, in the map's parameters.
    colour : str
        One of `COLOURS`.
    line : {"x", "y"}
        Along which axis the bifurcation diagram runs through the point.
    start : tuple of (name, value)
        Other initial values of the motion at the point, which lead to another attractor; none by default.
    physical : bool
        Show results in the units of the physical pair.

    Raises
    ------
    InputError
        Naming the field, the rule, the value and what to do.
    """

    model: MeshModel
    x: Axis
    y: Axis
    at: tuple[float, float]
    colour: str = "motion"
    line: str = "x"
    start: tuple[tuple[str, float], ...] = ()
    physical: bool = False

    def __post_init__(self) -> None:
        _known("colour", self.colour, COLOURS)
        _known("line", self.line, LINES)
        _check_model(self.model)
        for axis, value, count in zip((self.x, self.y), self.at, CELLS, strict=True):
            for end in (axis.start, axis.stop, value):
                bounded(axis.name, end)
            if axis.count != count:
                raise InputError(f"axis {axis.name} count", f"must be {count} in the explorer", axis.count)
        check_plane(self.model, self.x, self.y)
        _ = self.point

    @cached_property
    def base(self) -> MeshModel:
        """The model at the point, from its own initial values."""
        return self.model.with_values(dict(zip((self.x.name, self.y.name), self.at, strict=True)))

    @cached_property
    def point(self) -> MeshModel:
        """The model at the point, with the initial values of the motion chosen there."""
        return self.base.with_values(dict(self.start)) if self.start else self.base

    @cached_property
    def plane(self) -> tuple[object, ...]:
        """What the map depends on."""
        corner = self.model.with_values({self.x.name: self.x.start, self.y.name: self.y.start})
        return corner, self.x, self.y, self.colour == "attractors"

    def with_axes(self, x: Axis, y: Axis) -> View:
        """Another part of the plane, or another plane, with the point kept as far as it goes."""
        return replace(self, model=self.base, x=x, y=y, at=_at(self.base, x, y))

    def moved(self, x: float, y: float) -> View:
        """The same with the point elsewhere; a motion chosen at the old point is left behind."""
        return replace(self, at=(_within(self.x, x), _within(self.y, y)), start=())

    def stepped(self, columns: int, rows: int) -> View:
        """The point moved by so many cells of the map."""
        size = [(a.stop - a.start) / (a.count - 1) for a in (self.x, self.y)]
        return self.moved(self.at[0] + columns * size[0], self.at[1] + rows * size[1])

    def started(self, values: Mapping[str, float]) -> View:
        """The motion at the point from these initial values; others that were chosen stay."""
        chosen = replace(self.base, initial={}).with_values(dict(self.start)).with_values(values)
        return replace(self, start=tuple(chosen.initial.items()))

    def with_value(self, name: str, value: object) -> View:
        """A parameter or initial value set by name; one that the map scans moves the point."""
        found = bounded(name, value)
        for i, axis in enumerate((self.x, self.y)):
            if expand({name: 0.0}, self.model).keys() == expand({axis.name: 0.0}, self.model).keys():
                return replace(self, at=(found, self.at[1]) if i == 0 else (self.at[0], found), start=())
            if expand({name: 0.0}, self.model).keys() & expand({axis.name: 0.0}, self.model).keys():
                raise InputError(name, f"must be left to the axis {axis.name}", found, "Choose another axis first.")
        return replace(self, model=self.model.with_values({name: found}), start=())

    def with_kind(self, kind: str) -> View:
        """The same pair seen by another kind of model; the axes go back to what that kind has."""
        _known("kind", kind, KINDS)
        model = _without_strangers(self.base, kind)
        axes = [a if a.name in axis_names(model) else None for a in (self.x, self.y)]
        view = standard(model)
        x, y = axes[0] or view.x, axes[1] or view.y
        if x.name == y.name:
            x, y = view.x, view.y
        return replace(self, model=model, x=x, y=y, at=_at(model, x, y), start=())

    def with_stiffness(self, name: str) -> View:
        """Two-level stiffness or a series; of the other one the defaults."""
        _known("stiffness", name, STIFFNESSES)
        if name == stiffness_name(self.model):
            return self
        stiffness = TwoLevelStiffness() if name == "two-level" else HarmonicStiffness((0.25,))
        model = replace(self.base, stiffness=stiffness)
        x, y = (a if a.name in axis_names(model) else None for a in (self.x, self.y))
        view = standard(model)
        return replace(self, model=model, x=x or view.x, y=y or view.y,
                       at=_at(model, x or view.x, y or view.y), start=())

    def query(self) -> str:
        """All of it as the query of an address: only what differs from the defaults, numbers in full."""
        out: dict[str, str] = {"kind": self.model.kind}
        if stiffness_name(self.model) != "two-level":
            out["stiffness"] = stiffness_name(self.model)
        usual = _bare(self.model.kind, stiffness_name(self.model)).parameters()
        out |= {n: repr(v) for n, v in self.model.parameters().items() if v != usual.get(n, 0.0)}
        out |= {n: repr(v) for n, v in self.model.initial.items()}
        out |= {n: f"{a.name}:{a.start!r}:{a.stop!r}" for n, a in (("x", self.x), ("y", self.y))}
        out |= {"at": ",".join(map(repr, self.at)), "colour": self.colour, "line": self.line}
        if self.start:
            out["start"] = ",".join(f"{n}:{v!r}" for n, v in self.start)
        return urlencode(out | ({"units": "physical"} if self.physical else {}), safe=":,")


def from_query(text: str, otherwise: View) -> View:
    """The view that an address asks for; what it does not say is as in ``otherwise`` if it says nothing, else usual.

    Raises
    ------
    InputError
        For a name that does not exist, or a value that breaks its rule; it names the field.
    """
    text = text.removeprefix("?")
    if not text:
        return otherwise
    if len(text) > QUERY:
        raise InputError("address", f"must have at most {QUERY} characters", len(text))
    said = dict(parse_qsl(text, keep_blank_values=True))
    model = _model({n: v for n, v in said.items() if n not in _FIXED}, said)
    usual = standard(model)
    x, y = (_axis(n, said[n], c) if n in said else getattr(usual, n) for n, c in zip("xy", CELLS, strict=True))
    at = _pair("at", said["at"]) if "at" in said else _at(model, x, y)
    _known("units", said.get("units", "dimensionless"), _UNITS)
    return View(
        model, x, y, at, said.get("colour", "motion"), said.get("line", "x"), _start(said.get("start", "")),
        said.get("units") == "physical",
    )


def standard(model: MeshModel) -> View:
    """A model over the plane of the paper's figure 2."""
    from gearchaos.explorer.presets import plane_of

    x, y = plane_of(2)
    return View(model, x, y, _at(model, x, y))


def first_view(model: MeshModel, x: Axis | None = None, y: Axis | None = None) -> View:
    """A model over these axes, whatever their counts, or over those of figure 2."""
    view = standard(model)
    x, y = (
        Axis(a.name, a.start, a.stop, n) if a else usual
        for a, usual, n in zip((x, y), (view.x, view.y), CELLS, strict=True)
    )
    return View(model, x, y, _at(model, x, y))


def axis_names(model: MeshModel) -> list[str]:
    """Parameters that the map can scan: pairs in place of their members, the kind's own alone, and one new harmonic."""
    lateral = ("mu", "kappa", "zeta_support")
    out = []
    for name in [*known_names(model), *(n for n in model.parameters() if n not in known_names(model))]:
        foreign = (name.startswith(lateral) and model.kind != "full") or (
            name.startswith("beta") and model.kind == "single")
        if not foreign and name not in state_names(model.kind) and name not in out:
            out.append(name)
    return out


def stiffness_name(model: MeshModel) -> str:
    """Which of the two kinds of mesh stiffness a model has."""
    return STIFFNESSES[isinstance(model.stiffness, HarmonicStiffness)]


def _within(axis: Axis, value: float) -> float:
    """The nearest value that the explorer takes, rounded to what a pixel tells apart."""
    _, _, least, most = span(axis.name)
    return neat(min(max(number(axis.name, value), least), most), axis.stop - axis.start)


def _known(field: str, value: str, names: Iterable[str]) -> None:
    if value not in names:
        raise unknown_name(field, str(value)[:40], names)


def _check_model(model: MeshModel) -> None:
    """Raise unless every value is one the explorer takes."""
    for name, value in {**model.parameters(), **model.initial}.items():
        bounded(name, value)


def _bare(kind: str, stiffness: str) -> MeshModel:
    model = MeshModel(kind=kind)  # type: ignore[arg-type]
    return model if stiffness == "two-level" else replace(model, stiffness=HarmonicStiffness())


def _model(values: Mapping[str, str], said: Mapping[str, str]) -> MeshModel:
    kind, stiffness = said.get("kind", "torsional"), said.get("stiffness", "two-level")
    _known("kind", kind, KINDS)
    _known("stiffness", stiffness, STIFFNESSES)
    model = _bare(kind, stiffness)
    expand(dict.fromkeys(values, 0.0), model)  # an unknown name is refused before its value is read
    return model.with_values({n: bounded(n, v) for n, v in values.items()})


def _axis(field: str, text: str, count: int) -> Axis:
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(field, "must read name:start:stop", text[:60], "E.g. eps1:0:0.3.")
    return Axis(parts[0], bounded(parts[0], parts[1]), bounded(parts[0], parts[2]), count)


def _pair(field: str, text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(field, "must be two numbers with a comma between", text[:60])
    first, second = (_finite(field, part) for part in parts)
    return first, second


def _finite(field: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(field, "must be two numbers with a comma between", text[:40]) from None


def _start(text: str) -> tuple[tuple[str, float], ...]:
    """Initial values from ``x1:1.0,x1_dot:0.0``."""
    parts = [part.partition(":") for part in text.split(",") if part]
    for name, _, _ in parts:
        _known("start", name, {n for names in COORDINATES.values() for n in names})
    return tuple((name, bounded(name, value)) for name, _, value in parts)


def initial_values(model: MeshModel) -> dict[str, float]:
    """Every coordinate of a model at the start: what it was given, else x1 = 1 and the rest 0, as in the paper."""
    return {n: 1.0 if n == "x1" else 0.0 for n in COORDINATES[model.kind]} | dict(model.initial)


def _value_of(model: MeshModel, axis: Axis) -> float:
    """The value that a model has of an axis' parameter, or the middle of the axis where it has no single one."""
    values = model.parameters() | initial_values(model)
    missing = dict.fromkeys(state_names(model.kind))
    found = {values.get(n, missing.get(n, 0.0)) for n in expand({axis.name: 0}, model)}  # harmonics may be missing
    value = found.pop()
    return (axis.start + axis.stop) / 2 if value is None or found else value


def _at(model: MeshModel, x: Axis, y: Axis) -> tuple[float, float]:
    """The model's own values of both parameters."""
    return _value_of(model, x), _value_of(model, y)


def _without_strangers(model: MeshModel, kind: str) -> MeshModel:
    """A model of another kind, less the initial values and the friction that it does not have."""
    kept = {n: v for n, v in model.initial.items() if n in state_names(kind)}
    model = replace(model, initial={})
    if kind == "single":
        model = replace(model, beta1=0.01, beta2=0.01) if model.kind != "single" else model
    model = model.with_values({"kind": kind})
    return model.with_values(kept) if kept else model


__all__ = ["COLOURS", "HARMONICS", "LINES", "STIFFNESSES", "View", "axis_names", "from_query", "standard"]
