"""The stroboscopic portrait: the state once per mesh period."""

from __future__ import annotations

import numpy as np
from bokeh.models import ColumnDataSource

from gearchaos.app.figures.style import INK, bare

_FEW = 64


class PortraitFigure:
    """Stroboscopic points in the plane of displacement and velocity; large where they are few."""

    def __init__(self) -> None:
        self.figure = bare("Stroboscopic portrait", toolbar_location=None)
        self.source = ColumnDataSource({"x": [], "y": []})
        self.glyph = self.figure.scatter("x", "y", source=self.source, size=6, fill_color=INK, line_color=None).glyph

    def show(self, x: np.ndarray, y: np.ndarray, words: tuple[str, str]) -> None:
        """Draw points, each (N,)."""
        self.glyph.size = 6 if len(x) <= _FEW else 2
        self.source.data = {"x": x, "y": y}
        self.figure.xaxis.axis_label, self.figure.yaxis.axis_label = words

    def clear(self) -> None:
        """Show nothing."""
        self.source.data = {"x": [], "y": []}
