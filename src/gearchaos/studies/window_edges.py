"""The edges of ranges of speed, located on the orbits: where one begins or ends, loses stability, or is no longer to be
avoided.

Motions that repeat are followed from a speed on one side of an edge to one on the other, all of them side by side, and
the end of each is bisected to rounding errors. Where stability changes the motion beyond is computed, and followed in
turn. A motion that does not repeat ends at no event of an orbit, unless it begins where another motion ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.events import BORDER_COLLISION, FLIP, FOLD, GRAZE, NEIMARK_SACKER
from gearchaos.dynamics import Classification
from gearchaos.dynamics.orbits import Orbits, polish
from gearchaos.dynamics.response import compute_response
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.followed_motions import Asked, Motion, Severity, classified
from gearchaos.studies.initial_value_problems import initial_value_problems

LIMIT = "limit of the factor"  # the kind of an edge at which a dynamic factor passes its limit
_BISECTIONS = 60
_LOCATED = 1e-13  # width of the interval to which an edge is bisected, as a share of the speed
_REACH = 1.0  # largest change of a coordinate, in half backlashes, between orbits of one branch near its end
_BEYOND = 2e-4  # how far beyond a change of stability the motion is computed, as a share of the speed
_COARSE = 2e-4  # to this share of the speed the end of a motion that does not repeat is located
_COMPLEX = 1e-6  # imaginary part from which a critical multiplier counts as complex
_CRITICAL = 0.05  # largest distance of a critical multiplier from 1 or −1 next to its event
_ROUNDS = 40  # most motions that are followed one after another at an edge


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
    both. ``found`` is the one that is furthest outside so far; ``persists`` has the states at the speed outside of
    motions that are to be avoided there, too."""

    torque: float | None
    inside: float
    outside: float
    motions: Sequence[Motion]
    beyond: Sequence[Motion]
    severity: Severity
    found: Edge
    persists: list[np.ndarray] = field(default_factory=list)

    def reach(self, end: Edge) -> None:
        """Take the end of a motion for the edge, unless it is further inside than that found so far."""
        if (end.speed - self.found.speed) * (self.outside - self.inside) >= 0:
            self.found = end


class Followed(NamedTuple):
    """A motion at a speed, to be followed to another one ``until``, as long as it is to be avoided, or as it is not."""

    edge: Sought
    speed: float
    until: float
    motion: Motion
    avoided: bool = True


def locate_edges(
    model: MeshModel, edges: Sequence[Sought], settings: Classification, *, threads: int | None = None
) -> None:
    """Locate edges, each as far outside as a motion to be avoided is found by following those inside.

    A motion that does not repeat is bisected by computing it at speeds in between; where it begins with the end of a
    motion from beyond, that is the edge.
    """
    open_ = [Followed(edge, edge.inside, edge.outside, motion) for edge in edges
             for motion in edge.motions if edge.severity(motion)]
    for _ in range(_ROUNDS):
        repeating = [each for each in open_ if each.motion.period]
        trials = [(each, (each.until + each.speed) / 2, each.motion.w) for each in open_ if not each.motion.period]
        for each, *_ in trials:
            each.edge.reach(Edge(float(each.speed), "", float(abs(each.until - each.speed))))
        trials = [trial for trial in trials if abs(trial[1] - trial[0].speed) > _COARSE * trial[1]]
        for each, (end, w) in zip(repeating, ends_of_orbits(model, repeating), strict=True):
            at = end.speed * (1 + _BEYOND * np.sign(each.until - each.speed))
            goes_on = end.kind not in (GRAZE, BORDER_COLLISION, LIMIT) and (
                each.until - at) * (each.until - each.speed) > 0
            each.edge.reach(end if end.kind == FOLD or not goes_on else end._replace(resolution=abs(at - end.speed)))
            if end.speed == each.until:
                each.edge.persists.append(w)
            elif goes_on:
                trials.append((each, at, w))
        if not trials:
            break
        found = classified(model, [Asked(each.edge.torque, np.array([at]), w[:, None]) for each, at, w in trials],
                           settings, None, threads)
        open_ = []
        for (each, at, _), (motion,) in zip(trials, found, strict=True):
            if each.edge.severity(motion):
                open_.append(Followed(each.edge, at, each.until, motion))
            elif not each.motion.period:  # it has ended before
                open_.append(each._replace(until=at))
    back = [Followed(edge, edge.outside, edge.inside, motion, False) for edge in edges if not edge.found.kind
            for motion in edge.beyond if motion.period and not edge.severity(motion)]
    for each, (end, _) in zip(back, ends_of_orbits(model, back), strict=True):
        if end.kind and abs(end.speed - each.edge.found.speed) <= 2 * each.edge.found.resolution:
            each.edge.found = end


def ends_of_orbits(model: MeshModel, followed: Sequence[Followed]) -> list[tuple[Edge, np.ndarray]]:
    """Where each of K orbits ends on the way to another speed, is no longer stable, or is to be avoided or no longer.

    Returns the edge and the state of the last orbit. At the speed at the end of the way there is no event.
    """
    if not followed:
        return []
    low, high = (np.array([getattr(each, name) for each in followed]) for name in ("speed", "until"))
    first = np.stack([each.motion.w for each in followed], axis=1)
    last = _orbits(model, followed, low, first)
    before, before_at, why, changes = last.orbits.w.copy(), low.copy(), np.zeros(len(low), int), np.zeros(len(low), bool)
    open_ = np.flatnonzero(last.fails(first) == 0)
    for step in range(_BISECTIONS):
        middle = high[open_] if step == 0 else (low[open_] + high[open_]) / 2
        own, some = last.orbits.w[:, open_], [followed[i] for i in open_]
        gap = np.where(low[open_] == before_at[open_], 1.0, low[open_] - before_at[open_])
        found = _orbits(model, some, middle, own + (own - before[:, open_]) / gap * (middle - low[open_]))
        retry = np.flatnonzero(found.fails(own))
        found.put(retry, _orbits(model, [some[i] for i in retry], middle[retry], own[:, retry]))
        failing = found.fails(own)
        good, bad = open_[failing == 0], open_[failing > 0]
        why[bad], changes[bad] = failing[failing > 0], (found.contact != last.contact[open_])[failing > 0]
        before[:, good], before_at[good] = last.orbits.w[:, good], low[good]
        last.put(good, found.take(np.flatnonzero(failing == 0)))
        low[good], high[bad] = middle[failing == 0], middle[failing > 0]
        open_ = open_[np.abs(high[open_] - low[open_]) > _LOCATED * low[open_]]
        if len(open_) == 0:
            break
    until = np.array([each.until for each in followed])
    near = np.abs(low - until) <= 2 * _LOCATED * until  # the whole way, in smaller steps than at first
    low[near], why[near] = until[near], 0
    kinds = [_kind(last.orbits.multipliers[i], why[i], changes[i], model.damping_law) for i in range(len(low))]
    width = np.where((why > 0) | near, 0.0, np.abs(high - low))
    return [(Edge(*each), w) for *each, w in zip(low.tolist(), kinds, width.tolist(), last.orbits.w.T, strict=True)]


@dataclass
class _Found:
    """L orbits, their contact states, and whether each is to be avoided as it was, or is not as it was not."""

    orbits: Orbits
    contact: np.ndarray
    same: np.ndarray

    def fails(self, near: np.ndarray) -> np.ndarray:
        """Why each orbit does not go on from the one in a state ``near``: 0 it does, 1 there is none, 2 it is unstable,
        3 it is to be avoided, or no longer."""
        there = self.orbits.converged & (np.abs(self.orbits.w - near).max(axis=0) < _REACH)
        return np.select([~there, ~self.orbits.stable, ~self.same], [1, 2, 3], 0)

    def take(self, which: np.ndarray) -> _Found:
        """The orbits with these indices."""
        return _Found(self.orbits.take(which), self.contact[which], self.same[which])

    def put(self, which: np.ndarray, other: _Found) -> None:
        """Replace the orbits with these indices."""
        self.orbits.put(which, other.orbits)
        self.contact[which], self.same[which] = other.contact, other.same


def _orbits(model: MeshModel, followed: Sequence[Followed], speed: np.ndarray, w: np.ndarray) -> _Found:
    """The orbits of L motions near states w (d, L) at speeds (L,)."""
    if not followed:
        return _Found(Orbits(w, np.zeros(0, int), np.zeros(0), np.zeros((0, *2 * w.shape[:1])), np.zeros((0, len(w)))),
                      np.zeros(0, int), np.zeros(0, bool))
    values, torques = {"speed": speed}, [each.edge.torque for each in followed]
    if torques[0] is not None:
        values["torque"] = np.array(torques)
    flow = initial_value_problems(model, values, coordinates(vary(model, {}))).flow
    points, period = np.arange(len(speed)), np.array([each.motion.period for each in followed])
    found = polish(flow, np.ascontiguousarray(w), points, period, reach=_REACH)
    measures = flow.advance(np.where(np.isfinite(found.w), found.w, w), period, points=points, measured=True).measures
    response, _ = compute_response(measures, period * flow.system.period, period, flow.system.static_force)
    same = [(each.edge.severity(replace(each.motion, contact=int(contact), dynamic_factor=factor)) > 0) == each.avoided
            for each, contact, factor in zip(followed, response.contact, response.dynamic_factor, strict=True)]
    return _Found(found, response.contact.astype(int), np.array(same))


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
