"""The time histories of the relative displacement and of the mesh force."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Line, LinearAxis, Range1d, Span

from gearchaos.explorer.panels.style import BOUNDARY, FIRST_DATA, INK, SetAttributes, empty_figure, style_axis
from gearchaos.explorer.panels.units import Units
from gearchaos.gears.operating import Gears, pair_of
from gearchaos.plot._axes import mesh_period
from gearchaos.plot._motions import HISTORY_PERIODS

_SAMPLES = 3000
"""Largest number of samples drawn."""


_PERIODS = "time τ/T (mesh periods)"


class HistoryFigure:
    """The displacement z over the first mesh periods of the steady motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure("Time history", x_axis_label=_PERIODS)
        self.source = ColumnDataSource(FIRST_DATA)
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=1.2))

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units) -> None:
        """Draw a motion.

        Parameters
        ----------
        motion : xarray.Dataset
            In these units.
        tau : (S,)
            Dimensionless times of its samples.
        period : float
            Dimensionless mesh period.
        units : Units
        """
        time, shown, words = _times_shown(tau, period, units)
        self._set(self.source, data=_samples(time, motion["z"].values[shown]))
        self._set(self.figure.xaxis[0], axis_label=words)
        self._set(self.figure.yaxis[0], axis_label=units.label(motion["z"], "z"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data=FIRST_DATA)


class ForceFigure:
    """The mesh force over the first mesh periods of the steady motion, with the roll angle of wheel 1 above."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure("Mesh force (dashed: static)", ticks=6, x_axis_label=_PERIODS,
                                   x_range=Range1d(0, 1), extra_x_ranges={"roll": Range1d(0, 1)})
        self.source = ColumnDataSource(FIRST_DATA)
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=1.2))
        self.static = Span(dimension="width", location=0.0, line_color=BOUNDARY, line_dash="dashed")
        self.figure.add_layout(self.static)
        self.roll = LinearAxis(x_range_name="roll", axis_label="roll angle of wheel 1 [°]")
        style_axis(self.roll, ticks=6)
        self.figure.add_layout(self.roll, "above")

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units, gears: Gears) -> None:
        """Draw a motion of gears; parameters as of `HistoryFigure.show`."""
        time, shown, words = _times_shown(tau, period, units)
        pair = pair_of(gears)
        self._set(self.source, data=_samples(time, motion["mesh_force"].values[shown]))
        static = pair.M10 / pair.R1
        self._set(self.static, location=static if units.gears is not None else static / pair.scales.force)
        end = float(time[-1])
        self._set(self.figure.x_range, start=0.0, end=end)
        periods = float((tau[shown][-1] - tau[0]) / period)
        self._set(self.figure.extra_x_ranges["roll"], start=0.0, end=360 * periods / pair.n1)
        self._set(self.figure.xaxis[-1], axis_label=words)
        self._set(self.figure.yaxis[0], axis_label=units.label(motion["mesh_force"], "mesh_force"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data=FIRST_DATA)


def _times_shown(tau: np.ndarray, period: float, units: Units) -> tuple[np.ndarray, np.ndarray, str]:
    """The times (N,) shown, from 0; which samples (S,) these are; and the label of their axis."""
    periods = (tau - tau[0]) / period
    shown = periods <= HISTORY_PERIODS
    shown &= np.arange(len(tau)) < _SAMPLES
    if units.gears is None:
        return periods[shown], shown, _PERIODS
    return (tau[shown] - tau[0]) * units.one("tau"), shown, "time [ms]"


def _samples(x: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    """The data of a line."""
    return {"x": x.astype(np.float32), "y": y.astype(np.float32)}


def times(motion: xr.Dataset) -> tuple[np.ndarray, float]:
    """The times (S,) of a dimensionless motion, and its mesh period."""
    return motion["tau"].values, mesh_period(motion)
