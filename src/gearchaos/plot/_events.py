"""The colours of the kinds of events of periodic orbits, the same in all pictures and in the explorer."""

from __future__ import annotations

from gearchaos.plot._phase import INK

EVENT_COLOURS = {
    "fold": INK, "flip": "#1f5fd0", "neimark-sacker": "#0b7a3b", "pitchfork": "#a96a00", "neutral-saddle": "#555555",
    "graze": "#7a2b8f",
}
"""In the order of legends."""
