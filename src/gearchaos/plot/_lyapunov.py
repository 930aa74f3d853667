"""The Lyapunov diagram: the largest exponent against one parameter."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._checks import check
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._theme import INK, STROBE, adapt


@keeps_data
def lyapunov(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    r"""Draw the largest Lyapunov exponent with its confidence band and the zero line.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`: ``lyapunov``, ``lyapunov_lo`` and ``lyapunov_hi`` over one axis, per unit τ.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.lyapunov(diagram)
    >>> ax.get_ylabel()
    'largest exponent $\\lambda_1$'
    """
    check(ds, "bifurcation", lyapunov=1, lyapunov_lo=1, lyapunov_hi=1)
    ax = new_axes(ax)
    (axis,) = ds["lyapunov"].dims
    x, value = ds[axis].values, ds["lyapunov"].values
    ax.axhline(0, color=adapt("0.25"), linewidth=0.7)
    low, high = ds["lyapunov_lo"].values, ds["lyapunov_hi"].values
    band = ax.fill_between(x, low, high, color=adapt("#8fa6d3"), linewidth=0, label="99 % confidence interval")
    (line,) = ax.plot(x, value, color=adapt(INK), linewidth=0.4, label="largest exponent")
    ax.fill_between(x, 0, value, where=value > 0, color=adapt(STROBE), alpha=0.25, linewidth=0)
    ax.set(xlabel=axis_label(ds[axis], str(axis)), ylabel=axis_label(ds["lyapunov"], "lyapunov"))
    ax.set_xlim(float(x[0]), float(x[-1]) if len(x) > 1 else None)
    draw_legend(ax, [band, line])
    return ax
