"""The dossier of one motion: time history, phase trajectory, stroboscopic portrait and spectrum on one page."""

from __future__ import annotations

import matplotlib.pyplot as plt
import xarray as xr
from matplotlib.figure import Figure

from gearchaos.plot._history import history
from gearchaos.plot._phase import phase
from gearchaos.plot._portrait import portrait
from gearchaos.plot._spectrum import spectrum

_PERIODS = 12


def dossier(ds: xr.Dataset, *, title: str = "", figure: Figure | None = None) -> Figure:
    """Draw four views of the relative motion z, with the ends of the backlash where z is an axis.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples, or `gearchaos.steady`.
    title : str
        Above all four.
    figure : Figure, optional
        Where to draw; a new one of pyplot if left out.

    Returns
    -------
    Figure
    """
    figure = figure or plt.figure(figsize=(9.6, 7.2), layout="constrained")
    (time, plane), (points, lines) = figure.subplots(2, 2)
    history(ds, "z", time, periods=min(_PERIODS, ds.sizes["period"]))
    phase(ds, "z", ax=plane)
    portrait(ds, "z", ax=points)
    spectrum(ds, "z_dot", lines)
    views = ("Time history", "Phase trajectory", "Stroboscopic portrait", "Spectrum")
    for ax, name in zip((time, plane, points, lines), views, strict=True):
        ax.set_title(name, fontsize="medium")
    figure.suptitle(title)
    return figure
