"""The search of the speeds to avoid at several torques: motions, the edges between them, and its price."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import cast

import numpy as np

from gearchaos.continuation.natural import Follower, PathEnd
from gearchaos.errors import InputError
from gearchaos.execute.machine import check_memory
from gearchaos.flow import DIVERGED_AT
from gearchaos.gears.operation.operating import gears_of
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.cost import MAX_STEPS, Cost, TooManyStepsError
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.operation.beyond_the_teeth import TeethLimits
from gearchaos.studies.operation.factor_context import peak_root_stress
from gearchaos.studies.operation.followed_motions import (
    MOST_SEVERE,
    MOST_SPEEDS,
    WITHIN,
    FollowedMotions,
    Motion,
    brief_settings,
    parts_between,
    run_searches,
)
from gearchaos.studies.operation.knocks import Knock, find_knocks
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studies.operation.severities import SUDDEN
from gearchaos.studies.operation.window_edges import Bracket, MotionPath, continue_orbits, locate_edges
from gearchaos.studies.speeds.criteria import Criteria
from gearchaos.studies.speeds.speed_windows import Jump

_TRIAL_SPEEDS = 4  # least number of speeds at which a trial of a search looks for motions, at each torque
_UNLIKE_SPEEDS = 12  # least number of them where motions differ in kind
_IRREGULAR = 100  # states that take as long as one from which a motion to avoid does not repeat
_MOST_DEFLECTION = DIVERGED_AT / 100  # in half backlashes at rest; motions about a larger one may count as diverged
_MOST_RETURNS = 4  # times that the search goes on from motions that were lost


@dataclass
class AtTorque:
    """The motions of gears at one torque, and what the teeth bear. ``ratio`` is the quasi-static one, NaN for a
    train."""

    criteria: Criteria
    motions: FollowedMotions
    ratio: float
    limits: TeethLimits
    root: float | None = None  # the larger nominal root stress at rest, N/mm²
    edges: list[PathEnd] = field(default_factory=list)  # between the runs of speeds of one criterion
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
        """Whether a force is above the limit that is given, or without one above that of a load put on at once, twice
        the static force."""
        limit = self._given if np.isfinite(self._given) else SUDDEN * np.nan_to_num(self.ratio, nan=1.0)
        return bool(dynamic_factor > limit)

    def beyond(self, motion: Motion) -> bool:
        """Whether teeth cannot bear it."""
        return bool(self.limits.exceeded(motion.dynamic_factor, motion.deflection))

    def criterion(self, motion: Motion) -> int:
        """The index into `CRITERIA`; a motion that diverges exceeds every limit."""
        high = motion.dynamic_factor > self.limit or self.beyond(motion)
        return 2 if self.criteria.separation and motion.contact > 0 else int(high)

    def meshes(self, first: int, last: int, own: int) -> tuple[str, ...]:
        """The names of the meshes of a train at which the teeth separate in a range of speeds."""
        found = [m.meshes for s in self.motions.speeds[first : last + 1] for m in self.motions.at[s]
                 if self.criterion(m) >= own and m.meshes]
        names = getattr(self.motions.model, "mesh_names", ())
        return tuple(name for k, name in enumerate(names) if any(contacts[k] > 0 for contacts in found))

    @property
    def good(self) -> list[float]:
        """The speeds at which neither operation nor a load change meets a motion to avoid."""
        return [s for s, rank in zip(self.motions.speeds, self.motions.ranks(self.criterion), strict=True) if not rank]

    def brackets(self) -> list[Bracket]:
        """The edges between neighbouring speeds of different ranks.

        A motion met in operation at one of them may remain at the other after a load change alone. It does not end
        between them: operation comes to another motion, and the edge is known as well as the speeds are apart.
        """
        out, speeds, found = [], self.motions.speeds, self.motions.ranks(self.criterion)
        met = self.motions.operation()
        for i, (a, b) in enumerate(pairwise(found)):
            if a != b:
                inner, outer = i + (b > a), i + (a > b)
                inside, outside, worst = speeds[inner], speeds[outer], max(a, b)
                motions, least = self.motions.at[inside], criterion_of(worst)

                def as_severe(motion: Motion, least: int = least) -> int:
                    return int(self.criterion(motion) >= least)

                if worst > MOST_SEVERE and min(a, b):
                    motions = [m for m in met[inner] if not as_severe(m.leads_to[outside])]
                out.append(Bracket(
                    self.motions.torque, inside, outside, motions, self.motions.at[outside], as_severe,
                    PathEnd(inside, "", abs(outside - inside))))
        return out

    def left_behind(self) -> list[tuple[MotionPath, str, Motion]]:
        """The orbits that slow sweeps leave for good, with the direction of the sweep and the motion reached."""
        out, motions, rows = [], self.motions, self.motions.named()
        for direction, row, step in (("up", rows["rising"], 1), ("down", rows["falling"], -1)):
            for (motion, reached), (here, there) in zip(
                    pairwise(row[::step]), pairwise(motions.speeds[::step]), strict=True):
                if motion and reached and motion.period and reached.leads_to[here] is not motion:
                    out.append((MotionPath(motions.torque, here, there, motion), direction, reached))
        return out


def criterion_of(rank: int) -> int:
    """The criterion of a rank, see `FollowedMotions.ranks`."""
    return rank - MOST_SEVERE * (rank > MOST_SEVERE)


@dataclass(frozen=True)
class SpeedSearch:
    """A search of the speeds to avoid at several torques, None for that of the model, as work that has a price.

    A ``trial`` computes a number of its speeds alone.
    """

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
        return self.trial or sum(self._parts(self.criteria.spacing))

    def _parts(self, spacing: float) -> list[int]:
        """The numbers of speeds from each of those given to the next, with this largest distance."""
        return [parts_between(self.model, low, high, spacing) for low, high in pairwise(self.axis.values.tolist())]

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
        words = f"{starts} states at each speed (assess --starts {starts})"
        return words, replace(self, criteria=replace(self.criteria, starts=starts))

    def tells(self, found: list[AtTorque]) -> bool:
        """Whether the motions are of one kind at all speeds, or there are speeds enough to say how many are of each."""
        kinds = [{(each.criterion(m) > 0, m.period > 0) for m in motions} for each in found
                 for motions in each.motions.at.values()]
        return len(kinds) >= _UNLIKE_SPEEDS or all(kind == kinds[0] for kind in kinds)

    def needed(self, found: list[AtTorque]) -> float:
        """Speeds amid motions to avoid are `WITHIN` of each other, and not as close as elsewhere."""
        rarer = sum(self._parts(WITHIN)) / sum(self._parts(self.criteria.spacing))
        work, needed = 0.0, 0.0
        for each in found:
            for speed, motions in each.motions.at.items():
                avoided = [motion for motion in motions if each.criterion(motion)]
                states = len(each.motions.drawn.get(speed, ())) + _IRREGULAR * any(not m.period for m in avoided) + 1
                work, needed = work + states, needed + states * (rarer if avoided else 1.0)
        return needed / work

    def run(self, *, progress: bool = False, threads: int | None = None) -> list[AtTorque]:
        """What is found at each torque."""
        if not self.trial:
            return search_torques(self.model, self.axis.values.tolist(), self.torques, self.criteria,
                                  progress=progress, threads=threads)
        shares, criteria = (np.arange(self.trial) + 0.5) / self.trial, self.criteria
        ends = np.cumsum([0, *self._parts(criteria.spacing)])
        speeds = np.interp(shares * ends[-1], ends, self.axis.values).tolist()
        at = [_at_torque(self.model, torque, criteria) for torque in self.torques]
        run_searches([each.motions.add_random(speeds, each.criterion, criteria.starts, (criteria.seed,))
                      for each in at], self.model, criteria.settings, threads=threads)
        return at


def search_torques(
    model: MeshModel, speeds: Sequence[float], torques: Sequence[float | None], criteria: Criteria, *,
    progress: bool = False, threads: int | None = None,
) -> list[AtTorque]:
    """The motions at several torques side by side with their edges.

    Periodic motions that are lost between two speeds are followed by their orbits, and the search goes on from there.
    """
    at = [_at_torque(model, torque, criteria) for torque in torques]
    words = "motions from random states" if progress else None
    run_searches(
        [each.motions.search(speeds, each.criterion, each.limit, criteria.starts, criteria.seed, criteria.spacing)
         for each in at],
        model, criteria.settings, progress=words, threads=threads)
    for _ in range(_MOST_RETURNS):
        known = [sum(map(len, each.motions.at.values())) for each in at]
        continue_orbits(model, [each.motions for each in at])
        more = [each for each, count in zip(at, known, strict=True) if sum(map(len, each.motions.at.values())) > count]
        if not more:
            break
        run_searches([each.motions.refine(each.criterion, each.limit) for each in more], model, criteria.settings,
                     threads=threads)
    brackets = [each.brackets() for each in at]
    locate_edges(model, [edge for edges in brackets for edge in edges], criteria.settings, threads=threads)
    for each, edges in zip(at, brackets, strict=True):
        each.edges = [edge.found for edge in edges]
    swept = [each.left_behind() for each in at]
    ends = iter(Follower(model, "speed").ends([path.of_orbit for each in swept for path, *_ in each]))
    for each, left in zip(at, swept, strict=True):
        each.jumps = tuple(Jump(end.value, direction, end.kind, path.motion.dynamic_factor, reached.dynamic_factor)
                           for (path, direction, reached), (end, _) in zip(left, ends, strict=False))
        if criteria.knocks and not model.mesh_names:
            each.knocks, each.largest_knock = find_knocks(
                each.motions, each.good, each.criterion, each.beyond, criteria.settings, threads)
    return at


def _at_torque(model: MeshModel, torque: float | None, criteria: Criteria) -> AtTorque:
    """A model at a torque, before a search; raises `InputError` where the deflection alone comes near the bound of all
    motions."""
    model = model if torque is None else model.with_values({"torque": torque})
    system = switched_system(vary(model, {}))
    deflection = float(np.abs(system.static_force).max() / system.levels.max())
    if deflection > _MOST_DEFLECTION:
        raise InputError("torque", f"must deflect the teeth at rest by at most {_MOST_DEFLECTION:g} half backlashes",
                         f"{model.value('torque'):.6g} N m", f"It is about {deflection:.2g}: check the units.")
    gears, load = gears_of(model), model.value("torque") or 0.0
    root = peak_root_stress(gears, load, 1.0)
    if criteria.root_stress is not None and root is None:
        raise InputError("root_stress", "must be left out where the nominal root stress is not known",
                         criteria.root_stress, "It needs the drawing of a pair, a [design]. Or give factor.")
    return AtTorque(criteria, FollowedMotions(model, torque, criteria.draw),
                     quasi_static_ratio(model), TeethLimits.of(gears, load),
                     None if root is None else max(root))
