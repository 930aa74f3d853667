"""What the explorer takes: the range of every parameter, and how much may be computed at one go.

A visitor's browser may ask for anything, so that everything a request can ask for has its bound here.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from gearchaos.errors import InputError

CELLS = (400, 300)
"""Columns and rows of a sharpened map."""

COLUMNS, POINTS = 400, 96
"""Columns of a bifurcation diagram and stroboscopic points in each."""

BASIN = (160, 160)
"""Columns and rows of a basin plane."""

STARTS = 64
"""Starts from which the motions of one point are sought."""

MANY = (48, 36, 6)
"""Columns, rows and starts in each cell of the map of the number of attractors."""

PORTRAIT = 4000
"""Most stroboscopic points of a portrait, in mesh periods."""

HARMONICS = 8

LOCAL = ("127.0.0.1", "localhost", "::1")
"""Hosts that are reached from this machine alone."""

SORRY = "something went wrong here; the server's log says what"
"""What a visitor is told of an error of ours."""

QUERY = 4000
"""Most characters of an address."""


class Span(NamedTuple):
    """Ends of the slider, and ends of what a field takes."""

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
    """The ranges of a parameter or initial value, by its name, pairs and harmonics included."""
    match = _STEM.fullmatch(name)
    if match is None or match[1] not in _SPANS:
        raise InputError("parameter", "must be one that the explorer knows", name)
    return _SPANS[match[1]]


def bounded(name: str, value: object) -> float:
    """The value as a float, if it is a number in what the explorer takes for this name."""
    found = number(name, value)
    _, _, least, most = span(name)
    if not least <= found <= most:
        raise InputError(name, f"must lie in [{least:g}, {most:g}] in the explorer", found)
    match = _STEM.fullmatch(name)
    if match and match[1] in ("eps", "theta", "c", "alpha") and match[2] and int(match[2]) > HARMONICS:
        raise InputError(name, f"must be a harmonic of order at most {HARMONICS} in the explorer", int(match[2]))
    return found


def number(name: str, value: object) -> float:
    """The value as a finite float; ``name`` is what to call it if it is none."""
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, "must be a number", str(value)[:40]) from None
    if not math.isfinite(found):
        raise InputError(name, "must be a finite number", found)
    return found


def neat(value: float, width: float) -> float:
    """The value rounded to a thousandth or so of a range, so that it reads well and can be typed again."""
    return round(value, max(0, 4 - math.floor(math.log10(width)) - 1)) if width > 0 else value
