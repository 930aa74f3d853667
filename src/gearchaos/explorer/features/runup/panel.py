"""A run-up: the response over the speed and the waterfall of orders, which the browser draws as the speed goes by."""

from __future__ import annotations

import base64
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Line, LinearColorMapper, Range1d, Scatter, Span
from matplotlib import colormaps
from matplotlib.colors import to_hex

from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import Panel, SetAttributes, Units, image_data, unit
from gearchaos.explorer.features.runup.job import RunUpResult
from gearchaos.plot._runup import WATERFALL_COLOURS, WATERFALL_RANGE, WAYS, waterfall
from gearchaos.plot.axes import cell_extent
from gearchaos.quantities import quantity
from gearchaos.studies.operation.factor_context import words_beside

_MARK = "#c03a1e"  # colour of what moves with the speed
_NO_POINTS: dict[str, list[float]] = {"x": [], "y": []}
_DASHES = {"-": "solid", "--": "dashed"}


class _SpeedFigure(Panel):
    """A figure over the speed, with a line at the present one."""

    def __init__(self, set_attributes: SetAttributes, title: str) -> None:
        super().__init__(set_attributes, title, ticks=5, x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.now = Span(dimension="height", line_color=_MARK, line_width=1.5, visible=False)
        self.figure.add_layout(self.now)


class RunFigure(_SpeedFigure):
    """The dynamic factor over the speed, without load the peak of the mesh force; the motions after jumps as dots."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Run-up")
        self.lines = [ColumnDataSource(_NO_POINTS) for _ in WAYS]
        for source, (colour, dash, _) in zip(self.lines, WAYS.values(), strict=True):
            look = {"line_color": colour, "line_dash": _DASHES[dash], "line_width": 1.5}
            self.figure.add_glyph(source, Line(x="x", y="y", **look))
        self.jumps = ColumnDataSource(_NO_POINTS)
        self.figure.add_glyph(self.jumps, Scatter(x="x", y="y", size=6, fill_color=_MARK, line_color="white"))

    def show(self, found: xr.Dataset, units: Units) -> str:
        """Set the axes for a run-up in these units, and return the name of the variable over the speed."""
        name = "dynamic_factor" if np.isfinite(found["dynamic_factor"]).any() else "mesh_force_peak"
        speed, values = found["speed"], found[name]
        self._limit(cell_extent(speed.values, np.arange(2.0))[:2], (0.0, 1.05 * float(np.nanmax(values, initial=1e-9))))
        self._label(units.label(speed, "speed"), units.label(values, name))
        return name


class WaterfallFigure(_SpeedFigure):
    """The mesh force over the speed and the orders of the turn of the first wheel, in the present direction."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Orders")
        shades = [to_hex(colormaps[WATERFALL_COLOURS](i)) for i in range(256)]
        self.image, _ = self._image(LinearColorMapper(palette=shades, low=-WATERFALL_RANGE, high=0.0))

    def show(self, found: xr.Dataset, units: Units) -> list[dict[str, Any]]:
        """Set the axes for a run-up in these units, and return the images of its directions."""
        edges, level, words = waterfall(found)
        left, right, _, _ = cell_extent(found["speed"].values, np.arange(2.0))
        self._limit((left, right), (float(edges[0]), float(edges[-1])))
        self._label(units.label(found["speed"], "speed"), "order")
        self._set(self.figure.title, text=f"Orders, {words}")
        return [image_data(each.T.astype(np.float32), left, right, float(edges[0]), float(edges[-1])) for each in level]


class RunUpText(NamedTuple):
    """What stands below the figures of a run-up."""

    lines: list[tuple[str, bool, str]]  # colour, whether dashed, and words of the directions
    jumps: str  # colour of the dots
    sentences: list[str]


def run_up_text(found: xr.Dataset, name: str) -> RunUpText:
    """The legend of a run-up, where it jumps, and what belongs beside the variable ``name``."""
    ways = found["direction"].values.tolist()
    lines = [(WAYS[way][0], WAYS[way][1] == "--", WAYS[way][2]) for way in ways]
    sentences = [] if found.attrs["status"] == "ok" else [f"The run {found.attrs['status']}."]
    for way in ways:
        own = found.isel(jump=found["direction_of_jump"].values == way)
        for words, clear in (("Jumps", True), ("Changes from or to a motion that is not steady", False)):
            speeds = own["speed_of_jump"].values[own["clear_jump"].values == clear]
            if len(speeds):
                sentences.append(f"{words}, {WAYS[way][2]}: {', '.join(f'{speed:.0f}' for speed in speeds)} rpm.")
    return RunUpText(lines, _MARK, [*sentences, *words_beside(found, name)])


def played(found: RunUpResult, dataset: xr.Dataset, view: View, name: str, images: list[dict[str, Any]],
           ids: dict[str, Any]) -> dict[str, Any]:
    """All that the browser needs to play a run-up; ``ids`` are those of the models that it changes.

    Lines and jumps are in the order in which they go by.
    """
    run, ways = view.run, dataset["direction"].values.tolist()
    assert run is not None
    speed, lines, jumps = dataset["speed"].values, [], []
    for i, way in enumerate(ways):
        forward = slice(None, None, -1 if way == "down" else 1)
        lines.append([speed[forward].tolist(), dataset[name].values[i][forward].tolist()])
        own = dataset.isel(jump=dataset["direction_of_jump"].values == way)
        factors = own["factor_after_jump"].values if name == "dynamic_factor" else np.full(own.sizes["jump"], np.nan)
        jumps.append([own["speed_of_jump"].values[forward].tolist(), factors[forward].tolist()])
    axis = next((n for n, a in (("x", view.x), ("y", view.y)) if a.name == "speed"), "")
    sound = f"data:audio/wav;base64,{base64.b64encode(found.sound).decode()}" if found.sound else ""
    return {"start": run.start, "stop": run.stop, "duration": run.duration, "lines": lines, "jumps": jumps,
            "images": images, "axis": axis, "at": list(view.at), "sound": sound,
            "measure": quantity(name).long_name, "unit": unit(dataset[name]), **ids}
