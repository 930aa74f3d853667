"""The model of Fig. 1: two wheels on sprung supports, coupled along the line of action, and its two characteristics."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from gearchaos.errors import InputError, whole_number
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import MeshModel, mesh_stiffness
from gearchaos.model import backlash as backlash_function
from gearchaos.plot._datasets import check_positive
from gearchaos.plot.axes import new_axes
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt, adapt_style

_LINE: dict[str, Any] = {"color": INK, "linewidth": 1.0, "solid_capstyle": "round", "solid_joinstyle": "round"}
_THIN_LINE: dict[str, Any] = {"color": "0.45", "linewidth": 0.6}
_STEEL = "#e8ecf4"
_R1, _R2, _HALF = 1.5, 2.0, 3.1
"""Radii of the base circles, and half the vertical distance of the centres, in units of the drawing."""

_CENTRES = ((-_R1, -_HALF), (_R2, _HALF))
_RADII = (_R1, _R2)
_SIDES = (-1, 1)
"""Side of the line of action on which each wheel lies (left, right); its support is on the same side (below, above)."""

_FULL_HEIGHT = 4.0  # height in inches of the smallest drawing with a font of full size
_SMALLEST_SCALE = 0.5  # smallest scale of the font, in smaller drawings


def schematic(ax: Axes | None = None) -> Axes:
    """Draw the gear pair of Fig. 1a with the symbols of (2.1)-(2.6).

    The base circles touch the line of action, which is vertical. On it lie the elements of the mesh: spring c(t) with
    backlash 2Δ, damper k and transmission error e(t). The supports c_n, k_n act parallel to it.

    Parameters
    ----------
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Examples
    --------
    >>> import gearchaos as gc
    >>> ax = gc.plot.schematic()
    >>> ax.axison
    False
    """
    ax = new_axes(ax)
    ax.set_axis_off()
    ax.set_aspect("equal")
    for n in (1, 2):
        (x, y), r, side = _CENTRES[n - 1], _RADII[n - 1], _SIDES[n - 1]
        ax.add_patch(Circle((x, y), r, facecolor=adapt(_STEEL), edgecolor=adapt(INK), linewidth=1.2))
        ax.add_patch(Circle((x, y), 0.09, facecolor=adapt(INK), edgecolor="none", zorder=3))
        ax.plot([x, x - side * r], [y, y], **adapt_style(_THIN_LINE))
        ax.text(x - side * r / 2, y + 0.22, f"$R_{n}$", ha="center")
        ax.text(x + side * 0.48 * r, y + 0.12, f"$m_{n}, I_{n}$", ha="center")
        # by (2.3) u grows as the rim of wheel 1 moves up and that of wheel 2 down: the positive sense of both angles
        start, stop = ((190, 262), (-20, -110))[n - 1]
        _arc_arrow(ax, (x, y), r * 0.62, start, stop, rf"$\varphi_{n}$", 0.34)
        first, last = ((105, 190), (-5, 80))[n - 1]
        _arc_arrow(ax, (x, y), r + 0.32, first, last, f"$M_{n}$", 0.42, colour=STROBE)
        beside = x + side * (r + 0.75)
        ax.annotate("", (beside, y - 0.1), (beside, y - 0.95),
                    arrowprops={"arrowstyle": "-|>", "color": adapt("black"), "lw": 0.9})
        ax.text(beside + side * 0.15, y - 0.6, f"$u_{n}$", ha="left" if side > 0 else "right")
        # the support
        near, far = y + side * (r + 0.3), y + side * (r + 1.7)
        ax.plot([x, x], [y, near], **adapt_style(_LINE))
        ax.plot([x - 0.5, x + 0.5], [near, near], **adapt_style(_LINE))
        _spring(ax, x - 0.5, near, far)
        _damper(ax, x + 0.5, near, far)
        ax.plot([x - 1.0, x + 1.0], [far, far], **adapt_style(_LINE))
        for offset in np.linspace(-0.9, 1.0, 9):
            ax.plot([x + offset, x + offset - 0.18], [far, far + side * 0.22], **adapt_style(_THIN_LINE))
        ax.text(x - 0.85, (near + far) / 2, f"$c_{n}$", ha="right", va="center")
        ax.text(x + 0.85, (near + far) / 2, f"$k_{n}$", ha="left", va="center")
    _mesh(ax)
    ax.set(xlim=(-4.6, 5.2), ylim=(-7.0, 7.5))
    height = ax.get_window_extent().height / ax.figure.dpi
    for text in ax.texts:
        text.set_fontsize(float(text.get_fontsize()) * min(1.0, max(_SMALLEST_SCALE, height / _FULL_HEIGHT)))
    return ax


def _arc_arrow(
    ax: Axes, centre: tuple[float, float], radius: float, start: float, stop: float, name: str, off: float,
    colour: str = "black",
) -> None:
    """Draw an arc with an arrow head at its end, and a name ``off`` beyond its middle; angles in degrees."""
    colour, angle = adapt(colour), np.radians(np.linspace(start, stop, 60))
    x, y = centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)
    ax.plot(x[:-2], y[:-2], color=colour, linewidth=1.0)
    ax.annotate("", (x[-1], y[-1]), (x[-6], y[-6]), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.0,
                                                             "shrinkA": 0, "shrinkB": 0})
    mid = np.radians((start + stop) / 2)
    ax.text(centre[0] + (radius + off) * np.cos(mid), centre[1] + (radius + off) * np.sin(mid), name, color=colour,
            ha="center", va="center")


def _mesh(ax: Axes) -> None:
    """Draw the elements on the line of action, from the rim of wheel 1 up to that of wheel 2."""
    low, high, middle = -_HALF + _R1 - 0.1, _HALF - _R2 + 0.15, -0.95
    ax.plot([0, 0], [-_HALF - 2.0, _HALF + 2.4], color=adapt("0.6"), linewidth=0.6,
            linestyle=(0, (8, 3, 1.5, 3)), zorder=0)
    ax.plot([0, 0], [-_HALF, low], **adapt_style(_LINE))
    ax.plot([0, 0], [high, _HALF], **adapt_style(_LINE))
    ax.add_patch(Rectangle((-0.36, low), 0.72, 0.42, facecolor=adapt(BACKGROUND), edgecolor=adapt(INK), zorder=2))
    ax.text(0, low + 0.2, "$e(t)$", ha="center", va="center", fontsize="small")
    ax.plot([0, 0], [low + 0.42, middle], **adapt_style(_LINE))
    for y in (middle, high):
        ax.plot([-0.5, 0.5], [y, y], **adapt_style(_LINE))
    _spring(ax, -0.5, middle, middle + 1.2, coils=4)
    # the backlash: a plate that moves freely between two stops
    x, start = -0.5, middle + 1.2
    bottom, top, half = start + 0.14, high - 0.14, 0.28
    plate = (bottom + top) / 2
    ax.plot([x, x], [start, plate], **adapt_style(_LINE))
    ax.plot([x - 0.16, x + 0.16], [plate, plate], color=adapt(STROBE), linewidth=1.6)
    ax.plot([x - 0.07, x - half, x - half, x + half, x + half, x + 0.07], [bottom, bottom, top, top, bottom, bottom],
            **adapt_style(_LINE))
    ax.plot([x, x], [top, high], **adapt_style(_LINE))
    for y in (bottom, top):
        ax.plot([x - half - 0.32, x - half - 0.06], [y, y], **adapt_style(_THIN_LINE))
    ax.annotate("", (x - half - 0.2, bottom), (x - half - 0.2, top),
                arrowprops={"arrowstyle": "<->", "color": adapt("black"), "lw": 0.6, "shrinkA": 0, "shrinkB": 0})
    _damper(ax, 0.5, middle, high)
    ax.text(-0.85, middle + 0.6, "$c(t)$", ha="right", va="center")
    ax.text(-1.16, (middle + 1.2 + high) / 2, r"$2\Delta$", ha="right", va="center")
    ax.text(0.85, (middle + high) / 2, "$k$", ha="left", va="center")
    ax.text(-0.12, _HALF + 2.4, "line of action", fontsize="small", color=adapt("0.45"), va="top", ha="right",
            rotation=90)


def _spring(ax: Axes, x: float, start: float, end: float, coils: int = 5) -> None:
    """Draw a spring as a zigzag with straight ends."""
    margin = 0.12 * (end - start)
    turns = np.linspace(start + margin, end - margin, 4 * coils + 1)[1::2]
    y = np.concatenate([[start, start + margin], turns, [end - margin, end]])
    offset = np.concatenate([[0, 0], np.resize([0.2, -0.2], 2 * coils), [0, 0]])
    ax.plot(x + offset, y, **adapt_style(_LINE))


def _damper(ax: Axes, x: float, start: float, end: float) -> None:
    """Draw a damper: a cylinder on the side of ``start`` and a piston on the side of ``end``."""
    a, piston, b = (start + share * (end - start) for share in (0.35, 0.52, 0.68))
    ax.plot([x, x], [start, a], **adapt_style(_LINE))
    ax.plot([x - 0.2, x - 0.2, x + 0.2, x + 0.2], [b, a, a, b], **adapt_style(_LINE))
    ax.plot([x - 0.13, x + 0.13], [piston, piston], **adapt_style(_LINE))
    ax.plot([x, x], [piston, end], **adapt_style(_LINE))


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
        starts, levels = zip(*model.stiffness.parts(model.stiffness.numbers()), strict=True)
        first = -1 if starts[0] > 0 else 0  # in each period the last level also comes before the first start
        edges = np.concatenate(
            [[k + start for start in starts] for k in range(first, periods)] + [[periods + starts[0]]])
        ax.stairs(np.tile(levels, periods - first), edges, baseline=None, color=adapt(INK), linewidth=1.4)
        if marks := model.stiffness.part_marks:  # the names of the levels and of their durations
            low, high = min(levels), max(levels)
            ax.set_ylim(low - 0.35, high + 0.3)
            for (duration, _), start, end in zip(marks, starts, (*starts[1:], 1), strict=True):
                _dimension_line(ax, start, end, low - 0.13, duration)
            _dimension_line(ax, 0, 1, low - 0.27, "$T$")
            for (_, name), level in zip(marks, levels, strict=True):
                ax.annotate(name, (1, level), (4, 0), xycoords=("axes fraction", "data"), textcoords="offset points",
                            va="center", annotation_clip=False)
    ax.axhline(1, zorder=0, **adapt_style(_REFERENCE_LINE))
    ax.set(xlabel="time $t/T$", ylabel="mesh stiffness $c(t)/c_0$", xlim=(0, periods))
    return ax


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
