"""Bounds of what a page may ask for: the size of every computation, and the range of every value.

A browser may send any request, so every quantity in a request is bounded here.
"""

from __future__ import annotations

import math

from gearchaos.errors import InputError
from gearchaos.quantities import Range, find, parse, parse_harmonic

MAP_CELLS = (400, 300)  # columns and rows of the complete map
DIAGRAM_COLUMNS, DIAGRAM_POINTS = 400, 96  # columns of the bifurcation diagram, and stroboscopic points in each column
BASIN_CELLS = (160, 160)  # columns and rows of the plane of initial values whose basins are shown
INITIAL_STATES = 64  # number of initial states from which the coexisting motions of one point are sought
ATTRACTOR_MAP = (48, 36, 6)  # columns, rows, and initial states in each cell, of the map of the number of attractors
COARSER_TRAIN = (4, 16)
"""How many times fewer columns, and rows, the studies of a train have, of few and of many coordinates."""

SHARES = (0.1, 2.5)
"""Ends of the axes that a page shows first, relative to the values with which gears operate."""

LEAST_SPEED = 0.4
"""The same for the low end of the speed of a train: a period at a lower speed takes long to compute."""

BRANCH_POINTS = 2000  # largest number of points of a branch, or of a curve over the map, in each direction

SKELETON_PERIODS, SKELETON_PERIOD = (1, 2, 4), 2
"""Largest periods of the orbits whose bifurcation curves can be asked for, and the one that is chosen first."""

SKELETON_LINES = (0.5, 0.75, 0.25, 0.9)
"""Where the lines lie that are searched for the events of these curves, as shares of the map."""

LONGEST_RUN = 30.0  # seconds of a run-up that is played, its run-down included
PORTRAIT_POINTS = 4000  # largest number of stroboscopic points in a portrait, one per mesh period
HIGHEST_HARMONIC = 8  # highest order of the harmonics of the transmission error and of the mesh stiffness
LEVELS = (0.05, 20.0)  # least and largest level of a stepped mesh stiffness
QUERY_LENGTH = 4000  # largest number of characters in the query of an address

_OF_PARTS = Range(0.0, 1.0, -1e12, 1e12)
"""Range of the parameters of a train's parts. The train checks them too, and sliders lie around its own values."""


def value_range(name: str) -> Range:
    """The range that the explorer accepts for a parameter, pair, harmonic or initial value; `InputError` if none."""
    found = None if parse(name).prefix else find(name)
    if found is None or not (found.range or "." in name):
        raise InputError("parameter", "must be one that the explorer knows", name)
    return found.range or _OF_PARTS


def bounded(name: str, value: object) -> float:
    """``value`` as a float.

    An `InputError` says that it is not a finite number, or outside the range that the explorer accepts for this
    parameter, or that this is a harmonic of too high an order.
    """
    found = in_range(name, value)
    parts = parse_harmonic(name)
    if parts is not None and parts.order is not None and parts.order > HIGHEST_HARMONIC:
        raise InputError(name, f"must be a harmonic of order at most {HIGHEST_HARMONIC} in the explorer", parts.order)
    return found


def in_range(name: str, value: object) -> float:
    """``value`` as a float, for a harmonic of any order; raises `InputError` as `bounded`."""
    found = finite_number(name, value)
    _, _, least, most = value_range(name)
    if not least <= found <= most:
        raise InputError(name, f"must lie in [{least:g}, {most:g}] in the explorer", found)
    return found


def finite_number(name: str, value: object) -> float:
    """``value`` as a finite float; raises an `InputError` about the field ``name`` if it is not one."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, "must be a number", str(value)[:40]) from None
    if not math.isfinite(found):
        raise InputError(name, "must be a finite number", found)
    return found


def rounded(value: float, width: float) -> float:
    """``value`` rounded to 1/1000 to 1/10000 of ``width``, the width of its range, so that it has few digits."""
    return round(value, max(0, 4 - math.floor(math.log10(width)) - 1)) if width > 0 else value
