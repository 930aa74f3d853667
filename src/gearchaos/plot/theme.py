"""How pictures look: sizes, fonts and background of a style, colours on a light or dark background, marks of events."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from typing import Any

from matplotlib import rcParams, rcParamsDefault
from matplotlib.colors import LinearSegmentedColormap, to_hex, to_rgb

from gearchaos.continuation.events import KINDS
from gearchaos.errors import InputError, unknown_name
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float

INK = "#1d2b53"  # colour of lines and points in all pictures, on a light background: dark blue
STROBE = "#c03a1e"
"""Colour of stroboscopic points on a trajectory, and of what is emphasised, on a light background: red."""

BACKGROUND = "white"  # the colour that stands for the background of a picture: of outlines, and of boxes behind texts
_DARK = 0.5  # lightness below which a background is dark, from 0 (black) to 1 (white)
_CONTRAST = 0.8  # share of the range of lightness that colours keep when their lightness is reversed
_PALE = 0.85  # lightness above which a colour is pale: that of an area behind lines, which becomes a dark one
_PALE_SATURATION = 0.4  # factor of the saturation of pale colours, which would be too strong when dark
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


def adapt_scale(scale: LinearSegmentedColormap) -> LinearSegmentedColormap:
    """A colour scale from white to dark colours; on a dark background from its colour to light colours."""
    if not is_dark():
        return scale
    rest = [adapt(to_hex(scale(share))) for share in (1 / 3, 2 / 3, 1.0)]
    return LinearSegmentedColormap.from_list(f"{scale.name}-dark", [rcParams["axes.facecolor"], *rest])


EVENT_COLOURS = {name: kind.colour for name, kind in KINDS.items()}

SPECIAL_MARKERS = {
    "cusp": "v", "generalised flip": "D", "1:1 resonance": "P", "1:2 resonance": "X", "1:3 resonance": "^",
    "1:4 resonance": "s", "fold-flip": "o", "fold-neimark-sacker": "h", "flip-neimark-sacker": "p", "grazing-fold": "<",
    "grazing-flip": ">", "grazing-neimark-sacker": "d", "double graze": "*",
}
"""Markers of the points of codimension 2 by kind, in the order of legends."""


def event_words(kind: str) -> str:
    return "Neimark–Sacker" if kind == "neimark-sacker" else kind.replace("-", " ")


WIDTHS = {"column": 90.0, "double": 190.0}
"""Widths of journals' columns in mm: one column, and two with the space between them (Elsevier's artwork sizes)."""

_SETTINGS: Any = rcParams
_DEFAULTS: Any = rcParamsDefault
_MM_PER_INCH = 25.4
_LOWEST, _TALLEST = 70.0, 140.0
"""Least and largest height of a figure, in mm, if none is given: in a lower one a label beside the axis is cut off."""

_SIZE = Rule(lambda v: (v >= 40) & (v <= 2000), "must be from 40 to 2000 mm", "Labels need some room.")
"""The rule of widths and heights of figures."""

_EMBEDDED: dict[str, Any] = {"pdf.fonttype": 42, "ps.fonttype": 42, "svg.fonttype": "path", "hatch.linewidth": 0.6}
"""Fonts are embedded whole in PDF, as TrueType; in SVG letters are outlines, which look the same without any font."""

_SERIF: dict[str, Any] = {"font.family": "STIXGeneral", "mathtext.fontset": "stix"}
_TEXT = ("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "patch.edgecolor")
_BACKGROUND = ("figure.facecolor", "axes.facecolor", "legend.facecolor")

_SLIDES: dict[str, Any] = {"figure.figsize": (6.4, 3.6), "font.size": 10.5, "axes.titlesize": "large",
                           "savefig.dpi": 300}

_STYLES: dict[str, dict[str, Any]] = {
    "paper": {
        **_SERIF, "figure.figsize": (90 / _MM_PER_INCH, 70 / _MM_PER_INCH), "font.size": 8, "axes.titlesize": "medium",
        "axes.linewidth": 0.6, "xtick.major.width": 0.6, "ytick.major.width": 0.6, "xtick.major.size": 2.5,
        "ytick.major.size": 2.5, "savefig.dpi": 600,
    },
    "slides": _SLIDES,
    "dark": {**_SLIDES, "grid.color": "#4a4d55", **dict.fromkeys(_TEXT, "#e6e6e6"),
             **dict.fromkeys(_BACKGROUND, "#16181d")},
}
_KEYS = sorted({*_EMBEDDED, *(key for values in _STYLES.values() for key in values)})
"""All settings of matplotlib that a style determines: those that it does not name have matplotlib's defaults."""


class Style:
    """A style that is in force; as a context manager it ends, and the earlier settings are restored, with the block."""

    def __init__(self, settings: dict[str, Any]) -> None:
        self._before = {key: _SETTINGS[key] for key in settings}
        _SETTINGS.update(settings)

    def __enter__(self) -> Style:
        return self

    def __exit__(self, *error: object) -> None:
        _SETTINGS.update(self._before)


def style(name: str, width: str | float | None = None, height: float | None = None) -> Style:
    """Draw the pictures that follow for a paper, for slides or on a dark background.

    The style holds until the next call, or for a block: ``with gc.plot.style("paper"): ...``. In both cases pictures
    should be drawn and saved under the same style; `save_with_data` takes care of that itself. In all styles files have
    exactly the size of the figure, fonts are embedded in PDF (as TrueType), and SVG has letters as outlines.

    Parameters
    ----------
    name : {"paper", "slides", "dark"}
        ``"paper"``: 8 pt in a serif font of the size in which it is printed, 600 dots per inch. ``"slides"``: 16:9,
        1920 by 1080 pixels. ``"dark"``: as slides, on a dark background.
    width : {"column", "double"} or float, optional
        Width of the figure: a column of a journal (90 mm), both columns (190 mm), or a number in mm. By default 90 mm
        in a paper, 162.6 mm (6.4 in) otherwise.
    height : float, optional
        Height of the figure in mm; by default in proportion to the width, from 70 to 140 mm.

    Returns
    -------
    Style
        For use in a ``with`` statement.

    Raises
    ------
    InputError
        For an unknown name, or a size that is not from 40 to 2000 mm.

    Examples
    --------
    >>> import gearchaos as gc
    >>> with gc.plot.style("paper", width="column", height=60):
    ...     ax = gc.plot.stiffness()
    >>> [round(25.4 * float(side)) for side in ax.figure.get_size_inches()]
    [90, 60]
    """
    if name not in _STYLES:
        raise unknown_name("style", str(name), _STYLES)
    settings = {key: _DEFAULTS[key] for key in _KEYS} | _EMBEDDED | _STYLES[name]
    default = [_MM_PER_INCH * side for side in settings["figure.figsize"]]
    if isinstance(width, str) and width not in WIDTHS:
        raise InputError("width", f"must be {', '.join(WIDTHS)} or a number of mm", width)
    width = WIDTHS[width] if isinstance(width, str) else width

    def checked(field: str, size: Any) -> float:
        check_rule(field, number := to_float(field, size), _SIZE, size)
        return number

    wide = default[0] if width is None else checked("width", width)
    proportional = min(max(wide * default[1] / default[0], _LOWEST), _TALLEST)
    high = proportional if height is None else checked("height", height)
    settings["figure.figsize"] = (wide / _MM_PER_INCH, high / _MM_PER_INCH)
    return Style(settings)
