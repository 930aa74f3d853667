"""Ranges of speed to avoid, and those between them, at one torque."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_UP, Decimal
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics.response import MESH
from gearchaos.gears.dynamic_factor import standards
from gearchaos.studies.core.proportions import CONFIDENCE, proportion
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.severities import CONTACT_WORDS, FORCE_CRITERION, SEVERITIES, separated

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.operation.knocks import Knock

OPERATION = {
    "rest": "from rest", "rising": "speed rising", "falling": "speed falling", "changing": "after other speeds"}
MOTIONS = {**OPERATION, "load change": "load change", "other": "other initial states"}
"""The motions of a result, and how a reader wants them named; the first ones are those that operation meets."""

REACHED_BY = {MOTIONS["rest"]: ("rest",), MOTIONS["rising"]: ("rising speed",), MOTIONS["falling"]: ("falling speed",),
              MOTIONS["changing"]: ("rising speed", "falling speed")}
"""What leads to a motion, as JSON has it, where it is not called as the motion."""

FEW = 0.01
"""A range narrower than this share of its speed, or to which a smaller share of load changes leads, is a minor one."""

OUTWARDS, INWARDS, NEAREST = (
    (ROUND_FLOOR, ROUND_CEILING), (ROUND_CEILING, ROUND_FLOOR), (ROUND_HALF_UP, ROUND_HALF_UP))
"""How both ends of a range are rounded."""

MOST_PEAKS = 5  # most local peaks of the dynamic factor that are listed for a range


@dataclass(frozen=True)
class Peak:
    """A local peak of the dynamic factor: a computed speed, rpm, with a larger factor than its neighbours."""

    speed: float
    dynamic_factor: float


@dataclass(frozen=True)
class Reached:
    """A motion that is to be avoided in a range of speeds, by one of the words of `MOTIONS`.

    ``share`` is that of the range, between 0 and 1, in which it is; ``dynamic_factor`` is the largest one there, NaN if
    the motion is beyond the teeth at a speed.
    """

    motion: str
    share: float
    dynamic_factor: float


@dataclass(frozen=True)
class RandomStates:
    """The ``fraction`` of random states in a range that lead to a motion to avoid, with its 95 % interval.

    There were ``states`` in all, at ``speeds`` of the range; ``motion`` is the word of `MOTIONS` for what they are
    after. Each speed counts by its `weights_of`. The interval is that of Clopper and Pearson for as many states as
    count alike.
    """

    fraction: float
    fraction_lo: float
    fraction_hi: float
    states: int
    speeds: int
    motion: str = MOTIONS["load change"]

    @classmethod
    def of(cls, part: xr.Dataset) -> RandomStates | None:
        """Those of all speeds of a Dataset; None if there are none."""
        drawn = part.isel(speed=part["random_states"].values > 0)
        states = drawn["random_states"].values
        if len(states) == 0:
            return None
        weights = weights_of(drawn)
        share = float((weights * (drawn["avoided_states"].values / states)).sum() / weights.sum())
        alike = float(weights.sum() ** 2 / (weights**2 / states).sum())
        fraction, low, high = proportion(share * alike, alike).tolist()
        return cls(fraction, low, high, int(states.sum()), len(states), MOTIONS[str(part["motion"].values[-1])])


@dataclass(frozen=True)
class SpeedRange:
    """Consecutive computed speeds, from the first to the last, rpm of wheel 1.

    ``dynamic_factor`` is the largest peak of the mesh force over the static one in any motion that teeth can bear, at
    the speed ``speed_of_largest``; both are NaN if there is none.
    """

    start: float
    stop: float
    dynamic_factor: float
    speed_of_largest: float

    @property
    def largest_at(self) -> str:
        """The speed of the largest factor as a reader wants it, within the range; "none" if there is none."""
        if math.isnan(self.speed_of_largest):
            return "none"
        return speed_in_words(self.speed_of_largest, self.stop - self.start)


@dataclass(frozen=True)
class Window(SpeedRange):
    """Consecutive computed speeds that are to be avoided for the same reason, in ``operation`` or else after a load
    change alone: `CRITERION` or `FORCE_CRITERION`.

    The edges are the events ``begins_with`` and ``ends_with`` of an orbit, located to rounding errors: fold, flip,
    neimark-sacker, graze, or the limit of the factor. Where a motion that does not repeat ends, or operation comes
    to another motion, there is none, and the true edges lie at most ``start_resolution`` and ``stop_resolution``
    outside, rpm. Between the speeds of ``history`` operation also meets motions that are not to be avoided; it is
    None where it meets none, or where operation meets only these. ``random_states`` says which share of load
    changes leads to those that are, in the whole range; None where none were drawn. ``meshes`` are those of a train
    at which the teeth separate. ``contact`` is the worst contact state of motions that teeth bear, one of
    `CONTACT_WORDS`; ``beyond_the_teeth`` says whether there are others, which have no factor, ``hits`` whether the
    largest force exceeds the limit of a `Criteria`. A range that begins with the first computed speed
    (``from_scan_start``), or ends with the last one, may go on beyond. ``peaks`` are the local peaks of the dynamic
    factor at other speeds, at most the `MOST_PEAKS` largest, in rising order of speed. ``largest_after_load_change`` is
    the largest factor of the motions that only load changes lead to, where it exceeds that of operation.
    """

    start_resolution: float
    stop_resolution: float
    reached: tuple[Reached, ...]
    operation: bool
    criterion: str
    contact: str
    beyond_the_teeth: bool
    hits: bool
    from_scan_start: bool
    to_scan_end: bool
    begins_with: str
    ends_with: str
    history: tuple[float, float] | None
    random_states: RandomStates | None
    meshes: tuple[str, ...]
    peaks: tuple[Peak, ...]
    largest_after_load_change: Peak | None = None

    @property
    def depends_on_history(self) -> bool:
        """Whether operation also meets motions in it that are not to be avoided."""
        return self.history is not None

    @property
    def reached_by(self) -> list[str]:
        """What leads to the motions to avoid: rest, rising speed, falling speed, load change."""
        drawn = [self.random_states.motion] if self.random_states and self.random_states.fraction > 0 else []
        ways = [by for each in self.reached for by in REACHED_BY.get(each.motion, (each.motion,))]
        return list(dict.fromkeys(ways + drawn))

    @property
    def share_of_load_changes(self) -> float | None:
        """The share of load changes that leads to the motions to avoid; None where none were drawn."""
        found = self.random_states
        return found.fraction if found and found.motion == MOTIONS["load change"] else None

    @property
    def may_be_missed(self) -> bool:
        """Whether load changes alone lead to it, and as many drawn anew might well not (with more than 5 %)."""
        found = self.random_states
        return not self.operation and (found is None or (1 - found.fraction) ** found.states > 1 - CONFIDENCE)

    @property
    def narrow(self) -> bool:
        """Whether it is only a small share of its speed."""
        return self.stop - self.start < FEW * self.stop

    @property
    def rare(self) -> bool:
        """Whether load changes alone lead to it, and few of them."""
        return not self.operation and self.random_states is not None and self.random_states.fraction < FEW

    @property
    def minor(self) -> bool:
        """Whether it is narrow or rare."""
        return self.narrow or self.rare

    @property
    def cause(self) -> str:
        """What happens in the range, in words."""
        where = f" in {', '.join(self.meshes)}" if self.meshes else ""
        return f"{self.severity}{where}"

    @property
    def severity(self) -> str:
        """One of `SEVERITIES`."""
        if self.contact == BEYOND or self.criterion == FORCE_CRITERION:
            return BEYOND if self.contact == BEYOND else FORCE_CRITERION
        return SEVERITIES[separated(self.contact == CONTACT_WORDS[2], self.hits)]

    @property
    def reach(self) -> tuple[float, float]:
        """Both ends in rpm, as far outside as they may lie."""
        return self.start - self.start_resolution, self.stop + self.stop_resolution

    @property
    def ends(self) -> tuple[str, str]:
        """Both ends of `reach` as a reader wants them, rounded outwards."""
        return ends_in_words(*self.reach)

    @property
    def words(self) -> str:
        """The range as a reader wants it: "1453 to 8000 rpm"."""
        return f"{' to '.join(self.ends)} rpm"


@dataclass(frozen=True)
class UsableRange:
    """Speeds, rpm, at which no motion to avoid was found, between two edges or ends of the computed speeds."""

    start: float
    stop: float

    @property
    def document(self) -> dict[str, float]:
        """It ready for JSON."""
        return {"from": self.start, "to": self.stop, "margin": self.margin}

    @property
    def margin(self) -> float:
        """By which share the speed may differ either way from the middle of the range."""
        return (self.stop - self.start) / (self.stop + self.start)

    @property
    def margin_words(self) -> str:
        """The margin in percent, to a tenth, or to the first digit of a smaller one."""
        share = 100 * self.margin
        return f"±{share:.1f} %" if share >= 0.1 else f"±{share:.1g} %"


@dataclass(frozen=True)
class Jump:
    """Where a slow run-up or run-down leaves its motion: the speed, rpm, the direction, "up" or "down", the event at
    which the motion ends, "" for none, and the dynamic factors before and after."""

    speed: float
    direction: str
    event: str
    factor_before: float
    factor_after: float


@dataclass(frozen=True, eq=False)
class SpeedsToAvoid:
    """What `speeds_to_avoid` found at one torque.

    Attributes
    ----------
    torque : float
        At wheel 1, N m.
    windows : tuple of Window
        The ranges to avoid, in rising order; empty if none was found by what was `tried`.
    criterion : str
        What makes a speed one to avoid, in words.
    quasi_static_ratio : float
        The peak of the mesh force over the static one at no speed; more than 1 where the stiffness jumps. NaN for a
        train.
    dataset : xarray.Dataset
        Over ``motion`` and ``speed``, all computed speeds: ``label``, ``period``, ``contact``, ``dynamic_factor`` and
        ``beyond_the_teeth``; 0, 0, −1, NaN and False where there is no such motion; of a train, over ``mesh`` too,
        ``mesh_dynamic_factor``. Operation meets the motions from "rest", of "rising" and "falling" speed from both
        ends, and "changing", the worst of those met by coming slowly from rest at other speeds. "load change" is the
        worst of the others, from states that a change of the load leaves, or followed from such a motion to other
        speeds; with ``wide`` it is "other", from wide ranges of states.
        Over ``speed`` also ``random_states``, the number of these states, and ``avoided_states``, how many of them lead
        to a motion to avoid, and the factors by the standards and resonance ratios of `gearchaos.dynamic_factor`.
    tried, coarse, transmission_error, teeth_bear, load_change : str
        From which initial states motions were computed; what is not known to the resolution, empty if all is; where
        the transmission error is from; beyond what a motion is one that teeth cannot bear; after which change of the
        load motions were looked for, empty for none.
    jumps, knocks : tuple of Jump, of Knock
        Where slow sweeps leave their motion, and the least knocks that do; no knock if none was found by what was
        `tried`.
    resolution : float
        The edges are known to this share of the speed.
    """

    torque: float
    windows: tuple[Window, ...]
    criterion: str
    quasi_static_ratio: float
    dataset: xr.Dataset
    tried: str
    resolution: float
    coarse: str
    transmission_error: str
    teeth_bear: str
    load_change: str
    jumps: tuple[Jump, ...] = ()
    knocks: tuple[Knock, ...] = ()

    @property
    def usable(self) -> list[UsableRange]:
        """The ranges between those to avoid, as far as these may reach, in rising order."""
        return self._between(self.windows)

    @property
    def usable_in_operation(self) -> list[UsableRange]:
        """The same where the load is never lost nor reversed."""
        return self._between([each for each in self.windows if each.operation])

    def _between(self, windows: Sequence[Window]) -> list[UsableRange]:
        ends = [float(self.dataset["speed"][0])]
        for each in windows:
            ends += each.reach
        pairs = zip(ends[::2], [*ends[1::2], float(self.dataset["speed"][-1])], strict=True)
        return [UsableRange(start, stop) for start, stop in pairs if start < stop]

    @property
    def unloaded(self) -> tuple[str, ...]:
        """The meshes of a train that carry nothing at rest, at any speed."""
        if MESH not in self.dataset.dims:
            return ()
        loaded = self.dataset["mesh_dynamic_factor"].notnull().any(("motion", "speed"))
        return tuple(loaded["mesh"].values[~loaded.values].tolist()) if loaded.any() else ()  # none where all diverge

    @property
    def wide(self) -> bool:
        """Whether the states were drawn from wide ranges."""
        return "other" in self.dataset["motion"].values

    @property
    def largest(self) -> SpeedRange:
        """The whole range of computed speeds, with the largest dynamic factor in it."""
        return speed_range(self.dataset)

    @property
    def elsewhere(self) -> tuple[SpeedRange, bool] | None:
        """The computed speeds outside the ranges to avoid, as far as these may reach, and whether teeth separate there.

        None if there are no such speeds.
        """
        speeds = self.dataset["speed"].values
        outside = np.ones(len(speeds), dtype=bool)
        for each in self.windows:
            low, high = each.reach
            outside &= (speeds < low) | (speeds > high)
        part = self.dataset.isel(speed=outside)
        return (speed_range(part), bool((part["contact"] > 0).any())) if outside.any() else None

    @property
    def main_resonance(self) -> float:
        """The speed, rpm, at which the mesh frequency is the natural frequency at the mean mesh stiffness."""
        return float(self.dataset["speed"][-1] / self.dataset["resonance_ratio"][-1])

    def document(self) -> dict[str, Any]:
        """All of it but the kinds of motion, ready for JSON; NaN where there is no value."""
        ds = self.dataset
        along = {n: ds[n].values.tolist() for n in ("speed", *(each.name for each in standards())) if n in ds}
        factors = {MOTIONS[name]: ds["dynamic_factor"].sel(motion=name).values.tolist()
                   for name in ds["motion"].values.tolist()}
        return {
            "criterion": self.criterion, "units": {"speed": "rpm", "torque": "N*m"}, "torque": self.torque,
            "transmission_error": self.transmission_error, "quasi_static_ratio": self.quasi_static_ratio,
            "tried": self.tried, "resolution": self.resolution, "coarse": self.coarse,
            "computed": {**asdict(self.largest), "count": ds.sizes["speed"]},
            "ranges": [{**asdict(each), "depends_on_history": each.depends_on_history, "reached_by": each.reached_by,
                        "share_of_load_changes": each.share_of_load_changes}
                       for each in self.windows],
            "beyond_the_teeth": self.teeth_bear, "knocks": [knock.document(self.torque) for knock in self.knocks],
            "along_speed": {**along, "dynamic_factor": factors["from rest"], "motions": factors},
        }


def speed_in_words(speed: float, width: float, rounding: str = ROUND_HALF_UP) -> str:
    """A speed, rpm, as text: whole, below 100 rpm to three digits, and to as many more as tell it from another at a
    distance of ``width``."""
    digits = max(0, 2 - math.floor(math.log10(max(speed, 1e-3))))
    if width > 0:
        digits = max(digits, -math.floor(math.log10(width)))
    return f"{Decimal(repr(float(speed))).quantize(Decimal(1).scaleb(-digits), rounding).normalize():f}"


def ends_in_words(start: float, stop: float, rounding: tuple[str, str] = OUTWARDS) -> tuple[str, str]:
    """Both ends of a range of speed, rpm, as all that prints one has them; equal only if the ends are."""
    width = (stop - start) / (2 if rounding == INWARDS else 1)
    low, high = (speed_in_words(end, width, way) for end, way in zip((start, stop), rounding, strict=True))
    return low, high


def range_in_words(start: float, stop: float) -> str:
    """A range of computed speeds, or a single one, as a reader wants it without its unit: "500 to 8000"."""
    return " to ".join(dict.fromkeys(ends_in_words(start, stop, NEAREST)))


def weights_of(part: xr.Dataset) -> np.ndarray:
    """The part (N,) of a range for which each of its speeds stands: half way to the next, as far at the ends."""
    return np.gradient(part["speed"].values) if part.sizes["speed"] > 1 else np.ones(1)


def largest_factors(dataset: xr.Dataset) -> np.ndarray:
    """The largest dynamic factor (N,) of the motions of each speed; −∞ where all diverge."""
    factors = dataset["dynamic_factor"].values
    return np.where(np.isfinite(factors), factors, -np.inf).max(axis=0)


def speed_range(part: xr.Dataset) -> SpeedRange:
    """The range of all speeds of a Dataset."""
    speeds, factors = part["speed"].values, largest_factors(part)
    at = int(np.argmax(factors))
    largest = (float(factors[at]), float(speeds[at])) if np.isfinite(factors[at]) else (np.nan, np.nan)
    return SpeedRange(float(speeds[0]), float(speeds[-1]), *largest)
