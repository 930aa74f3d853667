"""The speeds to avoid: where the teeth separate, in any of the motions that are found, and how high the force is."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable, variables
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.operating import as_model
from gearchaos.quantities import POSITIVE
from gearchaos.studies.axis import Axis
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.followed_motions import RESOLUTION, STEPS_PER_BANDWIDTH, FollowedMotions, Motion, Severity, runs
from gearchaos.studies.speed_and_torque import by_standards, loaded, operating_axis, quasi_static_ratio
from gearchaos.validation import check_rule, to_float

if TYPE_CHECKING:
    import xarray as xr

CRITERION = "the teeth separate"
"""What makes a speed one to avoid; a motion that diverges counts as separated."""

FORCE_CRITERION = "the dynamic factor is too high"
"""What makes a speed one to avoid where the teeth stay in contact, with a limit of the dynamic factor."""

_CRITERIA = ("", FORCE_CRITERION, CRITERION)  # in rising order of severity: what does not count, 1 and 2

MOTIONS = {"rest": "from rest", "rising": "speed rising", "falling": "speed falling", "other": "other initial states"}
"""The motions of a result, and how a reader wants them named."""

CONTACT_WORDS = ("permanent contact", "loss of contact", "both flanks", "no bounded motion")
"""The contact states of `CONTACTS`, as a reader wants them named."""

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
    the motion diverges at a speed.
    """

    motion: str
    share: float
    dynamic_factor: float


@dataclass(frozen=True)
class SpeedRange:
    """Consecutive computed speeds, from the first to the last, rpm of wheel 1.

    ``dynamic_factor`` is the largest peak of the mesh force over the static one in any motion, at the speed
    ``speed_of_largest``; both are NaN if all motions of the range diverge.
    """

    start: float
    stop: float
    dynamic_factor: float
    speed_of_largest: float


@dataclass(frozen=True)
class Window(SpeedRange):
    """Consecutive computed speeds that are to be avoided for the same reason: `CRITERION` or `FORCE_CRITERION`.

    The true edges lie at most ``start_resolution`` and ``stop_resolution`` outside, rpm. ``contact`` is the worst
    contact state, one of `CONTACT_WORDS`. A range that begins with the first computed speed (``from_scan_start``), or
    ends with the last one, may go on beyond. ``peaks`` are the local peaks of the dynamic factor at other speeds, at
    most the `MOST_PEAKS` largest, in rising order of speed.
    """

    start_resolution: float
    stop_resolution: float
    reached: tuple[Reached, ...]
    criterion: str
    contact: str
    from_scan_start: bool
    to_scan_end: bool
    peaks: tuple[Peak, ...]

    @property
    def words(self) -> str:
        """The range as a reader wants it: "1453 to 8000 rpm", or "near 575 rpm" if it is a single computed speed."""
        if self.start == self.stop:
            return f"near {self.start:.0f} rpm"
        return f"{self.start:.0f} to {self.stop:.0f} rpm"


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
        The peak of the mesh force over the static one at no speed; more than 1 where the stiffness jumps.
    dataset : xarray.Dataset
        Over ``motion`` ("rest", "rising", "falling", "other") and ``speed``, all computed speeds: ``label``,
        ``period``, ``contact`` and ``dynamic_factor``; 0, 0, −1 and NaN where there is no such motion. "other" is the
        worst of the motions that are reached from random initial states, or followed from such a motion to other
        speeds. Over ``speed`` the factors by the standards and resonance ratios of `gearchaos.dynamic_factor`.
    tried, coarse, transmission_error : str
        From which initial states motions were computed; what is not known to the resolution, empty if all is; where
        the transmission error is from.
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

    @property
    def largest(self) -> SpeedRange:
        """The whole range of computed speeds, with the largest dynamic factor in it."""
        return _speed_range(self.dataset)

    @property
    def elsewhere(self) -> tuple[SpeedRange, bool] | None:
        """The computed speeds outside the ranges to avoid, as far as these may reach, and whether teeth separate there.

        None if there are no such speeds.
        """
        speeds = self.dataset["speed"].values
        outside = np.ones(len(speeds), dtype=bool)
        for each in self.windows:
            outside &= (speeds < each.start - each.start_resolution) | (speeds > each.stop + each.stop_resolution)
        part = self.dataset.isel(speed=outside)
        return (_speed_range(part), bool((part["contact"] > 0).any())) if outside.any() else None

    @property
    def in_contact_from_rest(self) -> list[tuple[float, float]]:
        """The computed speeds, rpm, from first to last, at which teeth separate, but not in the motion from rest."""
        contact, speeds = self.dataset["contact"].values, self.dataset["speed"].values
        history = (contact[0] == 0) & (contact > 0).any(axis=0)
        return [(float(speeds[run[0]]), float(speeds[run[-1]])) for run in runs(history.tolist()) if history[run[0]]]

    @property
    def main_resonance(self) -> float:
        """The speed, rpm, at which the mesh frequency is the natural frequency at the mean mesh stiffness."""
        return float(self.dataset["speed"][-1] / self.dataset["resonance_ratio"][-1])

    def document(self) -> dict[str, Any]:
        """All of it but the kinds of motion, ready for JSON; NaN where there is no value."""
        ds = self.dataset
        along = {n: ds[n].values.tolist() for n in ("speed", *(each.name for each in standards()))}
        factors = {words: ds["dynamic_factor"].sel(motion=name).values.tolist() for name, words in MOTIONS.items()}
        return {
            "criterion": self.criterion, "units": {"speed": "rpm", "torque": "N*m"}, "torque": self.torque,
            "transmission_error": self.transmission_error, "quasi_static_ratio": self.quasi_static_ratio,
            "tried": self.tried, "resolution": self.resolution, "coarse": self.coarse,
            "computed": {**asdict(self.largest), "count": ds.sizes["speed"]},
            "ranges": [asdict(each) for each in self.windows],
            "along_speed": {**along, "dynamic_factor": factors["from rest"], "motions": factors},
        }


def speeds_to_avoid(
    design: GearDesign, speed: Axis | str, torque: Any = None, *, factor: float | None = None, separation: bool = True,
    starts: int = 32, seed: int = 0, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> SpeedsToAvoid:
    """The ranges of speed in which the teeth separate, or the dynamic factor is too high, in any motion found.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with all that a model needs but the speed.
    speed : Axis or str
        Speeds of wheel 1 in rpm: "600:9000:60" (start, stop, count), or an `Axis` with the name "speed". Speeds are
        added between them.
    torque : torque, optional
        At wheel 1, a number in N m or a text such as "300 N*m"; by default that of the design.
    factor : float, optional
        Also the ranges in which the dynamic factor over the quasi-static ratio exceeds this although the teeth stay in
        contact.
    separation : bool, optional
        False for the ranges in which that ratio exceeds ``factor`` alone, whether the teeth separate or not; a motion
        that diverges exceeds every factor.
    starts : int, optional
        Random initial states at each speed, from the ranges that `gearchaos.attractors` takes by default.
    seed : int, optional
        Of the random initial states.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    SpeedsToAvoid

    Raises
    ------
    InputError
        If an input that the model needs is missing, the torque is 0, the axis is wrong, a number is out of bounds, or
        there is no factor without separation.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.speeds_to_avoid(design, "500:1500:10", "300 N*m")
    >>> [each.words for each in found.windows]
    ['560 to 585 rpm', '628 to 656 rpm', '1061 to 1092 rpm', '1139 to 1500 rpm']
    >>> [each.motion for each in found.windows[-1].reached], found.windows[-1].to_scan_end
    (['other initial states'], True)
    """
    axis = operating_axis("speed", speed)
    at_start = loaded(design, torque).at(speed=axis.start)
    if factor is not None:
        factor = to_float("factor", factor)
        check_rule("factor", factor, POSITIVE)
    elif not separation:
        raise InputError("factor", "must be given with separation=False", None, "E.g. factor=1.5.")
    starts, seed = whole_number("starts", starts, 0), whole_number("seed", seed, 0)
    check_memory("speeds times starts", axis.count * max(1, starts))
    model = as_model(at_start)
    ratio, options = quasi_static_ratio(model), as_settings(settings) or Classification()
    Bifurcation(model, axis, points=0, settings=options).cost.check_time()  # also that a period has not too many steps
    limit = np.inf if factor is None else factor * ratio
    criteria = [CRITERION] * separation + (
        [] if factor is None else [f"the dynamic factor over the quasi-static ratio exceeds {factor:g}"])

    def severity(motion: Motion) -> int:
        """The index into `_CRITERIA`; a motion that diverges exceeds every limit."""
        high = motion.dynamic_factor > limit or (motion.diverged and factor is not None)
        return 2 if separation and motion.contact > 0 else int(high)

    motions = FollowedMotions(model, options, progress=progress, threads=threads)
    tried_at = motions.search(axis.values.tolist(), severity, limit, starts, seed)
    tried = f"from rest, sweeps up and down at {len(motions.speeds)} speeds" + (
        f", {starts} random states at {tried_at}" if starts else "")
    dataset = _dataset(motions).assign(by_standards(at_start, np.array(motions.speeds))).assign(
        quasi_static_ratio=variable("quasi_static_ratio", (), np.array(ratio)),
    ).assign_coords(torque=variable("torque", (), np.array(at_start.torque))).assign_attrs(
        provenance("speeds_to_avoid", model, starts=starts, seed=seed, classification=asdict(options)))
    windows = _windows(motions, dataset, severity)
    edges = [edge for w in windows for edge in ((w.start, w.start_resolution), (w.stop, w.stop_resolution))]
    coarse = [f"the edge near {edge:.0f} rpm is known to {width:.0f} rpm" for edge, width in edges
              if width > 1.01 * RESOLUTION * edge]
    zeta = model.value("zeta") or 0.0
    if 2 * zeta / STEPS_PER_BANDWIDTH < RESOLUTION:
        coarse.append(f"at a damping ratio of {zeta:.3g} a resonance may pass between the first speeds")
    return SpeedsToAvoid(
        float(at_start.torque), windows, ", or ".join(criteria), ratio, dataset, tried, RESOLUTION, "; ".join(coarse),
        at_start.error_harmonics.source)


def _dataset(motions: FollowedMotions) -> xr.Dataset:
    """The motions over the motion and the speed."""
    rows = motions.named().values()
    data = {name: np.array([[none if m is None else getattr(m, name) for m in row] for row in rows], dtype=dtype)
            for name, none, dtype in (("label", 0, np.int32), ("period", 0, np.int32), ("contact", -1, np.int32),
                                      ("dynamic_factor", np.nan, float))}
    return new_dataset(variables(("motion", "speed"), data), {
        "speed": variable("speed", ("speed",), np.array(motions.speeds)), "motion": list(MOTIONS)})


def _windows(motions: FollowedMotions, dataset: xr.Dataset, severity: Severity) -> tuple[Window, ...]:
    """The ranges of speed that are equally to be avoided."""
    speeds, known = dataset["speed"].values, _largest_factors(dataset)
    steps = np.concatenate([[0.0], np.diff(speeds), [0.0]])
    severities = np.array([[0 if m is None else severity(m) for m in row] for row in motions.named().values()])
    found, windows = [max(map(severity, motions.at[s])) for s in motions.speeds], []
    for own, first, last in ((found[run[0]], run[0], run[-1]) for run in runs(found) if found[run[0]]):
        part = dataset.isel(speed=slice(first, last + 1))
        inner = range(max(first, 1), min(last, len(known) - 2) + 1)
        peaks = [i for i in inner if known[i - 1] < known[i] >= known[i + 1]]
        largest = sorted(sorted(peaks, key=lambda i: -known[i])[:MOST_PEAKS])
        # of the share each speed counts half way to the next
        weights = np.gradient(part["speed"].values) if part.sizes["speed"] > 1 else np.ones(1)
        rows = zip(MOTIONS.values(), severities[:, first : last + 1] == own, part["dynamic_factor"].values, strict=True)
        reached = [Reached(words, float(weights[avoided].sum() / weights.sum()), float(factors[avoided].max()))
                   for words, avoided, factors in rows if avoided.any()]
        windows.append(Window(
            **asdict(_speed_range(part)), start_resolution=float(steps[first]), stop_resolution=float(steps[last + 1]),
            reached=tuple(reached), criterion=_CRITERIA[own], contact=CONTACT_WORDS[int(part["contact"].max())],
            from_scan_start=first == 0, to_scan_end=last == len(speeds) - 1,
            peaks=tuple(Peak(float(speeds[i]), float(known[i])) for i in largest)))
    return tuple(windows)


def _largest_factors(dataset: xr.Dataset) -> np.ndarray:
    """The largest dynamic factor (N,) of the motions of each speed; −∞ where all diverge."""
    factors = dataset["dynamic_factor"].values
    return np.where(np.isfinite(factors), factors, -np.inf).max(axis=0)


def _speed_range(part: xr.Dataset) -> SpeedRange:
    """The range of all speeds of a Dataset."""
    speeds, factors = part["speed"].values, _largest_factors(part)
    at = int(np.argmax(factors))
    largest = (float(factors[at]), float(speeds[at])) if np.isfinite(factors[at]) else (np.nan, np.nan)
    return SpeedRange(float(speeds[0]), float(speeds[-1]), *largest)
