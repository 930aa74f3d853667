"""Bounds of what a page may ask for: the size of every computation, and the range of every value.

A browser may send any request, so every quantity in a request is bounded here.
"""

from __future__ import annotations

import math

from gearchaos.errors import InputError
from gearchaos.quantities import Range, find, parse, parse_harmonic

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


def span(name: str) -> Range:
    """The range of a parameter, pair, harmonic or initial value, by its name.

    Raises
    ------
    InputError
        If the explorer has no range for such a name.
    """
    found = None if parse(name).prefix else find(name)
    if found is None or found.range is None:
        raise InputError("parameter", "must be one that the explorer knows", name)
    return found.range


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
    parts = parse_harmonic(name)
    if parts is not None and parts.order is not None and parts.order > HARMONICS:
        raise InputError(name, f"must be a harmonic of order at most {HARMONICS} in the explorer", parts.order)
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
