"""The time history of the relative displacement."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Line

from gearchaos.explorer.panels.labels import label
from gearchaos.explorer.panels.style import INK, SetAttributes, empty_figure
from gearchaos.plot._axes import mesh_period
from gearchaos.plot._dossier import HISTORY_PERIODS

_SAMPLES = 3000
"""Largest number of samples drawn."""


class HistoryFigure:
    """The displacement z over the first mesh periods of the steady motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure("Time history", x_axis_label="time τ/T (mesh periods)")
        self.source = ColumnDataSource({"x": [], "y": []})
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=1.2))

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float) -> None:
        """Draw a motion.

        Parameters
        ----------
        motion : xarray.Dataset
            In any units.
        tau : (S,)
            Dimensionless times of its samples.
        period : float
            Dimensionless mesh period.
        """
        time = (tau - tau[0]) / period
        inside = time <= HISTORY_PERIODS
        values = (time[inside], motion["z"].values[inside])
        self._set(self.source, data={n: v[:_SAMPLES].astype(np.float32) for n, v in zip("xy", values, strict=True)})
        self._set(self.figure.yaxis[0], axis_label=label(motion["z"], "z"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data={"x": [], "y": []})


def times(motion: xr.Dataset) -> tuple[np.ndarray, float]:
    """The times (S,) of a dimensionless motion, and its mesh period."""
    return motion["tau"].values, mesh_period(motion)
