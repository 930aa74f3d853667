"""A fit: measured amplitudes over the speed beside the computed ones, a panel for each order."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend
from gearchaos.plot.theme import INK, STROBE, adapt_style

_STYLES: dict[str, dict[str, Any]] = {
    "measured": {"color": INK, "marker": "o", "markersize": 4, "fillstyle": "none", "linestyle": "none"},
    "computed": {"color": INK, "linewidth": 1.0},
    "not the motion from rest": {"color": STROBE, "marker": "s", "markersize": 3.5, "linestyle": "none"},
}


@keeps_data
def fit(ds: xr.Dataset, figure: Figure | None = None) -> Figure:
    """Draw a fit: the measured amplitudes as circles and the computed ones as a line, over the speed for each order.

    Squares on the line mark speeds at which another motion than that from rest fits better.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.fit`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.fit`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", chi1=0,
    ...     chi2=0, k="2000 N*s/m", backlash="0.12 mm", M10="85 N*m", speed=4000, error_amplitudes=["2 um"])
    >>> with TemporaryDirectory() as folder:
    ...     file = Path(folder) / "orders.csv"
    ...     _ = file.write_text("speed [rpm],order,amplitude [N]\\n4000,25,68\\n6000,25,166\\n9000,25,464\\n")
    ...     figure = gc.plot.fit(gc.fit(pair, str(file), ["error1=0.5:5 um"], starts=1))
    """
    over = ("measurement",)
    check(ds, "fit", speed=over, order=over, measured_amplitude=over, computed_amplitude=over)
    import matplotlib.pyplot as plt

    orders, other = np.unique(ds["order"].values), ds["history"].values != "rest"
    figure = figure or plt.figure(figsize=(6.4, 1.4 + 2.2 * len(orders)), layout="constrained")
    panels = figure.subplots(len(orders), 1, sharex=True, squeeze=False)[:, 0]
    shown = {"computed": ("computed", True), "measured": ("measured", True), "not the motion from rest": (
        "computed", other)}
    for ax, order in zip(panels, orders, strict=True):
        for name, (values, where) in shown.items():
            own = ds.isel(measurement=(ds["order"].values == order) & where)
            ax.plot(own["speed"], own[f"{values}_amplitude"], **adapt_style(_STYLES[name]))
        ax.set_ylabel(f"order {order:g} [{ds['measured_amplitude'].attrs['units']}]")
        ax.set_ylim(bottom=0)
    names = [name for name, (_, where) in shown.items() if np.any(where)]
    labels = {"measured": f"measured {json.loads(ds.attrs['settings'])['quantity']}"}
    draw_legend(panels[0], [
        Line2D([], [], label=labels.get(name, name), **adapt_style(_STYLES[name])) for name in names])
    panels[-1].set_xlabel(axis_label(ds["speed"], "speed"))
    return figure
