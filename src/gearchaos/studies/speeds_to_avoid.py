"""The speeds to avoid: the ranges of speed in which the teeth separate, and how high the mesh force is there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import POSITIVE
from gearchaos.validation import check_rule, to_float

if TYPE_CHECKING:
    import xarray as xr

CRITERION = "the teeth separate"
"""What makes a speed one to avoid; a motion that diverges counts as separated."""

FORCE_CRITERION = "the dynamic factor is too high"
"""What makes a speed one to avoid where the teeth stay in contact, with a limit of the dynamic factor."""

MOST_PEAKS = 5
"""Most local peaks of the dynamic factor that are listed for a range."""


@dataclass(frozen=True)
class Peak:
    """A local peak of the dynamic factor: a computed speed, rpm, with a larger factor than its neighbours."""

    speed: float
    dynamic_factor: float


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

    @property
    def words(self) -> str:
        """The range as a reader wants it: "1453 to 8000 rpm", or "near 575 rpm" if it is a single computed speed."""
        if self.start == self.stop:
            return f"near {self.start:.0f} rpm"
        return f"{self.start:.0f} to {self.stop:.0f} rpm"


@dataclass(frozen=True)
class RangeToAvoid(SpeedRange):
    """Consecutive speeds that are to be avoided for the same reason.

    Attributes
    ----------
    criterion : str
        Why: `CRITERION` or `FORCE_CRITERION`.
    from_scan_start, to_scan_end : bool
        Whether the range begins with the first computed speed, or ends with the last one: it may then go on beyond.
    peaks : tuple of Peak
        The local peaks of the dynamic factor in the range, at most the `MOST_PEAKS` largest, in rising order of speed.
        The first and last computed speeds are no local peaks.
    """

    criterion: str = CRITERION
    from_scan_start: bool = False
    to_scan_end: bool = False
    peaks: tuple[Peak, ...] = ()


def speeds_to_avoid(
    dataset: xr.Dataset, factor: float | None = None, *, separation: bool = True,
) -> tuple[RangeToAvoid, ...]:
    """The ranges of speed in which the teeth separate, or the dynamic factor is too high, in rising order.

    Parameters
    ----------
    dataset : Dataset
        ``contact`` and ``dynamic_factor`` over ``speed`` alone: from `gearchaos.dynamic_factor`, from
        `gearchaos.bifurcation` over the speed, or one torque of `gearchaos.operating_map`.
    factor : float, optional
        Also the ranges in which the dynamic factor exceeds this although the teeth stay in contact.
    separation : bool, optional
        False for the ranges in which the dynamic factor exceeds ``factor`` alone, whether the teeth separate or not; a
        motion that diverges exceeds every factor.

    Returns
    -------
    tuple of RangeToAvoid
        Each begins and ends at a computed speed; separation between two neighbouring speeds that are not in the result
        remains unknown. So do other motions than the computed one: `gearchaos.attractors` finds those of one speed.

    Raises
    ------
    InputError
        If the Dataset has not both variables over the speed alone, the factor is not greater than 0, or there is none
        without separation.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.dynamic_factor(design, "500:8000:40", "100 N*m")
    >>> ranges = gc.speeds_to_avoid(found)
    >>> ranges[0].words
    '1462 to 8000 rpm'
    >>> [each.words for each in gc.speeds_to_avoid(found, factor=4, separation=False)]
    ['1654 to 3962 rpm', 'near 4346 rpm', '5115 to 7615 rpm']
    """
    separated, factors = _over_speed(dataset)["contact"].values > 0, dataset["dynamic_factor"].values
    criteria = np.where(separated & separation, CRITERION, "")
    if factor is not None:
        limit = to_float("factor", factor)
        check_rule("factor", limit, POSITIVE)
        high = (factors > limit) | (separated & np.isnan(factors))  # a motion that diverges has no factor
        criteria = np.where((criteria == "") & high, FORCE_CRITERION, criteria)
    elif not separation:
        raise InputError("factor", "must be given with separation=False", None, "E.g. factor=1.5.")
    runs = [(criterion, [i for i, _ in run]) for criterion, run in groupby(
        enumerate(criteria.tolist()), key=lambda pair: pair[1])]
    return tuple(_to_avoid(dataset, criterion, run[0], run[-1]) for criterion, run in runs if criterion)


def criterion_in_words(factor: float | None, separation: bool) -> str:
    """What makes a speed one to avoid, with these options of `speeds_to_avoid`."""
    own = [CRITERION] if separation else []
    return ", or ".join(own + ([] if factor is None else [f"the dynamic factor exceeds {factor:g}"]))


def _to_avoid(dataset: xr.Dataset, criterion: str, first: int, last: int) -> RangeToAvoid:
    """The range of the speeds with these indices."""
    found = _speed_range(dataset.isel(speed=slice(first, last + 1)))
    speeds, factors = dataset["speed"].values, dataset["dynamic_factor"].values
    known = np.where(np.isfinite(factors), factors, -np.inf)
    peaks = [i for i in range(max(first, 1), min(last, len(known) - 2) + 1)
             if known[i - 1] < known[i] >= known[i + 1]]
    largest = sorted(sorted(peaks, key=lambda i: -known[i])[:MOST_PEAKS])
    return RangeToAvoid(
        found.start, found.stop, found.dynamic_factor, found.speed_of_largest, criterion, first == 0,
        last == len(speeds) - 1, tuple(Peak(float(speeds[i]), float(factors[i])) for i in largest))


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
    return _all_computed(dataset)


def _all_computed(dataset: xr.Dataset) -> xr.Dataset:
    """The Dataset; raises `InputError` if some of its speeds were not computed, or inferred from their neighbours."""
    missing = np.flatnonzero(dataset["contact"].values < 0)
    if len(missing):
        raise InputError(
            "dataset", "must be computed at all its speeds", f"{len(missing)} of {dataset.sizes['speed']} without",
            "Cells that were inferred (refine) or not computed yet have no contact state: compute the map without "
            "refine, or finish the run.")
    return dataset
