"""The bifurcation curves over the map, and their legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bokeh.models import ColumnDataSource, MultiLine

from gearchaos.explorer.jobs.skeleton import EventCurve, Skeleton
from gearchaos.explorer.panels.style import SetAttributes
from gearchaos.plot._theme import EVENT_COLOURS, event_words

_COLOURS = {kind: EVENT_COLOURS[kind] for kind in ("fold", "flip", "neimark-sacker", "graze")}
"""Colours of the curves by the kind of event, in the order of the legend."""

_DOTTED = "graze"
"""The kind whose curves are dotted, since a graze is no bifurcation in general."""

_WIDTH = 2.0
"""Width of the curves of orbits of period 1, in pixels; it decreases with the period."""

_FIELDS = ("xs", "ys", "colour", "width", "outline")


class SkeletonCurves:
    """Curves over a map: solid with a white outline, which shows them on every colour; those of grazes are dotted.

    Parameters
    ----------
    figure : bokeh figure
        Of the map.
    set_attributes : SetAttributes
    """

    def __init__(self, figure: Any, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.solid, self.dotted = (ColumnDataSource({n: [] for n in _FIELDS}) for _ in range(2))
        place = {"xs": "xs", "ys": "ys", "line_join": "round"}
        for source, dash in ((self.dotted, [2, 3]), (self.solid, [])):
            outline = MultiLine(**place, line_color="white", line_width="outline", line_alpha=0.7)
            line = MultiLine(**place, line_color="colour", line_width="width", line_dash=dash)
            for glyph in (outline, line):
                figure.add_glyph(source, glyph, level="overlay")  # can be redrawn without redrawing the map

    def show(self, curves: Sequence[EventCurve]) -> None:
        """Draw these curves instead of those before."""
        for source, dotted in ((self.solid, False), (self.dotted, True)):
            own = [c for c in curves if (c.kind == _DOTTED) == dotted]
            widths = [max(1.0, _WIDTH / c.period**0.5) for c in own]
            self._set(source, data={
                "xs": [c.x.tolist() for c in own], "ys": [c.y.tolist() for c in own],
                "colour": [_COLOURS.get(c.kind, "#333333") for c in own], "width": widths,
                "outline": [w + 1.6 for w in widths],
            })


@dataclass(frozen=True)
class SkeletonText:
    """What stands beside the button for bifurcation curves.

    Attributes
    ----------
    legend : list of (str, bool, str)
        Colour, whether dotted, and words of the kinds that occur.
    count : int
        Number of curves.
    status : str
    complete : bool
        Whether all lines have been searched.
    """

    legend: list[tuple[str, bool, str]]
    count: int
    status: str
    complete: bool


def skeleton_text(found: Skeleton | None) -> SkeletonText:
    """The legend of curves and how far the search is; None stands for a search that waits for the map."""
    if found is None:
        return SkeletonText([], 0, "follow when the map is complete …", False)
    kinds = {c.kind for c in found.curves}
    legend = [(colour, kind == _DOTTED, event_words(kind)) for kind, colour in _COLOURS.items() if kind in kinds]
    count, complete = len(found.curves), found.searched == found.lines
    words = f"{count or 'no'} curve{'' if count == 1 else 's'}"
    status = f"{words} of orbits up to {found.period}T" if complete else (
        f"{words} so far: line {found.searched + 1} of {found.lines} …")
    if found.failed:
        status += f"; {found.failed} could not be followed"
    return SkeletonText(legend, count, status, complete)
