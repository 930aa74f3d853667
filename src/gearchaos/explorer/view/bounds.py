"""Bounds of what a page may ask for: the range of every parameter, and the size of every computation.

A browser may send any request, so every quantity in a request is bounded here.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from gearchaos.errors import InputError

CELLS = (400, 300)
"""Columns and rows of the map at its finest."""

COLUMNS, POINTS = 400, 96
"""Columns of the bifurcation diagram, and stroboscopic points in each column."""

BASIN = (160, 160)
"""Columns and rows of the plane of initial values whose basins are shown."""

STARTS = 64
"""Initial states from which the coexisting motions of one point are sought."""

ATTRACTOR_MAP = (48, 36, 6)
"""Columns, rows, and initial states in each cell, of the map of the number of attractors."""

PORTRAIT = 4000
"""Largest number of stroboscopic points in a portrait, one per mesh period."""

HARMONICS = 8
"""Highest harmonic of the transmission error and of the mesh stiffness."""

QUERY = 4000
"""Largest number of characters in the query of an address."""


class Span(NamedTuple):
    """Range of a parameter: the ends of its slider (low, high), and the values accepted (least to most)."""

    low: float
    high: float
    least: float
    most: float


_SPANS: dict[str, Span] = {
    "omega": Span(0.2, 3.0, 0.05, 20.0),
    "zeta": Span(0.0, 0.2, 0.0, 10.0),
    "J": Span(0.5, 10.0, 0.05, 1000.0),
    "q": Span(0.0, 0.3, -100.0, 100.0),
    "beta": Span(0.0, 0.1, 0.0, 10.0),
    "mu": Span(0.5, 10.0, 0.05, 1000.0),
    "kappa": Span(0.1, 10.0, 0.005, 1000.0),
    "zeta_support": Span(0.0, 0.1, 0.0, 10.0),
    "chi": Span(-0.5, 0.75, -0.95, 0.95),
    "contact_ratio": Span(1.0, 2.0, 1.0, 2.0),
    "eps": Span(0.0, 0.3, -10.0, 10.0),
    "theta": Span(-3.2, 3.2, -100.0, 100.0),
    "c": Span(-0.5, 0.5, -0.95, 0.95),
    "alpha": Span(-3.2, 3.2, -100.0, 100.0),
    "x": Span(-3.0, 3.0, -1000.0, 1000.0),
    "y": Span(-3.0, 3.0, -1000.0, 1000.0),
    "z": Span(-3.0, 3.0, -1000.0, 1000.0),
}
_STEM = re.compile(r"([A-Za-z_]+?)(\d*)(_dot)?")


def span(name: str) -> Span:
    """The range of a parameter or initial value by its name; pairs and harmonics included.

    Raises
    ------
    InputError
        If the explorer knows no such name.
    """
    match = _STEM.fullmatch(name)
    if match is None or match[1] not in _SPANS:
        raise InputError("parameter", "must be one that the explorer knows", name)
    return _SPANS[match[1]]


def bounded(name: str, value: object) -> float:
    """``value`` as a float.

    Raises
    ------
    InputError
        If it is no finite number, or outside the range that the explorer accepts for this parameter.
    """
    found = number(name, value)
    _, _, least, most = span(name)
    if not least <= found <= most:
        raise InputError(name, f"must lie in [{least:g}, {most:g}] in the explorer", found)
    match = _STEM.fullmatch(name)
    if match and match[1] in ("eps", "theta", "c", "alpha") and match[2] and int(match[2]) > HARMONICS:
        raise InputError(name, f"must be a harmonic of order at most {HARMONICS} in the explorer", int(match[2]))
    return found


def number(name: str, value: object) -> float:
    """``value`` as a finite float; an `InputError` about the field ``name`` if it is none."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, "must be a number", str(value)[:40]) from None
    if not math.isfinite(found):
        raise InputError(name, "must be a finite number", found)
    return found


def rounded(value: float, width: float) -> float:
    """``value`` rounded to about 1/1000 of a range of the given width, so that it is short to read and to type."""
    return round(value, max(0, 4 - math.floor(math.log10(width)) - 1)) if width > 0 else value
