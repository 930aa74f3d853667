"""The bifurcation diagram along the line through the point, and the branch of a periodic motion over it."""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, HoverTool, LinearColorMapper, MultiLine, Range1d, Scatter, Span
from matplotlib.colors import to_hex

from gearchaos.continuation.events import KINDS
from gearchaos.explorer.core.style import PALETTE, Panel, SetAttributes, Units, image_data, symbol
from gearchaos.plot.axes import cell_extent
from gearchaos.plot.classes import motion_class
from gearchaos.plot.diagrams import DENSITY_COLOURS, DENSITY_EXPONENT, density
from gearchaos.plot.theme import event_words
from gearchaos.studies.orbits.branch_lines import axis_of, line_nodes, line_parts, stability_word

BRANCH_COLOUR = "#d95f02"  # colour of the lines, which differs from those of the diagram and of the marker at the point

_NO_LINES: dict[str, list[Any]] = {"xs": [], "ys": []}
_NO_EVENTS: dict[str, list[Any]] = {n: [] for n in ("x", "y", "marker", "colour", "kind", "at", "multipliers")}


class BranchLines:
    """The stroboscopic displacements of a branch over the diagram, a line for each point of its orbits; its events."""

    def __init__(self, figure: Any, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.stable, self.unstable = (ColumnDataSource(_NO_LINES) for _ in range(2))
        for source, width, dash in ((self.unstable, 1.5, [5, 4]), (self.stable, 2.2, [])):
            for colour, extra in (("white", 2.0), (BRANCH_COLOUR, 0.0)):
                figure.add_glyph(source, MultiLine(
                    xs="xs", ys="ys", line_color=colour, line_width=width + extra, line_join="round",
                    line_alpha=0.7 if extra else 1.0, line_dash=[] if extra else dash))
        self.events = ColumnDataSource(_NO_EVENTS)
        drawn = figure.add_glyph(self.events, Scatter(
            x="x", y="y", marker="marker", size=8, fill_color="colour", line_color="white", line_width=1))
        self.hover = HoverTool(renderers=[drawn], visible=False, limit=3, tooltips=[
            ("event", "@kind"), ("at", "@at"), ("multipliers", "@multipliers")])
        figure.add_tools(self.hover)

    def show(self, found: xr.Dataset, units: Units) -> None:
        """Draw a branch, which is in these units."""
        axis, z, z_event = axis_of(found), found["section_z"].values, found["event_section_z"].values
        kinds, values = found["event_kind"].values, found["event_value"].values
        nodes = line_nodes(found)
        x, y = np.concatenate([found[axis].values, values])[nodes.order], np.concatenate([z, z_event])[nodes.order]
        parts = list(line_parts(nodes))
        for source, wanted in ((self.stable, True), (self.unstable, False)):
            lines = [(x[first:end].tolist(), column.tolist()) for first, end, is_stable in parts if is_stable == wanted
                     for column in y[first:end].T]
            self._set(source, data={"xs": [a for a, _ in lines], "ys": [b for _, b in lines]})
        rows = []
        multipliers = found["event_multipliers_real"].values + 1j * found["event_multipliers_imag"].values
        for kind, value, own, points in zip(kinds, values, multipliers, z_event, strict=True):
            texts = (f"{event_words(str(kind))} of {len(points)}T",
                     f"{symbol(axis)} = {value:.6g}{units.after(axis)}", _multipliers(own))
            rows += [(float(value), float(point), KINDS[kind].marks[1], KINDS[kind].colour, *texts) for point in points]
        columns = zip(*rows, strict=True) if rows else _NO_EVENTS.values()
        self._set(self.events, data={n: list(column) for n, column in zip(_NO_EVENTS, columns, strict=True)})

    def clear(self) -> None:
        """Draw nothing."""
        for source in (self.stable, self.unstable):
            self._set(source, data=_NO_LINES)
        self._set(self.events, data=_NO_EVENTS)


def _multipliers(values: np.ndarray) -> str:
    """Floquet multipliers (d,) in words; a complex pair once."""
    texts = []
    for value in values:
        if abs(value.imag) < 1e-12:
            texts.append(f"{value.real:.4g}")
        elif value.imag > 0:
            texts.append(f"{value.real:.4g} ± {value.imag:.4g}i")
    return ", ".join(texts).replace("-", "−")


class BranchText(NamedTuple):
    """The text below the diagram on the branch shown."""

    lines: list[tuple[bool, str]]  # whether dashed, and words, of the lines that occur
    colour: str  # of the lines
    events: list[tuple[str, str, str]]  # character, colour and words of the kinds of event that occur
    sentences: list[str]


def branch_text(found: xr.Dataset, units: Units) -> BranchText:
    """Legend, range, ends and stable intervals of a branch."""
    axis, unstable, word = axis_of(found), found["unstable"].values > 0, stability_word(found)
    lines = [(bool(dashed), words) for dashed, words in enumerate((word, "unstable")) if (unstable == dashed).any()]
    kinds = found["event_kind"].values.tolist()
    events = [(kind.marks[2], kind.colour, f"{event_words(name)} ({kinds.count(name)})")
              for name, kind in KINDS.items() if name in kinds]
    (low, high), unit = json.loads(found.attrs["range"]), units.after(axis)
    if json.loads(found.attrs["closed"]):
        ends = "closed: it returns to its start (an isola)"
    else:
        ends = "it ends at " + " and at ".join(
            f"{end['value']:.6g}{unit} ({end['why']})" for end in json.loads(found.attrs["ends"]))
    intervals = json.loads(found.attrs[word])
    ranges = ", ".join(_interval(*each) for each in intervals)
    stable = f"{word.capitalize()} from {ranges}{unit}." if intervals else "Stable nowhere."
    first = f"Branch of {found.attrs['period']}T orbits along {symbol(axis)} from {_interval(low, high)}{unit}"
    return BranchText(lines, BRANCH_COLOUR, events, [f"{first}; {ends}.", stable])


def _interval(low: float, high: float) -> str:
    """An interval in words, with as many digits as its ends need to differ."""
    texts = [(f"{low:.{digits}g}", f"{high:.{digits}g}") for digits in (6, 9, 15)]
    return " to ".join(next((ends for ends in texts if ends[0] != ends[1]), texts[0]))


_ROWS = 240  # rows of the image
_STRIP = 0.05  # height of the strip with the kinds of motion, relative to the range of displacements


class BifurcationFigure(Panel):
    """Density of stroboscopic displacements against one parameter, and a strip above it with the kinds of motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, ticks=6, x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        ink = LinearColorMapper(palette=[to_hex(DENSITY_COLOURS(i / 255)) for i in range(256)], low=0, high=1)
        self.ink, _ = self._image(ink)
        self.strip, _ = self._image(LinearColorMapper(palette=PALETTE, low=-0.5, high=len(PALETTE) - 0.5))
        self.branch = BranchLines(self.figure, set_attributes)
        self._diagram: xr.Dataset | None = None
        self._branch: xr.Dataset | None = None
        self._units = Units()
        self.marker = Span(dimension="height", location=0.0, line_color="#c03a1e", line_width=1.5, line_alpha=0.8)
        self.figure.add_layout(self.marker)

    def mark(self, at: float) -> None:
        """Draw a vertical line at the point."""
        self._set(self.marker, location=at)

    def show(self, found: xr.Dataset, units: Units) -> None:
        """Draw a diagram, which is in these units."""
        self._diagram, self._units = found, units
        self._draw()

    def show_branch(self, found: xr.Dataset, units: Units) -> None:
        """Draw a branch, which is in these units, over the diagram."""
        self._branch = found
        self.branch.show(found, units)
        self._draw()

    def clear_branch(self) -> None:
        """Remove the branch."""
        if self._branch is not None:
            self._branch = None
            self.branch.clear()
            self._draw()

    def _draw(self) -> None:
        """Draw the diagram, if there is one, with a vertical axis on which the branch has room too."""
        if self._diagram is None:
            return
        found, units, z = self._diagram, self._units, self._diagram["section_z"]
        axis = str(z.dims[0])
        values = z.transpose(..., "point").values
        known = values[np.isfinite(values)]
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
        if self._branch is not None:  # at most threefold the range, since unstable orbits may be very large
            at, height = self._branch["section_z"].values, max(high - low, 1e-6)
            low, high = max(min(low, float(at.min())), low - height), min(max(high, float(at.max())), high + height)
        margin = 0.03 * (high - low) or 0.5
        low, high = low - margin, high + margin
        shades = density(values, low, high, _ROWS).T ** DENSITY_EXPONENT
        left, right, _, _ = cell_extent(found[axis].values, np.arange(2.0))
        top = high + _STRIP * (high - low)
        self._set(self.ink, data=image_data(shades.astype(np.float32), left, right, low, high))
        strip = motion_class(found["label"], found["period"])[None].astype(np.uint8)
        self._set(self.strip, data=image_data(strip, left, right, high, top))
        self._limit((float(found[axis][0]), float(found[axis][-1])), (low, top))
        of = f" of {found['mesh'].values[0]}" if "mesh" in found.coords else ""  # of a train, its first mesh
        self._label(units.parameter(axis), units.label(z, "z") + of)
