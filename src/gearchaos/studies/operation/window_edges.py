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
from gearchaos.continuation.natural import LIMIT, FollowedOrbits, Follower, Path, PathEnd
from gearchaos.dynamics import Classification
from gearchaos.dynamics.orbits import sections
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.initial_value_problems import initial_value_problems
from gearchaos.studies.operation.followed_motions import Criterion, FollowedMotions, Motion, Request, classified

_BEYOND = 2e-4  # how far beyond a change of stability the motion is computed, as a share of the speed
_COARSE = 2e-4  # to this share of the speed the end of a motion that does not repeat is located
_ROUNDS = 40  # most motions that are followed one after another at an edge


@dataclass
class Bracket:
    """Two speeds between which an edge is sought at a torque, one ``inside`` the range and one ``outside``, with the
    motions of both. ``found`` is the edge that is furthest outside so far."""

    torque: float | None
    inside: float
    outside: float
    motions: Sequence[Motion]
    beyond: Sequence[Motion]
    criterion: Criterion
    found: PathEnd

    def reach(self, end: PathEnd) -> None:
        """Take the end of a motion for the edge, unless it is further inside than that found so far."""
        if (end.value - self.found.value) * (self.outside - self.inside) >= 0:
            self.found = end


class MotionPath(NamedTuple):
    """The path of a motion at a torque from one speed to another. It ends where the motion is no longer to be avoided
    by the criterion, or begins to be if ``avoided`` is false."""

    torque: float | None
    speed: float
    until: float
    motion: Motion
    criterion: Criterion = lambda _: 1
    avoided: bool = True

    @property
    def of_orbit(self) -> Path:
        def holds(orbits: FollowedOrbits, index: int) -> bool:
            return (self.criterion(continued(orbits, index, self.motion)) > 0) == self.avoided

        return Path(_fixed(self.torque), self.speed, self.until, self.motion.period, self.motion.w, holds)


def _fixed(torque: float | None) -> dict[str, float]:
    """The parameters besides the speed, that of the model for None."""
    return {} if torque is None else {"torque": torque}


def continued(orbits: FollowedOrbits, index: int, before: Motion) -> Motion:
    """An orbit as a motion, the continuation of one before."""
    return replace(before, contact=int(orbits.contact[index]), dynamic_factor=float(orbits.factor[index]),
                   compression=float(orbits.compression[index]), meshes=orbits.meshes[index].tolist(),
                   factors=orbits.mesh_factors[index].tolist(),
                   deflection=float(orbits.deflection[index]), w=orbits.w[:, index].copy(), leads_to={})


def continue_orbits(model: MeshModel, torques: Sequence[FollowedMotions]) -> None:
    """Add the motions that are lost on the path to a neighbouring speed, but whose orbits go on there."""
    pending = [(motions, here, there, motion) for motions in torques
               for here, there in [*pairwise(motions.speeds), *((b, a) for a, b in pairwise(motions.speeds))]
               for motion in motions.at[here]
               if motion.period and motion.leads_to[there].leads_to.get(here) is not motion]
    while pending:
        found, goes_on = Follower(model, "speed").goes_on(
            [MotionPath(motions.torque, here, there, motion).of_orbit for motions, here, there, motion in pending])
        following = []
        for i in np.flatnonzero(goes_on).tolist():
            motions, here, there, motion = pending[i]
            reached = continued(found, i, motion)
            if not found.shorter[i]:
                values = {n: np.array([v]) for n, v in ({"speed": there} | _fixed(motions.torque)).items()}
                flow = initial_value_problems(model, values, coordinates(vary(model, {}))).flow
                (points,) = sections(flow, reached.w[:, None], np.zeros(1, int), np.array([motion.period]))
                reached.centre = points[:, :2].mean(axis=0).tolist()
                known = next((each for each in motions.at[there] if each.same(reached)), None)
                if known is None:
                    motions.at[there].append(reached)
                motion.leads_to[there] = reached = known or reached
                reached.leads_to[here] = motion
                at = motions.speeds.index(there) + (1 if there > here else -1)
                if 0 <= at < len(motions.speeds) and motions.speeds[at] not in reached.leads_to:
                    following.append((motions, there, motions.speeds[at], reached))
        pending = following


def locate_edges(
    model: MeshModel, brackets: Sequence[Bracket], settings: Classification, *, threads: int | None = None
) -> None:
    """Locate edges, each as far outside as a motion to be avoided is found by following those inside.

    The end of a motion that does not repeat is bisected: it is computed at speeds in between. If a motion from beyond
    ends there, its end is the edge.
    """
    follower = Follower(model, "speed")
    open_ = [(edge, MotionPath(edge.torque, edge.inside, edge.outside, motion, edge.criterion)) for edge in brackets
             for motion in edge.motions if edge.criterion(motion)]
    for _ in range(_ROUNDS):
        repeating = [pair for pair in open_ if pair[1].motion.period]
        trials = [(edge, path, (path.until + path.speed) / 2, path.motion.w) for edge, path in open_
                  if not path.motion.period]
        for edge, path, *_ in trials:
            edge.reach(PathEnd(float(path.speed), "", float(abs(path.until - path.speed))))
        trials = [trial for trial in trials if abs(trial[2] - trial[1].speed) > _COARSE * trial[2]]
        ends = follower.ends([path.of_orbit for _, path in repeating])
        for (edge, path), (end, w) in zip(repeating, ends, strict=True):
            at = end.value * (1 + _BEYOND * np.sign(path.until - path.speed))
            goes_on = end.kind not in (GRAZE, BORDER_COLLISION, LIMIT) and (
                path.until - at) * (path.until - path.speed) > 0
            edge.reach(end if end.kind == FOLD or not goes_on else end._replace(
                resolution=float(abs(at - end.value))))
            if goes_on:
                trials.append((edge, path, at, w))
        if not trials:
            break
        found = classified(model, [Request(path.torque, np.array([at]), w[:, None]) for _, path, at, w in trials],
                           settings, None, threads)
        open_ = []
        for (edge, path, at, _), (motion,) in zip(trials, found, strict=True):
            if edge.criterion(motion):
                open_.append((edge, path._replace(speed=at, motion=motion)))
            elif not path.motion.period:  # it has ended before
                open_.append((edge, path._replace(until=at)))
    back = [(edge, MotionPath(edge.torque, edge.outside, edge.inside, motion, edge.criterion, False))
            for edge in brackets if not edge.found.kind for motion in edge.beyond
            if motion.period and not edge.criterion(motion)]
    for (edge, _), (end, _) in zip(back, follower.ends([path.of_orbit for _, path in back]), strict=True):
        if end.kind and abs(end.value - edge.found.value) <= 2 * edge.found.resolution:
            edge.found = end
