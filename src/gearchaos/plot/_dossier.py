"""The dossier of one motion: time history, phase trajectory, stroboscopic portrait and spectrum on one page."""

from __future__ import annotations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from gearchaos.plot._history import history
from gearchaos.plot._phase import check_samples, phase
from gearchaos.plot._portrait import portrait
from gearchaos.plot._spectrum import spectrum

_PERIODS = 12
"""Largest number of mesh periods in the time history."""

_ROOM, _LEAST = np.array([6.4, 4.8]), 0.5
"""Size of a figure in inches from which on the font has its full size, and the smallest scale of the font."""

_LONG = 64
_LINE, _THIN = 0.8, 0.25
"""Trajectories of more than _LONG mesh periods are drawn with thin lines; widths of lines in points."""


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
    """
    check_samples(ds, {})
    figure = figure or plt.figure(figsize=(9.6, 7.2), layout="constrained")
    with matplotlib.rc_context({"font.size": matplotlib.rcParams["font.size"] * _scale(figure)}):
        _draw(ds, figure, title)
    return figure


def _scale(figure: Figure) -> float:
    """Scale of the font, which is smaller in a small figure."""
    return float(np.clip(min(figure.get_size_inches() / _ROOM), _LEAST, 1))


def _draw(ds: xr.Dataset, figure: Figure, title: str) -> None:
    (time, plane), (points, lines) = figure.subplots(2, 2)
    history(ds, "z", time, periods=min(_PERIODS, ds.sizes["period"]))
    phase(ds, "z", ax=plane, linewidth=_LINE if ds.sizes["period"] <= _LONG else _THIN)
    portrait(ds, "z", ax=points)
    spectrum(ds, "z_dot", lines)
    views = ("Time history", "Phase trajectory", "Stroboscopic portrait", "Spectrum")
    for ax, name in zip((time, plane, points, lines), views, strict=True):
        ax.set_title(name, fontsize="medium")
    figure.suptitle(title)
