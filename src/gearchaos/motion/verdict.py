"""What motion is it? A label for each trajectory, with the evidence for it, or an honest "undecided"."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from gearchaos.flow import ExactFlow, measure
from gearchaos.motion import lyapunov, torus
from gearchaos.motion.budget import Budget
from gearchaos.motion.label import Label, Reason
from gearchaos.motion.reading import Reading, read
from gearchaos.motion.sheet import Sheet

_STRETCH = 1280
"""Periods between looks at a motion that seems chaotic."""

_RECORD = 4_000_000
"""Most numbers of sections kept at once, so that memory does not grow with the number of trajectories."""

_SMOOTH_DIGITS = 4.0
_ZERO = 5e-4
_POSITIVE = 1e-3


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
        Lyapunov exponents per unit τ, largest first: exact of an orbit; of a torus from weighted Birkhoff averages,
        with the range of those of both halves of the run; else with 99 % intervals.
    rotation : (L,)
        Frequency of the strongest line of a quasi-periodic section, in cycles per mesh period; NaN for the others.
    transient_chaos : (L,)
        Whether the motion was chaotic, by its exponent, before it settled.
    spent : (L,)
        Mesh periods of transient and exponent runs.
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
    rotation: np.ndarray
    transient_chaos: np.ndarray
    spent: np.ndarray
    reading: Reading


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
    sheet = Sheet(flow, points, budget or Budget(), w, exponents)
    for stretch in sheet.budget.looks:
        sheet.wait(sheet.open, stretch)
    sheet.judge(_outlast(sheet, _examine(sheet, sheet.open)), Label.CHAOTIC, Reason.POSITIVE_EXPONENT)
    sheet.judge(sheet.open, Label.UNDECIDED, Reason.BUDGET)
    reading = _levels(sheet) if levels else Reading(*(np.full(w.shape[1], np.nan) for _ in fields(Reading)))
    return Verdicts(
        sheet.label.astype(np.int8), sheet.reason.astype(np.int8), sheet.period.astype(np.int32), sheet.w,
        sheet.residual, sheet.multipliers, sheet.exponent, sheet.low, sheet.high, sheet.rotation,
        sheet.wild & np.isin(sheet.label, (Label.PERIODIC, Label.QUASI_PERIODIC)), sheet.spent, reading,
    )


def _examine(sheet: Sheet, lanes: np.ndarray) -> np.ndarray:
    """Exponents of some motions, on runs that double while it is open what they are; which are chaotic."""
    length, chaotic = sheet.budget.exponent, lanes[:0]
    for _ in range(sheet.budget.extensions + 1):
        size = max(1, _RECORD // (length * sheet.flow.dimension))
        for part in (lanes[i : i + size] for i in range(0, len(lanes), size)):
            chaotic = np.concatenate([chaotic, part[_run(sheet, part, length)]])
        lanes = lanes[(sheet.label[lanes] == 0) & ~np.isin(lanes, chaotic)]
        length *= 2
    return chaotic


def _run(sheet: Sheet, lanes: np.ndarray, length: int) -> np.ndarray:
    """Exponents of some motions over one run; settle what returns or fills a smooth curve; which are chaotic."""
    d = sheet.flow.dimension
    start = np.linalg.qr(np.ones((d, d)) + np.diag(np.arange(1.0, d + 1)))[0].T[: sheet.exponents]
    tangent = np.repeat(start[:, :, None], len(lanes), axis=2)
    out = sheet.flow.advance(
        sheet.w[:, lanes], length, points=sheet.points[lanes], tangent=tangent, growth=True, sections=length
    )
    sheet.move(lanes, out.w, out.status, length)
    growth = out.growth[length // 20 :]
    found = lyapunov.from_growth(growth, sheet.period_length(lanes))
    sheet.exponent[:, lanes], sheet.low[:, lanes], sheet.high[:, lanes] = found.value, found.low, found.high
    sheet.settle_returning(lanes, out.sections, min(4 * sheet.budget.longest, length // 2))
    smooth = _settle_smooth(sheet, lanes, out.sections[:, 0], growth)
    positive = (found.low[0] > 0) & (found.value[0] > _POSITIVE) & ~smooth & (sheet.label[lanes] == 0)
    sheet.wild[lanes] |= positive
    return positive


def _settle_smooth(sheet: Sheet, lanes: np.ndarray, z: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Label motions whose sections z (N, lanes) fill a smooth curve at zero exponent; which they are.

    A slow spiral onto an orbit looks smooth too, so the exponents of both halves of the run must be zero; tangent
    vectors on a torus grow a little, so that an interval of block means would not do. A plane has no torus that
    attracts: the flow shrinks areas.
    """
    if sheet.flow.dimension == 2:
        return np.zeros(len(lanes), dtype=bool)
    both = np.stack(torus.halves(growth)) / sheet.period_length(lanes)
    zero = np.abs(both[:, 0]).max(axis=0) < _ZERO
    smooth = (torus.digits(z) >= _SMOOTH_DIGITS) & zero & (sheet.label[lanes] == 0)
    mine = lanes[smooth]
    sheet.judge(mine, Label.QUASI_PERIODIC, Reason.SMOOTH_CURVE)
    sheet.rotation[mine] = torus.rotation(z[:, smooth])
    low, high = np.sort(both[:, :, smooth], axis=0)
    sheet.exponent[:, mine], sheet.low[:, mine], sheet.high[:, mine] = (low + high) / 2, low, high
    return smooth


def _outlast(sheet: Sheet, chaotic: np.ndarray) -> np.ndarray:
    """Follow chaotic motions as long as the patience lasts, since chaos may be a transient; which are chaotic still."""
    hasty = sheet.spent[chaotic] < sheet.budget.patience
    waiting = waited = chaotic[hasty]
    while len(waiting):
        sheet.wait(waiting, _STRETCH)
        waiting = waiting[(sheet.label[waiting] == 0) & (sheet.spent[waiting] < sheet.budget.patience)]
    return np.concatenate([chaotic[~hasty], _examine(sheet, waited[sheet.label[waited] == 0])])


def _levels(sheet: Sheet) -> Reading:
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
