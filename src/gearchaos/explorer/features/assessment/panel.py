"""An assessment: ranges of speed to avoid over the map, and beside it in words, with the tables of these ranges."""

from __future__ import annotations

from typing import Any, NamedTuple

from bokeh.models import ColumnDataSource, Segment

from gearchaos.datasheet import assessment as in_words
from gearchaos.explorer.core.models import value_on
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import SetAttributes, Units, title
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.plot._assessment import bar, meaning
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studies.speeds.speed_windows import UsableRange, Window

_INK, OUTLINE = "#111111", "white"
_WIDTH = 9.0  # of a range to avoid on the map, in pixels
STRIPES = [2, 4]  # dark and light, where a load change alone leads there, in pixels
_NOTHING: dict[str, list[Any]] = {n: [] for n in ("x0", "y0", "x1", "y1", "colour")}


class AssessedLine:
    """An assessment over a map: a line through its speeds, and bars, in the colour of what happens, at ranges to avoid.

    Bars have dark edges and a white outline, which show them on every colour, and stripes where a load
    change alone leads there.
    """

    def __init__(self, figure: Any, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.scanned, self.avoided, self.striped = (ColumnDataSource(_NOTHING) for _ in range(3))
        place = {"x0": "x0", "y0": "y0", "x1": "x1", "y1": "y1"}
        for source, looks in (
            (self.scanned, (("line_color", OUTLINE, 4.0), ("line_color", _INK, 1.6))),
            (self.avoided, (("line_color", OUTLINE, _WIDTH + 7), ("line_color", _INK, _WIDTH + 4),
                            ("line_color", "colour", _WIDTH))),
        ):
            for name, colour, width in looks:
                figure.add_glyph(source, Segment(**place, **{name: colour}, line_width=width), level="overlay")
        stripes = Segment(**place, line_color=_INK, line_width=_WIDTH, line_dash=STRIPES)
        figure.add_glyph(self.striped, stripes, level="overlay")

    def show(self, found: Assessment, line: SpeedLine, view: View) -> None:
        """Draw an assessment where its line lies on the map of a view, if it does."""
        if (place := line.across(view)) is None:
            self.clear()
            return
        across, at = place
        speed = view.y if across is view.x else view.x
        drawn = [(*bar(window, (speed.start, speed.stop)), meaning(window)[1], not window.operation)
                 for _, window in found.avoid]
        striped = [each for each in drawn if each[3]]
        for source, parts in ((self.scanned, [(*found.speeds, _INK)]), (self.avoided, drawn), (self.striped, striped)):
            ends = [[part[i] for part in parts] for i in range(3)]
            along, level = ("y", "x") if across is view.x else ("x", "y")
            data = {f"{along}0": ends[0], f"{along}1": ends[1], "colour": ends[2],
                    f"{level}0": [at] * len(parts), f"{level}1": [at] * len(parts)}
            self._set(source, data=data)

    def clear(self) -> None:
        """Draw nothing."""
        for source in (self.scanned, self.avoided, self.striped):
            self._set(source, data=_NOTHING)


class AssessmentText(NamedTuple):
    """What stands below the map on an assessment."""

    other: str  # that it is not of the point; empty if it is
    sentences: list[str]
    headings: list[str]
    avoid: list[tuple[str, bool, list[str]]]  # colour, whether a load change alone leads there, row of a range to avoid
    usable: list[tuple[int, str]]  # number among `places`, and words of a range
    tried: str


def assessment_text(found: Assessment, line: SpeedLine, view: View, units: Units) -> AssessmentText:
    """An assessment in words, and of which torque or other value it is, if not of that of the point of a view."""
    (at,) = found.at
    other = ""
    if not line.goes_through(view) and (place := line.across(view)) is not None:
        (axis, value), own = place, value_on(view.operating_point, place[0])
        unit = units.after(axis.name)
        other = f"Of the {title(axis.name)} {value:g}{unit}, not that of the point, {own:g}{unit}: assess again there."
    part = in_words.avoided(at, found.gears)
    sentences = [in_words.sentence(words) for words in (
        *in_words.decision(found), in_words.worst(found), in_words.at_no_speed(at), *part.words) if words]
    headings, *rows = [list(row[: in_words.NARROW]) for row in part.table] or [[]]
    avoid = [(meaning(window)[1], not window.operation, row) for window, row in zip(at.windows, rows, strict=True)]
    usable = [(number, words[0]) for number, part in enumerate(at.usable, len(avoid))
              if (words := in_words.usable_in_words([part], found.speeds))]
    return AssessmentText(
        other, sentences, headings, avoid, usable, in_words.sentence(in_words.tried_in_words(found)))


def places(found: Assessment) -> list[float]:
    """The middles of the ranges to avoid and of the usable ones, rpm, in rising order each."""
    (at,) = found.at
    ranges: list[Window | UsableRange] = [*at.windows, *at.usable]
    return [(each.start + each.stop) / 2 for each in ranges]
