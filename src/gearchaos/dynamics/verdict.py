"""What motion is it? A label for each trajectory, with the evidence for it, or an honest "undecided"."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from gearchaos.dynamics import lyapunov, torus
from gearchaos.dynamics.labels import Label, Reason
from gearchaos.dynamics.response import Response, response
from gearchaos.dynamics.series import total
from gearchaos.dynamics.settings import Classification
from gearchaos.dynamics.state import ClassificationState
from gearchaos.flow import ExactFlow, empty_measures

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
    periods_run : (L,)
        Mesh periods of transient and exponent runs.
    response : Response
        Response measures of the motion.
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
    periods_run: np.ndarray
    response: Response


def classify(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray | None = None, *, settings: Classification | None = None,
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
    settings : Classification, optional
    levels : bool
        Whether to read the levels of the motion; without it they are NaN.
    """
    points = np.arange(w.shape[1]) if points is None else np.asarray(points)
    state = ClassificationState(flow, points, settings or Classification(), w)
    for stage in STAGES.values():
        stage(state)
    return conclude(state, levels=levels)


def look(state: ClassificationState) -> None:
    """Wait for the transients to pass; judge every motion that comes to a stable orbit."""
    for stretch in state.settings.transient_lengths:
        state.wait(state.unresolved, stretch)


def examine(state: ClassificationState) -> None:
    """Judge by its exponents every motion still open, but chaos that must be outlasted to know whether it lasts."""
    _exponents(state, state.unresolved)
    state.judge(state.unresolved[~state.chaotic_so_far[state.unresolved]], Label.UNDECIDED, Reason.BUDGET)
    outlasted = state.unresolved[state.periods_run[state.unresolved] >= state.settings.longest_transient]
    state.judge(outlasted, Label.CHAOTIC, Reason.POSITIVE_EXPONENT)


def outlast(state: ClassificationState) -> None:
    """Follow the chaos still open as long as the patience lasts, since it may be a transient, and judge it by its
    last periods."""
    settings, waiting = state.settings, state.unresolved
    end = settings.longest_transient - settings.exponent_run
    while len(waiting := waiting[(state.label[waiting] == 0) & (state.periods_run[waiting] < end)]):
        spent = state.periods_run[waiting]
        for before in np.unique(spent):  # each by its own clock, whoever is beside it; from the second round on in step
            until = min(end, (before // _STRETCH + 1) * _STRETCH)
            state.wait(waiting[spent == before], max(2 * settings.longest_period + 1, int(until - before)))
    state.judge(_exponents(state, state.unresolved), Label.CHAOTIC, Reason.POSITIVE_EXPONENT)
    state.judge(state.unresolved, Label.UNDECIDED, Reason.BUDGET)


STAGES: dict[str, Callable[[ClassificationState], None]] = {"transients": look, "exponents": examine, "chaos": outlast}
"""One after the other they judge all motions. Each takes longer, for ever fewer of them: a study gathers from all its
tiles what is still open before it goes on to the next."""


def conclude(state: ClassificationState, *, levels: bool = True) -> Verdicts:
    """The verdicts of motions that are judged: their exponents' sum checked, and their levels read."""
    _check_sums(state)
    state.distrust(np.flatnonzero(state.trace_error > _TRACE_ERROR))
    measures = _levels(state) if levels else Response(*(np.full(len(state.label), np.nan) for _ in fields(Response)))
    return Verdicts(
        state.label.astype(np.int8), state.reason.astype(np.int8), state.period.astype(np.int32), state.w,
        state.residual, state.multipliers, state.exponent, state.low, state.high, state.trace_error, state.rotation,
        state.chaotic_so_far & np.isin(state.label, (Label.PERIODIC, Label.QUASI_PERIODIC)), state.periods_run,
        measures,
    )


def _exponents(state: ClassificationState, lanes: np.ndarray) -> np.ndarray:
    """Exponents of some motions, on runs that double while it is open what they are; which are chaotic."""
    length, chaotic = state.settings.exponent_run, lanes[:0]
    for _ in range(state.settings.doublings + 1):
        size = max(1, _RECORD // (length * state.flow.dimension))
        for part in (lanes[i : i + size] for i in range(0, len(lanes), size)):
            chaotic = np.concatenate([chaotic, part[_run(state, part, length)]])
        lanes = lanes[(state.label[lanes] == 0) & ~np.isin(lanes, chaotic)]
        length *= 2
    return chaotic


def _run(state: ClassificationState, lanes: np.ndarray, length: int) -> np.ndarray:
    """Exponents of some motions over one run; settle what returns or fills a smooth curve; which are chaotic."""
    tangent = lyapunov.frame(state.flow.dimension, len(lanes))[: None if state.spectrum else 1]
    out = state.flow.advance(
        state.w[:, lanes], length, points=state.points[lanes], tangent=tangent, growth=True, sections=length
    )
    state.move(lanes, out.w, out.status, length)
    growth = out.growth[length // 20 :]
    found = lyapunov.from_growth(growth, state.period_length(lanes))
    state.set_exponents(lanes, found.value, found.low, found.high)
    state.settle_returning(lanes, out.sections, min(4 * state.settings.longest_period, length // 2))
    smooth = _settle_smooth(state, lanes, out.sections[:, 0], growth)
    positive = (found.low[0] > 0) & (found.value[0] > _POSITIVE) & ~smooth & (state.label[lanes] == 0)
    state.chaotic_so_far[lanes] |= positive
    return positive


def _settle_smooth(state: ClassificationState, lanes: np.ndarray, z: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Label motions whose sections z (N, lanes) fill a smooth curve at zero exponent; which they are.

    A slow spiral onto an orbit looks smooth too, so the exponents of both halves of the run must be zero; tangent
    vectors on a torus grow a little, so that an interval of block means would not do.
    """
    planar = _planar(state, lanes)
    if np.all(planar):
        return np.zeros(len(lanes), dtype=bool)
    both = np.stack(torus.halves(growth)) / state.period_length(lanes)
    zero = np.abs(both[:, 0]).max(axis=0) < _ZERO
    smooth = (torus.digits(z) >= _SMOOTH_DIGITS) & zero & (state.label[lanes] == 0) & ~planar
    mine = lanes[smooth]
    state.judge(mine, Label.QUASI_PERIODIC, Reason.SMOOTH_CURVE)
    state.rotation[mine] = torus.rotation(z[:, smooth])
    low, high = np.sort(both[:, :, smooth], axis=0)
    state.set_exponents(mine, (low + high) / 2, low, high)
    return smooth


def _planar(state: ClassificationState, lanes: np.ndarray) -> np.ndarray:
    """Where the relative motion is one in a plane, (lanes,), which has no torus that attracts: the flow shrinks areas.

    A mean rotation that the bearings hardly brake is a third coordinate with an exponent of zero of its own.
    """
    apart = state.flow.system.rotation_decay[state.points[lanes]] < _ZERO
    return apart & (state.flow.dimension <= 3)


def _check_sums(state: ClassificationState) -> None:
    """A short run with all exponents for motions that were judged by the largest alone."""
    bounded = ~np.isin(state.reason, (Reason.OUT_OF_RANGE, Reason.CHATTER))
    lanes = np.flatnonzero(bounded & np.isnan(state.trace_error))
    if len(lanes):
        frame = lyapunov.frame(state.flow.dimension, len(lanes))
        out = state.flow.advance(state.w[:, lanes], _CHECKED, points=state.points[lanes], tangent=frame, growth=True)
        state.check_sum(lanes, total(out.growth).sum(axis=0) / (_CHECKED * state.period_length(lanes)))


def _levels(state: ClassificationState) -> Response:
    """Levels over one round of an orbit, or over the budgeted stretch of any other bounded motion."""
    n = len(state.label)
    length = np.where(state.period > 0, state.period, state.settings.averaging_periods)
    bounded = state.label != Label.DIVERGED
    lanes, measures = np.flatnonzero(bounded), empty_measures(n)
    out = state.flow.advance(state.w[:, lanes], length[lanes], points=state.points[lanes], measured=True)
    measures[:, lanes] = out.measures
    found = response(measures, length * state.flow.system.period[state.points], length,
                     state.flow.system.static_force[state.points])
    values = [np.where(bounded, getattr(found, f.name), np.nan) for f in fields(Response)]
    return Response(*values)
