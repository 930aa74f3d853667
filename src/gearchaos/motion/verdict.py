"""What motion is it? A label for each trajectory, with the evidence for it, or an honest "undecided"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from gearchaos.flow import ExactFlow, empty_measures
from gearchaos.motion import lyapunov, torus
from gearchaos.motion.budget import Budget
from gearchaos.motion.label import Label, Reason
from gearchaos.motion.reading import Reading, read
from gearchaos.motion.series import total
from gearchaos.motion.sheet import Sheet

_STRETCH = 2560
"""A motion that seems chaotic is looked at after every so many periods."""

_RECORD = 4_000_000
"""Most numbers of sections kept at once, so that memory does not grow with the number of trajectories."""

_SMOOTH_DIGITS = 4.0
_ZERO = 5e-4
_POSITIVE = 1e-3
_TRACE_ERROR = 1e-6
_CHECKED = 32


@dataclass(frozen=True)
class Verdicts:
    """Verdicts on L trajectories of a d-dimensional system.

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
    exponent, low, high : (d, L)
        Lyapunov exponents per unit τ, largest first: exact of an orbit; of a torus from weighted Birkhoff averages,
        with the range of those of both halves of the run; else with 99 % intervals. In a map all but the
        first are NaN, except of orbits.
    trace_error : (L,)
        By how much the exponents miss their sum, the trace of the linear part. Beyond 1e-6 the verdict is undecided.
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
    trace_error: np.ndarray
    rotation: np.ndarray
    transient_chaos: np.ndarray
    spent: np.ndarray
    reading: Reading


def classify(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray | None = None, *, budget: Budget | None = None,
    levels: bool = True,
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
    levels : bool
        Whether to read the levels of the motion; without it they are NaN.
    """
    points = np.arange(w.shape[1]) if points is None else np.asarray(points)
    sheet = Sheet(flow, points, budget or Budget(), w)
    for stage in STAGES.values():
        stage(sheet)
    return conclude(sheet, levels=levels)


def look(sheet: Sheet) -> None:
    """Wait for the transients to pass; judge every motion that comes to a stable orbit."""
    for stretch in sheet.budget.looks:
        sheet.wait(sheet.open, stretch)


def examine(sheet: Sheet) -> None:
    """Judge by its exponents every motion still open, but chaos that must be outlasted to know whether it lasts."""
    _exponents(sheet, sheet.open)
    sheet.judge(sheet.open[~sheet.wild[sheet.open]], Label.UNDECIDED, Reason.BUDGET)
    outlasted = sheet.open[sheet.spent[sheet.open] >= sheet.budget.patience]
    sheet.judge(outlasted, Label.CHAOTIC, Reason.POSITIVE_EXPONENT)


def outlast(sheet: Sheet) -> None:
    """Follow the chaos still open as long as the patience lasts, since it may be a transient, and judge it by its
    last periods."""
    budget, waiting = sheet.budget, sheet.open
    end = budget.patience - budget.exponent
    while len(waiting := waiting[(sheet.label[waiting] == 0) & (sheet.spent[waiting] < end)]):
        spent = sheet.spent[waiting]
        for before in np.unique(spent):  # each by its own clock, whoever is beside it; from the second round on in step
            until = min(end, (before // _STRETCH + 1) * _STRETCH)
            sheet.wait(waiting[spent == before], max(2 * budget.longest + 1, int(until - before)))
    sheet.judge(_exponents(sheet, sheet.open), Label.CHAOTIC, Reason.POSITIVE_EXPONENT)
    sheet.judge(sheet.open, Label.UNDECIDED, Reason.BUDGET)


STAGES: dict[str, Callable[[Sheet], None]] = {"transients": look, "exponents": examine, "chaos": outlast}
"""One after the other they judge all motions. Each takes longer, for ever fewer of them: a study gathers from all its
tiles what is still open before it goes on to the next."""


def conclude(sheet: Sheet, *, levels: bool = True) -> Verdicts:
    """The verdicts of motions that are judged: their exponents' sum checked, and their levels read."""
    _check_sums(sheet)
    sheet.distrust(np.flatnonzero(sheet.trace_error > _TRACE_ERROR))
    reading = _levels(sheet) if levels else Reading(*(np.full(len(sheet.label), np.nan) for _ in fields(Reading)))
    return Verdicts(
        sheet.label.astype(np.int8), sheet.reason.astype(np.int8), sheet.period.astype(np.int32), sheet.w,
        sheet.residual, sheet.multipliers, sheet.exponent, sheet.low, sheet.high, sheet.trace_error, sheet.rotation,
        sheet.wild & np.isin(sheet.label, (Label.PERIODIC, Label.QUASI_PERIODIC)), sheet.spent, reading,
    )


def _exponents(sheet: Sheet, lanes: np.ndarray) -> np.ndarray:
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
    tangent = lyapunov.frame(sheet.flow.dimension, len(lanes))[: None if sheet.spectrum else 1]
    out = sheet.flow.advance(
        sheet.w[:, lanes], length, points=sheet.points[lanes], tangent=tangent, growth=True, sections=length
    )
    sheet.move(lanes, out.w, out.status, length)
    growth = out.growth[length // 20 :]
    found = lyapunov.from_growth(growth, sheet.period_length(lanes))
    sheet.set_exponents(lanes, found.value, found.low, found.high)
    sheet.settle_returning(lanes, out.sections, min(4 * sheet.budget.longest, length // 2))
    smooth = _settle_smooth(sheet, lanes, out.sections[:, 0], growth)
    positive = (found.low[0] > 0) & (found.value[0] > _POSITIVE) & ~smooth & (sheet.label[lanes] == 0)
    sheet.wild[lanes] |= positive
    return positive


def _settle_smooth(sheet: Sheet, lanes: np.ndarray, z: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Label motions whose sections z (N, lanes) fill a smooth curve at zero exponent; which they are.

    A slow spiral onto an orbit looks smooth too, so the exponents of both halves of the run must be zero; tangent
    vectors on a torus grow a little, so that an interval of block means would not do.
    """
    planar = _planar(sheet, lanes)
    if np.all(planar):
        return np.zeros(len(lanes), dtype=bool)
    both = np.stack(torus.halves(growth)) / sheet.period_length(lanes)
    zero = np.abs(both[:, 0]).max(axis=0) < _ZERO
    smooth = (torus.digits(z) >= _SMOOTH_DIGITS) & zero & (sheet.label[lanes] == 0) & ~planar
    mine = lanes[smooth]
    sheet.judge(mine, Label.QUASI_PERIODIC, Reason.SMOOTH_CURVE)
    sheet.rotation[mine] = torus.rotation(z[:, smooth])
    low, high = np.sort(both[:, :, smooth], axis=0)
    sheet.set_exponents(mine, (low + high) / 2, low, high)
    return smooth


def _planar(sheet: Sheet, lanes: np.ndarray) -> np.ndarray:
    """Where the relative motion is one in a plane, (lanes,), which has no torus that attracts: the flow shrinks areas.

    A mean rotation that the bearings hardly brake is a third coordinate with an exponent of zero of its own.
    """
    apart = sheet.flow.system.rotation_decay[sheet.points[lanes]] < _ZERO
    return apart & (sheet.flow.dimension <= 3)


def _check_sums(sheet: Sheet) -> None:
    """A short run with all exponents for motions that were judged by the largest alone."""
    bounded = ~np.isin(sheet.reason, (Reason.OUT_OF_RANGE, Reason.CHATTER))
    lanes = np.flatnonzero(bounded & np.isnan(sheet.trace_error))
    if len(lanes):
        frame = lyapunov.frame(sheet.flow.dimension, len(lanes))
        out = sheet.flow.advance(sheet.w[:, lanes], _CHECKED, points=sheet.points[lanes], tangent=frame, growth=True)
        sheet.check_sum(lanes, total(out.growth).sum(axis=0) / (_CHECKED * sheet.period_length(lanes)))


def _levels(sheet: Sheet) -> Reading:
    """Levels over one round of an orbit, or over the budgeted stretch of any other bounded motion."""
    n = len(sheet.label)
    length = np.where(sheet.period > 0, sheet.period, sheet.budget.measured)
    bounded = sheet.label != Label.DIVERGED
    lanes, measures = np.flatnonzero(bounded), empty_measures(n)
    out = sheet.flow.advance(sheet.w[:, lanes], length[lanes], points=sheet.points[lanes], measured=True)
    measures[:, lanes] = out.measures
    reading = read(measures, length * sheet.flow.system.period[sheet.points], length,
                   sheet.flow.system.static_force[sheet.points])
    values = [np.where(bounded, getattr(reading, f.name), np.nan) for f in fields(Reading)]
    return Reading(*values)
