"""One variable of a bifurcation diagram along its parameter: a response measure, an exponent, the contact state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes, vertical_limits
from gearchaos.plot._checks import check, check_name
from gearchaos.plot._classes import NO_CLASS, MotionClass, continuous_values, named_classes
from gearchaos.plot._data import keeps_data
from gearchaos.plot._ribbon import ribbon as draw_ribbon
from gearchaos.plot._theme import INK, adapt


@keeps_data
def response(
    ds: xr.Dataset, name: str = "v_rms", ax: Axes | None = None, *, ribbon: bool = True, legend: bool = True
) -> Axes:
    r"""Draw a variable along one parameter.

    A continuous variable is a line with a gap where it has no value (NaN); codes, such as ``contact``, and small whole
    numbers are dots at the names of their classes.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`, with or without points, or from `gearchaos.dynamic_factor`.
    name : str
        Variable over the parameter alone.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    ribbon, legend : bool
        Show the kind of motion at every value by the colours of a strip above, and a legend of them.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation` or `gearchaos.dynamic_factor`, or has no
        variable ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.response(diagram, "dynamic_factor")
    >>> ax.get_xlabel()
    'error amplitude $\\varepsilon_{1}$'
    """
    check(ds, "bifurcation", label=1, period=1)
    check_name(ds, "name", name, 1)
    ax = new_axes(ax)
    (axis,) = ds[name].dims
    x, classes = ds[axis].values, named_classes(ds, name)
    if classes is None:
        y = continuous_values(ds, name)
        ax.plot(x, y, color=adapt(INK), linewidth=1.0, marker="o", markersize=2.0, markeredgewidth=0)
        ax.set_ylim(*vertical_limits(y, unit_in(ds, name)))
    else:
        _draw_classes(ax, x, *classes)
    ax.set(xlabel=axis_label(ds[axis], str(axis)), ylabel=axis_label(ds[name], name, beside=ds[axis]))
    if len(x) > 1:
        ax.set_xlim(float(x[0]), float(x[-1]))
    if ribbon:
        draw_ribbon(ds, ax, legend=legend)
    return ax


def _draw_classes(ax: Axes, x: np.ndarray, index: np.ndarray, classes: Sequence[MotionClass]) -> None:
    """Draw the class of each value (N,) as a dot; the ticks are the names from the lowest to the highest class."""
    known = index != NO_CLASS
    ax.plot(x[known], index[known], color=adapt(INK), linestyle="none", marker="o", markersize=2.5, markeredgewidth=0)
    low, high = (int(index[known].min()), int(index[known].max())) if known.any() else (0, 0)
    ax.set_yticks(range(low, high + 1), [kind.name for kind in classes[low : high + 1]], fontsize="small")
    ax.set_ylim(low - 0.5, high + 0.5)
