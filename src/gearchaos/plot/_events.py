"""The words, colours and markers of the kinds of events of periodic orbits, in all pictures and in the explorer."""

from __future__ import annotations

EVENT_COLOURS = {
    "fold": "#111111", "flip": "#2a7fff", "neimark-sacker": "#d18f00", "pitchfork": "#3d5a00",
    "neutral-saddle": "#9a9a9a", "graze": "#a3158f",
}
"""In the order of legends. Colours differ by at least 25 CIELAB units, also under protanopia, deuteranopia and
tritanopia."""

SPECIAL_MARKERS = {
    "cusp": "v", "generalised flip": "D", "1:1 resonance": "P", "1:2 resonance": "X", "1:3 resonance": "^",
    "1:4 resonance": "s", "fold-flip": "o", "fold-neimark-sacker": "h", "flip-neimark-sacker": "p", "grazing-fold": "<",
    "grazing-flip": ">", "grazing-neimark-sacker": "d", "double graze": "*",
}
"""Markers of the points of codimension 2 by kind, in the order of legends."""


def event_words(kind: str) -> str:
    """A kind of event in words."""
    return "Neimark–Sacker" if kind == "neimark-sacker" else kind.replace("-", " ")
