"""The stroboscopic portrait: the state once per mesh period."""

from __future__ import annotations

import numpy as np
from bokeh.models import ColumnDataSource, Scatter

from gearchaos.explorer.figures.style import INK, Put, bare

_FEW = 64


class PortraitFigure:
    """Stroboscopic points in the plane of displacement and velocity; large where they are few."""

    def __init__(self, put: Put) -> None:
        self._put = put
        self.figure = bare("Stroboscopic portrait")
        self.source = ColumnDataSource({"x": [], "y": []})
        self.glyph = Scatter(x="x", y="y", size=6, fill_color=INK, line_color=None)
        self.figure.add_glyph(self.source, self.glyph)

    def show(self, x: np.ndarray, y: np.ndarray, words: tuple[str, str]) -> None:
        """Draw points, each (N,)."""
        self._put(self.glyph, size=6 if len(x) <= _FEW else 2)
        self._put(self.source, data={"x": x, "y": y})
        for axis, word in zip((*self.figure.xaxis, *self.figure.yaxis), words, strict=True):
            self._put(axis, axis_label=word)

    def clear(self) -> None:
        """Show nothing."""
        self._put(self.source, data={"x": [], "y": []})
