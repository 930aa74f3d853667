"""What the figures of the page share: size, fonts, tools, labels, colours of classes."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any

import xarray as xr
from bokeh.plotting import figure

from gearchaos.plot._axes import axis_label
from gearchaos.plot._classes import MOTION_CLASSES
from gearchaos.plot._phase import INK, STROBE

Put = Callable[..., None]
"""Takes a model and its new attributes, and has the browser show them; see `gearchaos.explorer.bridge.Bridge.put`."""

PALETTE = [c.colour for c in MOTION_CLASSES]
BOUNDARY = "#737373"

__all__ = ["BOUNDARY", "INK", "PALETTE", "STROBE", "Put", "bare", "label", "legend"]


def bare(title: str = "", ticks: int = 4, **options: Any) -> Any:
    """An empty figure that fills its place, with about so many ticks; it has no tools unless they are named.

    A figure that was panned or zoomed would keep its ranges for the next motion.
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
        axis.axis_label_text_font_style, axis.axis_label_text_font_size = "normal", "12px"
        axis.axis_label_standoff, axis.minor_tick_line_color = 3, None
        axis.ticker.update(num_minor_ticks=0, desired_num_ticks=ticks)
    return plot


def label(array: xr.DataArray | xr.Variable, name: str) -> str:
    """The words and the symbol of an axis; Bokeh sets the mathematics itself."""
    return plain(axis_label(array, name))


_GREEK = {
    r"\omega": "ω", r"\varepsilon": "ε", r"\theta": "θ", r"\alpha": "α", r"\kappa": "κ", r"\beta": "β", r"\mu": "μ",
    r"\zeta": "ζ", r"\chi": "χ", r"\tau": "τ", r"\lambda": "λ", r"\dot{z}": "z′", r"V_\mathrm{RMS}": "V_RMS",
}
_SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def plain(text: str) -> str:
    """Mathtext as plain characters: ``$\\varepsilon_{1}$`` as ε₁."""
    if "$" not in text:
        return text
    before, sign, after = text.partition("$")[0], text.split("$")[1], text.split("$", 2)[2]
    for name, letter in _GREEK.items():
        sign = sign.replace(name, letter)
    if sign.startswith(r"\dot{"):
        sign = sign.replace(r"\dot{", "").replace("}", "", 1) + "′"
    head, low, index = sign.partition("_")
    index = index.strip("{}") if low else ""
    subscript = index.replace("{", "").replace("}", "")
    digits = subscript.strip("′").replace(",", "").isdigit()
    shown = subscript.translate(_SUBSCRIPTS) if digits else f"_{subscript}" if low else ""
    return f"{before}{head}{shown}{after}"


def legend(entries: list[tuple[str, str]], title: str = "") -> str:
    """Squares of colour with names, as HTML; they wrap."""
    words = [f"<span>{html.escape(title)}</span>"] if title else []
    squares = (
        f'<span class="entry"><i style="background:{html.escape(colour)}"></i>{html.escape(name)}</span>'
        for colour, name in entries
    )
    return f'<div class="legend">{"".join([*words, *squares])}</div>'
