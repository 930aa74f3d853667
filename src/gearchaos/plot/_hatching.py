"""Hatching of the classes of a map, by which they can be told apart in print without colour."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

_LOOKS: tuple[tuple[str, str], ...] = (
    ("#ffffff", ""), ("#ffffff", "////"), ("#ffffff", "\\\\\\\\"), ("#ffffff", "----"), ("#ffffff", "xxxx"),
    ("#ffffff", "...."), ("#8c8c8c", ""), ("#d0d0d0", "||||"), ("#000000", ""),
)
"""Shade and hatch of each class of a map, in the order of the classes; used again after the last one."""

_INK = "black"

def shade(index: int) -> str:
    """The shade, without colour, of the class with this index."""
    return _LOOKS[index % len(_LOOKS)][0]


def draw_hatches(index: np.ndarray, ax: Axes, extent: tuple[float, float, float, float]) -> None:
    """Hatch the cells of a map, ``index`` (rows, columns) of their classes; negative ones stay as they are."""
    rows, columns = index.shape
    x, y = np.linspace(*extent[:2], columns + 1), np.linspace(*extent[2:], rows + 1)
    for kind in np.unique(index[index >= 0]).tolist():
        if hatch := _LOOKS[kind % len(_LOOKS)][1]:
            area = Path.make_compound_path(*(_rectangle(x[a], x[b], y[row], y[row + 1])
                                             for row, a, b in _runs(index == kind)))
            ax.add_patch(PathPatch(area, hatch=hatch, facecolor="none", edgecolor=_INK, linewidth=0))


def hatched_patch(kind: int, name: str) -> Patch:
    """The legend handle of the class with index ``kind``."""
    colour, hatch = _LOOKS[kind % len(_LOOKS)]
    return Patch(facecolor=colour, edgecolor=_INK, linewidth=0.5, hatch=hatch, label=name)


def _runs(mask: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """The row, first column and end column of each run of True cells in the rows of ``mask``."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    rows, first = np.nonzero(change == 1)
    end = np.nonzero(change == -1)[1]
    return zip(rows.tolist(), first.tolist(), end.tolist(), strict=True)


def _rectangle(left: float, right: float, bottom: float, top: float) -> Path:
    return Path([(left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)], closed=True)
