"""Periodic motions followed along the speed by their orbits, and the edges of ranges to avoid that lie at their ends.

A motion that few initial states reach is easily lost on the way to the next speed. Its orbit is not: Newton's method
follows it, all of them side by side, and the end of each is bisected to rounding errors: where it begins or ends, loses
stability, or is no longer to be avoided. Where stability changes the motion beyond is computed, and followed in turn. A
motion that does not repeat ends at no event of an orbit, unless it begins where another motion ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.events import BORDER_COLLISION, FLIP, FOLD, GRAZE, NEIMARK_SACKER
from gearchaos.dynamics import Classification
from gearchaos.dynamics.orbits import minimal_period, polish, sections
from gearchaos.dynamics.response import compute_response
from gearchaos.flow import Measure
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.followed_motions import Asked, FollowedMotions, Motion, Severity, classified, largest_deflection
from gearchaos.studies.initial_value_problems import initial_value_problems

LIMIT = "limit of the factor"  # the kind of an edge at which a dynamic factor passes its limit
_BISECTIONS = 60
_PASSES = 12  # most times that a way is bisected, of which the end was none
_LOCATED = 1e-13  # width of the interval to which an edge is bisected, as a share of the speed
_REACH = 0.3  # largest change of a coordinate, in half backlashes, between neighbouring orbits of one branch
_MERGING = 1e-2  # largest change to an orbit of half the period: they merge
_CONTINUOUS = 1e-4  # largest change of a coordinate where only contact or force changes
_BEYOND = 2e-4  # how far beyond a change of stability the motion is computed, as a share of the speed
_COARSE = 2e-4  # to this share of the speed the end of a motion that does not repeat is located
_COMPLEX = 1e-6  # imaginary part from which a critical multiplier counts as complex
_CRITICAL = 1e-3  # largest distance of the modulus of a critical multiplier from 1 next to its event
_ROUNDS = 40  # most motions that are followed one after another at an edge
_PARTS = 4  # steps in which an orbit is followed to a neighbouring speed if it is lost at once


class Edge(NamedTuple):
    """An end of a range of speed, rpm, and the event of a motion at which it lies, "" for none.

    The true end lies at most ``resolution`` outside the range: where a motion that does not repeat ends.
    """

    speed: float
    kind: str = ""
    resolution: float = 0.0


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
    found: Edge

    def reach(self, end: Edge) -> None:
        """Take the end of a motion for the edge, unless it is further inside than that found so far."""
        if (end.speed - self.found.speed) * (self.outside - self.inside) >= 0:
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


@dataclass
class _Orbits:
    """L orbits: states (d, L), multipliers (L, d), contact states, dynamic factors, least compressions and largest
    deflections, (L,), contact states of the K meshes (L, K), and whether each has a shorter period than the motion that
    it is to continue."""

    w: np.ndarray
    multipliers: np.ndarray
    converged: np.ndarray
    stable: np.ndarray
    contact: np.ndarray
    factor: np.ndarray
    compression: np.ndarray
    deflection: np.ndarray
    meshes: np.ndarray
    shorter: np.ndarray

    def take(self, which: np.ndarray) -> _Orbits:
        """The orbits with these indices."""
        return _Orbits(*(getattr(self, f.name)[..., which] if f.name == "w" else getattr(self, f.name)[which]
                         for f in fields(self)))

    def put(self, which: np.ndarray, other: _Orbits) -> None:
        """Replace the orbits with these indices."""
        self.w[:, which] = other.w
        for each in fields(self)[1:]:
            getattr(self, each.name)[which] = getattr(other, each.name)

    def fails(self, near: np.ndarray, ways: Sequence[Way]) -> np.ndarray:
        """Why each orbit does not go on from the one in a state ``near``: 0 it does, 1 there is none, 2 it is unstable,
        3 it is to be avoided, or no longer."""
        distance = np.abs(self.w - near).max(axis=0)
        there = self.converged & (distance < np.where(self.shorter, _MERGING, _REACH))
        other = [(way.severity(self.motion(i, way.motion)) > 0) != way.avoided for i, way in enumerate(ways)]
        return np.select([~there, ~self.stable, np.array(other, bool)], [1, 2, 3], 0)

    def motion(self, number: int, before: Motion) -> Motion:
        """An orbit as a motion, the continuation of one before."""
        return replace(before, contact=int(self.contact[number]), dynamic_factor=float(self.factor[number]),
                       compression=float(self.compression[number]), meshes=self.meshes[number].tolist(),
                       deflection=float(self.deflection[number]), w=self.w[:, number].copy(), leads_to={})


def _orbits(model: MeshModel, ways: Sequence[Way], speed: np.ndarray, w: np.ndarray) -> _Orbits:
    """The orbits of L ways near states w (d, L) at speeds (L,)."""
    values = {"speed": speed}
    if ways[0].torque is not None:
        values["torque"] = np.array([way.torque for way in ways])
    flow = initial_value_problems(model, values, coordinates(vary(model, {}))).flow
    points, period = np.arange(len(speed)), np.array([way.motion.period for way in ways])
    found = polish(flow, np.ascontiguousarray(w), points, period, reach=2 * _REACH)
    state = np.ascontiguousarray(np.where(np.isfinite(found.w), found.w, w))
    measures = flow.advance(state, period, points=points, measured=True).measures
    response, meshes = compute_response(measures, period * flow.system.period, period, flow.system.static_force)
    return _Orbits(state, found.multipliers, found.converged, found.stable, response.contact.astype(int),
                   response.dynamic_factor, measures[Measure.Z_MIN] - 1, largest_deflection(measures),
                   meshes.mesh_contact, minimal_period(flow, state, points, period) < period)


def continue_orbits(model: MeshModel, torques: Sequence[FollowedMotions]) -> None:
    """Add the motions that are lost on the way to a neighbouring speed, but whose orbits go on there."""
    pending = [(motions, here, there, motion) for motions in torques
               for here, there in _neighbours(motions.speeds) for motion in motions.at[here]
               if motion.period and motion.leads_to[there].leads_to.get(here) is not motion]
    while pending:
        ways = [Way(motions.torque, here, there, motion) for motions, here, there, motion in pending]
        start, step = (np.array([way.speed for way in ways]), np.array([way.until - way.speed for way in ways]))
        first = np.stack([way.motion.w for way in ways], axis=1)
        found = _orbits(model, ways, start + step, first)
        lost = np.flatnonzero(found.fails(first, ways))
        state = first[:, lost]
        for part in range(1, _PARTS + 1):  # in smaller steps
            if len(lost):
                some = [ways[i] for i in lost]
                again = _orbits(model, some, start[lost] + step[lost] * part / _PARTS, state)
                kept = np.flatnonzero(again.fails(state, some) == 0)
                lost, state, again = lost[kept], again.w[:, kept], again.take(kept)
        if len(lost):
            found.put(lost, again)
        goes_on = found.fails(first, ways) == 0
        goes_on[lost] = True
        following = []
        for i in np.flatnonzero(goes_on).tolist():
            motions, here, there, motion = pending[i]
            reached = found.motion(i, motion)
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
    values = {"speed": np.array([speed])} | ({} if motions.torque is None else {"torque": np.array([motions.torque])})
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
    open_ = [(edge, Way(edge.torque, edge.inside, edge.outside, motion, edge.severity)) for edge in edges
             for motion in edge.motions if edge.severity(motion)]
    for _ in range(_ROUNDS):
        repeating = [pair for pair in open_ if pair[1].motion.period]
        trials = [(edge, way, (way.until + way.speed) / 2, way.motion.w) for edge, way in open_
                  if not way.motion.period]
        for edge, way, *_ in trials:
            edge.reach(Edge(float(way.speed), "", float(abs(way.until - way.speed))))
        trials = [trial for trial in trials if abs(trial[2] - trial[1].speed) > _COARSE * trial[2]]
        for (edge, way), (end, w) in zip(repeating, ends_of_orbits(model, [w for _, w in repeating]), strict=True):
            at = end.speed * (1 + _BEYOND * np.sign(way.until - way.speed))
            goes_on = end.kind not in (GRAZE, BORDER_COLLISION, LIMIT) and (
                way.until - at) * (way.until - way.speed) > 0
            edge.reach(end if end.kind == FOLD or not goes_on else end._replace(
                resolution=float(abs(at - end.speed))))
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
    for (edge, _), (end, _) in zip(back, ends_of_orbits(model, [way for _, way in back]), strict=True):
        if end.kind and abs(end.speed - edge.found.speed) <= 2 * edge.found.resolution:
            edge.found = end


def ends_of_orbits(model: MeshModel, ways: Sequence[Way]) -> list[tuple[Edge, np.ndarray]]:
    """Where each of K orbits ends on its way, is no longer stable, or is to be avoided or no longer.

    Returns the edge and the state of the last orbit. At the end of the way there is no event. The way is bisected again
    from where an orbit was lost without an event: the steps were too long.
    """
    if not ways:
        return []
    low, until = (np.array([getattr(each, name) for each in ways]) for name in ("speed", "until"))
    first = np.stack([each.motion.w for each in ways], axis=1)
    last = _orbits(model, ways, low, first)
    kinds, open_ = [""] * len(ways), np.flatnonzero(last.fails(first, ways) == 0)
    for _ in range(_PASSES):
        why, jumps, changes = _bisect(model, ways, low, until, last, open_)
        again = []
        for i, reason, jump, change in zip(open_.tolist(), why.tolist(), jumps.tolist(), changes.tolist(), strict=True):
            kinds[i] = _kind(last.multipliers[i], reason, change, model.damping_law)
            if reason and (not kinds[i] or (reason == 3 and jump > _CONTINUOUS)):
                again.append(i)
        open_ = np.array(again, int)
        if len(open_) == 0:
            break
    width = np.where([bool(kind) for kind in kinds] | (low == until), 0.0, np.abs(until - low))
    return [(Edge(*each), w) for *each, w in zip(low.tolist(), kinds, width.tolist(), last.w.T, strict=True)]


def _bisect(
    model: MeshModel, ways: Sequence[Way], low: np.ndarray, until: np.ndarray, last: _Orbits, which: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bisect between speeds ``low``, where the orbits ``last`` are, and ``until``, for the ways with these indices.

    Both are moved to the last orbit that goes on. Returns why the next one does not, see `_Orbits.fails`, how far it is
    from the last one, and whether its contact differs.
    """
    high, why, jumps = until.copy(), np.zeros(len(low), int), np.zeros(len(low))
    changes, before, before_at = np.zeros(len(low), bool), last.w.copy(), low.copy()
    open_ = which
    for step in range(_BISECTIONS):
        if len(open_) == 0:
            break
        middle = high[open_] if step == 0 else (low[open_] + high[open_]) / 2
        own, some = last.w[:, open_], [ways[i] for i in open_]
        gap = np.where(low[open_] == before_at[open_], 1.0, low[open_] - before_at[open_])
        found = _orbits(model, some, middle, own + (own - before[:, open_]) / gap * (middle - low[open_]))
        retry = np.flatnonzero(found.fails(own, some))
        if len(retry):
            found.put(retry, _orbits(model, [some[i] for i in retry], middle[retry], own[:, retry]))
        failing = found.fails(own, some)
        good, bad = open_[failing == 0], open_[failing > 0]
        why[bad], changes[bad] = failing[failing > 0], (found.contact != last.contact[open_])[failing > 0]
        jumps[bad] = np.abs(found.w - own).max(axis=0)[failing > 0]
        before[:, good], before_at[good] = last.w[:, good], low[good]
        last.put(good, found.take(np.flatnonzero(failing == 0)))
        low[good], high[bad] = middle[failing == 0], middle[failing > 0]
        open_ = open_[np.abs(high[open_] - low[open_]) > _LOCATED * low[open_]]
    near = np.abs(low - until) <= 2 * _LOCATED * until  # the whole way, in smaller steps than at first
    low[near], why[near] = until[near], 0
    return why[which], jumps[which], changes[which]


def _kind(multipliers: np.ndarray, why: int, contact_changes: bool, law: str) -> str:
    """The kind of event at which an orbit ends, from the multipliers next to it and from what fails beyond."""
    if why == 0:
        return ""
    if why == 3:
        return (BORDER_COLLISION if law == "unilateral" else GRAZE) if contact_changes else LIMIT
    critical = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if abs(abs(critical) - 1) > _CRITICAL:
        return ""
    if abs(critical.imag) > _COMPLEX:
        return NEIMARK_SACKER
    return FOLD if critical.real > 0 else FLIP
