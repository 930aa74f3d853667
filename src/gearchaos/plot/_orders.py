"""An order spectrum: all lines with their names, those beside a mesh harmonic, the envelope and the cepstrum."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.gears.io.measured_quantities import MEASURED
from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend, second_axis_below
from gearchaos.plot.theme import INK, STROBE, adapt
from gearchaos.studies.vibration.orders import FLOOR

_NAMED = 8  # most lines with a name in a panel
_APART = 0.018  # least distance of names, over the width of a panel
_SHOWN = 1e-4  # weakest lines that are shown, over the strongest


@keeps_data
def orders(ds: xr.Dataset, figure: Figure | None = None) -> Figure:
    """Draw an order spectrum: all lines, those about the strongest mesh harmonic, their envelope, and the cepstrum.

    The strongest lines have their names. A second axis has the frequencies. Dots are the lines of the gears with which
    these are compared.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.orders`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.orders`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> pair = gc.GearPair(n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=2000.0,
    ...                    backlash=1.2e-4, M10=85.0, speed=4000.0, error_amplitudes=[2e-6])
    >>> figure = gc.plot.orders(gc.physical(gc.orders(pair)))
    """
    check(ds, "orders", line=("order",), modulation=("modulation_order",), cepstrum=("quefrency",))
    import matplotlib.pyplot as plt

    figure = figure or plt.figure(figsize=(6.4, 8.4), layout="constrained")
    above, near, envelope, cepstrum = figure.subplot_mosaic(
        [["above"] * 2, ["near"] * 2, ["envelope", "cepstrum"]], height_ratios=(1.5, 1.5, 1)).values()
    order, names = ds["order"].values, ds["line"].values
    last, carrier, width = max(order[names != ""], default=order[-1]), ds.attrs["carrier"], ds.sizes["modulation_order"]
    aside = order[width]
    _lines(above, ds, order > 0, (-0.02 * last, 1.05 * last))
    second_axis_below(above, float(ds["order_frequency"][1]) / order[1], "frequency [Hz]")
    if any(str(name).startswith("against_") for name in ds):
        draw_legend(above, [Line2D([], [], color=adapt(INK), label="these gears"), Line2D(
            [], [], marker=".", linestyle="none", color=adapt(STROBE), label="gears compared with")], ncols=2)
    own = str(names[order == carrier][0])
    _lines(near, ds, (abs(order - carrier) <= aside) & (order > 0), (carrier - aside, carrier + aside), own)
    envelope.vlines(ds["modulation_order"], 0, ds["modulation"], color=adapt(INK), linewidth=1.0)
    envelope.set(ylim=(0, 1.05 * max(float(ds["modulation"].fillna(0.0).max()), 100 * FLOOR)), ylabel="modulation",
                 xlabel=f"order of the envelope about {carrier:g}")
    cepstrum.plot(ds["quefrency"][1:], ds["cepstrum"][1:], color=adapt(INK), linewidth=0.6)
    cepstrum.set(xlabel="quefrency, turns", ylabel="cepstrum")
    return figure


def _lines(ax: Axes, ds: xr.Dataset, within: np.ndarray, limits: tuple[float, float], carrier: str = "") -> None:
    """Draw the lines within a range of orders, the strongest with their names, on a logarithmic axis; those of
    sidebands are without the name of their ``carrier``."""
    name = next(each.variable for each in MEASURED.values() if each.variable in ds)
    part = ds[[name, "line", *(n for n in ds if n == f"against_{name}")]].isel(order=within)
    order, size = part["order"].values, part[name].values
    largest = float(np.nanmax(size, initial=0.0)) or 1.0
    least = _SHOWN * largest
    ax.vlines(order, least, np.maximum(size, least), color=adapt(INK), linewidth=0.9)
    if f"against_{name}" in part:
        other = part[f"against_{name}"].where(part[f"against_{name}"] > least)
        ax.plot(order, other, ".", color=adapt(STROBE), markersize=4)
    placed: list[float] = []
    for k in np.argsort(-size):
        apart = np.abs(np.array(placed) - order[k]) > _APART * (limits[1] - limits[0])
        if part["line"].values[k] and apart.all() and len(placed) < _NAMED:
            text = str(part["line"].values[k])
            ax.annotate(text.removeprefix(f"{carrier} " if carrier else ""), (order[k], size[k]), (0, 3),
                        textcoords="offset points", rotation=90, fontsize="x-small", ha="center", va="bottom",
                        clip_on=True)
            placed.append(order[k])
    mesh = f" of {ds['mesh'].item()}" if "mesh" in ds.coords else ""
    ax.set(yscale="log", ylim=(least, 300 * largest), xlim=limits, xlabel=axis_label(ds["order"], "order"),
           ylabel=f"{axis_label(ds[name], name)}{mesh}, {ds.attrs['amplitude']}")
