"""The state of a classification in progress: states of the motions, verdicts so far, the test for periodic orbits."""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field
from typing import Any

import numpy as np

from gearchaos.dynamics import orbits
from gearchaos.dynamics.orbits import EXACT, candidates
from gearchaos.dynamics.settings import Classification
from gearchaos.dynamics.verdicts import Label, Reason, Verdicts
from gearchaos.flow import DIVERGED, OK, ExactFlow, FlowResult

_CANDIDATES = 3
"""Number of near returns tried for each motion, shortest period first."""

_MAX_DISTANCE = 0.05
"""A motion is tested against an orbit only if no coordinate differs by more than this."""

_NEWTON_REACH = 3 * _MAX_DISTANCE
"""Newton's method stops where a coordinate differs by more than this from the guess."""

_NEWTON_EXPANSION = 10.0
"""Newton's method stops where a multiplier is that large: the orbit is far from stable, or the motion not yet close
enough to a stable one."""

_APPROACH_PERIODS = 640
"""Largest number of mesh periods for which a motion is followed to test whether it approaches its orbit."""


@dataclass
class ClassificationState:
    """The classification of L motions of a d-dimensional system, in progress.

    The methods take the indices of some of the motions as ``motions``; in shapes the word stands for their number.

    Parameters
    ----------
    w : (d, L)
        Initial states at phase 0.

    Attributes
    ----------
    flow : ExactFlow
    points : (L,)
        Parameter point of each motion.
    settings : Classification
    all_exponents : bool
        Whether exponent runs compute all d Lyapunov exponents, or only the largest, on which the verdict depends.
    verdicts : Verdicts
        Verdicts so far; ``verdicts.w`` is the current state of each motion.
    chaotic_so_far : (L,) of bool
        Whether the largest Lyapunov exponent was positive in an exponent run.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import numpy as np
    >>> from gearchaos.dynamics import STAGES, Classification, ClassificationState, conclude
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> state = ClassificationState(problem.flow, problem.points, Classification(), problem.w)
    >>> STAGES["transients"](state)
    >>> state.unresolved.tolist()
    []
    """

    flow: ExactFlow
    points: np.ndarray
    settings: Classification
    w: InitVar[np.ndarray]
    all_exponents: bool = True
    verdicts: Verdicts = field(init=False)
    chaotic_so_far: np.ndarray = field(init=False)

    def __post_init__(self, w: np.ndarray) -> None:
        contacts = self.flow.system.contacts
        self.verdicts = Verdicts.unresolved(w, 0 if contacts is None else len(contacts.names))
        self.chaotic_so_far = np.zeros(w.shape[1], dtype=bool)

    def take(self, motions: np.ndarray) -> ClassificationState:
        """A copy of the classification state for the motions with these numbers."""
        verdicts = self.verdicts.take(motions)
        part = ClassificationState(self.flow, self.points[motions], self.settings, verdicts.w, self.all_exponents)
        part.verdicts, part.chaotic_so_far = verdicts, self.chaotic_so_far[motions]
        return part

    def checkpoint(self, motions: np.ndarray) -> dict[str, np.ndarray]:
        """The data from which the next stage resumes these unresolved motions, arrays (..., motions) by name."""
        return {"w": self.verdicts.w[:, motions], "periods_run": self.verdicts.periods_run[motions],
                "chaotic_so_far": self.chaotic_so_far[motions]}

    def resume(self, checkpoint: dict[str, np.ndarray]) -> None:
        """Set all motions to a `checkpoint`; an empty one leaves them at their initial states."""
        if checkpoint:
            self.verdicts.w[:], self.verdicts.periods_run[:] = checkpoint["w"], checkpoint["periods_run"]
            self.chaotic_so_far[:] = checkpoint["chaotic_so_far"]

    @property
    def resolved(self) -> np.ndarray:
        """Whether each motion is classified, (L,) of bool."""
        return self.verdicts.label != 0

    @property
    def unresolved(self) -> np.ndarray:
        """Numbers of the motions that are not classified yet."""
        return np.flatnonzero(~self.resolved)

    def period_length(self, motions: np.ndarray) -> np.ndarray:
        """The mesh period T of these motions, (motions,), in units of τ."""
        return self.flow.system.period[self.points[motions]]

    def advance(self, motions: np.ndarray, periods: Any, **options: Any) -> FlowResult:
        """`ExactFlow.advance` for these motions from their current states, which stay as they are."""
        return self.flow.advance(self.verdicts.w[:, motions], periods, points=self.points[motions], **options)

    def record_run(self, motions: np.ndarray, w: np.ndarray, status: np.ndarray, periods: int) -> None:
        """Record the states w (d, motions) and statuses (motions,) of motions after a run of this many mesh periods."""
        self.verdicts.w[:, motions] = w
        self.verdicts.periods_run[motions] += periods
        self.assign(motions[status == DIVERGED], Label.DIVERGED, Reason.OUT_OF_RANGE)
        self.assign(motions[(status != OK) & (status != DIVERGED)], Label.UNDECIDED, Reason.CHATTER)

    def assign(self, motions: np.ndarray, label: Label, reason: Reason) -> None:
        """Give these motions a label and a reason."""
        self.verdicts.label[motions], self.verdicts.reason[motions] = label, reason

    def run_transient(self, motions: np.ndarray, periods: int) -> None:
        """Follow motions for this many mesh periods, and classify those that have reached a stable periodic orbit."""
        if len(motions) == 0:
            return
        longest = self.settings.longest_period
        out = self.advance(motions, periods, sections=2 * longest + 1)
        self.record_run(motions, out.w, out.status, periods)
        self.classify_returning(motions, out.sections, longest)

    def classify_long_orbits(self, motions: np.ndarray, longest: int) -> None:
        """Classify the motions that repeat exactly after at most ``longest`` mesh periods.

        An orbit of many mesh periods may nearly return after several smaller numbers of them, and `classify_returning`
        tries only the shortest. A motion that is on its orbit returns exactly after multiples of its period alone.
        """
        length = 2 * longest + 1
        out = self.advance(motions, length, sections=length)
        self.record_run(motions, out.w, out.status, length)
        self._try_periods(motions, out.w, candidates(out.sections, longest, 1, EXACT, EXACT))

    def classify_returning(self, motions: np.ndarray, sections: np.ndarray, longest: int) -> None:
        """Classify the motions that are on an orbit of a period up to ``longest`` mesh periods.

        ``sections`` (S, d, motions) are their last stroboscopic states.
        """
        self._try_periods(motions, sections[-1], candidates(sections, longest, _CANDIDATES))

    def _try_periods(self, motions: np.ndarray, w: np.ndarray, periods: np.ndarray) -> None:
        """Classify the motions in the states w (d, motions) that are on an orbit of one of the periods (n, motions)."""
        for period in periods:
            tried = np.flatnonzero(~self.resolved[motions] & (period > 0))
            if len(tried) == 0:
                continue
            some, last = motions[tried], w[:, tried]
            found = orbits.polish(self.flow, last, self.points[some], period[tried], reach=_NEWTON_REACH,
                                  expansion=_NEWTON_EXPANSION)
            converged = np.flatnonzero(found.converged)
            points, longer = self.points[some[converged]], found.period[converged]
            minimal = orbits.minimal_period(self.flow, found.w[:, converged], points, longer)
            shorter = minimal < longer
            again = converged[shorter]
            if len(again):  # monodromy matrices and multipliers are those over the minimal period
                found.put(again, orbits.polish(self.flow, found.w[:, again], points[shorter], minimal[shorter]))
            distance = np.abs(last - found.w).max(axis=0)
            reached = found.stable & (distance < _MAX_DISTANCE)
            reached[reached] = orbits.approaching(
                self.flow, last[:, reached], self.points[some[reached]], found.take(reached), _APPROACH_PERIODS)
            self._assign_orbits(some[reached], found.take(reached), Reason.ORBIT)
            neutral = found.neutral & ~found.stable & (distance < orbits.ON_ORBIT)
            self._assign_orbits(some[neutral], found.take(neutral), Reason.NEUTRAL)

    def _assign_orbits(self, motions: np.ndarray, found: orbits.Orbits, reason: Reason) -> None:
        """Classify motions as periodic on their orbits, and record orbit, multipliers and exponents."""
        if len(motions) == 0:
            return
        verdicts, points = self.verdicts, self.points[motions]
        self.assign(motions, Label.PERIODIC, reason)
        verdicts.period[motions], verdicts.residual[motions] = found.period, found.residual
        verdicts.multipliers[motions] = found.multipliers
        verdicts.w[:, motions] = orbits.with_mean_velocity(self.flow, found.w, points, found.period)
        exact, trace = orbits.lyapunov_exponents(self.flow, points, found)
        self.set_exponents(motions, exact, exact, exact)
        self.set_trace_error(motions, exact.sum(axis=0), trace)

    def set_exponents(self, motions: np.ndarray, value: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        """Record Lyapunov exponents (k, motions), k = 1 (the largest) or d (all), and the ends of their intervals."""
        k, verdicts = len(value), self.verdicts
        verdicts.exponent[:k, motions] = value
        verdicts.exponent_low[:k, motions], verdicts.exponent_high[:k, motions] = low, high
        if k == self.flow.dimension and not self.flow.system.law.in_contact:
            self.set_trace_error(motions, value.sum(axis=0), self.flow.system.trace[self.points[motions]])

    def set_trace_error(self, motions: np.ndarray, exponent_sum: np.ndarray, trace: np.ndarray) -> None:
        """Record the absolute difference of the sum (motions,) of all exponents from the mean trace of the linear
        part."""
        self.verdicts.trace_error[motions] = np.abs(exponent_sum - trace)
