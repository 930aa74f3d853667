"""The line of gears over all speeds of a page, along which they are assessed, and where it lies on other views."""

from __future__ import annotations

from dataclasses import dataclass

from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import rounded
from gearchaos.explorer.core.models import value_on
from gearchaos.explorer.core.state import View
from gearchaos.studies.core.axis import Axis


@dataclass(frozen=True)
class SpeedLine:
    """The gears at the point of a view, at the speeds of its map, or of its run-up where these are not on an axis.

    The torque and all other parameters are those of the point.
    """

    view: View

    @property
    def speeds(self) -> tuple[float, float]:
        """The first and the last speed, rpm."""
        run = self.view.run
        assert run is not None  # there are gears
        ends = ((axis.start, axis.stop) for axis in (self.view.x, self.view.y) if axis.name == "speed")
        return next(ends, (run.start, run.stop))

    def goes_through(self, view: View) -> bool:
        """Whether the point of a view is one of these gears at some speed."""
        return self._is_common(view, {})

    def across(self, view: View) -> tuple[Axis, float] | None:
        """The axis across that of the speed on the map of a view, and the value at which the line lies there.

        None if it does not lie on that map.
        """
        other = {view.x.name: view.y, view.y.name: view.x}.get("speed")
        if other is None or view.gears is None:
            return None
        try:
            value = value_on(self.view.operating_point, other)
        except InputError:  # these gears have another kind of stiffness, without that parameter
            return None
        return (other, value) if self._is_common(view, {other.name: value}) else None

    def belongs_to(self, view: View) -> bool:
        """Whether the line goes through the point of a view, or lies on its map, and is looked at likewise."""
        return self.view.change == view.change and (self.goes_through(view) or self.across(view) is not None)

    def moved(self, view: View, speed: float) -> View:
        """The view with its point at a speed on the line, which belongs to it."""
        found = view if (place := self.across(view)) is None else view.with_value(place[0].name, place[1])
        start, stop = self.speeds
        return found.with_value("speed", rounded(speed, stop - start))

    def _is_common(self, view: View, values: dict[str, float]) -> bool:
        """Whether both views have the same model at the first speed and these values."""
        same = {"speed": self.speeds[0], **values}
        return view.gears is not None and view.model_at(same) == self.view.model_at(same)
