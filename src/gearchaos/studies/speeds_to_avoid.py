"""The speeds to avoid: where the teeth separate, in any of the motions that are found, and how high the force is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gearchaos.datasets import new_dataset, provenance, variable, variables
from gearchaos.dynamics import Classification
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import check_memory
from gearchaos.flow import DIVERGED_AT
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.geometry.root_stress import ROOT_STRESS
from gearchaos.gears.operating import as_model, gears_of, is_design
from gearchaos.gears.units import STRESS, measured, to_si
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.quantities import POSITIVE, Rule
from gearchaos.studies.axis import Axis
from gearchaos.studies.beside_factors import peak_root_stress
from gearchaos.studies.beyond_the_teeth import BEYOND, TeethLimits
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.cost import MAX_STEPS, Cost, TooManyStepsError
from gearchaos.studies.followed_motions import (
    MOST_SEVERE,
    MOST_SPEEDS,
    OTHER,
    RESOLUTION,
    STEPS_PER_BANDWIDTH,
    FollowedMotions,
    Motion,
    Severity,
    brief_settings,
    damping_ratio,
    parts_between,
    runs,
    side_by_side,
)
from gearchaos.studies.knocks import Knock, find_knocks
from gearchaos.studies.load_change import REVERSAL, Draw, LoadChange, wide_states
from gearchaos.studies.operating_ranges import range_of_speeds
from gearchaos.studies.price import announce
from gearchaos.studies.quasi_static import quasi_static_ratio, ratio_in_words
from gearchaos.studies.speed_and_torque import by_standards, loaded
from gearchaos.studies.speed_windows import (
    CONTACT_WORDS,
    CRITERION,
    FORCE_CRITERION,
    MOST_PEAKS,
    MOTIONS,
    OPERATION,
    SUDDEN,
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
STARTS = 128  # random initial states at each speed
SPACING = 0.0025  # largest distance of these speeds, as a share of the speed
_TRIAL_SPEEDS = 4  # least number of speeds at which a trial of a search looks for motions, at each torque
_SPACINGS = Rule(lambda v: (v >= 1e-3) & (v <= 1), "must lie in [0.001, 1]")
_MOST_DEFLECTION = DIVERGED_AT / 100  # in half backlashes at rest; motions about a larger one may count as diverged
_MOST_RETURNS = 4  # times that the search goes on from motions that were lost


@dataclass(frozen=True)
class Criteria:
    """What makes a motion one to avoid, and from which initial states motions are looked for."""

    factor: float | None = None
    root_stress: float | None = None
    separation: bool = True
    starts: int = STARTS
    spacing: float = SPACING
    seed: int = 0
    settings: Classification = field(default_factory=Classification)
    load_change: LoadChange | None = REVERSAL
    wide: bool = False
    knocks: bool = True

    @classmethod
    def checked(
        cls, starts: Any, spacing: Any, seed: Any, settings: Any, *, factor: Any = None, root_stress: Any = None,
        separation: bool = True, load_change: Any = REVERSAL.ratio, wide: bool = False, knocks: bool = True,
    ) -> Criteria:
        """The criteria; raises `InputError` for what is out of bounds."""
        if factor is not None:
            factor = to_float("factor", factor)
            check_rule("factor", factor, POSITIVE)
        if root_stress is not None:
            root_stress = to_si("root_stress", root_stress, STRESS, POSITIVE)
        if factor is None and root_stress is None and not separation:
            raise InputError("factor", "must be given with separation=False", None, "E.g. factor=1.5.")
        starts, seed = whole_number("starts", starts, 0), whole_number("seed", seed, 0)
        spacing = to_float("spacing", spacing)
        check_rule("spacing", spacing, _SPACINGS)
        change = None if load_change is None else LoadChange.checked(load_change)
        if starts == 0 and (wide or change not in (None, REVERSAL)):
            raise InputError("starts", "must be at least 1 for states after a load change, or wide ones", starts)
        return cls(factor, root_stress, separation, starts if change or wide else 0, spacing, seed,
                   as_settings(settings) or Classification(), change, wide, knocks)

    def words(self, ratio: float) -> str:
        """They as words, where the quasi-static ratio is this, or not known, NaN."""
        over = " over the quasi-static ratio" * bool(ratio_in_words(ratio))
        return ", or ".join(filter(None, [
            CRITERION * self.separation,
            "" if self.factor is None else f"the dynamic factor{over} exceeds {self.factor:g}",
            "" if self.root_stress is None else f"the nominal root stress exceeds {self.root_stress:g} "
            f"{ROOT_STRESS.unit}"]))

    @property
    def others(self) -> str:
        """The name of the motions that operation does not meet, see `MOTIONS`."""
        return "other" if self.wide else "load change"

    @property
    def change_in_words(self) -> str:
        """Beside operation, from where states come; empty for none."""
        if self.wide:
            return "any state of wide ranges is met" * (self.starts > 0)
        return self.load_change.words if self.load_change and self.starts else ""

    @property
    def draw(self) -> Draw:
        """Which random states are drawn."""
        return wide_states if self.wide else self.load_change or REVERSAL


@dataclass
class _AtTorque:
    """The motions of gears at one torque, None for that of the model, the quasi-static ratio, NaN for a train, and what
    the teeth bear."""

    criteria: Criteria
    motions: FollowedMotions
    ratio: float
    limits: TeethLimits
    root: float | None = None  # the larger nominal root stress at rest, N/mm²
    edges: list[Edge] = field(default_factory=list)  # between the runs of speeds of one severity
    jumps: tuple[Jump, ...] = ()  # of slow sweeps
    knocks: tuple[Knock, ...] = ()
    largest_knock: float = 0.0  # that was tried, rpm

    @property
    def limit(self) -> float:
        """The largest dynamic factor that is accepted, also in contact: at most that which the teeth bear."""
        return min(self._given, self.limits.factor)

    @property
    def _given(self) -> float:
        """The dynamic factor at the lower of the limits of factor and root stress that are given."""
        criteria, root = self.criteria, self.root
        return min(np.inf if criteria.factor is None else criteria.factor * np.nan_to_num(self.ratio, nan=1.0),
                   np.inf if criteria.root_stress is None or root is None else criteria.root_stress / root)

    def hits(self, dynamic_factor: float) -> bool:
        """Whether a force is no small one: above a limit that is given, or without one above twice the static force,
        that of a load put on at once."""
        limit = self._given if np.isfinite(self._given) else SUDDEN * np.nan_to_num(self.ratio, nan=1.0)
        return bool(dynamic_factor > limit)

    def beyond(self, motion: Motion) -> bool:
        """Whether teeth cannot bear it."""
        return bool(self.limits.exceeded(motion.dynamic_factor, motion.deflection))

    def severity(self, motion: Motion) -> int:
        """The index into `_CRITERIA`; a motion that diverges exceeds every limit."""
        high = motion.dynamic_factor > self.limit or self.beyond(motion)
        return 2 if self.criteria.separation and motion.contact > 0 else int(high)

    def meshes(self, first: int, last: int, own: int) -> tuple[str, ...]:
        """The names of the meshes of a train at which the teeth separate in a range of speeds."""
        found = [m.meshes for s in self.motions.speeds[first : last + 1] for m in self.motions.at[s]
                 if self.severity(m) >= own and m.meshes]
        names = getattr(self.motions.model, "mesh_names", ())
        return tuple(name for k, name in enumerate(names) if any(contacts[k] > 0 for contacts in found))

    @property
    def good(self) -> list[float]:
        """The speeds at which neither operation nor a load change meets a motion to avoid."""
        return [s for s, rank in zip(self.motions.speeds, self.motions.ranks(self.severity), strict=True) if not rank]

    def sought(self) -> list[Sought]:
        """The edges between neighbouring speeds of different ranks.

        A motion that operation meets at one of them, and that is there at the other after a load change, does not end
        between: operation comes to another one, and the edge is known as well as the speeds are apart.
        """
        out, speeds, found = [], self.motions.speeds, self.motions.ranks(self.severity)
        met = self.motions.operation()
        for i, (a, b) in enumerate(pairwise(found)):
            if a != b:
                inner, outer = i + (b > a), i + (a > b)
                inside, outside, worst = speeds[inner], speeds[outer], max(a, b)
                least = self._at_least(_severity_of(worst))
                motions = self.motions.at[inside]
                if worst > MOST_SEVERE and min(a, b):
                    motions = [m for m in met[inner] if not least(m.leads_to[outside])]
                out.append(Sought(
                    self.motions.torque, inside, outside, motions, self.motions.at[outside], least,
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


def _severity_of(rank: int) -> int:
    """The severity of a rank, see `FollowedMotions.ranks`."""
    return rank - MOST_SEVERE * (rank > MOST_SEVERE)


@dataclass(frozen=True)
class SpeedSearch:
    """A search of the speeds to avoid at several torques, None for that of the model, as work that has a price: all of
    it, or a trial at a number of its speeds alone."""

    model: MeshModel
    axis: Axis
    torques: Sequence[float | None]
    criteria: Criteria
    trial: int = 0

    def __post_init__(self) -> None:
        _ = self.cost

    @property
    def _count(self) -> int:
        """The number of speeds at which motions from random states are looked for where none is to be avoided."""
        return self.trial or sum(parts_between(self.model, low, high, self.criteria.spacing)
                                 for low, high in pairwise(self.axis.values.tolist()))

    @cached_property
    def cost(self) -> Cost:
        """Bound for the motions from random states where none is to be avoided.

        Raises `InputError` if that takes too many speeds, too much memory or too long.
        """
        axis, speeds, starts = self.axis, self._count, max(1, self.criteria.starts)
        if speeds > MOST_SPEEDS:
            raise InputError("speed", f"must take at most {MOST_SPEEDS} speeds", f"{axis.start:g}:{axis.stop:g}",
                             f"At a spacing of {self.criteria.spacing:g} it takes {speeds}. Give a narrower range.")
        check_memory("speeds times starts", speeds * starts * len(self.torques))
        try:
            cost = Bifurcation(self.model, axis, points=0, settings=brief_settings(self.criteria.settings)).cost
        except TooManyStepsError as error:
            least = axis.start * cast("float", error.value) / MAX_STEPS
            raise InputError("speed", f"must be at least about {least:.2g} rpm", f"{axis.start:g}:{axis.stop:g}",
                             f"Below it a mesh period takes more than {MAX_STEPS:,} steps.") from None
        found = replace(cost, motions=len(self.torques) * speeds * starts)
        found.check_time()
        return found

    def thinned(self, share: float) -> SpeedSearch:
        """A trial at some of the speeds, and of the torques, spread over all of them."""
        points = max(_TRIAL_SPEEDS, round(share * self._count * len(self.torques))) if share else 1
        number = min(len(self.torques), max(1, points // _TRIAL_SPEEDS))
        chosen = [self.torques[round((i + 0.5) * len(self.torques) / number - 0.5)] for i in range(number)]
        return replace(self, torques=chosen, trial=points // number)

    def smaller(self, share: float) -> tuple[str, SpeedSearch] | None:
        """Fewer torques, or of a few fewer states after load changes."""
        number = max(2, round(share * len(self.torques)))
        if number < len(self.torques):
            chosen = self.torques[:: -(-len(self.torques) // number)]
            return f"{len(chosen)} of the torques", replace(self, torques=chosen)
        starts = round(share * self.criteria.starts)
        if not starts:
            return None
        return f"--starts {starts} of assess", replace(self, criteria=replace(self.criteria, starts=starts))

    def run(self, *, progress: bool = False, threads: int | None = None) -> list[_AtTorque]:
        """What is found at each torque."""
        if not self.trial:
            return search_torques(self.model, self.axis.values.tolist(), self.torques, self.criteria,
                                  progress=progress, threads=threads)
        shares, criteria = (np.arange(self.trial) + 0.5) / self.trial, self.criteria
        at = [_at_torque(self.model, torque, criteria) for torque in self.torques]
        speeds = (self.axis.start + shares * (self.axis.stop - self.axis.start)).tolist()
        side_by_side([each.motions.add_random(speeds, each.severity, criteria.starts, (criteria.seed,)) for each in at],
                     self.model, criteria.settings, threads=threads)
        return at


def search_torques(
    model: MeshModel, speeds: Sequence[float], torques: Sequence[float | None], criteria: Criteria, *,
    progress: bool = False, threads: int | None = None,
) -> list[_AtTorque]:
    """The motions at several torques side by side with their edges.

    Periodic motions that are lost between two speeds are followed by their orbits, and the search goes on from there.
    """
    at = [_at_torque(model, torque, criteria) for torque in torques]
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
        if criteria.knocks and model.kind != "train":
            each.knocks, each.largest_knock = find_knocks(
                each.motions, each.good, each.severity, each.beyond, criteria.settings, threads)
    return at


def _at_torque(model: MeshModel, torque: float | None, criteria: Criteria) -> _AtTorque:
    """A model at a torque, before a search."""
    model = model if torque is None else model.with_values({"torque": torque})
    _check_deflection(model)
    gears, load = gears_of(model), model.value("torque") or 0.0
    root = peak_root_stress(gears, load, 1.0)
    if criteria.root_stress is not None and root is None:
        raise InputError("root_stress", "must be left out where the nominal root stress is not known",
                         criteria.root_stress, "It needs the drawing of a pair, a [design]. Or give factor.")
    return _AtTorque(criteria, FollowedMotions(model, torque, criteria.draw),
                     np.nan if model.kind == "train" else quasi_static_ratio(model), TeethLimits.of(gears, load),
                     None if root is None else max(root))


def _check_deflection(model: MeshModel) -> None:
    """Raise `InputError` for a torque at which the deflection alone comes near the bound of all motions."""
    system = switched_system(vary(model, {}))
    deflection = float(np.abs(system.static_force).max() / system.levels.max())
    if deflection > _MOST_DEFLECTION:
        raise InputError("torque", f"must deflect the teeth at rest by at most {_MOST_DEFLECTION:g} half backlashes",
                         f"{model.value('torque'):.6g} N m", f"It is about {deflection:.2g}: check the units.")


def speeds_to_avoid(
    design: GearDesign, speed: Axis | str, torque: Any = None, *, factor: float | None = None,
    root_stress: float | str | None = None, separation: bool = True,
    starts: int = STARTS, spacing: float = SPACING, seed: int = 0, load_change: float | None = REVERSAL.ratio,
    wide: bool = False, knocks: bool = True, settings: Classification | None = None, progress: bool = False,
    threads: int | None = None,
) -> SpeedsToAvoid:
    """The ranges of speed in which the teeth separate, or the dynamic factor is too high, in any motion that a gearbox
    can meet: in operation, or after a change of the load.

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
    root_stress : float or str, optional
        Likewise those in which the nominal root stress at the peak of the whole mesh force exceeds this, in N/mm² or
        with a unit.
    separation : bool, optional
        False for the ranges in which that ratio exceeds ``factor`` alone, whether the teeth separate or not; a motion
        that diverges exceeds every factor.
    starts : int, optional
        States after a change of the load at each speed; an eighth of them where a motion to avoid is known, and an
        eighth of that where one does not repeat, but in each range to avoid no fewer than 64, or than these.
    spacing : float, optional
        Largest distance of these speeds next to one where no motion to avoid is known, as a share of the speed.
    seed : int, optional
        Of these states.
    load_change : float or None
        λ: the load goes away or reverses to −λ times itself, for any time, and comes back: 1 is a reversal, 0 a loss,
        −0.5 a fall to half of it. None where the load never changes: then operation alone is looked at.
    wide : bool
        Draw from the ranges that `gearchaos.attractors` takes by default instead, which hold states that no load
        stores.
    knocks : bool
        Also look for the least knocks that lead from the motion from rest to one to avoid, at speeds without one.
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
    (['load change'], True)
    """
    axis = range_of_speeds(speed)
    at_start = loaded(design, torque).at(speed=axis.start)
    criteria = Criteria.checked(
        starts, spacing, seed, settings, factor=factor, root_stress=root_stress, separation=separation,
        load_change=load_change, wide=wide, knocks=knocks)
    model = as_model(at_start)
    search = SpeedSearch(model, axis, [model.value("torque")], criteria)
    announce(search, progress, threads)
    (found,) = search.run(progress=progress, threads=threads)
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
        "; ".join(coarse), gears.error_harmonics.source if is_design(gears) else "as given", found.limits.words,
        criteria.change_in_words, found.jumps, found.knocks)


def _tried(found: _AtTorque) -> str:
    """From which initial states motions were looked for, with the least and the largest number of random ones."""
    drawn = [len(each) for each in found.motions.drawn.values()]
    words = f"from rest, sweeps at {len(found.motions.speeds)} speeds"
    size = f"{measured(found.largest_knock, 3)} rpm of the speed of wheel 1"
    knocks = f", knocks of up to {size}" * (found.largest_knock > 0)
    if not drawn:
        return words + knocks
    number = " to ".join(map(str, sorted({min(drawn), max(drawn)})))
    states = f"state{'s' * (max(drawn) > 1)}"
    criteria, change = found.criteria, found.criteria.load_change
    after = f"after {change.words} " if change and not criteria.wide else ""
    return f"{words}, {number} {'' if after else 'random '}{states} {after}at {len(drawn)}{knocks}"


def _dataset(found: _AtTorque) -> xr.Dataset:
    """The motions over the motion and the speed, and over the speed the random states."""
    motions, rows = found.motions, found.motions.named()
    rows[found.criteria.others] = rows.pop(OTHER)
    data = {name: np.array([[none if m is None else getattr(m, name) for m in row] for row in rows.values()],
                           dtype=dtype)
            for name, none, dtype in (("label", 0, np.int32), ("period", 0, np.int32), ("contact", -1, np.int32),
                                      ("dynamic_factor", np.nan, float))}
    beyond = np.array([[m is not None and found.beyond(m) for m in row] for row in rows.values()])
    data |= {"beyond_the_teeth": beyond, "dynamic_factor": np.where(beyond, np.nan, data["dynamic_factor"])}
    drawn = [motions.drawn.get(speed, []) for speed in motions.speeds]
    avoided = {id(m) for s in motions.speeds for m in motions.at[s] if found.severity(m)}
    states = {"random_states": np.array([len(each) for each in drawn]),
              "avoided_states": np.array([sum(id(m) in avoided for m in each) for each in drawn])}
    return new_dataset(variables(("motion", "speed"), data) | variables(("speed",), states), {
        "speed": variable("speed", ("speed",), np.array(motions.speeds)), "motion": list(rows)})


def _windows(found: _AtTorque, dataset: xr.Dataset) -> tuple[Window, ...]:
    """The ranges of speed that are equally to be avoided, in operation or after a load change alone."""
    motions, severity = found.motions, found.severity
    speeds, met = dataset["speed"].values, motions.operation()
    severities = np.array([[0 if m is None else severity(m) for m in row] for row in motions.named().values()])
    ranks, windows = motions.ranks(severity), []
    parts = runs(ranks)
    ends = [Edge(float(speeds[0])), *found.edges, Edge(float(speeds[-1]))]
    for part, (start, stop) in zip(parts, pairwise(ends), strict=True):
        first, last = part[0], part[-1]
        before, rank, after = ([0, *ranks, 0][i] for i in (first, first + 1, last + 2))
        if not rank:
            continue
        operation, own = rank > MOST_SEVERE, _severity_of(rank)
        whole = dataset.isel(speed=slice(first, last + 1))
        within = whole.isel(motion=slice(len(OPERATION)) if operation else slice(len(OPERATION), None))
        known = largest_factors(dataset.isel(motion=slice(len(OPERATION)) if operation else slice(None)))
        inner = range(max(first, 1), min(last, len(known) - 2) + 1)
        peaks = [i for i in inner if known[i - 1] < known[i] >= known[i + 1]]
        largest = sorted(sorted(peaks, key=lambda i: -known[i])[:MOST_PEAKS])
        weights, speeds_within = weights_of(whole), speeds[first : last + 1].tolist()
        free = [i for i in range(last + 1 - first) if operation and any(severity(m) < own for m in met[first + i])]
        history = (start.speed if free[0] == 0 else speeds_within[free[0] - 1],
                   stop.speed if free[-1] == last - first else speeds_within[free[-1] + 1]) if free else None
        rows = zip(dataset["motion"].values.tolist(), severities[:, first : last + 1] > 0,
                   whole["dynamic_factor"].values, strict=True)
        reached = [Reached(MOTIONS[name], float(weights[avoided].sum() / weights.sum()), float(factors[avoided].max()))
                   for name, avoided, factors in rows if avoided.any()]
        own_range, beyond = speed_range(within), within["beyond_the_teeth"].values
        anyhow = speed_range(whole)
        worse = operation and anyhow.dynamic_factor > np.nan_to_num(own_range.dynamic_factor)
        borne = within["contact"].values[~beyond].max(initial=0)
        windows.append(Window(
            start.speed, stop.speed, own_range.dynamic_factor, own_range.speed_of_largest,
            start.resolution * (rank > before), stop.resolution * (rank > after), reached=tuple(reached),
            operation=operation, criterion=_CRITERIA[own],
            contact=CONTACT_WORDS[borne] if np.isfinite(own_range.dynamic_factor) else BEYOND,
            beyond_the_teeth=bool(whole["beyond_the_teeth"].values.any()), hits=found.hits(own_range.dynamic_factor),
            from_scan_start=first == 0, to_scan_end=last == len(speeds) - 1, begins_with=start.kind,
            ends_with=stop.kind, meshes=found.meshes(first, last, own), history=history,
            random_states=RandomStates.of(whole),
            peaks=tuple(Peak(float(speeds[i]), float(known[i])) for i in largest),
            largest_after_load_change=Peak(anyhow.speed_of_largest, anyhow.dynamic_factor) if worse else None))
    return tuple(windows)
