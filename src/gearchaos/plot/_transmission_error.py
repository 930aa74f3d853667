"""The transmission error of the unloaded gears of a design, over the mesh period and by harmonics."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics
from gearchaos.plot._axes import new_axes, panels, wrapped
from gearchaos.plot._checks import check_design
from gearchaos.plot._theme import INK, adapt

_UM = 1e6
_SAMPLES_PER_HARMONIC = 64
_SMALL_FONT = 0.85
"""Size of a small font over that of labels, for which `wrapped` counts characters."""


def transmission_error(design: GearDesign, ax: Axes | None = None) -> Axes:
    """Draw the transmission error of the unloaded gears in µm along the line of action.

    One panel shows e(t) over one mesh period, which begins when a tooth pair enters contact; e is positive where the
    driven wheel lags behind. The other panel shows the peak amplitudes e_j of the harmonics of the mesh frequency. The
    title says what the error was computed from, and what of it the harmonics leave out.

    Parameters
    ----------
    design : GearDesign
        The gear pair.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        With both panels as its ``child_axes``.

    Raises
    ------
    InputError
        If the error by the method of the design cannot be computed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.transmission_error(design)
    >>> len(ax.child_axes)
    2
    """
    check_design(design)
    error = design.error_harmonics
    ax = new_axes(ax)
    curve, bars = panels(ax, 0.62)
    count = len(error.amplitudes)
    time = np.linspace(0, 1, _SAMPLES_PER_HARMONIC * max(count, 1) + 1)
    curve.axhline(0, color=adapt("0.7"), linewidth=0.6)
    curve.plot(time, _UM * error.at(time), color=adapt(INK), linewidth=1.4)
    curve.set(xlim=(0, 1), xlabel="fraction of the mesh period", ylabel="error $e$ [µm]")
    bars.bar(np.arange(1, count + 1), _UM * np.array(error.amplitudes), width=0.35, color=adapt(INK))
    bars.set(xlim=(0.5, max(count, 3) + 0.5), xlabel="harmonic $j$", ylabel="amplitude $e_j$ [µm]")
    bars.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    if not count:
        curve.set_ylim(-1, 1)
        bars.set(xticks=[], yticks=[])
        bars.text(0.5, 0.5, "no harmonics", transform=bars.transAxes, ha="center", va="center", fontsize="small")
    inches = ax.get_window_extent().width / ax.figure.dpi
    ax.set_title(wrapped(_source(error), inches / _SMALL_FONT), loc="left", fontsize="small")
    return ax


def _source(error: ErrorHarmonics) -> str:
    """What the error was computed from, and what its harmonics leave out."""
    if not error.residual_peak:
        return error.source
    return (f"{error.source}; left out: {_UM * error.residual_rms:.3g} µm rms, {_UM * error.residual_peak:.3g} µm at "
            "most")
