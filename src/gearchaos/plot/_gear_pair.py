"""A gear design: its drawing in mesh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.transverse_section import TransverseSection, transverse_section
from gearchaos.plot._datasets import check_design, check_positive
from gearchaos.plot.axes import draw_legend, new_axes, panels
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt, adapt_style
from gearchaos.validation import to_float

_MM = 1e3
_FACES = ("#e8ecf4", "#f4f1e8")  # colours of the wheels
_STYLES: dict[str, dict[str, Any]] = {
    "tip circles": {"color": "0.35", "linewidth": 0.6},
    "pitch circles": {"color": "#2f6db5", "linewidth": 0.9, "linestyle": (0, (5, 1.5, 1, 1.5))},
    "reference circles": {"color": "0.45", "linewidth": 0.8, "linestyle": (0, (4, 2))},
    "base circles": {"color": "#1b7a4b", "linewidth": 1.0, "linestyle": (0, (1.2, 1.8))},
    "line of action": {"color": INK, "linewidth": 1.0, "linestyle": (0, (6, 1.5, 1.5, 1.5))},
    "path of contact": {"color": STROBE, "linewidth": 2.4, "solid_capstyle": "butt"},
}
_CENTRE_LINE: dict[str, Any] = {"color": "0.45", "linewidth": 0.6, "linestyle": (0, (10, 3, 2, 3))}
_SAME = 1e-6  # relative difference below which reference circles are drawn as the working pitch circles that they are
_MOST_TEETH = 400  # above this number the whole wheel is drawn without teeth, which would be smaller than a pixel
_SMALL = 0.6  # diameter over that of the larger wheel below which number and arrow are beside a wheel, not within it
_LEAST_TEETH, _LARGEST_VIEW = 0.5, 1000.0
_LEAST_VIEW = 1.25  # least width of the close-up over that of the path of contact


def gear_pair(design: GearDesign, ax: Axes | None = None, *, teeth: float | None = 3.0,
              phase: float | None = None, legend: bool = True) -> Axes:
    """Draw both wheels in mesh in the transverse section, to scale, in mm.

    One panel shows the teeth in contact, another one, beside or below it, the whole pair. Wheel 1, which drives
    clockwise, lies below wheel 2. The flanks are the involutes and trochoids that the basic rack generates. A backlash
    is made by thinner teeth, by the same amount on both wheels; without one the teeth are nominal. Of helical gears it
    is one transverse plane. A ring lies around wheel 1, on a rim of 2 modules. The pitch circles are the working ones;
    where the reference circles are the same, they are left out. A is the start and E the end of contact, C the pitch
    point (ISO 21771:2007); dots mark the points where flanks touch.

    Parameters
    ----------
    design : GearDesign
        The gear pair.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    teeth : float or None
        Width of the close-up in pitches, at least as wide as the path of contact; None for the whole pair alone.
    phase : float, optional
        The instant, as a fraction of the mesh period since a tooth pair entered contact; by default in the middle of
        the time during which most tooth pairs are in contact.
    legend : bool
        Add a legend of the lines.

    Returns
    -------
    Axes
        With the close-up and the whole pair as its ``child_axes``, or the whole pair itself if ``teeth`` is None.

    Raises
    ------
    InputError
        If ``design`` is not a `gearchaos.GearDesign`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(teeth=(17, 103), module="8 mm", face_width="100 mm", profile_shift=(0.145, 0.0))
    >>> close_up = gc.plot.gear_pair(design)
    >>> len(close_up.child_axes)
    2
    """
    check_design(design)
    if teeth is not None and check_positive("teeth", teeth, _LARGEST_VIEW) < _LEAST_TEETH:
        raise InputError("teeth", f"must be at least {_LEAST_TEETH}", teeth)
    section = transverse_section(design, None if phase is None else to_float("phase", phase))
    ax = new_axes(ax)
    if teeth is None:
        _whole_pair(ax, section)
    else:
        close, whole = panels(ax, 0.64, beside=0.2)
        _close_up(close, section, teeth)
        _whole_pair(whole, section)
    if legend:
        draw_legend(ax, [Line2D([], [], label=name, **adapt_style(_STYLES[name])) for name in _shown(section)])
    return ax


def _shown(section: TransverseSection) -> list[str]:
    """Names of the lines; reference circles are left out if they are the working pitch circles."""
    geometry = section.geometry
    same = abs(geometry.working_diameter[0] / geometry.reference_diameter[0] - 1) <= _SAME
    return [name for name in _STYLES if not (same and name == "reference circles")]


def _ends(section: TransverseSection, *along: float) -> np.ndarray:
    """Points (N, 2) on the line of action in mm."""
    return _MM * np.array([section.on_line(position) for position in along])


def _close_up(ax: Axes, section: TransverseSection, teeth: float) -> None:
    """Draw the teeth in contact, about the middle of the path of contact."""
    path = _ends(section, section.start, section.end)
    pitch = _MM * math.pi * section.geometry.working_diameter[0] / section.geometry.teeth[0]
    box = ax.get_window_extent()
    half = max(teeth * pitch, _LEAST_VIEW * np.ptp(path[:, 0])) / 2
    size = np.array([half, half * box.height / box.width])
    middle = path.mean(axis=0)
    for wheel in (0, 1):  # the part of each wheel in the view
        z, centre = section.geometry.teeth[wheel], _MM * section.centres[wheel]
        depth = abs(middle[1] - centre[1]) - size[1]
        count = math.ceil(math.atan2(abs(middle[0]) + size[0], depth) / (2 * math.pi) * z) + 3 if depth > 0 else z
        _fill(ax, _MM * section.body(wheel, range(-count, count + 1) if count <= z / 2 else None), wheel)
    _circles(ax, section, middle, size)
    ax.plot(*_ends(section, *section.line_of_action).T, zorder=3, **adapt_style(_STYLES["line of action"]))
    ax.plot(*path.T, zorder=4, **adapt_style(_STYLES["path of contact"]))
    ax.plot(*_ends(section, *section.contacts).T, "o", color=adapt(STROBE), markeredgecolor=adapt(BACKGROUND),
            markeredgewidth=0.8, markersize=6, zorder=6)
    pitch_point = _MM * section.pitch_point
    ax.plot(*pitch_point, "o", color=adapt(BACKGROUND), markeredgecolor=adapt(INK), markersize=4, zorder=5)
    for name, point, offset in (("A", path[0], (-9, -4)), ("E", path[1], (9, 4)), ("C", pitch_point, (4, -11))):
        ax.annotate(name, tuple(point), offset, textcoords="offset points", ha="center", va="center", fontsize="small",
                    zorder=7, bbox={"boxstyle": "round,pad=0.12", "facecolor": adapt(BACKGROUND), "edgecolor": "none",
                                    "alpha": 0.85})
    ax.set(xlim=(middle[0] - size[0], middle[0] + size[0]), ylim=(middle[1] - size[1], middle[1] + size[1]),
           xlabel="mm", ylabel="mm")
    ax.set_aspect("equal")


def _fill(ax: Axes, outline: np.ndarray, wheel: int, linewidth: float = 1.0) -> None:
    """Fill a closed outline (points, 2) in the colour of a wheel."""
    ax.fill(*outline.T, facecolor=adapt(_FACES[wheel]), edgecolor=adapt(INK), linewidth=linewidth, joinstyle="round",
            zorder=1)


def _circles(ax: Axes, section: TransverseSection, middle: np.ndarray, size: np.ndarray) -> None:
    """Draw the circles of both wheels, and the line of centres, in a view: its middle and half its size in mm."""
    geometry = section.geometry
    diameters = {"tip circles": geometry.tip_diameter, "pitch circles": geometry.working_diameter,
                 "reference circles": geometry.reference_diameter, "base circles": geometry.base_diameter}
    for name in (n for n in _shown(section) if n in diameters):
        style = adapt_style(_STYLES[name])
        for wheel, diameter in enumerate(diameters[name]):
            centre, radius = _MM * section.centres[wheel], _MM * diameter / 2
            # the part nearest to the view, longer than the view is wide and high
            half = min(2 * math.asin(min(1.0, math.hypot(*size) / radius)), math.pi)
            towards = math.atan2(*(middle - centre)[::-1])
            angle = np.linspace(towards - half, towards + half, 361)
            ax.plot(*(centre[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])), zorder=2, **style)
    ax.axvline(0, zorder=1.5, **adapt_style(_CENTRE_LINE))


def _whole_pair(ax: Axes, section: TransverseSection) -> None:
    """Draw both wheels with their centres, sense of rotation and line of action."""
    geometry = section.geometry
    for wheel in (0, 1):
        centre, radius = _MM * section.centres[wheel], _MM * geometry.working_diameter[wheel] / 2
        circle = np.linspace(0, 2 * math.pi, 361)  # in place of more teeth than can be seen
        disc = centre + radius * np.column_stack([np.cos(circle), np.sin(circle)])
        fine = geometry.teeth[wheel] > _MOST_TEETH and geometry.signs[wheel] > 0
        _fill(ax, disc if fine else _MM * section.body(wheel, detail=0.5), wheel, linewidth=0.6)
        small = geometry.signs[1] > 0 and geometry.tip_diameter[wheel] < _SMALL * max(geometry.tip_diameter)
        distance, start, end = (1.6, -40, 15) if small else (0.62, -25, 25)  # the arrow of a small wheel is outside it
        turn = np.radians(180 + (-1, geometry.signs[1])[wheel] * np.linspace(start, end, 30))
        x, y = centre[:, None] + distance * radius * np.array([np.cos(turn), np.sin(turn)])
        ax.plot(x[:-1], y[:-1], color=adapt(INK), linewidth=0.8)
        ax.annotate("", (x[-1], y[-1]), (x[-3], y[-3]),
                    arrowprops={"arrowstyle": "-|>", "color": adapt(INK), "lw": 0.8, "shrinkA": 0, "shrinkB": 0})
        beside = centre[0] + small * _MM * geometry.tip_diameter[wheel] / 2
        ax.annotate(str(wheel + 1), (beside, centre[1]), (7, 0), textcoords="offset points", ha="left", va="center",
                    fontsize="small")
    ends, path = _ends(section, *section.line_of_action), _ends(section, section.start, section.end)
    ax.plot(*ends.T, **adapt_style({**_STYLES["line of action"], "linestyle": "-"}))
    ax.plot(*path.T, **adapt_style(_STYLES["path of contact"]))
    centres = _MM * section.centres
    ax.plot(*centres.T, zorder=3, **adapt_style(_CENTRE_LINE))
    ax.plot(*centres.T, "+", color=adapt(INK), markersize=6, zorder=4)
    outer, height = _MM * np.array(section.outer_radii), centres[:, 1]
    width = max(outer)
    ax.set(xlim=(-1.03 * width, 1.03 * width),
           ylim=(min(height - outer) - 0.03 * width, max(height + outer) + 0.03 * width))
    ax.set_aspect("equal")
    ax.set_axis_off()
    teeth = " and ".join(map(str, geometry.teeth))
    ax.text(0.5, -0.02, f"{teeth} teeth\n$a$ = {_MM * geometry.centre_distance:.6g} mm", transform=ax.transAxes,
            ha="center", va="top", fontsize="small")
