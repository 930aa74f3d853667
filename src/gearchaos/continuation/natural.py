"""Natural-parameter continuation of stable periodic orbits, many side by side, and the events at which they end.

A motion that few initial states reach is easily lost on the way to the next value of a parameter. Its orbit is not:
Newton's method follows it, and its end is bisected to rounding errors: where it begins or ends, loses stability, or no
longer is of the kind that is followed. `arclength` follows a single orbit of any stability, also around its folds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.events import BORDER_COLLISION, FOLD, GRAZE, PITCHFORK, critical_event
from gearchaos.dynamics.orbits import minimal_period, polish
from gearchaos.dynamics.response import Deflections, compute_response
from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import coordinates, switched_system

LIMIT = "limit of the factor"  # the kind of an end at which an orbit is no longer of the kind that is followed
_BISECTIONS = 60
_PASSES = 12  # most times that a path is bisected, of which the end was none
_LOCATED = 1e-13  # width of the interval to which an end is bisected, as a share of the parameter
_REACH = 0.3  # largest change of a coordinate, in half backlashes, between neighbouring orbits of one branch
_MERGING = 1e-2  # largest change to an orbit of half the period: they merge
_CONTINUOUS = 1e-4  # largest change of a coordinate where only contact or force changes
_WELL_BEYOND = 1e-6  # share of the parameter beyond an event, where the orbits of a fold are no longer to be found
_PARTS = 4  # steps in which an orbit is followed to a neighbouring value if it is lost at once

GOES_ON, LOST, UNSTABLE, OTHER = range(4)
"""Why an orbit does not go on from its neighbour: it does, there is none, it is unstable, of another kind."""


class PathEnd(NamedTuple):
    """An end of a path, and the event of an orbit at which it lies, "" for none.

    The true end lies at most ``resolution`` beyond: where a motion that does not repeat ends.
    """

    value: float
    kind: str = ""
    resolution: float = 0.0


class Path(NamedTuple):
    """The path of an orbit through a state w (d,) from one value of a parameter to another, at ``fixed`` values of
    others. The period is in mesh periods. It ends where ``holds``, of orbits and the index of this one, is false."""

    fixed: Mapping[str, float]
    start: float
    until: float
    period: int
    w: np.ndarray
    holds: Callable[[FollowedOrbits, int], bool] = lambda orbits, index: True


@dataclass
class FollowedOrbits:
    """L orbits: states (d, L), multipliers (L, d), contact states and dynamic factors of the K meshes (L, K). All
    else is (L,): whether each is found and stable, the response, compression and deflection of its first mesh, and
    whether its period is shorter than that of the motion before."""

    w: np.ndarray
    multipliers: np.ndarray
    converged: np.ndarray
    stable: np.ndarray
    contact: np.ndarray
    factor: np.ndarray
    compression: np.ndarray
    deflection: np.ndarray
    meshes: np.ndarray
    mesh_factors: np.ndarray
    shorter: np.ndarray

    def take(self, which: np.ndarray) -> FollowedOrbits:
        """The orbits with these indices."""
        return FollowedOrbits(*(getattr(self, f.name)[..., which] if f.name == "w" else getattr(self, f.name)[which]
                        for f in fields(self)))

    def put(self, which: np.ndarray, other: FollowedOrbits) -> None:
        """Replace the orbits with these indices."""
        self.w[:, which] = other.w
        for each in fields(self)[1:]:
            getattr(self, each.name)[which] = getattr(other, each.name)

    def fails(self, near: np.ndarray, paths: Sequence[Path]) -> np.ndarray:
        """Why each orbit does not go on from the one in a state ``near`` (d, L): `GOES_ON` to `OTHER`."""
        distance = np.abs(self.w - near).max(axis=0)
        there = self.converged & (distance < np.where(self.shorter, _MERGING, _REACH))
        other = np.array([not path.holds(self, i) for i, path in enumerate(paths)], bool)
        return np.select([~there, ~self.stable, other], [LOST, UNSTABLE, OTHER], GOES_ON)


@dataclass(frozen=True)
class Follower:
    """Follows stable orbits of a model along a parameter."""

    model: MeshModel
    parameter: str

    def orbits(self, paths: Sequence[Path], values: np.ndarray, w: np.ndarray) -> FollowedOrbits:
        """Those of L paths near states w (d, L) at values (L,) of the parameter."""
        others = {name: np.array([path.fixed[name] for path in paths]) for name in paths[0].fixed}
        batch = vary(self.model, {self.parameter: values} | others)
        flow = ExactFlow(switched_system(batch, coordinates(vary(self.model, {}))))
        points, period = np.arange(len(values)), np.array([path.period for path in paths])
        found = polish(flow, np.ascontiguousarray(w), points, period, reach=2 * _REACH)
        state = np.ascontiguousarray(np.where(np.isfinite(found.w), found.w, w))
        measures = flow.advance(state, period, points=points, measured=True).measures
        teeth = Deflections.of(measures)
        response, meshes = compute_response(measures, period * flow.system.period, period, flow.system.static_force)
        return FollowedOrbits(state, found.multipliers, found.converged, found.stable, response.contact.astype(int),
                      response.dynamic_factor, teeth.compression, teeth.deflection,
                      meshes.mesh_contact, meshes.mesh_dynamic_factor,
                      minimal_period(flow, state, points, period) < period)

    def goes_on(self, paths: Sequence[Path]) -> tuple[FollowedOrbits, np.ndarray]:
        """The orbits at the ends of L paths, which are reached at once or in a few steps, and whether each is, (L,)."""
        start, step = (np.array([path.start for path in paths]), np.array([path.until - path.start for path in paths]))
        first = np.stack([path.w for path in paths], axis=1)
        found = self.orbits(paths, start + step, first)
        lost = np.flatnonzero(found.fails(first, paths))
        state = first[:, lost]
        for part in range(1, _PARTS + 1):  # in smaller steps
            if len(lost):
                some = [paths[i] for i in lost.tolist()]
                again = self.orbits(some, start[lost] + step[lost] * part / _PARTS, state)
                kept = np.flatnonzero(again.fails(state, some) == GOES_ON)
                lost, state, again = lost[kept], again.w[:, kept], again.take(kept)
        if len(lost):
            found.put(lost, again)
        there = found.fails(first, paths) == GOES_ON
        there[lost] = True
        return found, there

    def ends(self, paths: Sequence[Path]) -> list[tuple[PathEnd, np.ndarray]]:
        """Where each of K orbits ends on its path, loses its stability or becomes another kind; and its last state.

        At the end of the path there is no event. Where an orbit was lost without an event the steps were too long, and
        the path is bisected again from there.
        """
        if not paths:
            return []
        low, until = (np.array([getattr(each, name) for each in paths]) for name in ("start", "until"))
        first = np.stack([each.w for each in paths], axis=1)
        last = self.orbits(paths, low, first)
        kinds, open_ = [""] * len(paths), np.flatnonzero(last.fails(first, paths) == GOES_ON)
        for _ in range(_PASSES):
            found = self._bisect(paths, low, until, last, open_)
            again = []
            for i, why, jump, changes in zip(open_.tolist(), *(each.tolist() for each in found), strict=True):
                if why == OTHER:
                    touches = BORDER_COLLISION if self.model.law.releases else GRAZE
                    kinds[i] = touches if changes else LIMIT
                else:
                    kinds[i] = critical_event(last.multipliers[i], exists=why == UNSTABLE) if why else ""
                if why and (not kinds[i] or (why == OTHER and jump > _CONTINUOUS)):
                    again.append(i)
            open_ = np.array(again, int)
            if len(open_) == 0:
                break
        which = np.array([i for i, kind in enumerate(kinds) if kind == PITCHFORK], int)
        if len(which):  # next to a fold rounding errors leave the residual of an orbit small: is it also well beyond?
            beyond, own = low[which] * (1 + _WELL_BEYOND * np.sign(until - low)[which]), last.w[:, which]
            there = self.orbits([paths[i] for i in which.tolist()], beyond, own)
            stays = there.converged & (np.abs(there.w - own).max(axis=0) < _MERGING)
            for i in which[~stays].tolist():
                kinds[i] = FOLD
        width = np.where([bool(kind) for kind in kinds] | (low == until), 0.0, np.abs(until - low))
        return [(PathEnd(*each), w) for *each, w in zip(low.tolist(), kinds, width.tolist(), last.w.T, strict=True)]

    def _bisect(self, paths: Sequence[Path], low: np.ndarray, until: np.ndarray, last: FollowedOrbits,
                which: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Bisect between values ``low``, where the orbits ``last`` are, and ``until``, for paths with these indices.

        Both are moved to the last orbit that goes on. Returns why the next one does not, see `FollowedOrbits.fails`,
        how far it is from the last one, and whether its contact differs.
        """
        high, why, jumps = until.copy(), np.zeros(len(low), int), np.zeros(len(low))
        changes, before, before_at = np.zeros(len(low), bool), last.w.copy(), low.copy()
        open_ = which
        for step in range(_BISECTIONS):
            if len(open_) == 0:
                break
            middle = high[open_] if step == 0 else (low[open_] + high[open_]) / 2
            own, some = last.w[:, open_], [paths[i] for i in open_.tolist()]
            gap = np.where(low[open_] == before_at[open_], 1.0, low[open_] - before_at[open_])
            found = self.orbits(some, middle, own + (own - before[:, open_]) / gap * (middle - low[open_]))
            retry = np.flatnonzero(found.fails(own, some))
            if len(retry):
                found.put(retry, self.orbits([some[i] for i in retry], middle[retry], own[:, retry]))
            failing = found.fails(own, some)
            good, bad = open_[failing == GOES_ON], open_[failing > 0]
            why[bad], changes[bad] = failing[failing > 0], (found.contact != last.contact[open_])[failing > 0]
            jumps[bad] = np.abs(found.w - own).max(axis=0)[failing > 0]
            before[:, good], before_at[good] = last.w[:, good], low[good]
            last.put(good, found.take(np.flatnonzero(failing == GOES_ON)))
            low[good], high[bad] = middle[failing == GOES_ON], middle[failing > 0]
            open_ = open_[np.abs(high[open_] - low[open_]) > _LOCATED * np.abs(low[open_])]
        near = np.abs(low - until) <= 2 * _LOCATED * np.abs(until)  # the whole path, in smaller steps than at first
        low[near], why[near] = until[near], GOES_ON
        return why[which], jumps[which], changes[which]
