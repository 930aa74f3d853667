"""The two characteristics of Fig. 1b: mesh stiffness against time, backlash function against displacement."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import MeshModel, Stiffness, mesh_stiffness
from gearchaos.model import backlash as backlash_function
from gearchaos.plot._axes import new_axes
from gearchaos.plot._checks import check_positive
from gearchaos.plot._theme import INK, adapt, adapt_style

_MAX_PERIODS = 1000
_REFERENCE_LINE: dict[str, Any] = {"color": "0.55", "linewidth": 0.7, "linestyle": (0, (4, 3))}


def stiffness(model: AnyModel | None = None, ax: Axes | None = None, *, periods: int = 2) -> Axes:
    """Draw the mesh stiffness divided by the reference stiffness, c(t)/c0 = χ(τ), against time.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign, optional
        The model with the stiffness; by default the paper's.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    periods : int
        Number of mesh periods to show.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If ``model`` has another type.

    Examples
    --------
    >>> import gearchaos as gc
    >>> ax = gc.plot.stiffness(gc.MeshModel.of(c1=0.2), periods=1)
    >>> ax.get_ylabel()
    'mesh stiffness $c(t)/c_0$'
    """
    model = MeshModel() if model is None else as_model(model)
    periods = whole_number("periods", periods, 1, _MAX_PERIODS)
    ax = new_axes(ax)
    if model.stiffness.harmonics()[0] or not model.stiffness.jumps:
        t = np.linspace(0, periods, 400 * periods + 1)
        ax.plot(t, mesh_stiffness(model, t * model.period), color=adapt(INK), linewidth=1.4)
    else:
        _steps(model.stiffness, ax, periods)
    ax.axhline(1, zorder=0, **adapt_style(_REFERENCE_LINE))
    ax.set(xlabel="time $t/T$", ylabel="mesh stiffness $c(t)/c_0$", xlim=(0, periods))
    return ax


def _steps(wave: Stiffness, ax: Axes, periods: int) -> None:
    """Draw a stiffness in steps, with the names of its levels and of their durations if it has some.

    In each period the last level also comes before the first start.
    """
    starts, levels = zip(*wave.parts(wave.numbers()), strict=True)
    first = -1 if starts[0] > 0 else 0
    edges = np.concatenate([[k + start for start in starts] for k in range(first, periods)] + [[periods + starts[0]]])
    ax.stairs(np.tile(levels, periods - first), edges, baseline=None, color=adapt(INK), linewidth=1.4)
    if not wave.part_marks:
        return
    low, high = min(levels), max(levels)
    ax.set_ylim(low - 0.35, high + 0.3)
    for (duration, _), start, end in zip(wave.part_marks, starts, (*starts[1:], 1), strict=True):
        _dimension_line(ax, start, end, low - 0.13, duration)
    _dimension_line(ax, 0, 1, low - 0.27, "$T$")
    for (_, name), level in zip(wave.part_marks, levels, strict=True):
        ax.annotate(name, (1, level), (4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                    va="center", annotation_clip=False)


def _dimension_line(ax: Axes, start: float, end: float, y: float, name: str) -> None:
    """Draw a dimension line (an arrow with two heads) from ``start`` to ``end``, with a name at its middle."""
    arrow = {"arrowstyle": "<->", "color": adapt("black"), "shrinkA": 0, "shrinkB": 0, "lw": 0.7}
    ax.annotate("", (start, y), (end, y), arrowprops=arrow)
    ax.text((start + end) / 2, y, name, ha="center", va="center",
            bbox={"facecolor": adapt("white"), "edgecolor": "none", "pad": 1.0})


def backlash(ax: Axes | None = None, *, reach: float = 3.0) -> Axes:
    r"""Draw the backlash characteristic F(u)/Δ against u/Δ, (2.6), which is f(z) of (2.13).

    Parameters
    ----------
    ax : Axes, optional
        Where to draw; a new figure if left out.
    reach : float
        Half the width of the axis, in units of the half backlash Δ.

    Returns
    -------
    Axes

    Examples
    --------
    >>> import gearchaos as gc
    >>> ax = gc.plot.backlash(reach=2.0)
    >>> ax.get_xlabel()
    'displacement $u/\\Delta$'
    """
    if (reach := check_positive("reach", reach)) <= 1:
        raise InputError("reach", "must be greater than 1", reach, "The ends of the backlash lie at 1.")
    ax = new_axes(ax)
    u = np.array([-reach, -1, 1, reach])
    ax.axhline(0, color=adapt("0.7"), linewidth=0.6)
    ax.axvline(0, color=adapt("0.7"), linewidth=0.6)
    ax.axvspan(-1, 1, color=adapt("#f4f1e8"), zorder=0)
    ax.plot(u, backlash_function(u), color=adapt(INK), linewidth=1.4)
    _dimension_line(ax, -1, 1, 0.42 * (reach - 1), r"$2\Delta$")
    for z, name in ((-1, "back flank"), (1, "front flank")):
        ax.text(z * (1 + reach) / 2, -z * 0.5 * (reach - 1), name, ha="center", va="center", color=adapt("0.35"))
    ax.text(0, -0.5 * (reach - 1), "free", ha="center", va="center", color=adapt("0.35"))
    ax.set(xlabel=r"displacement $u/\Delta$", ylabel=r"$F(u)/\Delta$", xlim=(-reach, reach))
    return ax
