"""A drawing along the speed, and the one that is kept: dynamic factors from rest, ranges to avoid once assessed."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, Line, Range1d, Segment, Span

from gearchaos.explorer.core.style import BOUNDARY, FIRST_DATA, Panel, SetAttributes
from gearchaos.explorer.features.assessment.panel import OUTLINE, STRIPES
from gearchaos.explorer.features.drawing.panel import KEPT
from gearchaos.explorer.features.map.job import FULL
from gearchaos.gears.io.units import measured
from gearchaos.model import MeshModel
from gearchaos.plot._assessment import bar, meaning
from gearchaos.plot.theme import INK
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.maps.zones import Zones
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studies.speeds.speed_windows import range_in_words

_SPEEDS = 200
_COLOURS = (INK, KEPT)
_NAMES = ("this one", "the kept one")
_HEIGHTS = (0.14, 0.06)  # at which the ranges to avoid of both drawings lie, as shares of the figure
_BELOW = 0.2  # of the figure, below the curves
_WIDTH = 8.0  # of these ranges, in pixels
_NO_BARS: dict[str, list[float]] = {name: [] for name in ("x0", "x1", "y", "colour", "edge")}


class Factors(NamedTuple):
    """The torque, N m, speeds (S,), rpm, and the dynamic factor of the motion from rest there of each drawing, NaN
    where it is unbounded."""

    torque: float
    speeds: np.ndarray
    factors: list[np.ndarray]


def factors(models: Sequence[MeshModel], ends: tuple[float, float]) -> Generator[Factors]:
    """The dynamic factors of models, all at one torque, between two speeds; the only result of this job."""
    torque = float(models[0].value("torque") or 0.0)
    axes, found = (Axis("speed", *ends, _SPEEDS), Axis("torque", torque, torque, 1)), []
    for model in models:
        dataset = Zones(model, *axes, settings=FULL).run()
        found.append(dataset["dynamic_factor"].values.ravel())
    yield Factors(torque, dataset["speed"].values, found)


class FactorsFigure(Panel):
    """The dynamic factor along the speed, that of the kept drawing dashed, and below the ranges to avoid of each."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0))
        self.lines = [ColumnDataSource(FIRST_DATA) for _ in _NAMES]
        self.avoided, self.striped = ColumnDataSource(_NO_BARS), ColumnDataSource(_NO_BARS)
        self.point = Span(dimension="height", line_color=BOUNDARY, line_dash="dotted")
        self.figure.add_layout(self.point)
        for source, colour, dash in zip(self.lines, _COLOURS, ("solid", "dashed"), strict=True):
            self.figure.add_glyph(source, Line(x="x", y="y", line_color=colour, line_width=1.6, line_dash=dash))
        place = {"x0": "x0", "x1": "x1", "y0": "y", "y1": "y"}
        for source, style in ((self.avoided, {"line_color": "edge", "line_width": _WIDTH + 4}),
                              (self.avoided, {"line_color": "colour", "line_width": _WIDTH}),
                              (self.striped, {"line_color": OUTLINE, "line_width": _WIDTH, "line_dash": STRIPES})):
            self.figure.add_glyph(source, Segment(**place, **style))

    def show(self, found: Factors, assessed: Sequence[Assessment | None]) -> None:
        """Draw the curves of one drawing or two, and what was found to be avoided where it is known."""
        known = np.concatenate(found.factors)
        known = known[np.isfinite(known)]
        low, high = (known.min(), 1.03 * known.max()) if known.size else (0.0, 1.0)
        bottom = (low - _BELOW * high) / (1 - _BELOW)
        ends = float(found.speeds[0]), float(found.speeds[-1])
        self._limit(ends, (float(bottom), float(high)))
        for source, curve in zip(self.lines, [*found.factors, None], strict=False):
            self._set(source, data=FIRST_DATA if curve is None else {
                "x": found.speeds.astype(np.float32), "y": curve.astype(np.float32)})
        bars = [(*bar(window, ends), bottom + height * (high - bottom), meaning(window)[1], edge, window.operation)
                for each, height, edge in zip(assessed, _HEIGHTS, _COLOURS, strict=False) if each is not None
                for _, window in each.avoid]
        for source, shown in ((self.avoided, bars), (self.striped, [each for each in bars if not each[-1]])):
            self._set(source, data={name: [each[n] for each in shown] for n, name in enumerate(_NO_BARS)})
        self._label("speed of wheel 1 [rpm]", "dynamic factor")

    def mark(self, speed: float) -> None:
        """Mark the speed of the point."""
        self._set(self.point, location=speed)


def factors_text(found: Factors, assessed: Sequence[Assessment | None]) -> list[str]:
    """The largest factors and the ranges to avoid of one drawing or two, in sentences."""
    names = _NAMES[: len(found.factors)] if len(found.factors) > 1 else ("",)
    largest = [_named(name, _largest(found.speeds, each)) for name, each in zip(names, found.factors, strict=True)]
    sentences = [f"Dynamic factor from rest, {range_in_words(found.speeds[0], found.speeds[-1])} rpm at "
                 f"{found.torque:.6g} N m: {'; '.join(largest)}."]
    if any(each is not None for each in assessed):
        avoided = [_named(name, _avoided(each)) for name, each in zip(names, assessed, strict=False)]
        sentences.append(f"To avoid, as bars: {'; '.join(avoided)}.")
    return sentences


def _named(name: str, words: str) -> str:
    return f"{name} {words}".strip()


def _largest(speeds: np.ndarray, factor: np.ndarray) -> str:
    if not np.isfinite(factor).any():
        return "no bounded motion"
    most = int(np.nanargmax(factor))
    return f"at most {measured(float(factor[most]), 3)} at {speeds[most]:.0f} rpm"


def _avoided(found: Assessment | None) -> str:
    if found is None:
        return "not assessed at this torque"
    alone = " in operation, load changes left out" * (not found.at[0].load_change)
    return f"{', '.join(window.words for _, window in found.avoid) or 'nothing found'}{alone}"
