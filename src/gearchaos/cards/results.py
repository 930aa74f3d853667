"""Cards of what was computed: verdicts, orbits, what divides two basins, and results of studies."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
import xarray as xr

from gearchaos.cards.card import EMPHASIS, MOST_POINTS, Card, Drawing, around, card, colours
from gearchaos.continuation.events import KINDS
from gearchaos.continuation.orbit import Orbit
from gearchaos.continuation.saddles import EdgeState
from gearchaos.datasets import gridded_variable, motions
from gearchaos.errors import InputError
from gearchaos.plot import MOTION_CLASSES, attractor_names, motion_class
from gearchaos.plot.classes import NO_CLASS
from gearchaos.plot.diagrams import density
from gearchaos.plot.motions import first_coordinate
from gearchaos.plot.states import UNDECIDED, attractor_colours
from gearchaos.studies.motion.regime import Verdict, steady
from gearchaos.studies.motion.simulate import simulate
from gearchaos.studies.operation.factor_context import beside_factors
from gearchaos.studies.orbits.branch_lines import axis_of, line_nodes, line_parts

_PLANE = ("z", "z_dot")
_LONGEST = 16  # longest period, in mesh periods, of an orbit whose trajectory is drawn
_SAMPLES = 48  # instants drawn in each mesh period
_BACKLASH_COLOUR = "rgba(128,128,128,.7)"


@card.register
def _verdict(verdict: Verdict) -> Card:
    """Its evidence, and the motion in the phase plane, of a short period as a trajectory, else as points."""
    palette = {kind.name: kind.colour for kind in MOTION_CLASSES}
    rows = [("because", verdict.reason)]
    if verdict.multipliers:
        rows.append(("largest multiplier", f"{abs(verdict.multipliers[0]):.4g} in modulus"))
    if verdict.lyapunov:
        low, high = verdict.lyapunov_ci[0]
        interval = f", {low:.4g} to {high:.4g} at 99 %" if high > low else ""
        rows.append(("largest exponent", f"{verdict.lyapunov[0]:.4g}{interval}"))
    rows += [(name, f"{value:.4g}") for name, value in (
        ("V_RMS", verdict.v_rms), ("dynamic factor", verdict.dynamic_factor)) if value is not None]
    if verdict.dynamic_factor is not None:
        rows += beside_factors(verdict.model, factor=verdict.dynamic_factor).items()
    if verdict.contact is not None:
        rows.append(("contact", verdict.contact))
    model = verdict.model
    point = f"{model.kind}, ω = {model.omega:.6g}"
    if model.is_operated:
        point += f", {model.value('speed'):.6g} rpm, {model.value('torque'):.6g} N m"
    rows.append(("operating point", point))
    trajectory, picture = None, ""
    if "z" in verdict.section:
        if verdict.period is not None and verdict.period <= _LONGEST:
            motion = steady(model, verdict)
            samples = len(motion.tau) // 8  # `steady` records eight periods of the orbit
            trajectory = [motion[name].values[: samples + 1] for name in _PLANE]
        picture = _phase_plane(trajectory, [np.array(verdict.section[name]) for name in _PLANE])
    return Card(f"Verdict: {verdict.label}", rows, picture, palette.get(verdict.label, palette["other sub-harmonic"]))


def _phase_plane(trajectory: list[np.ndarray] | None, points: list[np.ndarray]) -> str:
    """The plane of z and its velocity, with both ends of the backlash."""
    shown = points if trajectory is None else trajectory
    drawing = Drawing("motion in the plane of displacement and velocity", around(shown[0]), around(shown[1]))
    for end in (-1, 1):
        drawing.line(np.full(2, end), np.array(drawing.y), colour=_BACKLASH_COLOUR, width=0.8, dashed=True)
    if trajectory is not None:
        drawing.line(*trajectory)
    drawing.dots(*points, colour=EMPHASIS, radius=2.2 if trajectory is not None else 0.9)
    return drawing.svg


@card.register
def _orbit(orbit: Orbit) -> Card:
    n = orbit.unstable
    kind = f"unstable in {n} direction{'s' * (n > 1)}" if n else orbit.stability
    multipliers = (f"{m.real:.4g}" + (f" {'+' if m.imag > 0 else '−'} {abs(m.imag):.4g}i" if m.imag else "")
                   for m in orbit.multipliers[:4])
    rows = [("multipliers", ", ".join(multipliers)),
            ("first point", ", ".join(f"{name} = {value:.6g}" for name, value in orbit.state.items())),
            ("contact switches", str(len(orbit.switches))), ("residual", f"{orbit.residual:.2g}")]
    picture = ""
    if orbit.period <= _LONGEST:
        motion = simulate(orbit.model, orbit.period, samples=_SAMPLES)
        points = [motion[f"section_{name}"].values for name in _PLANE]
        picture = _phase_plane([np.append(motion[n].values, motion[n].values[0]) for n in _PLANE], points)
    return Card(f"Orbit of period {orbit.period}T, {kind}", rows, picture)


@card.register
def _edge(edge: EdgeState) -> Card:
    """What divides two basins: its saddle."""
    if edge.orbit is None:
        count = len(next(iter(edge.states.values()), ()))
        return Card("Edge state: not periodic", [("states on the boundary", str(count))])
    inner = _orbit(edge.orbit)
    return Card(f"Edge state: {inner.title[0].lower()}{inner.title[1:]}", inner.rows, inner.picture)


_MOST_KINDS = 5  # most kinds of motion that are listed with their shares
_ROWS = 110  # rows of the image of a bifurcation diagram
_POINT_COLOUR = (111, 143, 208)  # of a diagram, red, green and blue: visible on light and dark pages

_NEVER_EMPTY = ("label", "attractor", "section_z")
"""Variables of cards that have values in every result; there may be no attractors, events or curves."""


@card.register
def _result(ds: xr.Dataset) -> Card:
    """What was varied, what was found, and a small picture."""
    kind = str(ds.attrs.get("study", ""))
    if not kind:
        raise InputError("value", "must be the result of a study", "a Dataset without attrs['study']",
                         "xarray drops attributes in arithmetic, unless xarray.set_options(keep_attrs=True) is set.")
    title = f"Result: {kind.replace('_', ' ')}"
    parts, draw = _SHOWN.get(kind, ({}, None))
    whole = all(name in ds and ds[name].ndim == dims and (ds[name].size or name not in _NEVER_EMPTY)
                for name, dims in parts.items())
    if not whole:  # its user has taken a part of it
        return Card(title, [*_axes(ds), ("shown", "a part of the result")])
    shown = gridded_variable(ds)
    if draw is None and shown is not None and ds[shown].ndim == 1:  # a study without a drawing of its own
        picture = _line(ds, str(ds[shown].dims[0]), shown).svg
    else:
        picture = draw(ds).svg if draw else ""
    rows = [*_axes(ds)]
    if (status := ds.attrs.get("status", "ok")) != "ok":
        rows.append(("status", str(status)))
    if kind in ("basins", "attractors"):
        shares = zip(attractor_names(ds), ds["attractor_fraction"].values, strict=True)
        rows.append(("attractors", ", ".join(f"{name} {100 * share:.3g} %" for name, share in shares)))
    elif "label" in ds and ds["label"].ndim:
        counts = Counter(motions(ds["label"], ds["period"]))
        listed = [f"{name} {100 * n / ds['label'].size:.3g} %" for name, n in counts.most_common(_MOST_KINDS)]
        rows.append(("motions", ", ".join(listed) + (", …" if len(counts) > _MOST_KINDS else "")))
    if kind == "branch":
        events = Counter(ds["event_kind"].values.tolist())
        rows.append(("points", f"{ds.sizes['point']}, {100 * float((ds['unstable'] == 0).mean()):.3g} % stable"))
        rows.append(("events", ", ".join(f"{n} {name}" for name, n in events.items()) or "none"))
    if kind == "skeleton":
        kinds = Counter(ds["curve_kind"].values.tolist())
        rows.append(("curves", ", ".join(f"{n} {name}" for name, n in kinds.items()) or "none"))
    return Card(title, rows, picture)


def _axes(ds: xr.Dataset) -> Iterator[tuple[str, str]]:
    """The ranges of the coordinates that have a unit or a name of a parameter."""
    for name, values in ds.indexes.items():
        array = ds[name]
        if len(values) > 1 and array.dtype.kind == "f":
            unit = str(array.attrs.get("units", ""))
            unit = f" {unit.replace('*', ' ')}" if unit in ("rpm", "N*m", "Hz", "mm", "µm", "ms") else ""
            yield str(name), f"{float(array[0]):.6g} to {float(array[-1]):.6g}{unit}, {len(values)} values"


def _basins(ds: xr.Dataset) -> Drawing:
    palette, index = [*attractor_colours(ds), UNDECIDED], ds["attractor"].values
    # -1 is undecided, -2 not computed
    cells = np.where(index < -1, NO_CLASS, np.where(index < 0, len(palette) - 1, index))
    return _class_map("map of the basins of attraction", cells, palette)


def _class_map(label: str, index: np.ndarray, palette: list[str]) -> Drawing:
    """A map of classes (rows, columns) in their colours; cells of `NO_CLASS`, the last row, are transparent."""
    drawing = Drawing(label, (0, 1), (0, 1))
    drawing.raster(np.vstack([colours(palette), np.zeros((1, 4), np.uint8)])[index])
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
    drawing = Drawing(f"bifurcation diagram of {name.removeprefix('section_')}", (0, 1), (0, 1))
    drawing.raster(pixels)
    return drawing


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
        own, look = ds["curve"].values == number, KINDS[kind]
        colour = "currentColor" if kind in ("fold", "pitchfork") else look.colour  # that are dark
        drawing.line(x[own], y[own], colour=colour, dashed=not look.changes)
    return drawing


def _attractors(ds: xr.Dataset) -> Drawing:
    x, y = (ds[f"attractor_section_{name}"].values for name in _PLANE)
    drawing = Drawing("stroboscopic points of the attractors", around(x), around(y))
    for i, colour in enumerate(attractor_colours(ds)):
        drawing.dots(x[i], y[i], radius=3.2)
        drawing.dots(x[i], y[i], colour=colour, radius=2.3)
    return drawing


def _simulate(ds: xr.Dataset) -> Drawing:
    prefix = "" if "tau" in ds.dims else "section_"
    x, y = (ds[f"{prefix}{name}"].values[:MOST_POINTS] for name in _PLANE)
    drawing = Drawing("motion in the plane of displacement and velocity", around(x), around(y))
    drawing.line(x, y, width=0.8) if "tau" in ds.dims else drawing.dots(x, y, radius=0.9)
    return drawing


_ATTRACTORS = {"attractor_label": 1, "attractor_period": 1, "attractor_fraction": 1}
_SHOWN: dict[str, tuple[dict[str, int], Callable[[xr.Dataset], Drawing]]] = {
    "zones": ({"label": 2, "period": 2}, lambda ds: _class_map(
        "map of the kinds of motion", motion_class(ds["label"], ds["period"]),
        [kind.colour for kind in MOTION_CLASSES])),
    "bifurcation": ({"label": 1, "period": 1, "lyapunov": 1}, _bifurcation),
    "dynamic_factor": ({"label": 1, "period": 1, "dynamic_factor": 1},
                       lambda ds: _line(ds, "speed", "dynamic_factor")),
    "basins": ({"attractor": 2, **_ATTRACTORS}, _basins),
    "attractors": ({**_ATTRACTORS, "attractor_section_z": 2, "attractor_section_z_dot": 2}, _attractors),
    "branch": ({"unstable": 1, "z_peak_to_peak": 1, "event_kind": 1, "event_value": 1, "event_z_peak_to_peak": 1},
               _branch),
    "skeleton": ({"curve": 1, "curve_kind": 1}, _skeleton),
    "simulate": ({"section_z": 1, "section_z_dot": 1}, _simulate),
}
"""What the card of a result shows, by kind of study: variables with their numbers of dimensions, and the drawing."""
