"""What figures and texts of the page share: words, symbols and units in plain characters; colours, fonts, images."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, DataRange1d, Image, LinearColorMapper
from bokeh.plotting import figure

from gearchaos.explorer.core import bounds
from gearchaos.gears.operation.operating import Gears, pair_of
from gearchaos.gears.operation.results import physical, unit_of
from gearchaos.plot.axes import axis_label
from gearchaos.plot.classes import MOTION_CLASSES
from gearchaos.quantities import (
    COORDINATES,
    HARMONICS,
    OPERATION,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    STIFFNESS_PARAMETERS,
    VERDICTS,
    find,
    quantity,
)

_SCALES = {"delta": "Δ", "omega0": "ω₀", "1/omega0": "1/ω₀", "c0": "c₀", "1": ""}
"""Symbols of the units that make a quantity dimensionless."""

_HINTS = {
    "omega": "Mesh frequency over the natural frequency √(c₀/m) on the mean mesh stiffness: 1 is resonance",
    "q0": "Torque on both wheels, as a compression of the mean mesh stiffness in half backlashes",
    "q1": "Driving torque on wheel 1, as a compression of the mean mesh stiffness in half backlashes",
    "q2": "Resisting torque on wheel 2, as a compression of the mean mesh stiffness in half backlashes",
    "eps": "Amplitude of a harmonic of the transmission error, in half backlashes: how inexact the teeth are",
    "theta": "Phase of a harmonic of the transmission error, in rad",
    "zeta": "Damping of the mesh over critical damping: gears have 0.02 to 0.1",
    "chi0": "Step of the mesh stiffness about its mean, as the number of tooth pairs in contact changes",
    "chi1": "Height of the upper level of the mesh stiffness above its mean",
    "chi2": "Depth of the lower level of the mesh stiffness below its mean",
    "contact_ratio": "Mean number of tooth pairs in contact: 1.5 means two pairs for half of the time",
    "c": "Amplitude of a harmonic of the mesh stiffness, as a share of its mean",
    "alpha": "Phase of a harmonic of the mesh stiffness, in rad",
    "J": "Inertia of each wheel, over the mass m of the relative motion",
    "beta": "Friction in the bearings of each wheel",
    "mu": "Mass of each wheel, over the mass m of the relative motion",
    "kappa": "Stiffness of the support of each wheel, over the mean mesh stiffness",
    "zeta_support": "Damping of the support of each wheel",
    "speed": "Speed of wheel 1", "torque": "Torque at wheel 1",
    "backlash": "Total play of the teeth along the line of action",
    "grade": "Accuracy grade from which the transmission error follows: 1 is the finest",
    "z": "Dynamic transmission error at the start: from −1 to 1, in half backlashes, the teeth are apart",
    "x": "Rotation of a wheel at the start, as an arc on its base circle, in half backlashes",
    "y": "Displacement of the centre of a wheel at the start, in half backlashes",
    "v_rms": "How strong the vibration is, as the root mean square of the velocity",
    "z_rms": "Root mean square of the dynamic transmission error about its mean",
    "z_peak_to_peak": "Largest minus smallest dynamic transmission error",
    "dynamic_factor": "Peak of the mesh force over the static force that carries the torque",
    "contact_fraction": "Share of the time in which the teeth touch",
    "contact": "Whether the teeth stay in contact, separate, or also hit the back flanks",
    "multiplier": "Growth of a small disturbance over one period of the motion: below 1 the motion is stable",
    "lyapunov": "Mean rate at which neighbouring motions part: positive means chaos",
    "mesh_force_peak": "Largest force between the teeth",
}
"""What a parameter or measure means, by name; that of both wheels or of a family of harmonics holds for all of them."""

_MOTIONS = {
    "quasi-periodic": "Two frequencies without a common period: the motion never repeats",
    "chaotic": "Never repeats, and neighbouring motions part exponentially",
    "undecided": "The computation was not long enough to tell", "diverged": "Grows without bound",
    "other sub-harmonic": "Repeats after 5 or more mesh periods",
    "in contact": "The teeth never separate", "separation": "The teeth separate and meet on the driving flanks",
    "both flanks": "The teeth separate and also hit their back flanks", "no contact": "The teeth never touch",
}
"""What the kinds of motion that have no period, and the contact states, mean."""


def hint(name: str) -> str:
    """What a parameter or measure means, in words."""
    base = name.removesuffix("_dot").rstrip("0123456789") if name not in _HINTS else name
    return f"Velocity of: {_HINTS[base]}" if name.endswith("_dot") else _HINTS.get(base, title(name))


def motion_hint(name: str) -> str:
    """What a kind of motion, such as "2T", or a contact state means, in words."""
    count = name.removesuffix("T")
    if not count.isdecimal():
        return _MOTIONS.get(name, "")
    return "Repeats with every mesh period T" if count == "1" else f"Repeats after {count} mesh periods"


def title(name: str) -> str:
    """A parameter in words; empty for an initial value."""
    return "" if (found := find(name)) is None else found.title


def symbol(name: str) -> str:
    """The symbol of a parameter or variable, or its name: of a part of a train as it is, of others in words."""
    found = find(name)
    return found.symbol if found is not None and found.symbol else name if "." in name else name.replace("_", " ")


def label(array: xr.DataArray | xr.Variable, name: str) -> str:
    """Label of an axis: words, symbol and unit of a variable."""
    return plain(axis_label(array, name))


def unit(array: xr.DataArray | xr.Variable) -> str:
    """The unit of a variable, e.g. ``mm/s`` or ``Δω₀``; empty for a plain number."""
    return _unit_symbols(array.attrs.get("units", "1"))


def _unit_symbols(text: str) -> str:
    """A unit as it is shown: ``Δω₀`` for ``delta*omega0``, ``N m`` for ``N*m``; empty for a plain number."""
    parts = text.replace("^2", "²").split("*")
    return "".join(_SCALES[part] for part in parts) if set(parts) <= _SCALES.keys() else " ".join(parts)


def plain(text: str) -> str:
    """A text with the mathtext of symbols in plain characters: ``$\\varepsilon_{1}$`` becomes ε₁."""
    before, _, rest = text.partition("$")
    tex, _, after = rest.partition("$")
    return f"{before}{_plain_symbols().get(tex, tex)}{after}"


@cache
def _plain_symbols() -> dict[str, str]:
    """The symbols of all quantities, dimensionless and with units, by their mathtext."""
    orders = range(1, bounds.HIGHEST_HARMONIC + 1)
    harmonics = [quantity(f"{family}{order}") for family in HARMONICS for order in orders]
    found = [*PARAMETERS, *OPERATION, *STIFFNESS_PARAMETERS, *harmonics, *COORDINATES, *RESPONSES, *VERDICTS, *RESULTS]
    with_units = {q.physical.tex: q.physical.symbol for q in found if q.physical is not None}
    return with_units | {q.tex: q.symbol for q in found}


NONE = "–"  # the unit of a plain number on a page that marks those


@dataclass(frozen=True)
class Units:
    """The units of one figure or text: those of the gears, or dimensionless ones.

    Dimensionless numbers are ``marked`` as such on a page that has others too.
    """

    gears: Gears | None = None
    marked: bool = False

    def scaled(self, dataset: xr.Dataset) -> xr.Dataset:
        """A dimensionless result in these units."""
        return dataset if self.gears is None else physical(dataset, self.gears)

    def variables(self, variables: Mapping[str, xr.Variable]) -> dict[str, xr.Variable]:
        """Dimensionless variables by name in these units."""
        shown = self.scaled(xr.Dataset(dict(variables)))
        return {name: shown[name].variable for name in variables}

    def one(self, name: str) -> float:
        """The value of one dimensionless unit of a quantity."""
        found = None if self.gears is None else unit_of(name, pair_of(self.gears).scales)
        return 1.0 if found is None else found[0]

    def label(self, array: xr.DataArray | xr.Variable, name: str) -> str:
        """Label of an axis: words, symbol and unit of a variable."""
        text = label(array, name)
        return text if "[" in text or not self.marked else f"{text} [{unit(array) or NONE}]"

    def parameter(self, name: str) -> str:
        """Label of an axis or a slider: a parameter in words, its symbol, and its unit."""
        return f"{title(name)} {symbol(name)}".strip() + self.bracketed(name)

    def of_parameter(self, name: str) -> str:
        """The unit of a parameter or initial value, which is dimensionless unless it is one of gears."""
        found = find(name)
        if found is not None and found.title.endswith("phase"):
            return "rad"
        return NONE if found is None else _unit_symbols(found.unit) or NONE

    def bracketed(self, name: str) -> str:
        """The unit of a parameter in brackets after a space; empty on a page without gears."""
        return f" [{self.of_parameter(name)}]" if self.marked else ""

    def after(self, name: str) -> str:
        """The unit of a parameter to follow its value; empty on a page without gears."""
        text = self.of_parameter(name)
        return f" {text if text != NONE else f'[{NONE}]'}" if self.marked else ""

    def of_measure(self, name: str) -> str:
        """The unit of a measure by which a map is coloured, in brackets after a space; empty without gears."""
        found = find(name)
        if not self.marked or found is None:
            return ""
        physical_unit = found.physical.unit if self.gears is not None and found.physical is not None else None
        return f" [{physical_unit or _unit_symbols(found.unit) or NONE}]"

    def number(self, value: float | str, unit_text: str) -> str:
        """A number with its unit."""
        mark = unit_text or (f"[{NONE}]" if self.marked else "")
        return f"{value}\N{NO-BREAK SPACE}{mark}" if mark else str(value)


SetAttributes = Callable[..., None]
"""A function that takes a Bokeh model and new values of its attributes, and sends these to the browser.

The model in this process is not changed; see `gearchaos.explorer.web.messages.Messages.set_attributes`.
"""

PALETTE = [c.colour for c in MOTION_CLASSES]
BOUNDARY = "#737373"

FIRST_DATA = {"x": [0.0], "y": [1.0]}
"""Data of a figure without a motion: a single point, which a line does not show. Without any, Bokeh finds no
ranges for its axes, and says so in the browser's console."""


class Legend(NamedTuple):
    """A legend below a figure: its title, and colours with their meaning."""

    title: str = ""
    entries: tuple[tuple[str, str], ...] = ()


def motion_colour(label: str) -> str:
    """The colour of a kind of motion, by its label such as "2T"."""
    colours = {c.name: c.colour for c in MOTION_CLASSES}
    return colours.get(label, colours["other sub-harmonic"])


class Panel:
    """A Bokeh figure, whose changes are sent by a `SetAttributes`."""

    def __init__(self, set_attributes: SetAttributes, title: str = "", ticks: int = 4, **options: Any) -> None:
        self._set = set_attributes
        self.figure = empty_figure(title, ticks, **options)

    def _label(self, x: str, y: str) -> None:
        """Label the horizontal axis, the lower one if there are two, and the vertical axis."""
        self._set(self.figure.xaxis[-1], axis_label=x)
        self._set(self.figure.yaxis[0], axis_label=y)

    def _limit(self, x: tuple[float, float], y: tuple[float, float]) -> None:
        """Set both ends of both axes."""
        self._set(self.figure.x_range, start=x[0], end=x[1])
        self._set(self.figure.y_range, start=y[0], end=y[1])

    def _image(self, mapper: LinearColorMapper) -> tuple[ColumnDataSource, Any]:
        """The source of an image, and what draws it."""
        self.figure.grid.visible = False
        source = ColumnDataSource(NO_IMAGE)
        glyph = Image(image="image", x="x", y="y", dw="dw", dh="dh", color_mapper=mapper)
        return source, self.figure.add_glyph(source, glyph)


NO_IMAGE: dict[str, list[Any]] = {n: [] for n in ("image", "x", "y", "dw", "dh")}


def image_data(image: np.ndarray, left: float, right: float, bottom: float, top: float) -> dict[str, list[Any]]:
    """The data of an image (rows, columns) between these ends."""
    return {"image": [image], "x": [left], "y": [bottom], "dw": [right - left], "dh": [top - bottom]}


def empty_figure(title: str = "", ticks: int = 4, **options: Any) -> Any:
    """A Bokeh figure that fills its element, with about ``ticks`` ticks per axis.

    By default it has no tools: a figure that was zoomed would keep its ranges for the next motion.
    """
    plot = figure(title=title or None, sizing_mode="stretch_both", min_height=120, output_backend="canvas",
                  **{"tools": "", "toolbar_location": None, **options})
    plot.toolbar.logo = None
    for ends in (plot.x_range, plot.y_range):
        ends.syncable = not isinstance(ends, DataRange1d)  # those that the browser finds need not be sent here
    plot.min_border, plot.outline_line_color = 4, "#c8c8c8"
    plot.grid.grid_line_color = "#eeeeee"
    if plot.title is not None:
        plot.title.update(text_font_size="12px", text_font_style="normal", text_color="#444444")
    for axis in (*plot.xaxis, *plot.yaxis):
        style_axis(axis, ticks)
    return plot


def style_axis(axis: Any, ticks: int) -> None:
    """Set fonts and ticks of an axis."""
    axis.axis_label_text_font_style, axis.axis_label_text_font_size = "normal", "12px"
    axis.axis_label_standoff, axis.minor_tick_line_color = 3, None
    axis.ticker.update(num_minor_ticks=0, desired_num_ticks=ticks)
