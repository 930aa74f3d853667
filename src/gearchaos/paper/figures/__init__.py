"""The figures of the paper: one function per layout, which draws Datasets according to the settings of a figure."""

from gearchaos.paper.figures._draw import LAYOUTS, draw

__all__ = ["LAYOUTS", "draw"]
