"""The edges of ranges of speed to avoid, at the ends of the periodic motions in them.

Orbits are followed along the speed side by side. Where stability changes the motion beyond is computed, and followed in
turn. A motion that does not repeat ends at no event of an orbit, unless it begins where another motion ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.events import BORDER_COLLISION, FOLD, GRAZE
from gearchaos.continuation.natural import LIMIT, End, Follower, Orbits, Path
from gearchaos.dynamics import Classification
from gearchaos.dynamics.orbits import sections
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.operation.followed_motions import Asked, FollowedMotions, Motion, Severity, classified

_BEYOND = 2e-4  # how far beyond a change of stability the motion is computed, as a share of the speed
_COARSE = 2e-4  # to this share of the speed the end of a motion that does not repeat is located
_ROUNDS = 40  # most motions that are followed one after another at an edge


@dataclass
class Sought:
    """An edge that is sought at a torque: between a speed ``inside`` the range and one ``outside``, with the motions of
    both. ``found`` is the one that is furthest outside so far."""

    torque: float | None
    inside: float
    outside: float
    motions: Sequence[Motion]
    beyond: Sequence[Motion]
    severity: Severity
    found: End

    def reach(self, end: End) -> None:
        """Take the end of a motion for the edge, unless it is further inside than that found so far."""
        if (end.value - self.found.value) * (self.outside - self.inside) >= 0:
            self.found = end


class Way(NamedTuple):
    """The way of a motion at a torque from one speed to another, as long as the severity is that of ``avoided``, if one
    is given."""

    torque: float | None
    speed: float
    until: float
    motion: Motion
    severity: Severity = lambda _: 1
    avoided: bool = True

    @property
    def path(self) -> Path:
        """It as that of an orbit."""
        def holds(orbits: Orbits, index: int) -> bool:
            return (self.severity(continued(orbits, index, self.motion)) > 0) == self.avoided

        return Path(_fixed(self.torque), self.speed, self.until, self.motion.period, self.motion.w, holds)


def _fixed(torque: float | None) -> dict[str, float]:
    """The parameters besides the speed, that of the model for None."""
    return {} if torque is None else {"torque": torque}


def continued(orbits: Orbits, index: int, before: Motion) -> Motion:
    """An orbit as a motion, the continuation of one before."""
    return replace(before, contact=int(orbits.contact[index]), dynamic_factor=float(orbits.factor[index]),
                   compression=float(orbits.compression[index]), meshes=orbits.meshes[index].tolist(),
                   deflection=float(orbits.deflection[index]), w=orbits.w[:, index].copy(), leads_to={})


def continue_orbits(model: MeshModel, torques: Sequence[FollowedMotions]) -> None:
    """Add the motions that are lost on the way to a neighbouring speed, but whose orbits go on there."""
    pending = [(motions, here, there, motion) for motions in torques
               for here, there in _neighbours(motions.speeds) for motion in motions.at[here]
               if motion.period and motion.leads_to[there].leads_to.get(here) is not motion]
    while pending:
        found, goes_on = Follower(model, "speed").goes_on(
            [Way(motions.torque, here, there, motion).path for motions, here, there, motion in pending])
        following = []
        for i in np.flatnonzero(goes_on).tolist():
            motions, here, there, motion = pending[i]
            reached = continued(found, i, motion)
            if not found.shorter[i]:
                reached = _added(model, motions, there, reached)
                motion.leads_to[there] = reached
                reached.leads_to[here] = motion
                at = motions.speeds.index(there) + (1 if there > here else -1)
                if 0 <= at < len(motions.speeds) and motions.speeds[at] not in reached.leads_to:
                    following.append((motions, there, motions.speeds[at], reached))
        pending = following


def _neighbours(speeds: Sequence[float]) -> list[tuple[float, float]]:
    """All pairs of neighbouring speeds, in both directions."""
    pairs = list(pairwise(speeds))
    return [*pairs, *((b, a) for a, b in pairs)]


def _added(model: MeshModel, motions: FollowedMotions, speed: float, motion: Motion) -> Motion:
    """A motion among those of its speed: the same one that is known, or itself, which is new."""
    values = {n: np.array([v]) for n, v in ({"speed": speed} | _fixed(motions.torque)).items()}
    flow = initial_value_problems(model, values, coordinates(vary(model, {}))).flow
    (points,) = sections(flow, motion.w[:, None], np.zeros(1, int), np.array([motion.period]))
    motion.centre = points[:, :2].mean(axis=0).tolist()
    for known in motions.at[speed]:
        if known.same(motion):
            return known
    motions.at[speed].append(motion)
    return motion


def locate_edges(
    model: MeshModel, edges: Sequence[Sought], settings: Classification, *, threads: int | None = None
) -> None:
    """Locate edges, each as far outside as a motion to be avoided is found by following those inside.

    A motion that does not repeat is bisected by computing it at speeds in between; where it begins with the end of a
    motion from beyond, that is the edge.
    """
    follower = Follower(model, "speed")
    open_ = [(edge, Way(edge.torque, edge.inside, edge.outside, motion, edge.severity)) for edge in edges
             for motion in edge.motions if edge.severity(motion)]
    for _ in range(_ROUNDS):
        repeating = [pair for pair in open_ if pair[1].motion.period]
        trials = [(edge, way, (way.until + way.speed) / 2, way.motion.w) for edge, way in open_
                  if not way.motion.period]
        for edge, way, *_ in trials:
            edge.reach(End(float(way.speed), "", float(abs(way.until - way.speed))))
        trials = [trial for trial in trials if abs(trial[2] - trial[1].speed) > _COARSE * trial[2]]
        for (edge, way), (end, w) in zip(repeating, follower.ends([w.path for _, w in repeating]), strict=True):
            at = end.value * (1 + _BEYOND * np.sign(way.until - way.speed))
            goes_on = end.kind not in (GRAZE, BORDER_COLLISION, LIMIT) and (
                way.until - at) * (way.until - way.speed) > 0
            edge.reach(end if end.kind == FOLD or not goes_on else end._replace(
                resolution=float(abs(at - end.value))))
            if goes_on:
                trials.append((edge, way, at, w))
        if not trials:
            break
        found = classified(model, [Asked(way.torque, np.array([at]), w[:, None]) for _, way, at, w in trials],
                           settings, None, threads)
        open_ = []
        for (edge, way, at, _), (motion,) in zip(trials, found, strict=True):
            if edge.severity(motion):
                open_.append((edge, way._replace(speed=at, motion=motion)))
            elif not way.motion.period:  # it has ended before
                open_.append((edge, way._replace(until=at)))
    back = [(edge, Way(edge.torque, edge.outside, edge.inside, motion, edge.severity, False)) for edge in edges
            if not edge.found.kind for motion in edge.beyond if motion.period and not edge.severity(motion)]
    for (edge, _), (end, _) in zip(back, follower.ends([way.path for _, way in back]), strict=True):
        if end.kind and abs(end.value - edge.found.value) <= 2 * edge.found.resolution:
            edge.found = end
