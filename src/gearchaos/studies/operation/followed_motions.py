"""The motions that are found along the speed, and to which of them each leads when the speed changes slowly.

Other speeds are computed between those given, so that the edges of ranges to avoid and peaks beside them are located.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby, pairwise
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.execute import tiles
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.initial_value_problems import Motions, initial_states, initial_value_problems
from gearchaos.studies.motion.batch_classification import SAME_CENTRE, classify_batch, signature
from gearchaos.studies.operation.known_orbits import LONGEST_ORBIT, reach
from gearchaos.studies.operation.load_change import REVERSAL, StateSampler

_BRIEF = 1000
"""Longest transient, mesh periods, after which a chaotic motion counts as one that is known with its contact state at
its speed; where none is known it is followed as long as the settings say."""

_MOMENT = 2000  # motions that are classified in about a second, without a bar; ten times as many reach known orbits
MOST_SPEEDS = 4000  # most speeds that are computed
RESOLUTION = 0.005  # share of the speed to which edges and peaks are located
_FEWER = 8  # as many times fewer random states where a motion to be avoided is known, and again if it does not repeat
WITHIN = 0.01  # largest distance of speeds amid motions to be avoided, as a share of the speed
_NEXT_TO_END = 4  # speeds of a range to avoid, next to each of its ends, with as many random states as elsewhere
STEPS_PER_BANDWIDTH = 4
"""Least number of the first speeds in the half-power bandwidth of a resonance, 2ζ of its speed for each order."""

_MARGIN = 2.0
"""How many times as far as from its neighbour's a peak of the compression or force may rise between two speeds."""


@dataclass
class Motion:
    """One of the motions of a speed."""

    label: int
    period: int  # in mesh periods, 0 where there is none
    contact: int  # index into `CONTACTS`
    dynamic_factor: float  # peak of the mesh force over the static one; NaN if the motion diverges
    compression: float  # least deflection of the teeth, in half backlashes, 0 or less where they separate; NaN likewise
    centre: Sequence[float]  # mean of z and z' over the stroboscopic points of an orbit; 0 for other motions
    w: np.ndarray  # (d,), a state on it at phase 0
    meshes: Sequence[int] = ()  # the contact of each mesh of a train
    deflection: float = 0.0  # the largest of the teeth on either flank, in half backlashes; NaN likewise
    factors: Sequence[float] = ()  # the dynamic factor of each mesh of a train, NaN without static load
    leads_to: dict[float, Motion] = field(default_factory=dict)  # the motion it becomes when the speed changes to this

    @property
    def diverged(self) -> bool:
        """Whether it leaves every bound."""
        return self.label == Label.DIVERGED

    def same(self, other: Motion) -> bool:
        """Whether two motions of one speed are the same: orbits by their centre, others by their contact state."""
        return other is self or (
            (self.label, self.period, self.contact) == (other.label, other.period, other.contact)
            and all(abs(a - b) < SAME_CENTRE for a, b in zip(self.centre, other.centre, strict=True)))


class Request(NamedTuple):
    """Motions to be classified, from states w (d, L) at speeds (L,). A chaotic one is followed for `_BRIEF` periods at
    most if they are ``brief``. One that reaches an orbit ``known`` at its speed is that motion."""

    torque: float | None  # that of the model for None
    speed: np.ndarray
    w: np.ndarray
    brief: bool = False
    random: bool = False  # whether from random states
    known: Mapping[float, Sequence[Motion]] = MappingProxyType({})


Seed = tuple[int, ...]  # of random states: that of the search, and which of its draws
_T = TypeVar("_T")
Search = Generator[Request, list["Motion"], _T]
"""A search that asks for motions, is sent them classified, and returns a value at its end."""


def run_searches(
    searches: Iterable[Search[_T]], model: MeshModel, settings: Classification, *, progress: str | None = None,
    threads: int | None = None,
) -> list[_T]:
    """Run searches at several torques: what all of them ask for next is classified in one batch.

    The motions are those of the model at the torques and speeds of the requests. The progress is that of motions from
    random states, which take the most time.
    """
    running, done = dict(enumerate(searches)), dict[int, _T]()
    answers: dict[int, list[Motion] | None] = dict.fromkeys(running)
    brief = brief_settings(settings)
    while answers:
        requests: dict[int, Request] = {}
        for i, answer in answers.items():
            try:
                requests[i] = running[i].send(answer)  # type: ignore[arg-type]  # None begins it
            except StopIteration as end:
                done[i] = end.value
        answers = {}
        for short in (True, False):
            group = {i: each for i, each in requests.items() if each.brief == short}
            if group:
                words = progress if any(each.random for each in group.values()) else None
                found = classified(model, list(group.values()), brief if short else settings, words, threads)
                answers |= dict(zip(group, found, strict=True))
    return [done[i] for i in running]


def classified(
    model: MeshModel, requests: Sequence[Request], settings: Classification, progress: str | None, threads: int | None
) -> list[list[Motion]]:
    """The motions of each of several requests."""
    names, sizes = coordinates(vary(model, {})), [len(each.speed) for each in requests]
    speed, w = (np.concatenate([getattr(each, name) for each in requests], axis=-1) for name in ("speed", "w"))
    values = {"speed": speed}
    if requests[0].torque is not None:
        values["torque"] = np.repeat([each.torque for each in requests], sizes)
    orbits = [{s: [m for m in each.known.get(s, ()) if 0 < m.period <= LONGEST_ORBIT] for s in set(each.speed.tolist())}
              for each in requests]
    known = [of_speed[s] for each, of_speed in zip(requests, orbits, strict=True) for s in each.speed.tolist()]
    motions: list[Motion | None] = [None] * len(speed)

    def started(number: np.ndarray) -> Motions:
        different, points = np.unique([v[number] for v in values.values()], axis=1, return_inverse=True)
        flow = initial_value_problems(model, dict(zip(values, different, strict=True)), names).flow
        return Motions(flow, w[:, number].copy(), points)

    def follow(tile: slice) -> None:
        number = near[tile]
        followed = started(number)
        at_point = [known[number[i]] for i in np.unique(followed.points, return_index=True)[1]]
        for i, point, reached in zip(number, followed.points, reach(followed, at_point), strict=True):
            motions[i] = at_point[point][reached] if reached >= 0 else None
        w[:, number] = followed.w

    point = np.unique([*values.values()], axis=1, return_inverse=True)[1]
    order = np.argsort(point, kind="stable")
    near, kept = order[[bool(known[i]) for i in order]], started(order[:1]).flow.points_kept
    words = f"{progress}, to known orbits" if progress and len(near) > 10 * _MOMENT else None
    shares = tiles.split_points(point[near], kept, threads=threads) if kept else tiles.split(len(near), threads=threads)
    for _ in tiles.run(follow, shares, progress=words, threads=threads):
        pass
    others = np.array([i for i in order if motions[i] is None], int)

    def collect(_: np.ndarray, final: Motions, found: Verdicts) -> dict[str, np.ndarray]:
        return {
            **signature(final, found), "dynamic_factor": found.variables()["dynamic_factor"],
            "compression": found["compression"], "deflection": found["deflection"], "w": found.w.T,
            "meshes": found["mesh_contact"], "factors": found["mesh_dynamic_factor"],
        }

    if len(others):
        found: dict[str, Any] = classify_batch(
            lambda number: started(others[number]), collect, np.arange(len(others)), settings=settings,
            points=point[others], kept=kept, progress=progress if len(others) > _MOMENT else None, threads=threads)
        columns = ("label", "period", "contact", "dynamic_factor", "compression", "deflection", "centre_z",
                   "centre_z_dot")
        for i, label, period, contact, factor, compression, deflection, *centre, state, meshes, factors in zip(
                others, *(found[n].tolist() for n in columns), found["w"], found["meshes"].tolist(),
                found["factors"].tolist(), strict=True):
            motions[i] = Motion(label, period, contact, factor, compression, centre, state, meshes, deflection, factors)
    ends = np.cumsum(sizes).tolist()
    return [cast("list[Motion]", motions[end - size : end]) for size, end in zip(sizes, ends, strict=True)]


def brief_settings(settings: Classification) -> Classification:
    """The settings for motions of which a chaotic one is followed no longer than `_BRIEF` periods."""
    return replace(settings, longest_transient=min(_BRIEF, settings.longest_transient))


def fewer(starts: int, times: int = 1) -> int:
    """An eighth of the random states, or an eighth of that, but at least one."""
    return -(-starts // _FEWER**times)


def parts_between(model: MeshModel, low: float, high: float, spacing: float) -> int:
    """The number of parts into which two speeds are divided at first, for the damping and a largest spacing."""
    least = 0.0 if model.mesh_names else model.zeta * (model.value("speed") or 0.0) / model.omega
    step = min(max(step_at_resonance(model, high), RESOLUTION), spacing)
    return math.ceil((high - low) / (step * max(low, least)))


def step_at_resonance(model: MeshModel, speed: float) -> float:
    """The largest distance of speeds at which no resonance is passed, as a share of the speed; ∞ where none is met up
    to this speed."""
    return 2 * model.zeta / STEPS_PER_BANDWIDTH if model.resonates(speed) else math.inf


class FollowedMotions:
    """The motions found at speeds that are added one after another, at one torque.

    ``speeds`` are in rising order, rpm; ``at`` has the motions of each, the one from rest first, and ``drawn`` those
    that the random states of a speed lead to, one for each state. The model has a parameter ``speed``, and the
    ``torque`` of the motions if one is given. The methods that compute are searches for `run_searches`.
    """

    def __init__(self, model: MeshModel, torque: float | None = None, draw: StateSampler = REVERSAL) -> None:
        self.model, self.torque, self._draw = model, torque, draw
        self._names = coordinates(vary(model, {}))
        self.speeds: list[float] = []
        self.at: dict[float, list[Motion]] = {}
        self.drawn: dict[float, list[Motion]] = {}

    def add(self, speeds: Sequence[float], starts: int = 0, seed: Seed = ()) -> Search[None]:
        """Add speeds, with the motions from the initial values of the model, and those from ``starts`` random states.

        Every motion is then followed to both neighbouring speeds, and those found there further, until none is new.
        """
        new = np.array(sorted(set(speeds) - set(self.speeds)))
        if len(new):
            yield from self._add(new, initial_states(self.model, {"speed": new}, self._names))
            self.speeds = sorted(self.at)
        if starts and speeds:
            factors = [self.at[s][0].dynamic_factor for s in speeds]
            each = np.repeat(speeds, starts)
            w = self._draw(self.model, {"speed": np.array(speeds)}, factors, starts, seed)
            for speed, motion in zip(each.tolist(), (yield from self._add(each, w, random=True)), strict=True):
                self.drawn.setdefault(speed, []).append(motion)
        pairs = [*pairwise(self.speeds), *((there, here) for here, there in pairwise(self.speeds))]
        while pending := [(motion, there) for here, there in pairs for motion in self.at[here]
                          if there not in motion.leads_to]:
            at = np.array([speed for _, speed in pending])
            found = yield from self._add(at, np.stack([motion.w for motion, _ in pending], axis=1))
            for (motion, speed), reached in zip(pending, found, strict=True):
                motion.leads_to[speed] = self.at[speed][0] if motion.diverged else reached

    def search(
        self, speeds: Sequence[float], criterion: Criterion, limit: float, starts: int, seed: int, spacing: float
    ) -> Search[None]:
        """Add speeds, others between them, and more until edges and peaks are located or there are `MOST_SPEEDS`.

        Of the others there are as many equidistant ones between two as resonances of the damping ask for; next to a
        speed without a motion to be avoided they are no further apart than the ``spacing``, as a share of the speed,
        elsewhere than `WITHIN`, since a range in which every motion keeps contact may lie between. Resonances have the
        same relative width at 1/n of the natural frequency for every n. Where ω < ζ a vibration is over within a mesh
        period: none of them stands out.
        ``limit`` is that of the dynamic factor.
        """
        yield from self.add_random(speeds, criterion, starts, (seed, 0))
        more = list[float]()
        for low, high in pairwise(self.speeds):
            free = not all(any(map(criterion, self.at[end])) for end in (low, high))
            more += np.linspace(low, high, parts_between(self.model, low, high, spacing if free else WITHIN) + 1)[
                1:-1].tolist()
        yield from self.add_random(more, criterion, starts, (seed, 1))
        yield from self.refine(criterion, limit)
        yield from self._draw_in_ranges(criterion, starts, seed)
        yield from self.refine(criterion, limit)

    def add_random(self, speeds: Sequence[float], criterion: Criterion, starts: int, seed: Seed) -> Search[None]:
        """Add speeds with random states: an eighth of ``starts`` where a motion to be avoided is known, and an eighth
        of that where one does not repeat, which takes as long as a hundred others."""
        yield from self.add(speeds, fewer(starts, 2), (*seed, 0))
        regular = self._regular(speeds, criterion)
        yield from self.add(regular, fewer(starts) - fewer(starts, 2), (*seed, 1))
        free = [s for s in regular if not any(map(criterion, self.at[s]))]
        yield from self.add(free, starts - fewer(starts), (*seed, 2))

    def _regular(self, speeds: Iterable[float], criterion: Criterion) -> list[float]:
        """The speeds at which every known motion to be avoided repeats."""
        return [s for s in speeds if all(m.period for m in self.at[s] if criterion(m))]

    def _draw_in_ranges(self, criterion: Criterion, starts: int, seed: int) -> Search[None]:
        """Add random states to each range to be avoided: at speeds throughout it if it has fewer than ``starts`` and
        than 64, and as many as elsewhere next to its ends. Another motion may reach beyond these."""
        chosen, ends, least = list[float](), set[float](), min(starts, _FEWER**2)
        for run in runs(self.ranks(criterion)):
            inside = [self.speeds[i] for i in run]
            if any(map(criterion, self.at[inside[0]])):
                if sum(len(self.drawn.get(s, ())) for s in inside) < least:
                    chosen += [min(inside, key=lambda s: abs(s - at)) for at in np.linspace(
                        inside[0], inside[-1], _FEWER)]
                ends.update(inside[:_NEXT_TO_END], inside[-_NEXT_TO_END:])
        yield from self.add(chosen, fewer(least), (seed, 2))
        yield from self.add(sorted(self._regular(ends, criterion)), starts, (seed, 3))

    def refine(self, criterion: Criterion, limit: float) -> Search[None]:
        """Add speeds until edges and peaks are located, and follow motions that were added to both neighbours."""
        yield from self.add(())
        while (room := MOST_SPEEDS - len(self.speeds)) > 0 and (new := speeds_between(self, criterion, limit)):
            yield from self.add(new[:room])

    def operation(self) -> list[list[Motion]]:
        """The motions that operation meets at each speed: from rest at any speed, and those that each of them becomes
        as the speed rises or falls slowly, in any order."""
        met = {s: {id(self.at[s][0]): self.at[s][0]} for s in self.speeds}
        ways, size = (self.speeds, self.speeds[::-1]), 0
        while size < (size := sum(map(len, met.values()))):
            for here, there in (pair for speeds in ways for pair in pairwise(speeds)):
                met[there] |= {id(m): m for m in (known.leads_to[there] for known in met[here].values())}
        return [[*each.values()] for each in met.values()]

    def ranks(self, criterion: Criterion) -> list[int]:
        """How strongly each speed is to be avoided: the largest criterion of its motions; where operation meets one to
        avoid, `MOST_SEVERE` and the criterion of that."""
        met = [max(map(criterion, motions)) for motions in self.operation()]
        return [MOST_SEVERE + own if own else max(map(criterion, self.at[s]))
                for own, s in zip(met, self.speeds, strict=True)]

    def named(self) -> dict[str, list[Motion | None]]:
        """The motions at each speed: from rest, passed by sweeps from rest, the worst of the others that operation
        meets, and the worst of all others, each None where there is none."""
        swept: list[list[Motion | None]] = []
        for speeds in (self.speeds, self.speeds[::-1]):
            passed = [self.at[speeds[0]][0]]
            for speed in speeds[1:]:
                passed.append(passed[-1].leads_to[speed])
            swept.append([*passed])
        rest: list[Motion | None] = [self.at[s][0] for s in self.speeds]
        rows = {"rest": rest, "rising": swept[0], "falling": swept[1][::-1]}
        met = self.operation()
        for name, known, without in (
                ("changing", met, list(zip(*rows.values(), strict=True))),
                (OTHER, [self.at[s] for s in self.speeds], met)):
            left = [[m for m in motions if all(m is not each for each in named)]
                    for motions, named in zip(known, without, strict=True)]
            rows[name] = [max(each, key=lambda m: (m.contact, np.inf if m.diverged else m.dynamic_factor), default=None)
                          for each in left]
        return rows

    def _add(self, speeds: np.ndarray, w: np.ndarray, random: bool = False) -> Search[list[Motion]]:
        """Add the motions from states w (d, L) at speeds (L,); returns them, or the same ones that are known."""
        found, at = (yield Request(self.torque, speeds, w, True, random, self.at)), speeds.tolist()
        first: dict[tuple[float, int], int] = {}  # of the chaotic motions that look the same, and like none known
        for i, (speed, motion) in enumerate(zip(at, found, strict=True)):
            if motion.label == Label.CHAOTIC and not any(motion.same(known) for known in self.at.get(speed, ())):
                first.setdefault((speed, motion.contact), i)
        if first:
            longer = list(first.values())
            w = np.stack([found[i].w for i in longer], axis=1)
            settled = dict(zip(first, (yield Request(self.torque, speeds[longer], w, False)), strict=True))
            found = [settled.get((speed, motion.contact), motion) if motion.label == Label.CHAOTIC else motion
                     for speed, motion in zip(at, found, strict=True)]
        reached = []
        for speed, motion in zip(at, found, strict=True):
            known = self.at.setdefault(speed, [])
            same = next((each for each in known if each.same(motion)), None)
            if same is None:
                known.append(same := motion)
            elif not motion.period and motion.dynamic_factor > same.dynamic_factor:  # another part of a motion
                same.dynamic_factor = motion.dynamic_factor
            reached.append(same)
        return reached


Criterion = Callable[[Motion], int]
"""How strongly a speed is to be avoided for a motion: 0 for a motion that is no reason to, at most `MOST_SEVERE`."""
MOST_SEVERE = 2
OTHER = "other"
"""The name of the motions that operation does not meet."""


def speeds_between(motions: FollowedMotions, criterion: Criterion, limit: float) -> list[float]:
    """Speeds in the middle between two that are further apart than the resolution, where one of these holds:

    - one is to be avoided, the other not, or for another reason;
    - both are to be avoided, but no such motion of one leads to such a motion of the other;
    - a motion of one is lost on the way to the other, and might come to separate if followed in smaller steps;
    - the teeth might separate at a peak between them, or the force exceed the limit;
    - the largest force of a range to be avoided is at one of them.
    """
    speeds, avoided = motions.speeds, motions.ranks(criterion)
    chosen = set()
    for i, (low, high) in enumerate(pairwise(speeds)):
        ways = [(m, m.leads_to[there], here) for here, there in ((low, high), (high, low)) for m in motions.at[here]]
        stays = any(criterion(motion) and criterion(reached) for motion, reached, _ in ways)
        returns = all(reached.leads_to[here] is motion for motion, reached, here in ways)
        if avoided[i] != avoided[i + 1] or not (stays if avoided[i] else returns):
            chosen.add(i)
    least = np.array([min((m.compression for m in motions.at[s] if not m.diverged), default=np.nan) for s in speeds])
    most = np.array([max((m.dynamic_factor for m in motions.at[s] if not m.diverged), default=np.nan) for s in speeds])
    free = np.array([not each for each in avoided])
    tips = _near_tips(-least, 0.0, free) | _near_tips(most, limit, free)
    for run in runs(avoided):
        if avoided[run[0]] and np.isfinite(most[run]).any():
            tips.add(run[int(np.nanargmax(most[run]))])
    chosen |= {j for i in tips for j in (i - 1, i) if 0 <= j < len(speeds) - 1}
    return [(speeds[i] + speeds[i + 1]) / 2 for i in sorted(chosen)
            if speeds[i + 1] - speeds[i] > RESOLUTION * speeds[i]]


def _near_tips(values: np.ndarray, limit: float, free: np.ndarray) -> set[int]:
    """Local peaks of values (N,) at ``free`` speeds, between whose neighbours the values might exceed a limit."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    rise = values - np.fmin(padded[:-2], padded[2:])
    peak = (values >= padded[:-2]) & (values >= padded[2:]) & free
    return set(np.flatnonzero(peak & (values + _MARGIN * rise > limit)).tolist())


def runs(values: Sequence[int]) -> list[list[int]]:
    """The indices of equal consecutive values."""
    return [[i for i, _ in run] for _, run in groupby(enumerate(values), key=lambda pair: pair[1])]
