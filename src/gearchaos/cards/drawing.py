"""Small drawings as SVG: lines, points and maps in a box, without axes."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

WIDTH, HEIGHT = 190.0, 110.0
"""Size of a drawing in CSS pixels."""

_PAD = 4.0
"""Margin within a drawing, in pixels."""

MOST_POINTS = 1500
"""Most points of a line and most dots of a set; of more, equally spaced ones are drawn."""

EMPHASIS = "#d9573c"
"""A colour that is visible on light and dark pages; lines have the colour of the page's texts."""


@dataclass
class Drawing:
    """A drawing in the coordinates of its content.

    Parameters
    ----------
    label : str
        What it shows, for readers who do not see it.
    x, y : (float, float)
        Ranges of the coordinates shown.
    equal : bool
        Whether both coordinates have the same scale.
    """

    label: str
    x: tuple[float, float]
    y: tuple[float, float]
    equal: bool = False
    _parts: list[str] = field(default_factory=list)

    def line(self, x: np.ndarray, y: np.ndarray, *, colour: str = "currentColor", width: float = 1.2,
             dashed: bool = False, fill: str = "none") -> None:
        """Add a line through points (P,); it is interrupted where a coordinate is not finite."""
        step = max(1, -(-len(x) // MOST_POINTS))
        path = _path(*self._pixels(np.asarray(x, float)[::step], np.asarray(y, float)[::step]))
        dash = ' stroke-dasharray="3 2.5"' if dashed else ""
        if path:
            self._parts.append(f'<path d="{path}" fill="{fill}" fill-opacity=".18" stroke="{colour}" '
                               f'stroke-width="{width:g}" stroke-linejoin="round"{dash}/>')

    def dots(self, x: np.ndarray, y: np.ndarray, *, colour: str = "currentColor", radius: float = 1.6) -> None:
        """Add dots (P,), as strokes of no length with round ends; those that are not finite are left out."""
        step = max(1, -(-len(x) // MOST_POINTS))
        across, up = self._pixels(np.asarray(x, float)[::step], np.asarray(y, float)[::step])
        known = np.isfinite(across) & np.isfinite(up)
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

    def _pixels(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions in pixels, from the upper left corner."""
        size = np.array([WIDTH - 2 * _PAD, HEIGHT - 2 * _PAD])
        ranges = np.array([self.x, self.y])
        length = np.maximum(ranges[:, 1] - ranges[:, 0], np.finfo(float).tiny)
        scale = np.full(2, min(size / length)) if self.equal else size / length
        middle = ranges.mean(axis=1)
        return WIDTH / 2 + (x - middle[0]) * scale[0], HEIGHT / 2 - (y - middle[1]) * scale[1]


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


def _path(across: np.ndarray, up: np.ndarray) -> str:
    """The data of an SVG path through points; a new part begins after each that is not finite."""
    known, parts = np.isfinite(across) & np.isfinite(up), []
    for i, (a, b) in enumerate(zip(across, up, strict=True)):
        if known[i]:
            parts.append(f"{'L' if i and known[i - 1] else 'M'}{a:.1f} {b:.1f}")
    return "".join(parts)
