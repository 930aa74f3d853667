"""The motions that are found along the speed, and to which of them each leads when the speed changes slowly."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.dynamics import Classification, Label, Verdicts
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import MeshModel
from gearchaos.model.switched import coordinates
from gearchaos.studies.batch_classification import classify_batch
from gearchaos.studies.coexistence import SAME_CENTRE, signature
from gearchaos.studies.initial_value_problems import initial_value_problems

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


_BRIEF = 1000
"""Longest transient, mesh periods, after which a chaotic motion counts as one that is known with its contact state at
its speed; where none is known it is followed as long as the settings say."""


@dataclass
class Motion:
    """One of the motions of a speed.

    Attributes
    ----------
    label, period : int
        Its kind, a `Label`, and its period in mesh periods, 0 where there is none.
    contact : int
        Index into `CONTACTS`.
    dynamic_factor : float
        Peak of the mesh force over the static one; NaN if the motion diverges.
    compression : float
        Least deflection of the teeth, in half backlashes, 0 or less where they separate; NaN if the motion diverges.
    centre : sequence of float
        Mean of z and z' over the stroboscopic points of an orbit; 0 for other motions.
    w : (d,)
        A state on it at phase 0.
    leads_to : dict of float to Motion
        By speed: the motion that it becomes when the speed changes to that one.
    """

    label: int
    period: int
    contact: int
    dynamic_factor: float
    compression: float
    centre: Sequence[float]
    w: np.ndarray
    leads_to: dict[float, Motion] = field(default_factory=dict)

    @property
    def diverged(self) -> bool:
        """Whether it leaves every bound."""
        return self.label == Label.DIVERGED

    def same(self, other: Motion) -> bool:
        """Whether two motions of one speed are the same: orbits by their centre, others by their contact state."""
        alike = (self.label, self.period, self.contact) == (other.label, other.period, other.contact)
        return alike and all(abs(a - b) < SAME_CENTRE for a, b in zip(self.centre, other.centre, strict=True))


class FollowedMotions:
    """The motions found at speeds that are added one after another.

    Parameters
    ----------
    model : MeshModel
        With a parameter ``speed``.
    settings : Classification
    progress : bool
        Show a progress bar for the random initial states, which take the most time.
    threads : int, optional

    Attributes
    ----------
    speeds : list of float
        In rising order, rpm.
    at : dict of float to list of Motion
        The motions of each speed, the one from rest first.
    """

    def __init__(
        self, model: MeshModel, settings: Classification, *, progress: bool = False, threads: int | None = None
    ) -> None:
        self.model, self._settings, self._progress, self._threads = model, settings, progress, threads
        self._names = coordinates(initial_value_problems(model).batch)
        self.speeds: list[float] = []
        self.at: dict[float, list[Motion]] = {}

    def add_from_rest(self, speeds: Iterable[float]) -> None:
        """Add speeds, each with its motion from the initial values of the model."""
        new = np.array(sorted(set(speeds) - set(self.speeds)))
        if len(new):
            w = initial_value_problems(self.model, {"speed": new}, self._names).w
            self._add(new, w)
            self.speeds = sorted(self.at)

    def add_from_random_states(self, speeds: Sequence[float], starts: int, seed: int) -> None:
        """Add the motions from ``starts`` random initial states at each of some of the speeds."""
        if not starts or not speeds:
            return
        each = np.repeat(speeds, starts)
        base = replace(self.model, initial={}) if self.model.kind == "single" else self.model
        values = {"speed": each, **spread(default_box(self.model), len(each), seed)}
        w = initial_value_problems(base, values, self._names).w
        self._add(each, w, progress="motions from random states" if self._progress else None)

    def follow(self) -> None:
        """Follow every motion to both neighbouring speeds, and those found there further, until no new one is found."""
        pairs = [*zip(self.speeds, self.speeds[1:], strict=False), *zip(self.speeds[1:], self.speeds, strict=False)]
        while pending := [(motion, there) for here, there in pairs for motion in self.at[here]
                          if there not in motion.leads_to]:
            speeds = np.array([speed for _, speed in pending])
            found = self._add(speeds, np.stack([motion.w for motion, _ in pending], axis=1))
            for (motion, speed), reached in zip(pending, found, strict=True):
                motion.leads_to[speed] = self.at[speed][0] if motion.diverged else reached

    def named(self) -> dict[str, list[Motion | None]]:
        """The motions at each speed: from rest, passed by sweeps from rest, and the worst of the others or None."""
        swept: list[list[Motion]] = []
        for speeds in (self.speeds, self.speeds[::-1]):
            passed = [self.at[speeds[0]][0]]
            for speed in speeds[1:]:
                passed.append(passed[-1].leads_to[speed])
            swept.append(passed)
        rows: dict[str, list[Motion | None]] = {
            "rest": [self.at[s][0] for s in self.speeds], "rising": [*swept[0]], "falling": [*swept[1][::-1]]}
        others = [[m for m in self.at[s] if all(m is not row[i] for row in rows.values())]
                  for i, s in enumerate(self.speeds)]
        return {**rows, "other": [
            max(each, key=lambda m: (m.contact, np.inf if m.diverged else m.dynamic_factor), default=None)
            for each in others]}

    def _add(self, speeds: np.ndarray, w: np.ndarray, progress: str | None = None) -> list[Motion]:
        """Add the motions from states w (d, L) at speeds (L,); returns them, or the same ones that are known."""
        brief = replace(self._settings, longest_transient=min(_BRIEF, self._settings.longest_transient))
        found, at = self._classified(speeds, w, brief, progress), speeds.tolist()
        first: dict[tuple[float, int], int] = {}  # of the chaotic motions that look the same, and like none known
        for i, (speed, motion) in enumerate(zip(at, found, strict=True)):
            if motion.label == Label.CHAOTIC and not any(motion.same(known) for known in self.at.get(speed, ())):
                first.setdefault((speed, motion.contact), i)
        if first:
            longer = list(first.values())
            w = np.stack([found[i].w for i in longer], axis=1)
            settled = dict(zip(first, self._classified(speeds[longer], w, self._settings), strict=True))
            found = [settled.get((speed, motion.contact), motion) if motion.label == Label.CHAOTIC else motion
                     for speed, motion in zip(at, found, strict=True)]
        reached = []
        for speed, motion in zip(at, found, strict=True):
            known = self.at.setdefault(speed, [])
            same = next((each for each in known if each.same(motion)), motion)
            if same is motion:
                known.append(motion)
            elif not motion.period and motion.dynamic_factor > same.dynamic_factor:  # another part of a motion
                same.dynamic_factor = motion.dynamic_factor
            reached.append(same)
        return reached

    def _classified(
        self, speeds: np.ndarray, w: np.ndarray, settings: Classification, progress: str | None = None
    ) -> list[Motion]:
        """The motions from states w (d, L) at speeds (L,)."""

        def initial_states(number: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
            values, points = np.unique(speeds[number], return_inverse=True)
            flow = initial_value_problems(self.model, {"speed": values}, self._names).flow
            return flow, w[:, number].copy(), points

        def collect(_: np.ndarray, flow: ExactFlow, points: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
            periods = np.where(found.period > 0, found.period, settings.averaging_periods)
            measures = flow.advance(found.w, periods, points=points, measured=True).measures
            return {
                **signature(flow, points, found), "dynamic_factor": found.variables()["dynamic_factor"],
                "compression": measures[Measure.Z_MIN] - 1, "w": found.w.T,
            }

        found: dict[str, Any] = classify_batch(
            initial_states, collect, np.argsort(speeds, kind="stable"), settings=settings,
            progress=progress, threads=self._threads,
        )
        names = ("label", "period", "contact", "dynamic_factor", "compression", "centre_z", "centre_z_dot")
        return [Motion(label, period, contact, factor, compression, centre, state)
                for label, period, contact, factor, compression, *centre, state in zip(
                    *(found[n].tolist() for n in names), found["w"], strict=True)]
