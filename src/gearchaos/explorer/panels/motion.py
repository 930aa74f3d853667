"""The figures of the motion at the point: histories, phase trajectory, stroboscopic portrait, spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, DataRange1d, FixedTicker, Line, LinearAxis, Range1d, Scatter, Span

from gearchaos.datasets import variable
from gearchaos.explorer.jobs.point import PointMotion
from gearchaos.explorer.panels.style import BOUNDARY, FIRST_DATA, NONE, Panel, SetAttributes, Units, style_axis
from gearchaos.gears.operating import Gears, pair_of
from gearchaos.plot.axes import mesh_period
from gearchaos.plot.motions import FLOOR, HISTORY_PERIODS, amplitudes
from gearchaos.plot.theme import INK, STROBE

_HISTORY_SAMPLES = 3000  # largest number of samples drawn

_PERIODS = "time τ/T (mesh periods)"


class _LineFigure(Panel):
    """A figure with one line, which is a single point until a motion is drawn."""

    def __init__(self, set_attributes: SetAttributes, title: str, width: float, **options: Any) -> None:
        super().__init__(set_attributes, title, **options)
        self.source = ColumnDataSource(FIRST_DATA)
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=width))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data=FIRST_DATA)


class HistoryFigure(_LineFigure):
    """The displacement z over the first mesh periods of the steady motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Time history", 1.2, x_axis_label=_PERIODS)

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units) -> None:
        """Draw a motion, which is in these units; its times ``tau`` (S,) and its mesh period are dimensionless."""
        time, shown, words = _times_shown(tau, period, units)
        self._set(self.source, data=_samples(time, motion["z"].values[shown]))
        self._label(words, units.label(motion["z"], "z"))


class ForceFigure(_LineFigure):
    """The mesh force over the first mesh periods of the steady motion, with the roll angle of wheel 1 above."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Mesh force (dashed: static)", 1.2, ticks=6, x_axis_label=_PERIODS,
                         x_range=Range1d(0, 1), extra_x_ranges={"roll": Range1d(0, 1)})
        self.static = Span(dimension="width", location=0.0, line_color=BOUNDARY, line_dash="dashed")
        self.figure.add_layout(self.static)
        self.roll = LinearAxis(x_range_name="roll", axis_label="roll angle of wheel 1 [°]")
        style_axis(self.roll, ticks=6)
        self.figure.add_layout(self.roll, "above")

    def show(self, motion: xr.Dataset, tau: np.ndarray, period: float, units: Units, gears: Gears) -> None:
        """Draw a motion of gears; arguments as of `HistoryFigure.show`."""
        (time, shown, words), pair = _times_shown(tau, period, units), pair_of(gears)
        self._set(self.source, data=_samples(time, motion["mesh_force"].values[shown]))
        static = pair.M10 / pair.R1
        self._set(self.static, location=static if units.gears is not None else static / pair.scales.force)
        self._set(self.figure.x_range, start=0.0, end=float(time[-1]))
        periods = float((tau[shown][-1] - tau[0]) / period)
        self._set(self.figure.extra_x_ranges["roll"], start=0.0, end=360 * periods / pair.n1)
        self._label(words, units.label(motion["mesh_force"], "mesh_force"))
        self._set(self.figure, visible=True)

    def clear(self) -> None:
        """Hide the figure: without a motion of gears its axes mean nothing."""
        self._set(self.figure, visible=False)


def _times_shown(tau: np.ndarray, period: float, units: Units) -> tuple[np.ndarray, np.ndarray, str]:
    """The times (N,) shown, from 0; which samples (S,) these are; and the label of their axis."""
    periods = (tau - tau[0]) / period
    shown = (periods <= HISTORY_PERIODS) & (np.arange(len(tau)) < _HISTORY_SAMPLES)
    if units.gears is None:
        return periods[shown], shown, _PERIODS
    return (tau[shown] - tau[0]) * units.one("tau"), shown, "time [ms]"


def _samples(x: np.ndarray, y: np.ndarray) -> dict[str, np.ndarray]:
    """The data of a line."""
    return {"x": x.astype(np.float32), "y": y.astype(np.float32)}


def times(motion: xr.Dataset) -> tuple[np.ndarray, float]:
    """The times (S,) of a dimensionless motion, and its mesh period."""
    return motion["tau"].values, mesh_period(motion)


_PHASE_SAMPLES = 3072  # largest number of samples of the trajectory drawn
_PHASE_POINTS = 96  # largest number of stroboscopic points drawn


class PhaseFigure(Panel):
    """Velocity against displacement, the ends of the backlash and the stroboscopic points."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Phase (dashed: backlash)", x_range=DataRange1d(), y_range=DataRange1d())
        self.line, self.points = ColumnDataSource(FIRST_DATA), ColumnDataSource({"x": [], "y": []})
        self.ends = [Span(dimension="height", location=z, line_color=BOUNDARY, line_dash="dashed") for z in (-1, 1)]
        drawn = self.figure.add_glyph(self.line, Line(x="x", y="y", line_color=INK, line_width=1))
        dots = self.figure.add_glyph(self.points, Scatter(x="x", y="y", size=5, fill_color=STROBE, line_color=None))
        self.figure.x_range.renderers = self.figure.y_range.renderers = [drawn, dots]
        for end in self.ends:
            self.figure.add_layout(end)

    def show(self, motion: xr.Dataset, units: Units) -> None:
        """Draw a motion, which is in these units."""
        self._set(self.line, data=_samples(*(motion[n].values[:_PHASE_SAMPLES] for n in ("z", "z_dot"))))
        x, y = (motion[f"section_{n}"].values[:_PHASE_POINTS] for n in ("z", "z_dot"))
        self._set(self.points, data={"x": x, "y": y})
        for sign, end in zip((-1, 1), self.ends, strict=True):
            self._set(end, location=sign * units.one("z"))
        self._label(units.label(motion["z"], "z"), units.label(motion["z_dot"], "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.line, data=FIRST_DATA)
        self._set(self.points, data={"x": [], "y": []})


_FEW = 64  # up to this number of points, markers are large

_PADDING = 0.3
"""Room around the points, relative to the range of their values, so that few of them do not lie in the corners."""


class PortraitFigure(Panel):
    """Stroboscopic points in the plane of displacement and velocity."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Stroboscopic portrait", x_range=DataRange1d(range_padding=_PADDING),
                         y_range=DataRange1d(range_padding=_PADDING))
        self.source = ColumnDataSource(FIRST_DATA)
        self.glyph = Scatter(x="x", y="y", size=0, fill_color=INK, line_color=None)
        self.figure.add_glyph(self.source, self.glyph)

    def show(self, found: PointMotion, units: Units) -> None:
        """Draw the points of a motion in these units; those of its portrait if there is one."""
        names = ("section_z", "section_z_dot")
        section = found.verdict.section if found.portrait is None else {
            n: found.portrait[f"section_{n}"].values for n in ("z", "z_dot")}
        points = {n: variable(n, ("period",), np.asarray(section[n.removeprefix("section_")])) for n in names}
        x, y = (units.variables(points)[n] for n in names)
        self._set(self.glyph, size=6 if len(x) <= _FEW else 2)
        self._set(self.source, data={"x": x.values, "y": y.values})
        self._label(units.label(x, "z"), units.label(y, "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.glyph, size=0)
        self._set(self.source, data=FIRST_DATA)


_ORDERS = 6  # highest order of the mesh frequency shown

_ORDER, _AMPLITUDE = "order of the mesh frequency", "amplitude"


class SpectrumFigure(_LineFigure):
    """Amplitudes on a logarithmic scale; those of periodic motions are free of leakage."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, "Spectrum of the velocity z′", 1.0, y_axis_type="log",
                         x_range=Range1d(0, _ORDERS), x_axis_label=_ORDER, y_axis_label=_AMPLITUDE)
        self.figure.xaxis.ticker = FixedTicker(ticks=list(range(_ORDERS + 1)))

    def show(self, motion: xr.Dataset, velocity: xr.DataArray, units: Units) -> None:
        """Draw the spectrum of a velocity in these units; ``motion``, dimensionless, has the times of the samples."""
        order, amplitude = amplitudes(motion.assign(z_dot=(velocity.dims, velocity.values)), "z_dot")
        inside = order <= _ORDERS
        least = max(float(amplitude[inside].max()) * FLOOR, 1e-37)
        self._set(self.source, data=_samples(order[inside], np.maximum(amplitude[inside], least)))
        _, bracket, unit = units.label(velocity, "z_dot").partition(" [")
        words = f"{_ORDER} [{NONE}]" if units.marked else _ORDER
        if units.gears is not None:  # with the frequency of order 1, short enough for a small figure
            words = f"order (1 is {pair_of(units.gears).mesh_frequency / (2 * np.pi):.5g} Hz)"
        self._label(words, _AMPLITUDE + bracket + unit)
