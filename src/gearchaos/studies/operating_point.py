"""The operating point at which a study builds the model of a design that has none of its own."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gearchaos.gears.operating import OperatingModel, is_design
from gearchaos.studies.axis import Axis


def at_axis_starts(model: Any, axes: Iterable[Axis]) -> Any:
    """A design without speed or torque at the first values of the axes ``speed`` and ``torque``.

    Parameters
    ----------
    model : GearDesign or other
        Anything but a design is returned as it is, and so is a design that has both values.
    axes : iterable of Axis
        The axes of the study. Of several with one name the first counts.

    Returns
    -------
    GearDesign or other
        Values of the design itself are kept. Without an axis for a missing value it stays missing.
    """
    if not is_design(model):
        return model
    starts: dict[str, float] = {}
    for axis in axes:
        starts.setdefault(axis.name, axis.start)
    return model.at(**{n: starts[n] for n in ("speed", "torque") if n in starts and getattr(model, n) is None})


def check_speed_axes(model: Any, axes: Iterable[Axis]) -> None:
    """Raise `InputError` if an end of an axis ``speed`` is above the limit of the pitch line velocity of a design."""
    if not (isinstance(model, OperatingModel) and is_design(model.gears)):
        return
    from gearchaos.gears.design.checks import check_speed_range

    for axis in axes:
        if axis.name == "speed":
            check_speed_range(model.gears, axis.start, axis.stop)
