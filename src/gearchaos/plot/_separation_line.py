"""The line over speed and torque below which a gear pair at constant stiffness loses contact: an overlay for a map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.separation import separation_margin
from gearchaos.plot._axes import new_axes, wrapped
from gearchaos.plot._checks import check_design
from gearchaos.plot._theme import BACKGROUND, INK, adapt
from gearchaos.studies.axis import Axis
from gearchaos.studies.operating_map import operating_axis

_SPEEDS, _TORQUES = 801, 121
"""Points of the grid on which the line is found."""

_LEAST_TORQUE = 1e-4
"""Least torque of the grid, relative to the largest one: with none there is no stiffness by ISO 6336-1."""

_LABEL_WIDTH = 0.8
"""Greatest width of the label of an axis over that of the Axes, which a layout engine may make narrower."""

_NOTE = "line: permanent contact ends, at mean stiffness"


def separation_line(
    design: GearDesign, ax: Axes | None = None, *, speed: Axis | str | None = None, torque: Axis | str | None = None,
    note: bool = True,
) -> Axes:
    """Draw where permanent contact ends at constant mesh stiffness, over speed in rpm and torque in N m of wheel 1.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with transmission error, damping ratio and inertia.
    ax : Axes
        A map over speed and torque, e.g. of `zones` for a result of `gearchaos.operating_map`. It keeps its limits.
    speed, torque : Axis or str, optional
        Ranges in rpm and N m, such as "500:6000:200", of which only the ends matter; by default those of ``ax``.
    note : bool
        Say below the label of the speed what the line is.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the ranges are neither given nor those of ``ax``, or an input that the line needs is missing.

    Notes
    -----
    The line is that of `gearchaos.gears.separation.separation_torque`, with the time mean of the mesh stiffness. With
    varying stiffness it is a first estimate; a motion with impacts may exist above it, too.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     transmission_error="from quality", quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.separation_line(design, speed="3000:6000:2", torque="20:400:2")
    >>> ax.get_ylabel()
    'torque [N m]'
    """
    check_design(design)
    given = {"speed": speed, "torque": torque}
    ends = {name: _range(name, value, ax) for name, value in given.items()}
    speeds = np.linspace(*ends["speed"], _SPEEDS)
    torques = np.linspace(max(ends["torque"][0], _LEAST_TORQUE * ends["torque"][1]), ends["torque"][1], _TORQUES)
    margin = separation_margin(design, speeds, torques)
    drawn = ax is not None and ax.has_data()
    ax = new_axes(ax)
    colours = (INK, BACKGROUND) if ax.images else (adapt(INK), adapt(BACKGROUND))
    outline = [withStroke(linewidth=3.2, foreground=colours[1])]
    for x, y in _zeros(ax, speeds, torques, margin):
        ax.plot(x, y, color=colours[0], linewidth=1.5, zorder=5, path_effects=outline, label="end of permanent contact")
    ax.set(xlim=ends["speed"], ylim=ends["torque"])
    if not drawn:
        ax.set(xlabel="speed [rpm]", ylabel="torque [N m]")
    if note:
        inches = _LABEL_WIDTH * ax.get_window_extent().width / ax.figure.dpi
        ax.set_xlabel(f"{ax.get_xlabel()}\n{wrapped(_NOTE, inches)}")
    return ax


def _range(name: str, given: Axis | str | None, ax: Axes | None) -> tuple[float, float]:
    """First and last value of an axis: those given, or the limits of an Axes."""
    if given is not None:
        axis = operating_axis(name, given)
        return axis.start, axis.stop
    if ax is None or not ax.has_data():
        raise InputError(name, "must be given without a map", None, "E.g. 500:6000:200, or ax= with a map.")
    return ax.get_xlim() if name == "speed" else ax.get_ylim()


def _zeros(ax: Axes, speeds: np.ndarray, torques: np.ndarray, margin: np.ndarray) -> list[np.ndarray]:
    """The lines (2, points) where the margin (torques, speeds) is 0; infinite margins count as large ones."""
    limits = ax.get_xlim(), ax.get_ylim()
    contours = ax.contour(speeds, torques, np.clip(margin, -1e3 * torques[-1], None), levels=[0.0])
    contours.remove()
    ax.set(xlim=limits[0], ylim=limits[1])
    return [segment.T for segment in contours.allsegs[0] if len(segment) > 1]
