"""What all figures of the page share: size, fonts, ticks, colours of the kinds of motion, legends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bokeh.plotting import figure

from gearchaos.plot.classes import MOTION_CLASSES
from gearchaos.plot.theme import INK, STROBE

SetAttributes = Callable[..., None]
"""A function that takes a Bokeh model and new values of its attributes, and sends these to the browser.

The model in this process is not changed; see `gearchaos.explorer.web.messages.Messages.set_attributes`.
"""

PALETTE = [c.colour for c in MOTION_CLASSES]
BOUNDARY = "#737373"

__all__ = ["BOUNDARY", "FIRST_DATA", "INK", "PALETTE", "STROBE", "Legend", "SetAttributes", "empty_figure",
           "motion_colour", "style_axis"]


FIRST_DATA = {"x": [0.0], "y": [1.0]}
"""Data of a figure without a motion: a single point, which a line does not show. Without any, Bokeh finds no
ranges for its axes, and says so in the browser's console."""


@dataclass(frozen=True)
class Legend:
    """A legend below a figure: its title, and colours with their meaning."""

    title: str = ""
    entries: tuple[tuple[str, str], ...] = ()


def motion_colour(label: str) -> str:
    """The colour of a kind of motion, by its label such as "2T"."""
    colours = {c.name: c.colour for c in MOTION_CLASSES}
    return colours.get(label, colours["other sub-harmonic"])


def empty_figure(title: str = "", ticks: int = 4, **options: Any) -> Any:
    """A Bokeh figure that fills its element, with about ``ticks`` ticks per axis.

    By default it has no tools: a figure that was zoomed would keep its ranges for the next motion.
    """
    plot = figure(
        title=title or None, sizing_mode="stretch_both", min_height=120, output_backend="canvas",
        **{"tools": "", "toolbar_location": None, **options},
    )
    plot.toolbar.logo = None
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
