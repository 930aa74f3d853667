"""What motion is it? A label for each trajectory, with the evidence for it, or an honest "undecided"."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from enum import IntEnum

import numpy as np

from gearchaos.errors import InputError
from gearchaos.flow import DIVERGED, OK, ExactFlow, measure
from gearchaos.motion import lyapunov, orbit, torus
from gearchaos.motion.reading import Reading, read
from gearchaos.motion.recurrence import candidates


class Label(IntEnum):
    """Kinds of motion."""

    PERIODIC = 1
    QUASI_PERIODIC = 2
    CHAOTIC = 3
    UNDECIDED = 4
    DIVERGED = 5


class Reason(IntEnum):
    """Why a verdict stands."""

    ORBIT = 1
    POSITIVE_EXPONENT = 2
    SMOOTH_CURVE = 3
    BUDGET = 4
    OUT_OF_RANGE = 5
    CHATTER = 6
    NEUTRAL = 7


REASONS = {
    Reason.ORBIT: "a stable periodic orbit converged and the trajectory approaches it",
    Reason.POSITIVE_EXPONENT: "the largest Lyapunov exponent is positive by its 99 % confidence interval",
    Reason.SMOOTH_CURVE: "the largest exponent is zero and weighted Birkhoff averages converge as on a smooth curve",
    Reason.BUDGET: "no return within the budget, and the largest exponent is not clearly positive",
    Reason.OUT_OF_RANGE: "|z| or |z'| passed 1e8 half backlashes",
    Reason.NEUTRAL: "the motion repeats exactly, and its neighbours neither approach nor leave it",
    Reason.CHATTER: "more contact switches within one step than can be followed",
}


@dataclass(frozen=True)
class Budget:
    """How long to wait and how hard to look, in mesh periods.

    Attributes
    ----------
    looks : tuple of int
        Stretches of transient; after each one all motions that nearly return are polished. Every stretch is longer
        than ``longest``.
    longest : int
        Longest period looked for.
    exponent : int
        Length of the run that yields the Lyapunov exponents of what has not returned; doubled up to
        ``extensions`` times while the verdict is open.
    measured : int
        Periods over which the levels of a motion that does not return are averaged.
    """

    looks: tuple[int, ...] = (80, 80, 160, 320, 640)
    longest: int = 64
    exponent: int = 250
    extensions: int = 3
    measured: int = 96

    def __post_init__(self) -> None:
        for name in ("longest", "exponent", "measured"):
            if getattr(self, name) < 1:
                raise InputError(f"budget.{name}", "must be at least 1", getattr(self, name))
        if self.extensions < 0:
            raise InputError("budget.extensions", "must not be negative", self.extensions)
        for stretch in (*self.looks, self.exponent):
            if stretch <= self.longest:
                raise InputError("budget", f"must have stretches longer than longest = {self.longest}", stretch,
                                 "A return after n periods shows only in more than n sections.")


@dataclass(frozen=True)
class Verdicts:
    """Verdicts on L trajectories of a d-dimensional system; K exponents each.

    Attributes
    ----------
    label, reason : (L,)
        `Label` and `Reason` codes.
    period : (L,)
        Minimal period in mesh periods, 0 where there is none.
    w : (d, L)
        A point of the polished orbit, or where the trajectory was last, at phase 0.
    residual : (L,)
        Largest change of a coordinate over one round of the orbit; NaN where there is none.
    multipliers : (L, d)
        Floquet multipliers, largest modulus first; NaN where there is no orbit.
    exponent, low, high : (K, L)
        Lyapunov exponents per unit τ, largest first, and the ends of their 99 % intervals.
    spent : (L,)
        Mesh periods of transient and exponent run.
    reading : Reading
        Levels of the motion.
    """

    label: np.ndarray
    reason: np.ndarray
    period: np.ndarray
    w: np.ndarray
    residual: np.ndarray
    multipliers: np.ndarray
    exponent: np.ndarray
    low: np.ndarray
    high: np.ndarray
    spent: np.ndarray
    reading: Reading


@dataclass
class _Sheet:
    """Verdicts being filled in."""

    flow: ExactFlow
    points: np.ndarray
    budget: Budget
    w: np.ndarray
    label: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        d, n = self.w.shape
        self.w = self.w.copy()
        self.label, self.reason, self.period = (np.zeros(n, dtype=np.int64) for _ in range(3))
        self.residual, self.spent = np.full(n, np.nan), np.zeros(n, dtype=np.int64)
        self.multipliers = np.full((n, d), np.nan, dtype=complex)

    def with_exponents(self, count: int) -> None:
        self.exponent, self.low, self.high = (np.full((count, self.w.shape[1]), np.nan) for _ in range(3))

    @property
    def open(self) -> np.ndarray:
        return np.flatnonzero(self.label == 0)

    def period_length(self, lanes: np.ndarray) -> np.ndarray:
        return self.flow.system.period[self.points[lanes]]


def classify(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray | None = None, *, budget: Budget | None = None,
    exponents: int = 1, levels: bool = True,
) -> Verdicts:
    """Verdicts on the motions that start from w (d, L) at the given parameter points (L,).

    Parameters
    ----------
    flow : ExactFlow
    w : (d, L)
        Initial coordinates at phase 0.
    points : (L,), optional
        Parameter point of each trajectory; by default trajectory i runs at point i.
    budget : Budget, optional
    exponents : int
        How many Lyapunov exponents to find, 1 to d.
    levels : bool
        Whether to read the levels of the motion; without it they are NaN.
    """
    points = np.arange(w.shape[1]) if points is None else np.asarray(points)
    sheet = _Sheet(flow, points, budget or Budget(), w)
    sheet.with_exponents(exponents)
    _wait(sheet)
    _find_exponents(sheet)
    _close(sheet)
    reading = _levels(sheet) if levels else Reading(*(np.full(w.shape[1], np.nan) for _ in fields(Reading)))
    return Verdicts(
        sheet.label.astype(np.int8), sheet.reason.astype(np.int8), sheet.period.astype(np.int32), sheet.w,
        sheet.residual, sheet.multipliers, sheet.exponent, sheet.low, sheet.high, sheet.spent, reading,
    )


def _wait(sheet: _Sheet) -> None:
    """Let transients die; settle every motion as soon as it returns to a stable orbit."""
    for stretch in sheet.budget.looks:
        lanes = sheet.open
        if len(lanes) == 0:
            return
        out = sheet.flow.advance(
            sheet.w[:, lanes], stretch, points=sheet.points[lanes], sections=sheet.budget.longest + 1
        )
        _move(sheet, lanes, out.w, out.status, stretch)
        _settle_periodic(sheet, lanes, out.sections)


def _move(sheet: _Sheet, lanes: np.ndarray, w: np.ndarray, status: np.ndarray, periods: int) -> None:
    sheet.w[:, lanes] = w
    sheet.spent[lanes] += periods
    for code, label, reason in (
        (DIVERGED, Label.DIVERGED, Reason.OUT_OF_RANGE), (None, Label.UNDECIDED, Reason.CHATTER),
    ):
        bad = lanes[status == code if code is not None else (status != OK) & (status != DIVERGED)]
        sheet.label[bad], sheet.reason[bad] = label, reason


def _settle_periodic(sheet: _Sheet, lanes: np.ndarray, sections: np.ndarray) -> None:
    """Try the few shortest near returns of each open lane until one is its orbit; sections (longest + 1, d, lanes)."""
    tries = candidates(sections, sheet.budget.longest, 3)
    for period in tries:
        mine = np.flatnonzero((sheet.label[lanes] == 0) & (period > 0))
        if len(mine) == 0:
            continue
        found = _minimal(sheet, orbit.polish(sheet.flow, sections[-1][:, mine], sheet.points[lanes[mine]],
                                             period[mine]), lanes[mine])
        distance = np.abs(sections[-1][:, mine] - found.w).max(axis=0)
        owned = found.stable & _approached(sections[:, :, mine], found, distance)
        _settle(sheet, lanes[mine[owned]], found, owned, Reason.ORBIT)
        owned = found.neutral & ~found.stable & (distance < _AT_ORBIT)
        _settle(sheet, lanes[mine[owned]], found, owned, Reason.NEUTRAL)


def _minimal(sheet: _Sheet, found: orbit.Orbits, lanes: np.ndarray) -> orbit.Orbits:
    """The same orbits with minimal periods and the multipliers of one round."""
    good = np.flatnonzero(found.converged)
    shortest = orbit.shortest_round(sheet.flow, found.w[:, good], sheet.points[lanes[good]], found.period[good])
    again = good[shortest < found.period[good]]
    if len(again):
        new = orbit.polish(sheet.flow, found.w[:, again], sheet.points[lanes[again]],
                           shortest[shortest < found.period[good]])
        found.w[:, again], found.period[again] = new.w, new.period
        found.residual[again], found.multipliers[again] = new.residual, new.multipliers
    return found


_AT_ORBIT = 1e-8
_CLOSE = 0.05


def _approached(sections: np.ndarray, found: orbit.Orbits, now: np.ndarray) -> np.ndarray:
    """Whether the trajectory (longest + 1, d, L) is at the orbit, or came closer to it in whole rounds."""
    longest = len(sections) - 1
    rounds = longest // found.period * found.period
    before = sections[longest - rounds, :, np.arange(sections.shape[2])].T
    return (now < _AT_ORBIT) | ((now < _CLOSE) & (now < np.abs(before - found.w).max(axis=0)))


def _settle(sheet: _Sheet, lanes: np.ndarray, found: orbit.Orbits, which: np.ndarray, reason: Reason) -> None:
    sheet.label[lanes], sheet.reason[lanes] = Label.PERIODIC, reason
    sheet.w[:, lanes], sheet.period[lanes] = found.w[:, which], found.period[which]
    sheet.residual[lanes], sheet.multipliers[lanes] = found.residual[which], found.multipliers[which]
    duration = found.period[which] * sheet.period_length(lanes)
    exact = lyapunov.from_multipliers(found.multipliers[which], duration).T[: len(sheet.exponent)]
    sheet.exponent[:, lanes] = sheet.low[:, lanes] = sheet.high[:, lanes] = exact


def _find_exponents(sheet: _Sheet) -> None:
    """Exponents of what has not returned, on runs that double while the verdict stays open."""
    length = sheet.budget.exponent
    for _ in range(sheet.budget.extensions + 1):
        lanes = sheet.open
        if len(lanes) == 0:
            return
        _run_exponents(sheet, lanes, length)
        length *= 2


def _run_exponents(sheet: _Sheet, lanes: np.ndarray, length: int) -> None:
    count, d = len(sheet.exponent), sheet.flow.dimension
    start = np.linalg.qr(np.ones((d, d)) + np.diag(np.arange(1.0, d + 1)))[0].T[:count]
    tangent = np.repeat(start[:, :, None], len(lanes), axis=2)
    out = sheet.flow.advance(
        sheet.w[:, lanes], length, points=sheet.points[lanes], tangent=tangent, growth=True, sections=length
    )
    _move(sheet, lanes, out.w, out.status, length)
    found = lyapunov.from_growth(out.growth[length // 20 :], sheet.period_length(lanes))
    sheet.exponent[:, lanes], sheet.low[:, lanes], sheet.high[:, lanes] = found.value, found.low, found.high
    _settle_periodic(sheet, lanes, out.sections[-sheet.budget.longest - 1 :])
    left = np.flatnonzero(sheet.label[lanes] == 0)
    _decide(sheet, lanes[left], torus.digits(out.sections[:, 0, left]))


_SMOOTH_DIGITS = 4.0
_ZERO = 1e-3


def _decide(sheet: _Sheet, lanes: np.ndarray, digits: np.ndarray) -> None:
    """Chaotic by a positive exponent; quasi-periodic by a zero one and a smooth section, which d = 2 cannot have.

    An exponent counts as zero only if its interval lies within 1e-3 of zero on both sides, since a slow spiral onto
    an orbit looks smooth too; and as positive only beyond 1e-3, since tangent vectors on a torus grow a little.
    """
    value, low, high = sheet.exponent[0, lanes], sheet.low[0, lanes], sheet.high[0, lanes]
    zero = (np.abs(value) < _ZERO) & (high - value < _ZERO)
    smooth = (digits >= _SMOOTH_DIGITS) & zero & (sheet.flow.dimension > 2)
    chaotic = (low > 0) & (value > _ZERO) & ~smooth
    sheet.label[lanes[smooth]], sheet.reason[lanes[smooth]] = Label.QUASI_PERIODIC, Reason.SMOOTH_CURVE
    sheet.label[lanes[chaotic]], sheet.reason[lanes[chaotic]] = Label.CHAOTIC, Reason.POSITIVE_EXPONENT


def _close(sheet: _Sheet) -> None:
    lanes = sheet.open
    sheet.label[lanes], sheet.reason[lanes] = Label.UNDECIDED, Reason.BUDGET


def _levels(sheet: _Sheet) -> Reading:
    """Levels over one round of an orbit, or over the budgeted stretch of any other bounded motion."""
    n = len(sheet.label)
    length = np.where(sheet.period > 0, sheet.period, sheet.budget.measured)
    bounded = sheet.label != Label.DIVERGED
    measures = measure.empty(n)
    for periods in np.unique(length[bounded]):
        mine = np.flatnonzero(bounded & (length == periods))
        out = sheet.flow.advance(sheet.w[:, mine], int(periods), points=sheet.points[mine], measured=True)
        measures[:, mine] = out.measures
    reading = read(measures, length * sheet.flow.system.period[sheet.points], length,
                   sheet.flow.system.static_force[sheet.points])
    values = [np.where(bounded, getattr(reading, f.name), np.nan) for f in fields(Reading)]
    return Reading(*values)
