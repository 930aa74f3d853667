"""The classes of the cells of a map, each with a name and a colour: kinds of motion, contact states, counts.

Hatching tells them apart without colour.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_hex, to_rgb
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from gearchaos.plot._datasets import flags
from gearchaos.plot.theme import adapt, adapt_style
from gearchaos.studies.maps.cells_to_avoid import BEYOND_CODE, TO_AVOID
from gearchaos.studies.operation.severities import SEVERITIES


class MotionClass(NamedTuple):
    """A class of the cells of a map: its name in the legend, and its colour.

    Attributes
    ----------
    name : str
        Name in the legend.
    colour : str
        Colour, ``#rrggbb``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.plot.MOTION_CLASSES[0]
    MotionClass(name='1T', colour='#f4f1e8')
    """

    name: str
    colour: str


MOTION_CLASSES: tuple[MotionClass, ...] = (
    MotionClass("1T", "#f4f1e8"),
    MotionClass("2T", "#abcdff"),
    MotionClass("3T", "#10b368"),
    MotionClass("4T", "#14648c"),
    MotionClass("other sub-harmonic", "#a971e5"),
    MotionClass("quasi-periodic", "#f5c518"),
    MotionClass("chaotic", "#c03a1e"),
    MotionClass("undecided", "#4d4d4d"),
    MotionClass("diverged", "#111111"),
)
"""Kinds of motion. Colours differ by at least 25 CIELAB units, also under protanopia, deuteranopia and tritanopia."""

CONTACT_CLASSES: tuple[MotionClass, ...] = (
    MotionClass("in contact", "#abcdff"),
    MotionClass("separation", "#f5c518"),
    MotionClass("both flanks", "#c03a1e"),
    MotionClass("no contact", "#4d4d4d"),
)
"""Contact states; the index is the code of ``contact``."""

SEVERITY_COLOURS = dict(zip(SEVERITIES, (
    CONTACT_CLASSES[0].colour, "#f7e7a3", "#e59a1f", CONTACT_CLASSES[2].colour, MOTION_CLASSES[-1].colour),
    strict=True))
"""Colours of what happens at speeds to avoid."""

PALE = 0.45
"""Opacity of what operation does not meet."""


_FREE = "#dde7ee"  # colour of cells in which nothing is to be avoided: no pale one of these


def _paler(colour: str) -> str:
    red, green, blue = (PALE * part + 1 - PALE for part in to_rgb(colour))
    return to_hex((red, green, blue))


AVOID_CLASSES: tuple[MotionClass, ...] = tuple(
    MotionClass(words, _FREE if code == 0 else
                SEVERITY_COLOURS[words] if words in SEVERITY_COLOURS else
                _paler(SEVERITY_COLOURS[TO_AVOID[code - BEYOND_CODE]]))
    for code, words in TO_AVOID.items())
"""What is to be avoided; the index is the code of ``to_avoid``."""

NO_CLASS = -1
"""Class index of cells that are not computed, and so have no class."""

_NOT_COMPUTED: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.6", "hatch": "////"}  # how these cells look
_YES_NO = (MotionClass("no", "#f4f1e8"), MotionClass("yes", "#c03a1e"))
_YES_NO_VARIABLES = ("hysteresis", "transient_chaos", "inferred")  # their codes 0 and 1 mean no and yes
_MAX_LEGEND_CLASSES = 9  # more classes are shown by a colour bar
_LAST_NAMED_PERIOD = 4  # the longest period, in mesh periods, that has a class of its own
_BY_MEANING = {c.name: i for i, c in enumerate(MOTION_CLASSES) if i > _LAST_NAMED_PERIOD}  # by names of ``label``
_DIVERGED = _BY_MEANING["diverged"]


def motion_class(label: xr.DataArray, period: xr.DataArray) -> np.ndarray:
    """Index into `MOTION_CLASSES` of every cell; `NO_CLASS` in cells that are not computed yet.

    Parameters
    ----------
    label : DataArray of int
        Codes with ``flag_values`` and ``flag_meanings`` attributes, as the studies write them.
    period : DataArray of int
        Period in mesh periods where the label is periodic.

    Returns
    -------
    ndarray of int, the shape of ``label``

    Raises
    ------
    KeyError
        If ``label`` has no flag attributes.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> index = gc.plot.motion_class(zones.label, zones.period)
    >>> index.shape
    (16, 24)
    >>> gc.plot.MOTION_CLASSES[index[0, 0]].name
    '1T'
    """
    codes = label.values
    out = np.clip(period.values, 1, _LAST_NAMED_PERIOD + 1).astype(int) - 1
    for value, meaning in flags(label).items():
        if meaning in _BY_MEANING:
            out[codes == value] = _BY_MEANING[meaning]
    out[codes <= 0] = NO_CLASS
    return out


def _not_computed(ds: xr.Dataset, name: str) -> np.ndarray:
    """Whether each value of a variable is not computed yet, by the labels of the same cells: 0 or −1."""
    if "label" not in ds or ds["label"].dims != ds[name].dims:
        return np.zeros(ds[name].shape, bool)
    return ds["label"].values <= 0


def continuous_values(ds: xr.Dataset, name: str) -> np.ndarray:
    """The values of a variable that has no classes, as floats; NaN where they are not computed."""
    return np.where(_not_computed(ds, name), np.nan, ds[name].values)


def named_classes(ds: xr.Dataset, name: str) -> tuple[np.ndarray, tuple[MotionClass, ...]] | None:
    """The index of every cell into the classes of a variable, and those classes; None for a continuous variable.

    The index is `NO_CLASS` in cells that are not computed yet.
    """
    if ds[name].dtype.kind not in "iu":
        return None
    if name == "label":
        return motion_class(ds["label"], ds["period"]), MOTION_CLASSES
    missing, values, classes = _not_computed(ds, name), ds[name].values.astype(int), tuple[MotionClass, ...]()
    if name == "to_avoid":
        index, classes = values, AVOID_CLASSES
    elif name.startswith("contact"):
        index, classes = np.maximum(values, NO_CLASS), (*CONTACT_CLASSES, MOTION_CLASSES[_DIVERGED])
        if name == "contact" and "label" in ds:  # diverged motions have the code of no contact
            index = np.where(motion_class(ds["label"], ds["period"]) == _DIVERGED, len(CONTACT_CLASSES), index)
    elif name in _YES_NO_VARIABLES:
        index, classes = values, _YES_NO
    else:
        if named := flags(ds[name]):
            codes = np.array(list(named))
            classes = tuple(MotionClass(n.replace("_", " "), c.colour)
                            for n, c in zip(named.values(), MOTION_CLASSES, strict=False))
        else:  # counts, coloured by a scale; the values of missing cells are none
            codes = np.unique(values[~missing]) if not missing.all() else np.zeros(1, int)
            shades = matplotlib.colormaps["viridis"](np.linspace(0, 1, len(codes)))
            classes = tuple(MotionClass(str(n), to_hex(c)) for n, c in zip(codes, shades, strict=True))
        index = np.where(np.isin(values, codes), np.searchsorted(codes, values), NO_CLASS)
    return None if len(classes) > _MAX_LEGEND_CLASSES else (np.where(missing, NO_CLASS, index), classes)


_LOOKS: tuple[tuple[str, str], ...] = (
    ("#ffffff", ""), ("#ffffff", "////"), ("#ffffff", "\\\\\\\\"), ("#ffffff", "----"), ("#ffffff", "xxxx"),
    ("#ffffff", "...."), ("#8c8c8c", ""), ("#d0d0d0", "||||"), ("#000000", ""),
)
"""Shade and hatch of each class of a map, in the order of the classes; used again after the last one."""


def look(index: int) -> tuple[str, str]:
    """The shade, without colour, and the hatch of the class with this index."""
    return _LOOKS[index % len(_LOOKS)]


def draw_classes(
    index: np.ndarray, ax: Axes, extent: tuple[float, float, float, float],
    classes: Sequence[MotionClass] = MOTION_CLASSES, *, hatch: bool = False,
) -> None:
    """Colour or hatch cells by their class, ``index`` (rows, columns) into ``classes``; those not computed are striped.
    """
    colours = [look(i)[0] if hatch else c.colour for i, c in enumerate(classes)]
    ax.imshow(
        np.ma.masked_equal(index, NO_CLASS), origin="lower", aspect="auto", interpolation="nearest",
        cmap=ListedColormap(colours), vmin=-0.5, vmax=len(classes) - 0.5,
        extent=extent, interpolation_stage="rgba",
    )
    if hatch:
        draw_hatches(index, ax, extent)
    if np.any(index == NO_CLASS):
        ax.patch.set(**adapt_style(_NOT_COMPUTED))


def draw_hatches(index: np.ndarray, ax: Axes, extent: tuple[float, float, float, float]) -> None:
    """Hatch the cells of a map, ``index`` (rows, columns) of their classes; negative ones stay as they are."""
    rows, columns = index.shape
    x, y = np.linspace(*extent[:2], columns + 1), np.linspace(*extent[2:], rows + 1)
    for kind in np.unique(index[index >= 0]).tolist():
        if not (hatch := look(kind)[1]):
            continue
        # row, first column and end column of each run of these cells in the rows
        change = np.diff(np.pad(index == kind, ((0, 0), (1, 1))).astype(np.int8), axis=1)
        runs = zip(*(found.tolist() for found in (*np.nonzero(change == 1), np.nonzero(change == -1)[1])), strict=True)
        area = Path.make_compound_path(*(
            Path([(x[a], y[r]), (x[b], y[r]), (x[b], y[r + 1]), (x[a], y[r + 1]), (x[a], y[r])], closed=True)
            for r, a, b in runs))
        ax.add_patch(PathPatch(area, hatch=hatch, facecolor="none", edgecolor="black", linewidth=0))


def hatched_patch(kind: int, name: str) -> Patch:
    """The legend handle of the class with index ``kind``."""
    colour, hatch = look(kind)
    return Patch(facecolor=colour, edgecolor="black", linewidth=0.5, hatch=hatch, label=name)


def patches(entries: Mapping[int, tuple[str, str]], not_computed: bool, hatch: bool = False) -> list[Patch]:
    """Legend handles: a square for every class, by its index with colour and name, and a striped one if some cells are
    not computed.
    """
    edge = adapt("0.35")
    squares = [hatched_patch(i, name) if hatch else Patch(facecolor=colour, edgecolor=edge, linewidth=0.5, label=name)
               for i, (colour, name) in entries.items()]
    if not_computed:
        squares.append(Patch(**adapt_style(_NOT_COMPUTED), linewidth=0.5, label="not computed"))
    return squares
