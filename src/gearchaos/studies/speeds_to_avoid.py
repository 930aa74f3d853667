"""The speeds to avoid: the ranges of speed in which the teeth separate, and how high the mesh force is there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

CRITERION = "the teeth separate"
"""What makes a speed one to avoid; a motion that diverges counts as separated."""


@dataclass(frozen=True)
class SpeedRange:
    """Consecutive speeds of a result to which one statement applies.

    Attributes
    ----------
    start, stop : float
        First and last of the speeds, rpm of wheel 1.
    dynamic_factor : float
        Largest peak of the mesh force over the static one; NaN if all motions of the range diverge.
    speed_of_largest : float
        Speed with that dynamic factor, rpm; NaN likewise.
    """

    start: float
    stop: float
    dynamic_factor: float
    speed_of_largest: float


def speeds_to_avoid(dataset: xr.Dataset) -> tuple[SpeedRange, ...]:
    """The ranges of speed in which the teeth separate, in rising order.

    Parameters
    ----------
    dataset : Dataset
        ``contact`` and ``dynamic_factor`` over ``speed`` alone: from `gearchaos.dynamic_factor`, from
        `gearchaos.bifurcation` over the speed, or one torque of `gearchaos.operating_map`.

    Returns
    -------
    tuple of SpeedRange
        Each begins and ends at a computed speed; separation between two neighbouring speeds that are not in the result
        remains unknown.

    Raises
    ------
    InputError
        If the Dataset has not both variables over the speed alone.
    """
    separated = _over_speed(dataset)["contact"].values > 0
    runs = [[i for i, _ in run] for lost, run in groupby(enumerate(separated), key=lambda pair: pair[1]) if lost]
    return tuple(_speed_range(dataset.isel(speed=slice(run[0], run[-1] + 1))) for run in runs)


def all_speeds(dataset: xr.Dataset) -> SpeedRange:
    """The whole range of speed of a result, with its largest dynamic factor; arguments as of `speeds_to_avoid`."""
    return _speed_range(_over_speed(dataset))


def _speed_range(part: xr.Dataset) -> SpeedRange:
    """The range of all speeds of a Dataset."""
    speeds, factors = part["speed"].values, part["dynamic_factor"].values
    largest = (np.nan, np.nan)
    if np.isfinite(factors).any():
        at = int(np.nanargmax(factors))
        largest = float(factors[at]), float(speeds[at])
    return SpeedRange(float(speeds[0]), float(speeds[-1]), *largest)


def _over_speed(dataset: Any) -> xr.Dataset:
    """The Dataset; raises `InputError` unless it has the contact state and the dynamic factor over the speed alone."""
    names = ("contact", "dynamic_factor")
    found = getattr(dataset, "data_vars", {})
    if not all(name in found and found[name].dims == ("speed",) for name in names):
        raise InputError("dataset", f"must have {' and '.join(names)} over the speed alone",
                         {str(n): v.dims for n, v in found.items() if n in names} or f"a {type(dataset).__name__}",
                         "gearchaos.dynamic_factor computes it; of a map choose one torque: "
                         "dataset.sel(torque=100, method='nearest').")
    return dataset
