"""Style of the figures: width in inches, sizes of fonts and lines in points, letters of panels."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes

WIDTH = 7.2
"""Width of every figure, in inches."""

STYLE: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 10,
    "axes.labelsize": 10,
    "axes.titlesize": 10,
    "legend.fontsize": 9,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "path.simplify_threshold": 0.5,
}


def letter(ax: Axes, name: str, text: str = "") -> None:
    """The panel's letter and a short text above its upper left corner (above the strip and legend if there are any)."""
    ax.annotate(
        f"({name})" + (f"  {text}" if text else ""), (0, 1), (0, 4), xycoords="axes fraction",
        textcoords="offset points", ha="left", va="bottom", fontsize=10,
    )
