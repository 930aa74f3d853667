"""Pictures of several panels within the area of one Axes."""

from __future__ import annotations

from matplotlib.axes import Axes

WIDE = 1.15
"""Ratio of width to height of an Axes from which on its panels lie side by side, and not one above the other."""

_BESIDE, _BELOW = 0.62, 0.55
"""Space between two panels for the labels of an axis, in inches: beside each other, and one below the other."""

_WIDEST_GAP = 0.3
"""Largest share of the width or height that the space between two panels takes."""


def panels(ax: Axes, share: float, beside: float = _BESIDE) -> tuple[Axes, Axes]:
    """Replace an Axes by two panels: side by side in a wide one, else one above the other.

    Parameters
    ----------
    ax : Axes
        Its own frame and axes are hidden; the panels are its ``child_axes``.
    share : float
        Share of the width or height that the first panel, left or above, takes.
    beside : float
        Space between panels that lie side by side, in inches.
    """
    ax.set_axis_off()
    box, wide = ax.get_window_extent(), is_wide(ax)
    length, gap = (box.width, beside) if wide else (box.height, _BELOW)
    between = min(gap * ax.figure.dpi / length, _WIDEST_GAP)
    first, second = share * (1 - between), (1 - share) * (1 - between)
    if wide:
        return ax.inset_axes((0, 0, first, 1)), ax.inset_axes((1 - second, 0, second, 1))
    return ax.inset_axes((0, 1 - first, 1, first)), ax.inset_axes((0, 0, 1, second))


def is_wide(ax: Axes) -> bool:
    """Whether the panels of an Axes lie side by side."""
    box = ax.get_window_extent()
    return box.width >= WIDE * box.height
