"""The speeds to avoid: where the teeth separate, in any of the motions that are found, and how high the force is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable, variables
from gearchaos.dynamics import Classification, Label
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.flow import DIVERGED_AT
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operating import as_model, gears_of, is_design
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.quantities import POSITIVE, Rule
from gearchaos.studies.axis import Axis
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.cost import MAX_STEPS, Cost, TooManyStepsError
from gearchaos.studies.followed_motions import (
    MOST_SPEEDS,
    RESOLUTION,
    STEPS_PER_BANDWIDTH,
    FollowedMotions,
    Motion,
    Severity,
    brief_settings,
    damping_ratio,
    fewer,
    parts_between,
    runs,
    side_by_side,
)
from gearchaos.studies.known_orbits import LONGEST
from gearchaos.studies.operating_ranges import range_of_speeds
from gearchaos.studies.quasi_static import quasi_static_ratio, ratio_in_words
from gearchaos.studies.speed_and_torque import by_standards, loaded
from gearchaos.studies.speed_windows import (
    CONTACT_WORDS,
    CRITERION,
    FORCE_CRITERION,
    MOST_PEAKS,
    MOTIONS,
    UNBOUNDED,
    Jump,
    Peak,
    RandomStates,
    Reached,
    SpeedsToAvoid,
    Window,
    largest_factors,
    speed_range,
    weights_of,
)
from gearchaos.studies.window_edges import Edge, Sought, Way, continue_orbits, ends_of_orbits, locate_edges
from gearchaos.validation import check_rule, to_float

if TYPE_CHECKING:
    import xarray as xr

_CRITERIA = ("", FORCE_CRITERION, CRITERION)  # in rising order of severity: what does not count, 1 and 2
STARTS = 512  # random initial states at each speed
SPACING = 0.0025  # largest distance of these speeds, as a share of the speed
_OF_TRAINS, _BESIDE = 160, 5000
"""Mesh periods for which a motion of a train from a random state is followed, longer than one of a pair, and for which
those that are followed along the speed are at each speed; measured on trains of two meshes."""

_SPACINGS = Rule(lambda v: (v >= 1e-3) & (v <= 1), "must lie in [0.001, 1]")
_MOST_DEFLECTION = DIVERGED_AT / 100  # in half backlashes at rest; motions about a larger one may count as diverged
_MOST_RETURNS = 4  # times that the search goes on from motions that were lost


@dataclass(frozen=True)
class Criteria:
    """What makes a motion one to avoid, and from which initial states motions are looked for."""

    factor: float | None = None
    separation: bool = True
    starts: int = STARTS
    spacing: float = SPACING
    seed: int = 0
    settings: Classification = field(default_factory=Classification)

    @classmethod
    def checked(
        cls, factor: Any, separation: bool, starts: Any, spacing: Any, seed: Any, settings: Any
    ) -> Criteria:
        """The criteria; raises `InputError` for what is out of bounds."""
        if factor is not None:
            factor = to_float("factor", factor)
            check_rule("factor", factor, POSITIVE)
        elif not separation:
            raise InputError("factor", "must be given with separation=False", None, "E.g. factor=1.5.")
        starts, seed = whole_number("starts", starts, 0), whole_number("seed", seed, 0)
        spacing = to_float("spacing", spacing)
        check_rule("spacing", spacing, _SPACINGS)
        return cls(factor, separation, starts, spacing, seed, as_settings(settings) or Classification())

    def words(self, ratio: float) -> str:
        """They as words, where the quasi-static ratio is this, or not known, NaN."""
        over = " over the quasi-static ratio" * bool(ratio_in_words(ratio))
        return ", or ".join([CRITERION] * self.separation + ([] if self.factor is None else [
            f"the dynamic factor{over} exceeds {self.factor:g}"]))

    def limit(self, ratio: float) -> float:
        """The largest dynamic factor that is accepted, where the quasi-static ratio is this, or not known, NaN."""
        return np.inf if self.factor is None else self.factor * (1.0 if np.isnan(ratio) else ratio)


@dataclass
class _AtTorque:
    """The motions of gears at one torque, None for that of the model, and the quasi-static ratio, NaN for a train."""

    criteria: Criteria
    motions: FollowedMotions
    ratio: float
    edges: list[Edge] = field(default_factory=list)  # between the runs of speeds of one severity
    jumps: tuple[Jump, ...] = ()  # of slow sweeps

    @property
    def limit(self) -> float:
        return self.criteria.limit(self.ratio)

    def severity(self, motion: Motion) -> int:
        """The index into `_CRITERIA`; a motion that diverges exceeds every limit."""
        high = motion.dynamic_factor > self.limit or (motion.diverged and self.criteria.factor is not None)
        return 2 if self.criteria.separation and motion.contact > 0 else int(high)

    def meshes(self, first: int, last: int, own: int) -> tuple[str, ...]:
        """The names of the meshes of a train at which the teeth separate in a range of speeds."""
        found = [m.meshes for s in self.motions.speeds[first : last + 1] for m in self.motions.at[s]
                 if self.severity(m) == own and m.meshes]
        names = getattr(self.motions.model, "mesh_names", ())
        return tuple(name for k, name in enumerate(names) if any(contacts[k] > 0 for contacts in found))

    @property
    def severities(self) -> list[int]:
        """The largest one at each speed."""
        return [max(map(self.severity, self.motions.at[s])) for s in self.motions.speeds]

    def sought(self) -> list[Sought]:
        """The edges between neighbouring speeds of different severities."""
        out, speeds, found = [], self.motions.speeds, self.severities
        for i, (a, b) in enumerate(pairwise(found)):
            if a != b:
                inside, outside = speeds[i + (b > a)], speeds[i + (a > b)]
                out.append(Sought(
                    self.motions.torque, inside, outside, self.motions.at[inside], self.motions.at[outside],
                    self._at_least(max(a, b)),
                    Edge(inside, "", abs(outside - inside))))
        return out

    def _at_least(self, severity: int) -> Severity:
        """Whether a motion is at least as severe."""
        return lambda motion: int(self.severity(motion) >= severity)

    def left_behind(self) -> list[tuple[Way, str, Motion]]:
        """The orbits that slow sweeps leave for good, with the direction of the sweep and the motion reached."""
        out, motions, rows = [], self.motions, self.motions.named()
        for direction, row, step in (("up", rows["rising"], 1), ("down", rows["falling"], -1)):
            for (motion, reached), (here, there) in zip(
                    pairwise(row[::step]), pairwise(motions.speeds[::step]), strict=True):
                if motion and reached and motion.period and reached.leads_to[here] is not motion:
                    out.append((Way(motions.torque, here, there, motion), direction, reached))
        return out


def search_cost(model: MeshModel, axis: Axis, torques: int, criteria: Criteria) -> Cost:
    """What a search at so many torques computes: the motions from random states where none is to be avoided.

    Raises `InputError` if that takes too many speeds, too much memory or too long.
    """
    speeds = sum(parts_between(model, low, high, criteria.spacing) for low, high in pairwise(axis.values.tolist()))
    if speeds > MOST_SPEEDS:
        raise InputError("speed", f"must take at most {MOST_SPEEDS} speeds", f"{axis.start:g}:{axis.stop:g}",
                         f"At a spacing of {criteria.spacing:g} it takes {speeds}. Give a narrower range.")
    starts = max(1, criteria.starts)
    check_memory("speeds times starts", speeds * starts * torques)
    try:
        cost = Bifurcation(model, axis, points=0, settings=brief_settings(criteria.settings)).cost
    except TooManyStepsError as error:
        least = axis.start * cast("float", error.value) / MAX_STEPS
        raise InputError("speed", f"must be at least about {least:.2g} rpm", f"{axis.start:g}:{axis.stop:g}",
                         f"Below it a mesh period takes more than {MAX_STEPS:,} steps.") from None
    usual = _OF_TRAINS + _BESIDE // starts if model.kind == "train" else LONGEST
    found = replace(cost, motions=torques * speeds * starts, usual_periods=usual,
                    periods=max(usual, cost.periods * fewer(starts, 2) // starts))
    found.check_time()
    return found


def search_torques(
    model: MeshModel, speeds: Sequence[float], torques: Sequence[float | None], criteria: Criteria, *,
    progress: bool = False, threads: int | None = None,
) -> list[_AtTorque]:
    """The motions at several torques side by side with their edges.

    Periodic motions that are lost between two speeds are followed by their orbits, and the search goes on from there.
    """
    models = [model if t is None else model.with_values({"torque": t}) for t in torques]
    at = [_AtTorque(criteria, FollowedMotions(each, t), np.nan if each.kind == "train" else quasi_static_ratio(each))
          for each, t in zip(models, torques, strict=True)]
    for loaded_model in models:
        _check_deflection(loaded_model)
    words = "motions from random states" if progress else None
    side_by_side(
        [each.motions.search(speeds, each.severity, each.limit, criteria.starts, criteria.seed, criteria.spacing)
         for each in at],
        model, criteria.settings, progress=words, threads=threads)
    for _ in range(_MOST_RETURNS):
        known = [sum(map(len, each.motions.at.values())) for each in at]
        continue_orbits(model, [each.motions for each in at])
        more = [each for each, count in zip(at, known, strict=True) if sum(map(len, each.motions.at.values())) > count]
        if not more:
            break
        side_by_side([each.motions.refine(each.severity, each.limit) for each in more], model, criteria.settings,
                     threads=threads)
    sought = [each.sought() for each in at]
    locate_edges(model, [edge for edges in sought for edge in edges], criteria.settings, threads=threads)
    for each, edges in zip(at, sought, strict=True):
        each.edges = [edge.found for edge in edges]
    swept = [each.left_behind() for each in at]
    ends = iter(ends_of_orbits(model, [way for each in swept for way, *_ in each]))
    for each, left in zip(at, swept, strict=True):
        each.jumps = tuple(Jump(end.speed, direction, end.kind, way.motion.dynamic_factor, reached.dynamic_factor)
                           for (way, direction, reached), (end, _) in zip(left, ends, strict=False))
    return at


def _check_deflection(model: MeshModel) -> None:
    """Raise `InputError` for a torque at which the deflection alone comes near the bound of all motions."""
    system = switched_system(vary(model, {}))
    deflection = float(np.abs(system.static_force).max() / system.levels.max())
    if deflection > _MOST_DEFLECTION:
        raise InputError("torque", f"must deflect the teeth at rest by at most {_MOST_DEFLECTION:g} half backlashes",
                         f"{model.value('torque'):.6g} N m", f"It is about {deflection:.2g}: check the units.")


def speeds_to_avoid(
    design: GearDesign, speed: Axis | str, torque: Any = None, *, factor: float | None = None, separation: bool = True,
    starts: int = STARTS, spacing: float = SPACING, seed: int = 0, settings: Classification | None = None,
    progress: bool = False, threads: int | None = None,
) -> SpeedsToAvoid:
    """The ranges of speed in which the teeth separate, or the dynamic factor is too high, in any motion found.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with all that a model needs but the speed.
    speed : Axis or str
        The range of speeds of wheel 1 in rpm: "600:9000", or with a number of first speeds "600:9000:60", or an `Axis`
        with the name "speed". Speeds are added between them.
    torque : torque, optional
        At wheel 1, a number in N m or a text such as "300 N*m"; by default that of the design.
    factor : float, optional
        Also the ranges in which the dynamic factor over the quasi-static ratio exceeds this although the teeth stay in
        contact.
    separation : bool, optional
        False for the ranges in which that ratio exceeds ``factor`` alone, whether the teeth separate or not; a motion
        that diverges exceeds every factor.
    starts : int, optional
        Random initial states at each speed, from the ranges that `gearchaos.attractors` takes by default; an eighth of
        them where a motion to avoid is known, and an eighth of that where one does not repeat, but in each range to
        avoid no fewer than 64, or than these.
    spacing : float, optional
        Largest distance of these speeds next to one where no motion to avoid is known, as a share of the speed.
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
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality (typical)",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.speeds_to_avoid(design, "800:1250:10", "100 N*m", starts=64)
    >>> [each.words for each in found.windows]
    ['860 to 941 rpm', '1057 to 1164 rpm', '1201 to 1250 rpm']
    >>> [each.motion for each in found.windows[-1].reached], found.windows[-1].to_scan_end
    (['other initial states'], True)
    """
    axis = range_of_speeds(speed)
    at_start = loaded(design, torque).at(speed=axis.start)
    criteria = Criteria.checked(factor, separation, starts, spacing, seed, settings)
    model = as_model(at_start)
    search_cost(model, axis, 1, criteria).announce(progress, threads)
    (found,) = search_torques(
        model, axis.values.tolist(), [model.value("torque")], criteria, progress=progress, threads=threads)
    result = summarised(found)
    return replace(result, dataset=result.dataset.assign(by_standards(at_start, np.array(found.motions.speeds))))


def summarised(found: _AtTorque) -> SpeedsToAvoid:
    """What was found at a torque."""
    motions, criteria, model = found.motions, found.criteria, found.motions.model
    gears, torque = gears_of(model), (model.value("torque") or 0.0) if motions.torque is None else motions.torque
    dataset = _dataset(found).assign(
        quasi_static_ratio=variable("quasi_static_ratio", (), np.array(found.ratio)),
    ).assign_coords(torque=variable("torque", (), np.array(torque))).assign_attrs(provenance(
        "speeds_to_avoid", model, starts=criteria.starts, spacing=criteria.spacing, seed=criteria.seed,
        classification=asdict(criteria.settings)))
    windows = _windows(found, dataset)
    coarse = [f"the search ended at {MOST_SPEEDS} speeds"] * (len(motions.speeds) >= MOST_SPEEDS)
    zeta = damping_ratio(model)
    if 2 * zeta / STEPS_PER_BANDWIDTH < RESOLUTION:
        coarse.append(f"at a damping ratio of {zeta:.3g} a resonance may pass between the first speeds")
    return SpeedsToAvoid(
        float(torque), windows, criteria.words(found.ratio), found.ratio, dataset, _tried(found), RESOLUTION,
        "; ".join(coarse), gears.error_harmonics.source if is_design(gears) else "as given", found.jumps)


def _tried(found: _AtTorque) -> str:
    """From which initial states motions were looked for, with the least and the largest number of random ones."""
    drawn = [len(each) for each in found.motions.drawn.values()]
    words = f"from rest, sweeps at {len(found.motions.speeds)} speeds"
    if not drawn:
        return words
    number = " to ".join(map(str, sorted({min(drawn), max(drawn)})))
    return f"{words}, {number} random state{'s' * (max(drawn) > 1)} at {len(drawn)}"


def _dataset(found: _AtTorque) -> xr.Dataset:
    """The motions over the motion and the speed, and over the speed the random states."""
    motions, rows = found.motions, found.motions.named().values()
    data = {name: np.array([[none if m is None else getattr(m, name) for m in row] for row in rows], dtype=dtype)
            for name, none, dtype in (("label", 0, np.int32), ("period", 0, np.int32), ("contact", -1, np.int32),
                                      ("dynamic_factor", np.nan, float))}
    drawn = [motions.drawn.get(speed, []) for speed in motions.speeds]
    avoided = [sum(own > 0 and found.severity(m) == own for m in each)
               for each, own in zip(drawn, found.severities, strict=True)]
    states = {"random_states": np.array([len(each) for each in drawn]), "avoided_states": np.array(avoided)}
    return new_dataset(variables(("motion", "speed"), data) | variables(("speed",), states), {
        "speed": variable("speed", ("speed",), np.array(motions.speeds)), "motion": list(MOTIONS)})


def _windows(found: _AtTorque, dataset: xr.Dataset) -> tuple[Window, ...]:
    """The ranges of speed that are equally to be avoided."""
    motions, severity = found.motions, found.severity
    speeds, known = dataset["speed"].values, largest_factors(dataset)
    severities = np.array([[0 if m is None else severity(m) for m in row] for row in motions.named().values()])
    all_severities, windows = found.severities, []
    parts = runs(all_severities)
    ends = [Edge(float(speeds[0])), *found.edges, Edge(float(speeds[-1]))]
    for part, (start, stop) in zip(parts, pairwise(ends), strict=True):
        first, last = part[0], part[-1]
        before, own, after = ([0, *all_severities, 0][i] for i in (first, first + 1, last + 2))
        if not own:
            continue
        within = dataset.isel(speed=slice(first, last + 1))
        inner = range(max(first, 1), min(last, len(known) - 2) + 1)
        peaks = [i for i in inner if known[i - 1] < known[i] >= known[i + 1]]
        largest = sorted(sorted(peaks, key=lambda i: -known[i])[:MOST_PEAKS])
        weights, speeds_within = weights_of(within), speeds[first : last + 1].tolist()
        free = [i for i, s in enumerate(speeds_within) if any(severity(m) < own for m in motions.at[s])]
        history = (start.speed if free[0] == 0 else speeds_within[free[0] - 1],
                   stop.speed if free[-1] == last - first else speeds_within[free[-1] + 1]) if free else None
        rows = zip(MOTIONS.values(), severities[:, first : last + 1] == own, within["dynamic_factor"].values,
                   strict=True)
        reached = [Reached(words, float(weights[avoided].sum() / weights.sum()), float(factors[avoided].max()))
                   for words, avoided, factors in rows if avoided.any()]
        own_range, diverged = speed_range(within), (within["label"] == Label.DIVERGED).any()
        windows.append(Window(
            start.speed, stop.speed, own_range.dynamic_factor, own_range.speed_of_largest,
            start.resolution * (own > before), stop.resolution * (own > after),
            reached=tuple(reached), criterion=_CRITERIA[own],
            contact=UNBOUNDED if diverged else CONTACT_WORDS[int(within["contact"].max())],
            from_scan_start=first == 0, to_scan_end=last == len(speeds) - 1, begins_with=start.kind,
            ends_with=stop.kind, meshes=found.meshes(first, last, own), history=history,
            random_states=RandomStates.of(within.isel(speed=slice(free[0], free[-1] + 1)) if free else within),
            peaks=tuple(Peak(float(speeds[i]), float(known[i])) for i in largest)))
    return tuple(windows)
