"""What to avoid and what to use over speed and torque: the decision as a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from gearchaos.errors import InputError
from gearchaos.plot._datasets import described, figure_of
from gearchaos.plot._dynamic_factor import computed_factors, draw_computed
from gearchaos.plot.axes import draw_legend
from gearchaos.plot.classes import PALE, SEVERITY_COLOURS
from gearchaos.plot.theme import EVENT_COLOURS, INK, adapt, event_words
from gearchaos.studies.maps.cells_to_avoid import AFTER_A_LOAD_CHANGE
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studies.speeds.speed_windows import SpeedsToAvoid, Window

MOST_ROWS = 12
"""Most torques that are drawn as rows of bars; more are areas."""

_USABLE = "#bad7c9"  # of the speeds that are usable at all torques
_SHADE = 0.25  # opacity of the ranges to avoid behind the dynamic factor
_NO_EVENT = "0.45"  # colour of an edge at which a motion ends that does not repeat
_BAR, _MARK = 0.62, 0.78  # heights of bars and of the marks of their edges, as shares of a row
_NARROWEST = 1e-3  # width of a bar, as a share of the axis
_STRIP = 0.09  # height of the strip of the speeds that are usable at all torques, over that of all areas
_HIGHEST = 4.6  # picture, in inches
_MARGIN_WIDTH = 0.55  # least width of a usable range, in inches, in which its margin is written


def assessment(found: Assessment, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw what to avoid and what to use, the speed across and the torque up.

    A colour says what happens in a range to avoid, pale and hatched where a load change alone leads there. Lines
    mark the edges by the event at which they lie. What is left blank is usable, with its margin where there is room
    for it: by which share the speed may differ either way from the middle of the range. Above several torques a row
    shows what is usable at all of them. Up to 12 torques are rows of bars, in even distances, more are areas to
    scale.

    Parameters
    ----------
    found : Assessment
        From `gearchaos.assess`.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of what happens and of the events.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If it is not the result of `gearchaos.assess`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.assessment(gc.assess(design, "500:700:10", [100, 300], starts=0))
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['100', '300', 'all']
    """
    if not isinstance(found, Assessment):
        raise InputError("found", "must be the result of gearchaos.assess", described(found))
    torques = np.array([each.torque for each in found.at])
    rows = len(torques) <= MOST_ROWS
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.figure(figsize=(6.4, height(found)), layout="constrained").subplots()
    middle = (torques[1:] + torques[:-1]) / 2
    edges = np.arange(len(torques) + 1) - 0.5 if rows else np.concatenate(
        [[2 * torques[0] - middle[0]], middle, [2 * torques[-1] - middle[-1]]])
    top = edges[-1] + (len(torques) > 1) * (1.0 if rows else _STRIP * (edges[-1] - edges[0]))
    ax.set(xlim=found.speeds, ylim=(edges[0], top), xlabel="speed of wheel 1 [rpm]", ylabel="torque at wheel 1 [N m]")
    known: dict[str, Any] = {}
    events: dict[str, Any] = {}
    for number, each in enumerate(found.at):
        low, high = edges[number : number + 2]
        for window in each.windows:
            _draw_window(ax, window, low, high, rows, known, events)
        if rows:
            _margins(ax, each.usable, (low + high) / 2)
    if rows:
        ax.set_yticks(range(len(torques)), [f"{torque:g}" for torque in torques])
        ax.tick_params(axis="y", length=0)
    else:
        ax.yaxis.set_major_locator(MaxNLocator(6))
    if len(torques) > 1:
        _usable_at_all(ax, found, edges[-1], top, rows)
        known["usable at all torques"] = Patch(facecolor=adapt(_USABLE), label="usable at all torques")
        known["avoid at some"] = Patch(facecolor=adapt("0.85"), label="to avoid at some torque")
    if legend and (known or events):
        draw_legend(ax, [*known.values(), *events.values()])
    return ax


def draw_factors(at: SpeedsToAvoid, ax: Axes) -> Axes:
    """Draw the dynamic factor of each motion found at a torque over the speed, with the ranges to avoid."""
    for window in at.windows:
        ax.axvspan(*window.reach, facecolor=adapt(meaning(window)[1]), alpha=_SHADE, linewidth=0, zorder=0)
    lines = computed_factors({name: at.dataset.sel(motion=name) for name in at.dataset["motion"].values.tolist()})
    draw_computed(ax, lines)
    speeds = at.dataset["speed"].values
    ax.set(xlim=(speeds[0], speeds[-1]), xlabel="speed of wheel 1 [rpm]", ylabel="dynamic factor")
    draw_legend(ax, lines)
    return ax


def height(found: Assessment) -> float:
    """The height of a picture in which there is room for all torques, in inches."""
    return min(1.9 + 0.4 * len(found.at), _HIGHEST) if len(found.at) <= MOST_ROWS else _HIGHEST


def meaning(window: Window) -> tuple[str, str]:
    """What happens in a range to avoid, as the legend has it, and its colour on a light background."""
    return window.severity, SEVERITY_COLOURS[window.severity]


def bar(window: Window, speeds: tuple[float, float]) -> tuple[float, float]:
    """Where a range to avoid is drawn over an axis, so wide that a single speed is seen."""
    low, high = window.reach
    return low, max(high, low + _NARROWEST * (speeds[1] - speeds[0]))


def _draw_window(ax: Axes, window: Window, low: float, high: float, rows: bool, known: dict[str, Any],
                 events: dict[str, Any]) -> None:
    """Draw a range to avoid between two heights, mark its edges by their events, and add the legend handles by label.
    """
    words, plain = meaning(window)
    colour = adapt(plain)
    margin, beside = ((1 - (share if rows else 1.0)) / 2 * (high - low) for share in (_BAR, _MARK))
    pale: dict[str, Any] = {"alpha": PALE, "hatch": "////", "edgecolor": adapt("0.3"), "linewidth": 0}
    start, stop = bar(window, ax.get_xlim())
    style: dict[str, Any] = {"facecolor": colour, "linewidth": 0, **({} if window.operation else pale)}
    ax.broken_barh([(start, stop - start)], (low + margin, high - low - 2 * margin), zorder=2, **style)
    known[words] = Patch(facecolor=colour, label=words)
    if not window.operation:
        known[AFTER_A_LOAD_CHANGE] = Patch(**{**pale, "facecolor": "none", "alpha": 1, "label": AFTER_A_LOAD_CHANGE})
    for speed, kind, end in ((window.start, window.begins_with, window.from_scan_start),
                             (window.stop, window.ends_with, window.to_scan_end)):
        if not end:
            label = event_words(kind) if kind else "no event"
            style = {"color": adapt(EVENT_COLOURS.get(kind, INK) if kind else _NO_EVENT), "linewidth": 1.8}
            ax.plot([speed, speed], [low + beside, high - beside], zorder=3, solid_capstyle="butt", **style)
            events[label] = Line2D([], [], label=label, **style)


def _usable_at_all(ax: Axes, found: Assessment, low: float, high: float, rows: bool) -> None:
    """The speeds that are usable at all torques, in a row above them."""
    ax.axhline(low, color=adapt("0.6"), linewidth=0.8)
    height = high - low
    ax.axhspan(low + 0.12 * height, low + 0.88 * height, facecolor=adapt("0.85"), linewidth=0)
    for part in found.usable_at_all:
        ax.broken_barh([(part.start, part.stop - part.start)], (low + 0.12 * height, 0.76 * height), linewidth=0,
                       facecolor=adapt(_USABLE), zorder=2)
    _margins(ax, found.usable_at_all, (low + high) / 2)
    if rows:
        ax.set_yticks([*ax.get_yticks(), (low + high) / 2], [*(t.get_text() for t in ax.get_yticklabels()), "all"])


def _margins(ax: Axes, usable: list[Any], height: float) -> None:
    """Write the margins of usable ranges where there is room."""
    speeds = ax.get_xlim()
    least = _MARGIN_WIDTH * (speeds[1] - speeds[0]) / (0.85 * figure_of(ax).get_figwidth())
    for part in usable:
        if part.stop - part.start >= least:
            ax.text((part.start + part.stop) / 2, height, part.margin_words, ha="center", va="center",
                    fontsize="small", color=adapt(INK), zorder=4)
