"""A card: a title, rows of names and values, and a small drawing as SVG, in colours that suit any page.

The modules beside this one register the card of each class with `card`.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import singledispatch
from html import escape
from typing import Any

import numpy as np

from gearchaos.errors import InputError

_BOX = ("display:flex;flex-wrap:wrap;gap:8px 18px;align-items:flex-start;box-sizing:border-box;width:fit-content;"
        "max-width:100%;border:1px solid rgba(128,128,128,.45);border-radius:6px;padding:8px 12px;margin:2px 0;"
        "font:13px/1.45 system-ui,sans-serif;color:inherit;background:transparent")
_TITLE = "font-weight:600;font-size:14px;margin-bottom:3px;overflow-wrap:anywhere"
_ROWS = "display:grid;grid-template-columns:max-content minmax(0,1fr);gap:0 12px"
_NAME = "opacity:.72"
_VALUE = "overflow-wrap:anywhere"
_SWATCH = ("display:inline-block;width:.75em;height:.75em;margin-right:.45em;border:1px solid rgba(128,128,128,.8);"
           "border-radius:2px;vertical-align:-.05em")


@dataclass(frozen=True)
class Card:
    """What a notebook shows of a value; it loads nothing and needs no script.

    Texts and lines have the colour of the page around them, so that the card can be read on light and dark pages.
    """

    title: str
    rows: Sequence[tuple[str, str]] = ()  # names and values; all texts are escaped
    picture: str = ""  # the ``svg`` of a `Drawing`
    colour: str = ""  # of a square before the title

    @property
    def html(self) -> str:
        """The card as HTML."""
        swatch = f'<span style="{_SWATCH};background:{escape(self.colour)}"></span>' if self.colour else ""
        rows = "".join(f'<div style="{_NAME}">{escape(name)}</div><div style="{_VALUE}">{escape(value)}</div>'
                       for name, value in self.rows)
        return (f'<div class="gearchaos-card" style="{_BOX}"><div style="flex:1 1 200px;min-width:0">'
                f'<div style="{_TITLE}">{swatch}{escape(self.title)}</div><div style="{_ROWS}">{rows}</div></div>'
                f"{self.picture}</div>")

    def _repr_html_(self) -> str:
        return self.html

    def __repr__(self) -> str:
        return "\n".join([self.title, *(f"  {name}: {value}" for name, value in self.rows)])


@singledispatch
def card(value: Any) -> Card:
    """What a notebook shows of a value: its main numbers and a small picture.

    Notebooks show models, gears, verdicts, orbits and studies as cards by themselves. A result, which is an xarray
    Dataset, is shown by xarray with all its variables; ``gc.card(result)`` is a card of it.

    Parameters
    ----------
    value : MeshModel, GearPair, GearDesign, Verdict, Orbit, EdgeState, Study or Dataset
        The value; a Dataset must be the result of a study.

    Returns
    -------
    Card
        A notebook shows it; ``html`` is its text.

    Raises
    ------
    InputError
        For a value of another kind.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.card(gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1))
    Single-degree-of-freedom model
      mesh frequency ω: 0.8
      mesh damping ζ: 0.025
      static load q₀: 0.1
      transmission error ε: 0.1
      mesh stiffness χ: two levels, 1.25 and 0.75, contact ratio 1.5
    """
    raise InputError("value", "must be a model, gears, a verdict, an orbit, a study or a result of one",
                     f"a {type(value).__name__}")


WIDTH, HEIGHT = 190.0, 110.0  # size of a drawing in CSS pixels
_PAD = 4.0  # margin within a drawing, in pixels
MOST_POINTS = 1500  # most points of a line and most dots of a set; of more, equally spaced ones are drawn
EMPHASIS = "#d9573c"  # visible on light and dark pages; lines have the colour of the page's texts


@dataclass
class Drawing:
    """A drawing in the coordinates of its content."""

    label: str  # what it shows, for readers who do not see it
    x: tuple[float, float]  # range shown
    y: tuple[float, float]
    equal: bool = False  # whether both coordinates have the same scale
    _parts: list[str] = field(default_factory=list)

    def line(self, x: np.ndarray, y: np.ndarray, *, colour: str = "currentColor", width: float = 1.2,
             dashed: bool = False, fill: str = "none") -> None:
        """Add a line through points (P,); it is interrupted where a coordinate is not finite."""
        across, up, known = self._pixels(x, y)
        path = "".join(f"{'L' if i and known[i - 1] else 'M'}{across[i]:.1f} {up[i]:.1f}"
                       for i in np.flatnonzero(known))
        dash = ' stroke-dasharray="3 2.5"' if dashed else ""
        if path:
            self._parts.append(f'<path d="{path}" fill="{fill}" fill-opacity=".18" stroke="{colour}" '
                               f'stroke-width="{width:g}" stroke-linejoin="round"{dash}/>')

    def dots(self, x: np.ndarray, y: np.ndarray, *, colour: str = "currentColor", radius: float = 1.6) -> None:
        """Add dots (P,), as strokes of no length with round ends; those that are not finite are left out."""
        across, up, known = self._pixels(x, y)
        path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(across[known], up[known], strict=True))
        self._parts.append(f'<path d="{path}" stroke="{colour}" stroke-width="{2 * radius:g}" '
                           'stroke-linecap="round" fill="none"/>')

    def raster(self, pixels: np.ndarray) -> None:
        """Add an image (rows, columns, 4) of bytes, the lowest row first, over the whole drawing."""
        from matplotlib.image import imsave

        file = io.BytesIO()
        imsave(file, np.ascontiguousarray(pixels[::-1]), format="png")
        data = base64.b64encode(file.getvalue()).decode("ascii")
        self._parts.append(f'<image href="data:image/png;base64,{data}" x="0" y="0" width="{WIDTH:g}" '
                           f'height="{HEIGHT:g}" preserveAspectRatio="none" style="image-rendering:pixelated"/>')

    @property
    def svg(self) -> str:
        """The drawing as SVG."""
        return (f'<svg role="img" aria-label="{escape(self.label)}" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" '
                f'width="{WIDTH:g}" height="{HEIGHT:g}" style="flex:none;max-width:100%;overflow:hidden">'
                f"{''.join(self._parts)}</svg>")

    def _pixels(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Positions of points (P,), or of `MOST_POINTS`, in pixels from the upper left corner, and which are finite."""
        step = max(1, -(-len(x) // MOST_POINTS))
        size = np.array([WIDTH - 2 * _PAD, HEIGHT - 2 * _PAD])
        ranges = np.array([self.x, self.y])
        length = np.maximum(ranges[:, 1] - ranges[:, 0], np.finfo(float).tiny)
        scale = np.full(2, min(size / length)) if self.equal else size / length
        middle = ranges.mean(axis=1)
        across = WIDTH / 2 + (np.asarray(x, float)[::step] - middle[0]) * scale[0]
        up = HEIGHT / 2 - (np.asarray(y, float)[::step] - middle[1]) * scale[1]
        return across, up, np.isfinite(across) & np.isfinite(up)


def around(*values: Iterable[float] | np.ndarray) -> tuple[float, float]:
    """The range of all values that are finite, a little wider; (0, 1) if there are none."""
    known = np.concatenate([np.ravel(np.asarray(v, float)) for v in values])
    known = known[np.isfinite(known)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    margin = 0.03 * (high - low) or 0.5 * max(abs(low), 1e-9)
    return low - margin, high + margin


def colours(names: Sequence[str]) -> np.ndarray:
    """The bytes (N, 4) of colours of matplotlib."""
    from matplotlib.colors import to_rgba_array

    return np.round(255 * to_rgba_array(names)).astype(np.uint8)
