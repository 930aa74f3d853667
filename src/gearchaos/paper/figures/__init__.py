"""The figures of the paper: one function per layout; the Datasets come from the cache, the settings from the table."""

from gearchaos.paper.figures._draw import LAYOUTS, draw

__all__ = ["LAYOUTS", "draw"]
