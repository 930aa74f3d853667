"""Colours of lines and texts on a light or a dark background, and how kinds of events are marked."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from typing import Any

from matplotlib import rcParams
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb
from matplotlib.patheffects import withStroke

INK = "#1d2b53"
"""Colour of lines and points in all pictures, on a light background: dark blue."""

STROBE = "#c03a1e"
"""Colour of stroboscopic points on a trajectory, and of what is emphasised, on a light background: red."""

BACKGROUND = "white"
"""The colour that stands for the background of a picture: of outlines, and of boxes behind texts."""

_DARK = 0.5
"""Lightness below which a background is dark, from 0 (black) to 1 (white)."""

_CONTRAST = 0.8
"""Share of the range of lightness that colours keep when their lightness is reversed."""

_OUTLINE = 2.0
"""Width of the outline of a legend handle, on both sides together, in points."""

_PALE = 0.85
"""Lightness above which a colour is pale: that of an area behind lines, which becomes a dark one."""

_PALE_SATURATION = 0.4
"""Factor of the saturation of pale colours, which would be too strong when dark."""

_ON_DARK = {
    "#111111": "#f2f2f2", "#2a7fff": "#1bc2ff", "#d18f00": "#dbb80f", "#3d5a00": "#86b572", "#9a9a9a": "#6b6b6b",
    "#a3158f": "#ff39c2",
}
"""Colours of the kinds of events of periodic orbits on a dark background, which differ by at least 25 CIELAB units,
also under protanopia, deuteranopia and tritanopia; colours with reversed lightness would be too similar."""

_COLOUR_KEYS = ("color", "facecolor", "edgecolor", "markerfacecolor", "markeredgecolor")


def is_dark() -> bool:
    """Whether new Axes have a dark background, by matplotlib's current settings."""
    return colorsys.rgb_to_hls(*to_rgb(rcParams["axes.facecolor"]))[1] < _DARK


def adapt(colour: str) -> str:
    """The colour itself on a light background; on a dark one a similar hue with reversed lightness.

    `BACKGROUND` becomes the colour of the background.
    """
    if not is_dark() or colour == "none":
        return colour
    if colour == BACKGROUND:
        return to_hex(rcParams["axes.facecolor"])
    if colour in _ON_DARK:
        return _ON_DARK[colour]
    hue, lightness, saturation = colorsys.rgb_to_hls(*to_rgb(colour))
    pale = lightness > _PALE
    return to_hex(colorsys.hls_to_rgb(hue, 1 - _CONTRAST * lightness, saturation * (_PALE_SATURATION if pale else 1)))


def adapt_style(style: Mapping[str, Any]) -> dict[str, Any]:
    """Properties of an artist, with all colours adapted to the background by `adapt`."""
    return {key: adapt(value) if key in _COLOUR_KEYS else value for key, value in style.items()}


def style_on(on_map: bool, style: Mapping[str, Any]) -> dict[str, Any]:
    """Properties of an artist as they are over a map, whose colours are the same in all styles; else adapted."""
    return dict(style) if on_map else adapt_style(style)


def legend_style(on_map: bool, style: Mapping[str, Any]) -> dict[str, Any]:
    """Properties of the legend handle of a line; that of a line over a map has a white outline on a dark background."""
    if not (on_map and is_dark()):
        return style_on(on_map, style)
    outline = [withStroke(linewidth=style.get("linewidth", 1.0) + _OUTLINE, foreground="white")]
    return {**style, "path_effects": outline}


def adapt_scale(scale: LinearSegmentedColormap) -> LinearSegmentedColormap:
    """A colour scale from white to dark colours; on a dark background from its colour to light colours."""
    if not is_dark():
        return scale
    rest = [adapt(to_hex(scale(share))) for share in (1 / 3, 2 / 3, 1.0)]
    return LinearSegmentedColormap.from_list(f"{scale.name}-dark", [rcParams["axes.facecolor"], *rest])


EVENT_COLOURS = {
    "fold": "#111111", "flip": "#2a7fff", "neimark-sacker": "#d18f00", "pitchfork": "#3d5a00",
    "neutral-saddle": "#9a9a9a", "graze": "#a3158f",
}
"""In the order of legends. Colours differ by at least 25 CIELAB units, also under protanopia, deuteranopia and
tritanopia."""

SPECIAL_MARKERS = {
    "cusp": "v", "generalised flip": "D", "1:1 resonance": "P", "1:2 resonance": "X", "1:3 resonance": "^",
    "1:4 resonance": "s", "fold-flip": "o", "fold-neimark-sacker": "h", "flip-neimark-sacker": "p", "grazing-fold": "<",
    "grazing-flip": ">", "grazing-neimark-sacker": "d", "double graze": "*",
}
"""Markers of the points of codimension 2 by kind, in the order of legends."""


def event_words(kind: str) -> str:
    """A kind of event in words."""
    return "Neimark–Sacker" if kind == "neimark-sacker" else kind.replace("-", " ")
