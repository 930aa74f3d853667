"""The dossier of one motion: a figure with its time history, phase trajectory, stroboscopic portrait and spectrum."""

from __future__ import annotations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib import rcParams, rcParamsDefault
from matplotlib.figure import Figure

from gearchaos.plot._data import keeps_data
from gearchaos.plot._history import history
from gearchaos.plot._phase import check_samples, phase
from gearchaos.plot._portrait import portrait
from gearchaos.plot._spectrum import spectrum

HISTORY_PERIODS = 12
"""Largest number of mesh periods in the time history."""

_HEIGHT = 0.75
"""Height of a new figure over its width."""

_FULL_SIZE = np.array([6.4, 4.8])
"""Width and height in inches of the smallest figure with a font of full size, where that is matplotlib's default."""

_SMALLEST_SCALE = 0.5
"""Smallest scale of the font, in smaller figures."""

_LONG = 64
"""Trajectories of more mesh periods than this are drawn with thin lines."""

_LINE_WIDTH, _THIN_LINE_WIDTH = 0.8, 0.25
"""Widths of lines, in points."""


@keeps_data
def dossier(ds: xr.Dataset, *, title: str = "", figure: Figure | None = None) -> Figure:
    """Draw four views of the relative motion z; the ends of the backlash are marked in the phase plane.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples, or `gearchaos.steady`.
    title : str
        Title of the figure.
    figure : Figure, optional
        Where to draw; a new pyplot figure if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.simulate` with samples, or of `gearchaos.steady`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.2), periods=8, transient=200, samples=64)
    >>> figure = gc.plot.dossier(motion, title="ε₁ = 0.2")
    >>> len(figure.axes)
    4
    """
    check_samples(ds, {})
    figure = figure or plt.figure(figsize=_figure_size(), layout="constrained")
    with matplotlib.rc_context({"font.size": rcParams["font.size"] * _scale(figure)}):
        _draw(ds, figure, title)
    return figure


def _figure_size() -> tuple[float, float]:
    """Width and height of a new figure, in inches: that of a style, or else larger than that of a single Axes."""
    size, default = rcParams["figure.figsize"], rcParamsDefault["figure.figsize"]
    return (9.6, 7.2) if list(size) == list(default) else (size[0], _HEIGHT * size[0])


def _scale(figure: Figure) -> float:
    """Scale of the font: 1, or less in a small figure."""
    full = _FULL_SIZE * rcParams["font.size"] / rcParamsDefault["font.size"]
    return float(np.clip(min(figure.get_size_inches() / full), _SMALLEST_SCALE, 1))


def _draw(ds: xr.Dataset, figure: Figure, title: str) -> None:
    axes = figure.subplots(2, 2).ravel()
    history(ds, "z", axes[0], periods=min(HISTORY_PERIODS, ds.sizes["period"]))
    phase(ds, "z", ax=axes[1], linewidth=_LINE_WIDTH if ds.sizes["period"] <= _LONG else _THIN_LINE_WIDTH)
    portrait(ds, "z", ax=axes[2])
    spectrum(ds, "z_dot", axes[3])
    views = ("Time history", "Phase trajectory", "Stroboscopic portrait", "Spectrum")
    for ax, name in zip(axes, views, strict=True):
        ax.set_title(name, fontsize="medium")
    figure.suptitle(title)
