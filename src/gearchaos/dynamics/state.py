"""Verdicts being filled in: where each trajectory is, and how motions that return are settled."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearchaos.dynamics import lyapunov
from gearchaos.dynamics import orbits as orbit
from gearchaos.dynamics.labels import Label, Reason
from gearchaos.dynamics.recurrence import candidates
from gearchaos.dynamics.settings import Classification
from gearchaos.flow import DIVERGED, OK, ExactFlow

_TRIES = 3
_CLOSE = 0.05
_REACH = 3 * _CLOSE
"""A motion is at its orbit if within _CLOSE of it; Newton may overshoot on the way."""

_EXPANSION = 10.0
"""Beside a stable orbit neighbours do not part that far in a round, or no longer do when the motion is closer to it."""

_FOLLOWED = 640
_BY_LANE = ("label", "reason", "period", "residual", "rotation", "trace_error", "periods_run", "chaotic_so_far",
            "multipliers")


@dataclass
class ClassificationState:
    """Verdicts on L trajectories of a d-dimensional system; see `Verdicts` for most of the columns.

    With ``spectrum`` every run for exponents finds all d of them, else the largest,
    which decides. ``chaotic_so_far`` (L,)
    marks motions whose exponent was found positive, be it for good or for a while.
    """

    flow: ExactFlow
    points: np.ndarray
    settings: Classification
    w: np.ndarray
    spectrum: bool = True
    label: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        d, n = self.w.shape
        self.w = self.w.copy()
        self.label, self.reason, self.period = (np.zeros(n, dtype=np.int64) for _ in range(3))
        self.residual, self.rotation, self.trace_error = (np.full(n, np.nan) for _ in range(3))
        self.periods_run, self.chaotic_so_far = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
        self.multipliers = np.full((n, d), np.nan, dtype=complex)
        self.exponent, self.low, self.high = (np.full((d, n), np.nan) for _ in range(3))

    def take(self, lanes: np.ndarray) -> ClassificationState:
        """The verdicts of the chosen lanes, as far as they are."""
        part = ClassificationState(self.flow, self.points[lanes], self.settings, self.w[:, lanes], self.spectrum)
        for name in _BY_LANE:
            setattr(part, name, getattr(self, name)[lanes])
        for name in ("exponent", "low", "high"):
            setattr(part, name, getattr(self, name)[:, lanes])
        return part

    @property
    def unresolved(self) -> np.ndarray:
        return np.flatnonzero(self.label == 0)

    def period_length(self, lanes: np.ndarray) -> np.ndarray:
        return self.flow.system.period[self.points[lanes]]

    def move(self, lanes: np.ndarray, w: np.ndarray, status: np.ndarray, periods: int) -> None:
        """Put trajectories where they are after so many more periods."""
        self.w[:, lanes] = w
        self.periods_run[lanes] += periods
        self.judge(lanes[status == DIVERGED], Label.DIVERGED, Reason.OUT_OF_RANGE)
        self.judge(lanes[(status != OK) & (status != DIVERGED)], Label.UNDECIDED, Reason.CHATTER)

    def judge(self, lanes: np.ndarray, label: Label, reason: Reason) -> None:
        self.label[lanes], self.reason[lanes] = label, reason

    def distrust(self, lanes: np.ndarray) -> None:
        """Take back what was said of motions whose exponents do not sum to the trace."""
        self.judge(lanes, Label.UNDECIDED, Reason.INCONSISTENT)
        self.period[lanes], self.residual[lanes], self.multipliers[lanes] = 0, np.nan, np.nan

    def wait(self, lanes: np.ndarray, periods: int) -> None:
        """Follow trajectories for so many periods; settle those that by then return to a stable orbit."""
        if len(lanes) == 0:
            return
        longest = self.settings.longest_period
        out = self.flow.advance(self.w[:, lanes], periods, points=self.points[lanes], sections=2 * longest + 1)
        self.move(lanes, out.w, out.status, periods)
        self.settle_returning(lanes, out.sections, longest)

    def settle_returning(self, lanes: np.ndarray, sections: np.ndarray, longest: int) -> None:
        """Try the few shortest near returns of each open lane until one is its orbit; sections (S, d, lanes)."""
        for period in candidates(sections, longest, _TRIES):
            mine = np.flatnonzero((self.label[lanes] == 0) & (period > 0))
            if len(mine) == 0:
                continue
            last = sections[-1][:, mine]
            guess = orbit.polish(
                self.flow, last, self.points[lanes[mine]], period[mine], reach=_REACH, expansion=_EXPANSION
            )
            found = self._minimal(guess, lanes[mine])
            distance = np.abs(last - found.w).max(axis=0)
            owned = found.stable & (distance < _CLOSE)
            owned[owned] = self._approaching(last[:, owned], lanes[mine[owned]], found.take(owned))
            self._settle(lanes[mine[owned]], found, owned, Reason.ORBIT)
            owned = found.neutral & ~found.stable & (distance < orbit.AT_ORBIT)
            self._settle(lanes[mine[owned]], found, owned, Reason.NEUTRAL)

    def _minimal(self, found: orbit.Orbits, lanes: np.ndarray) -> orbit.Orbits:
        """The same orbits with minimal periods and the multipliers of one round."""
        good = np.flatnonzero(found.converged)
        shortest = orbit.shortest_round(self.flow, found.w[:, good], self.points[lanes[good]], found.period[good])
        again = good[shortest < found.period[good]]
        if len(again):
            new = orbit.polish(self.flow, found.w[:, again], self.points[lanes[again]],
                               shortest[shortest < found.period[good]])
            found.put(again, new)
        return found

    def _approaching(self, w: np.ndarray, lanes: np.ndarray, found: orbit.Orbits) -> np.ndarray:
        return orbit.approaching(self.flow, w, self.points[lanes], found, _FOLLOWED)

    def _settle(self, lanes: np.ndarray, found: orbit.Orbits, which: np.ndarray, reason: Reason) -> None:
        if len(lanes) == 0:
            return
        self.judge(lanes, Label.PERIODIC, reason)
        self.period[lanes] = found.period[which]
        self.w[:, lanes] = orbit.with_mean_velocity(
            self.flow, found.w[:, which], self.points[lanes], self.period[lanes]
        )
        self.residual[lanes], self.multipliers[lanes] = found.residual[which], found.multipliers[which]
        exact = lyapunov.of_orbits(self.flow, self.points[lanes], found.take(which))
        self.set_exponents(lanes, exact, exact, exact)

    def set_exponents(self, lanes: np.ndarray, value: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
        """The first exponents (k, lanes), or all d, with the ends of their intervals."""
        k = len(value)
        self.exponent[:k, lanes], self.low[:k, lanes], self.high[:k, lanes] = value, low, high
        if k == self.flow.dimension:
            self.check_sum(lanes, value.sum(axis=0))

    def check_sum(self, lanes: np.ndarray, total: np.ndarray) -> None:
        """Note by how much the sum of all exponents (lanes,) misses the trace of the linear part."""
        self.trace_error[lanes] = np.abs(total - self.flow.system.trace[self.points[lanes]])

