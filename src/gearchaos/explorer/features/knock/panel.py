"""What a knock does to the motion at the point: the displacement over the time, and in words."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, Line, Range1d, Span

from gearchaos.datasets import variable
from gearchaos.explorer.core.style import BOUNDARY, FIRST_DATA, Legend, Panel, SetAttributes, Units
from gearchaos.explorer.features.knock.job import AFTER, BEFORE, KnockedMotion
from gearchaos.gears.io.units import measured
from gearchaos.plot.classes import SEVERITY_COLOURS
from gearchaos.plot.theme import INK
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.severities import CRITERION, SEVERITIES

_LINES = (("without a knock", "#9a9a9a", 1.0), ("after half of it", INK, 1.4),
          ("after the least knock", SEVERITY_COLOURS[SEVERITIES[3]], 1.4))
"""The lines of `KnockedMotion.z`: name in the legend, colour, width in pixels."""


class KnockFigure(Panel):
    """The displacement z over the mesh periods before and after a knock; a dashed line is at the knock."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, ticks=6, x_range=Range1d(-BEFORE, AFTER))
        self.lines = [ColumnDataSource(FIRST_DATA) for _ in _LINES]
        for source, (_, colour, width) in zip(self.lines, _LINES, strict=True):
            self.figure.add_glyph(source, Line(x="x", y="y", line_color=colour, line_width=width))
        self.figure.add_layout(Span(dimension="height", location=0, line_color=BOUNDARY, line_dash="dashed"))

    def show(self, found: KnockedMotion, units: Units) -> None:
        """Draw what a knock does, in these units."""
        z = units.variables({"z": variable("z", ("knock", "instant"), found.z)})["z"]
        for source, line in zip(self.lines, z.values, strict=True):
            self._set(source, data={"x": found.time.astype(np.float32), "y": line.astype(np.float32)})
        self._label("time after the knock (mesh periods)", units.label(z, "z"))


class KnockText(NamedTuple):
    """What stands beside the picture."""

    sentences: list[str]
    legend: Legend


def knock_text(found: KnockedMotion) -> KnockText:
    """What knocks do to a motion, in words."""
    knock, half = found.knock, found.half
    if knock is None or half is None:
        return KnockText([f"No knock up to {measured(found.largest, 3)} rpm of wheel 1 leads from this motion to one "
                          "to avoid."], Legend())
    least = (f"The least knock that leads to a motion to avoid is {measured(abs(knock.speed_step), 2)} rpm of wheel 1 "
             f"({measured(abs(knock.impulse), 2)} N m s), {'for' if knock.speed_step > 0 else 'back'}wards at "
             f"{measured(knock.phase, 2)} of the mesh period")
    to = f"It leads to a motion in which {CRITERION}, {_factor(knock.dynamic_factor, knock.beyond_the_teeth)}."
    back = "back to this motion" if found.back else (
        f"to a motion to avoid, in which {CRITERION}" if half.contact else "to another motion in contact")
    return KnockText([f"{least}. {to}", f"Half of it leads {back}, {_factor(half.dynamic_factor, found.beyond)}."],
                     Legend(entries=tuple((colour, name) for name, colour, _ in _LINES)))


def _factor(factor: float, beyond: bool) -> str:
    return f"which is {BEYOND}" if beyond else f"with a dynamic factor of {measured(factor, 3)}"
