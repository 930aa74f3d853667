"""Cards of results of studies, which are Datasets."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import xarray as xr

from gearchaos.cards.card import Card
from gearchaos.cards.drawing import EMPHASIS, MOST_POINTS, Drawing, around, colours
from gearchaos.datasets import gridded_variable, motions
from gearchaos.errors import InputError
from gearchaos.plot import MOTION_CLASSES, attractor_names, motion_class
from gearchaos.plot._basins import UNDECIDED, attractor_colours
from gearchaos.plot._bifurcation import density
from gearchaos.plot._motions import first_coordinate
from gearchaos.plot._theme import EVENT_COLOURS
from gearchaos.studies.branch_lines import axis_of, line_nodes, line_parts

_MOST_KINDS = 5
"""Most kinds of motion that are listed with their shares."""

_ROWS = 110
"""Rows of the image of a bifurcation diagram."""

_POINT_COLOUR = (111, 143, 208)
"""Colour of the points of a diagram, red, green and blue: visible on light and dark pages."""


_ATTRACTORS = {"attractor_label": 1, "attractor_period": 1, "attractor_fraction": 1}
_PARTS: dict[str, dict[str, int]] = {
    "zones": {"label": 2, "period": 2}, "bifurcation": {"label": 1, "period": 1, "lyapunov": 1},
    "dynamic_factor": {"label": 1, "period": 1, "dynamic_factor": 1}, "basins": {"attractor": 2, **_ATTRACTORS},
    "attractors": {**_ATTRACTORS, "attractor_section_z": 2, "attractor_section_z_dot": 2},
    "branch": {"unstable": 1, "z_peak_to_peak": 1, "event_kind": 1, "event_value": 1, "event_z_peak_to_peak": 1},
    "skeleton": {"curve": 1, "curve_kind": 1}, "simulate": {"section_z": 1, "section_z_dot": 1},
}
"""The variables that the card of a result shows, by kind of study, with their numbers of dimensions."""

_NEVER_EMPTY = ("label", "attractor", "section_z")
"""Those of them that have values in every result; there may be no attractors, events or curves."""


def result_card(ds: xr.Dataset) -> Card:
    """The card of a result: what was varied, what was found, and a small picture."""
    kind = str(ds.attrs.get("study", ""))
    if not kind:
        raise InputError("value", "must be the result of a study", "a Dataset without attrs['study']",
                         "xarray drops attributes in arithmetic, unless xarray.set_options(keep_attrs=True) is set.")
    title = f"Result: {kind.replace('_', ' ')}"
    if not _is_whole(ds, kind):
        return Card(title, [*_axes(ds), ("shown", "a part of the result")])
    return Card(title, [*_axes(ds), *_found(ds, kind)], _picture(ds, kind))


def _is_whole(ds: xr.Dataset, kind: str) -> bool:
    """Whether a result still has what its card shows, with all dimensions; its user may have taken a part of it."""
    return all(name in ds and ds[name].ndim == dims and (ds[name].size or name not in _NEVER_EMPTY)
               for name, dims in _PARTS.get(kind, {}).items())


def _axes(ds: xr.Dataset) -> Iterator[tuple[str, str]]:
    """The ranges of the coordinates that have a unit or a name of a parameter."""
    for name, values in ds.indexes.items():
        array = ds[name]
        if len(values) > 1 and array.dtype.kind == "f":
            unit = str(array.attrs.get("units", ""))
            unit = f" {unit.replace('*', ' ')}" if unit in ("rpm", "N*m", "Hz", "mm", "µm", "ms") else ""
            yield str(name), f"{float(array[0]):.6g} to {float(array[-1]):.6g}{unit}, {len(values)} values"


def _found(ds: xr.Dataset, kind: str) -> Iterator[tuple[str, str]]:
    """What was found, in a few rows."""
    if (status := ds.attrs.get("status", "ok")) != "ok":
        yield "status", str(status)
    if kind in ("basins", "attractors"):
        shares = zip(attractor_names(ds), ds["attractor_fraction"].values, strict=True)
        yield "attractors", ", ".join(f"{name} {100 * share:.3g} %" for name, share in shares)
    elif "label" in ds and ds["label"].ndim:
        counts = Counter(motions(ds["label"], ds["period"]))
        shown = [f"{name} {100 * n / ds['label'].size:.3g} %" for name, n in counts.most_common(_MOST_KINDS)]
        yield "motions", ", ".join(shown) + (", …" if len(counts) > _MOST_KINDS else "")
    if kind == "branch":
        events = Counter(ds["event_kind"].values.tolist())
        yield "points", f"{ds.sizes['point']}, {100 * float((ds['unstable'] == 0).mean()):.3g} % stable"
        yield "events", ", ".join(f"{n} {name}" for name, n in events.items()) or "none"
    if kind == "skeleton":
        kinds = Counter(ds["curve_kind"].values.tolist())
        yield "curves", ", ".join(f"{n} {name}" for name, n in kinds.items()) or "none"


def _picture(ds: xr.Dataset, kind: str) -> str:
    """The drawing of a result as SVG; empty for kinds without one, and for results without values."""
    draw, shown = _DRAWINGS.get(kind), gridded_variable(ds)
    if draw is not None:
        drawing: Drawing | None = draw(ds)
    elif shown is not None and ds[shown].ndim == 1:  # a study without a drawing of its own
        drawing = _line(ds, str(ds[shown].dims[0]), shown)
    else:
        drawing = None
    return drawing.svg if drawing else ""


def _zones(ds: xr.Dataset) -> Drawing:
    index = motion_class(ds["label"], ds["period"])
    palette = np.vstack([colours([kind.colour for kind in MOTION_CLASSES]), np.zeros((1, 4), np.uint8)])
    return _map("map of the kinds of motion", palette[index])


def _basins(ds: xr.Dataset) -> Drawing:
    index = ds["attractor"].values
    palette = np.vstack([colours([*attractor_colours(ds), UNDECIDED]), np.zeros((1, 4), np.uint8)])
    count = len(palette) - 2
    rows = np.where(index < -1, count + 1, np.where(index < 0, count, index))  # -1 undecided, -2 not computed
    return _map("map of the basins of attraction", palette[rows])


def _map(label: str, pixels: np.ndarray) -> Drawing:
    drawing = Drawing(label, (0, 1), (0, 1))
    drawing.raster(pixels)
    return drawing


def _bifurcation(ds: xr.Dataset) -> Drawing:
    axis = str(ds["label"].dims[0])
    if "point" not in ds.dims:
        return _line(ds, axis, "lyapunov")
    name = "section_z" if "section_z" in ds else f"section_{first_coordinate(ds)}"
    values = ds[name].values
    low, high = around(values)
    shade = density(values, low, high, _ROWS).T
    pixels = np.zeros((*shade.shape, 4), np.uint8)
    pixels[..., :3] = _POINT_COLOUR
    pixels[..., 3] = np.round(255 * shade**0.22)
    return _map(f"bifurcation diagram of {name.removeprefix('section_')}", pixels)


def _line(ds: xr.Dataset, axis: str, name: str) -> Drawing:
    """One variable along an axis."""
    x, y = ds[axis].values, ds[name].values
    drawing = Drawing(f"{name.replace('_', ' ')} along {axis}", around(x), around(y))
    drawing.line(x, y)
    return drawing


def _branch(ds: xr.Dataset) -> Drawing:
    nodes, name = line_nodes(ds), "z_peak_to_peak"
    x = np.concatenate([ds[axis_of(ds)].values, ds["event_value"].values])[nodes.order]
    y = np.concatenate([ds[name].values, ds[f"event_{name}"].values])[nodes.order]
    drawing = Drawing("response along the branch, unstable parts dashed", around(x), around(y))
    for first, end, stable in line_parts(nodes):
        drawing.line(x[first:end], y[first:end], dashed=not stable)
    drawing.dots(ds["event_value"].values, ds[f"event_{name}"].values, colour=EMPHASIS)
    return drawing


def _skeleton(ds: xr.Dataset) -> Drawing:
    settings = json.loads(ds.attrs["settings"])
    x, y = (ds[settings[axis][0]].values for axis in "xy")
    (left, right), (low, high) = (settings[axis][1:3] for axis in "xy")
    drawing = Drawing("curves of events", (left, right), (low, high))
    for number, kind in enumerate(ds["curve_kind"].values.tolist()):
        own = ds["curve"].values == number
        dark = kind in ("fold", "pitchfork")
        drawing.line(x[own], y[own], colour="currentColor" if dark else EVENT_COLOURS[kind], dashed=kind == "graze")
    return drawing


def _attractors(ds: xr.Dataset) -> Drawing:
    x, y = (ds[f"attractor_section_{name}"].values for name in ("z", "z_dot"))
    drawing = Drawing("stroboscopic points of the attractors", around(x), around(y))
    for i, colour in enumerate(attractor_colours(ds)):
        drawing.dots(x[i], y[i], radius=3.2)
        drawing.dots(x[i], y[i], colour=colour, radius=2.3)
    return drawing


def _simulate(ds: xr.Dataset) -> Drawing:
    names = ("z", "z_dot") if "tau" in ds.dims else ("section_z", "section_z_dot")
    x, y = (ds[name].values[:MOST_POINTS] for name in names)
    drawing = Drawing("motion in the plane of displacement and velocity", around(x), around(y))
    drawing.line(x, y, width=0.8) if "tau" in ds.dims else drawing.dots(x, y, radius=0.9)
    return drawing


_DRAWINGS: dict[str, Callable[[xr.Dataset], Drawing]] = {
    "zones": _zones, "basins": _basins, "bifurcation": _bifurcation, "branch": _branch, "skeleton": _skeleton,
    "attractors": _attractors, "simulate": _simulate,
    "dynamic_factor": lambda ds: _line(ds, "speed", "dynamic_factor"),
}
"""The drawing of the results of each study that has one."""
