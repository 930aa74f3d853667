"""A scatter: the probability of contact loss along the speed, and which input it is due to."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend
from gearchaos.plot.theme import INK, STROBE, adapt
from gearchaos.studies.uncertainty.scatter_results import AFTER, OUTCOMES, OUTPUTS

_STYLES: tuple[Any, ...] = ("-", "--", "-.", ":")  # of the torques, beside their colours
_BARS = 0.8  # width of all bars of an input
_INDICES = (("first_index", "first-order index S", 0.45), ("total_index", "total index $S_T$", 1.0))


@keeps_data
def scatter(ds: xr.Dataset, figure: Figure | None = None) -> Figure:
    """Draw a scatter: the probability of contact loss along the speed for each torque, its 95 % interval as a band, and
    pale that after a change of the load.

    Below, if they are known, bars of the first-order and the total index of each input for the share of the speeds with
    contact loss, with intervals; a group for each input, in it a pair of bars for each torque.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.scatter`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.scatter`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.8, q0=0.1, chi0=0, zeta=0.05, eps1=0.045)
    >>> figure = gc.plot.scatter(gc.scatter(model, ["eps1=0.045±0.005"], "omega=0.7:0.9:5", samples=64))
    """
    along = str(ds["probability"].dims[2]) if "probability" in ds else "speed"
    check(ds, "scatter", probability=("outcome", "torque", along), total_index=("output", "torque", "varied"))
    import matplotlib.pyplot as plt

    known = bool(np.isfinite(ds["total_index"].sel(output=OUTPUTS[0])).any())
    figure = figure or plt.figure(figsize=(6.4, 6.0 if known else 3.4), layout="constrained")
    above, *below = figure.subplots(1 + known, 1, squeeze=False)[:, 0]
    count = ds.sizes["torque"]  # from light to dark loads
    colours = [adapt(each) for each in (INK, STROBE)[:count]] if count <= 2 else [
        adapt(to_hex(colormaps["plasma"](share))) for share in np.linspace(0.0, 0.8, count)]
    _draw_probabilities(above, ds.sel(outcome=OUTCOMES[0]), along, colours)
    inputs, width = ds["varied"].values.tolist(), _BARS / (len(_INDICES) * len(colours))
    for ax in below:
        for t, colour in enumerate(colours):
            one = ds.sel(output=OUTPUTS[0]).isel(torque=t)
            for n, (name, _, alpha) in enumerate(_INDICES):  # those of the first order pale beside the total ones
                at = np.arange(len(inputs)) + (len(_INDICES) * t + n + 0.5) * width - _BARS / 2
                values = one[name].values
                ends = np.abs(np.stack([values - one[f"{name}_lo"].values, one[f"{name}_hi"].values - values]))
                ax.bar(at, values, width, color=colour, alpha=alpha, yerr=ends, ecolor=adapt("#555555"),
                       error_kw={"linewidth": 0.8}, capsize=1.5)
        ax.set_xticks(range(len(inputs)), inputs)
        ax.axhline(0, color=adapt(INK), linewidth=0.6)
        ax.set_ylabel("index for the share of\nspeeds with contact loss")
        draw_legend(ax, [Patch(facecolor=adapt("#555555"), alpha=alpha, label=label) for _, label, alpha in _INDICES])
    return figure


def _draw_probabilities(ax: Axes, ds: xr.Dataset, along: str, colours: list[str]) -> None:
    x, handles, changed = ds[along].values, list[Any](), f"probability{AFTER}"
    for t, colour in enumerate(colours):
        one = ds.isel(torque=t)
        style = _STYLES[t % len(_STYLES)]
        marker = "o" if len(x) == 1 else ""
        ax.fill_between(x, one["probability_lo"], one["probability_hi"], color=colour, alpha=0.25, linewidth=0)
        ax.plot(x, one["probability"], color=colour, linestyle=style, marker=marker, linewidth=1.4)
        if changed in ds:
            ax.plot(x, one[changed], color=colour, linestyle=style, marker=marker, linewidth=1.0, alpha=0.45)
        if "torque" in ds.coords:
            handles.append(Line2D([], [], color=colour, linestyle=style, label=f"{float(one['torque']):g} N m"))
    ax.set(xlabel=axis_label(ds[along], along), ylabel="probability of contact loss", ylim=(0, 1.02))
    if len(x) > 1:
        ax.set_xlim(x[0], x[-1])
    if changed in ds:
        handles.append(Line2D([], [], color=colours[0], linewidth=1.0, alpha=0.45, label="after a change of the load"))
    if handles:
        draw_legend(ax, handles)
