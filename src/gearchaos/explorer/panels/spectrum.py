"""The spectrum of the velocity in orders of the mesh frequency."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, FixedTicker, Line, Range1d

from gearchaos.explorer.panels.style import FIRST_DATA, INK, SetAttributes, empty_figure
from gearchaos.explorer.panels.units import NONE, Units
from gearchaos.gears.operating import pair_of
from gearchaos.plot._motions import FLOOR, amplitudes

_ORDERS = 6
"""Highest order of the mesh frequency shown."""

_ORDER = "order of the mesh frequency"

_AMPLITUDE = "amplitude"


def _order(units: Units) -> str:
    """Label of the axis of orders; for gears with the frequency of the first, short enough for a small figure."""
    if units.gears is not None:
        return f"order (1 is {pair_of(units.gears).mesh_frequency / (2 * np.pi):.5g} Hz)"
    return f"{_ORDER} [{NONE}]" if units.marked else _ORDER


class SpectrumFigure:
    """Amplitudes on a logarithmic scale; those of periodic motions are free of leakage."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure("Spectrum of the velocity z′", y_axis_type="log", x_range=Range1d(0, _ORDERS),
                           x_axis_label=_ORDER, y_axis_label=_AMPLITUDE)
        self.figure.xaxis.ticker = FixedTicker(ticks=list(range(_ORDERS + 1)))
        self.source = ColumnDataSource(FIRST_DATA)
        self.figure.add_glyph(self.source, Line(x="x", y="y", line_color=INK, line_width=1))

    def show(self, motion: xr.Dataset, velocity: xr.DataArray, units: Units) -> None:
        """Draw the spectrum of a velocity in these units; ``motion``, dimensionless, has the times of the samples."""
        order, amplitude = amplitudes(motion.assign(z_dot=(velocity.dims, velocity.values)), "z_dot")
        inside = order <= _ORDERS
        least = max(float(amplitude[inside].max()) * FLOOR, 1e-37)
        values = (order[inside], np.maximum(amplitude[inside], least))
        self._set(self.source, data={n: v.astype(np.float32) for n, v in zip("xy", values, strict=True)})
        _, bracket, unit = units.label(velocity, "z_dot").partition(" [")
        self._set(self.figure.yaxis[0], axis_label=_AMPLITUDE + bracket + unit)
        self._set(self.figure.xaxis[0], axis_label=_order(units))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.source, data=FIRST_DATA)
