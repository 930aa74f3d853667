"""The kinds of motion that pictures tell apart, and their colours."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray as xr


class MotionClass(NamedTuple):
    """One entry of the legend: a name and a colour."""

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
"""Colours differ by at least 25 CIELAB units also under protanopia, deuteranopia and tritanopia."""

NOT_COMPUTED = -1
GROUND: dict[str, Any] = {"facecolor": "white", "edgecolor": "0.6", "hatch": "////"}
"""What shows where nothing is computed."""

LEGEND: dict[str, Any] = {
    "loc": "lower left", "bbox_to_anchor": (0, 1.01, 1, 0), "borderaxespad": 0, "frameon": False,
    "handlelength": 1.1, "columnspacing": 1.0, "handletextpad": 0.5,
}
"""Where and how legends of classes stand: above the Axes, without a frame."""

_LAST_NAMED_PERIOD = 4
_BY_MEANING = {"quasi-periodic": 5, "chaotic": 6, "undecided": 7, "diverged": 8}


def motion_class(label: xr.DataArray, period: xr.DataArray) -> np.ndarray:
    """Index into `MOTION_CLASSES` of every cell, `NOT_COMPUTED` where a run has not come to yet.

    Parameters
    ----------
    label : DataArray of int
        Codes with ``flag_values`` and ``flag_meanings`` attributes, as the studies write them.
    period : DataArray of int
        Period in mesh periods where the label is periodic.

    Returns
    -------
    ndarray of int, the shape of ``label``
    """
    codes = label.values
    out = np.clip(period.values, 1, _LAST_NAMED_PERIOD + 1).astype(int) - 1
    for value, meaning in zip(np.ravel(label.attrs["flag_values"]), label.attrs["flag_meanings"].split(), strict=True):
        if meaning in _BY_MEANING:
            out[codes == value] = _BY_MEANING[meaning]
    out[codes == 0] = NOT_COMPUTED
    return out
