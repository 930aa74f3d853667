"""Which label a motion gets, in three stages, each for the motions that the previous one left unresolved.

Periodic, diverged and chattering motions are recognised by `transients.py`, all others here.

Arguments named ``motions`` are the indices of some of the motions of a `ClassificationState`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from gearchaos.dynamics import orbits, time_series
from gearchaos.dynamics.response import Deflections, compute_response
from gearchaos.dynamics.settings import Classification
from gearchaos.dynamics.time_series import time_sum
from gearchaos.dynamics.transients import ClassificationState
from gearchaos.dynamics.verdicts import Label, Reason, Verdicts
from gearchaos.flow import ExactFlow, Measure, of_meshes

_CHAOS_INTERVAL = 2560
"""Mesh periods between two tests of whether a chaotic motion has settled on an orbit."""

_MAX_SECTION_VALUES = 4_000_000
"""Largest number of values of the sections recorded at once, which bounds the memory for any batch size."""

_TORUS_DIGITS = 4.0
"""Smallest number of decimal digits to which weighted Birkhoff averages of a quasi-periodic motion agree."""

_ZERO_EXPONENT = 5e-4
"""Upper bound of |λ1| of a quasi-periodic motion, and of the decay rate of a mean rotation that counts as neutral, per
unit of τ."""

_CHAOTIC_EXPONENT = 1e-3
"""Lower bound of λ1 of a chaotic motion, per unit of τ."""

_FLANKS, _SOON = 2, 16
"""Contacts of a mesh of one spring, and mesh periods in which nearly all chaotic motions change contact."""

_MAX_TRACE_ERROR = 1e-6
"""Largest |sum of the exponents − trace| of a consistent run, per unit of τ."""

_LONG_ORBIT = 16
"""A motion with negative exponents that is not classified otherwise is searched for orbits of up to this many times the
longest period."""

_TRACE_CHECK_PERIODS = 32
"""Length in mesh periods of the run that checks the sum of all exponents where only the largest was computed."""


def classify(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray | None = None, *, settings: Classification | None = None,
    response: bool = True,
) -> Verdicts:
    """Classify motions.

    Parameters
    ----------
    flow : ExactFlow
    w : (d, L)
        Initial states at phase 0.
    points : (L,), optional
        Parameter point of each motion; by default motion i runs at point i.
    settings : Classification, optional
    response : bool
        Whether to compute the response measures; without it they are missing.

    Returns
    -------
    Verdicts

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.dynamics import Label, classify, motion_name
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1), {"eps1": [0.1, 0.2, 0.206]})
    >>> verdicts = classify(problem.flow, problem.w)
    >>> [motion_name(Label(label), period) for label, period in zip(verdicts.label, verdicts.period)]
    ['2T', 'chaotic', '8T']
    """
    points = np.arange(w.shape[1]) if points is None else np.asarray(points)
    state = ClassificationState(flow, points, settings or Classification(), w)
    for stage in STAGES.values():
        stage(state)
    return conclude(state, response=response)


def _transient_stage(state: ClassificationState) -> None:
    """Run all motions through their transients, and classify those that reach a stable periodic orbit."""
    for periods in state.settings.transient_lengths:
        state.run_transient(state.unresolved, periods)


def _exponent_stage(state: ClassificationState) -> None:
    """Classify unresolved motions by their exponents, except chaotic ones whose chaos may be transient."""
    positive = _classify_by_exponents(state, state.unresolved)
    state.assign(np.setdiff1d(state.unresolved, positive), Label.UNDECIDED, Reason.BUDGET)
    motions = state.unresolved
    _end_unstable(state, motions[state.verdicts.periods_run[motions] >= state.settings.longest_transient])


def _chaos_stage(state: ClassificationState) -> None:
    """Follow chaotic motions up to the longest transient, and classify them by the exponents of their last periods."""
    settings, motions = state.settings, state.unresolved
    end = settings.longest_transient - settings.exponent_run
    periods_run = state.verdicts.periods_run
    while len(motions := motions[~state.resolved[motions] & (periods_run[motions] < end)]):
        before = periods_run[motions]
        for periods in np.unique(before):  # so that the times of the tests do not depend on the batch
            until = min(end, (periods // _CHAOS_INTERVAL + 1) * _CHAOS_INTERVAL)
            state.run_transient(motions[before == periods], max(2 * settings.longest_period + 1, int(until - periods)))
    _end_unstable(state, _classify_by_exponents(state, state.unresolved))
    state.assign(state.unresolved, Label.UNDECIDED, Reason.BUDGET)


STAGES: dict[str, Callable[[ClassificationState], None]] = {
    "transients": _transient_stage, "exponents": _exponent_stage, "chaos": _chaos_stage,
}
"""The stages by name, in order. After the last one every motion is classified. Each stage runs longer than the previous
one and for fewer motions, so a study that runs a stage on parts of its motions collects the unresolved ones of all
parts before the next stage."""


def conclude(state: ClassificationState, *, response: bool = True) -> Verdicts:
    """Finish a classification in which every motion is resolved, and return the verdicts.

    The sum of the exponents of each motion is compared with the trace.

    Parameters
    ----------
    state : ClassificationState
        With L motions, all of them resolved.
    response : bool
        Whether to compute the response measures; without it they are missing.

    Returns
    -------
    Verdicts

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.dynamics import STAGES, Classification, ClassificationState, conclude
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> problem = initial_value_problems(gc.MeshModel.of(q0=0.1, eps1=0.1))
    >>> state = ClassificationState(problem.flow, problem.points, Classification(), problem.w)
    >>> for stage in STAGES.values():
    ...     stage(state)
    >>> conclude(state).label.tolist()
    [1]
    """
    verdicts = state.verdicts
    bounded = ~np.isin(verdicts.reason, (Reason.OUT_OF_RANGE, Reason.CHATTER))
    motions = np.flatnonzero(bounded & np.isnan(verdicts.trace_error))  # only their largest exponent was computed
    if len(motions):
        frame = orbits.tangent_frame(state.flow.dimension, len(motions))
        measured = state.flow.system.law.in_contact
        run = state.advance(motions, _TRACE_CHECK_PERIODS, tangent=frame, growth=True, measured=measured)
        duration = _TRACE_CHECK_PERIODS * state.period_length(motions)
        trace = orbits.mean_trace(state.flow.system, state.points[motions], run.measures, duration)
        state.set_trace_error(motions, time_sum(run.growth).sum(axis=0) / duration, trace)
    wrong = np.flatnonzero(verdicts.trace_error > _MAX_TRACE_ERROR)
    state.assign(wrong, Label.UNDECIDED, Reason.INCONSISTENT)
    verdicts.period[wrong], verdicts.residual[wrong], verdicts.multipliers[wrong] = 0, np.nan, np.nan
    settled = np.isin(verdicts.label, (Label.PERIODIC, Label.QUASI_PERIODIC))
    verdicts.transient_chaos[:] = state.chaotic_so_far & settled
    if response:
        motions = np.flatnonzero(verdicts.label != Label.DIVERGED)
        period = verdicts.period[motions]
        periods = np.where(period > 0, period, state.settings.averaging_periods)
        measures = state.advance(motions, periods, measured=True).measures
        duration, force = periods * state.period_length(motions), state.flow.system.static_force[state.points[motions]]
        found, meshes = compute_response(measures, duration, periods, force)
        verdicts.response.put(motions, found)
        verdicts.deflections.put(motions, Deflections.of(measures))
        contacts = state.flow.system.contacts
        if contacts is not None and contacts.names:
            verdicts.meshes.put(motions, meshes)
    return verdicts


def _classify_by_exponents(state: ClassificationState, motions: np.ndarray) -> np.ndarray:
    """Classify motions by exponent runs of doubling length, except those with a positive one, whose numbers are
    returned."""
    length, unstable = state.settings.exponent_run, motions[:0]
    for _ in range(state.settings.doublings + 1):
        for part in _parts(state, motions, length):
            unstable = np.concatenate([unstable, part[_exponent_run(state, part, length)]])
        motions = motions[~state.resolved[motions] & ~np.isin(motions, unstable)]
        length *= 2
    longest = min(_LONG_ORBIT * state.settings.longest_period, state.settings.longest_transient // 2)
    settled = motions[state.verdicts.exponent_high[0, motions] < 0]  # their period is not one of the nearest returns
    for part in _parts(state, settled, 2 * longest + 1):
        state.classify_long_orbits(part, longest)
    return unstable


def _parts(state: ClassificationState, motions: np.ndarray, sections: int) -> Iterator[np.ndarray]:
    """Parts of these motions of which this number of sections can be recorded at once."""
    size = max(1, _MAX_SECTION_VALUES // (sections * state.flow.dimension))
    return (motions[i : i + size] for i in range(0, len(motions), size))


def _exponent_run(state: ClassificationState, motions: np.ndarray, length: int) -> np.ndarray:
    """Compute exponents over one run, and classify periodic and quasi-periodic motions.

    Returns which motions have a positive exponent, (motions,) of bool. The first twentieth of the run, in which the
    tangent vectors align, is dropped.
    """
    tangent = orbits.tangent_frame(state.flow.dimension, len(motions))[: None if state.all_exponents else 1]
    out = state.advance(motions, length, tangent=tangent, growth=True, sections=length)
    state.record_run(motions, out.w, out.status, length)
    growth = out.growth[length // 20 :]
    exponents = time_series.exponents_from_growth(growth, state.period_length(motions))
    state.set_exponents(motions, exponents.value, exponents.low, exponents.high)
    state.classify_returning(motions, out.sections, min(4 * state.settings.longest_period, length // 2))
    _classify_tori(state, motions, out.sections[:, 0], growth)
    positive = (exponents.low[0] > 0) & (exponents.value[0] > _CHAOTIC_EXPONENT) & ~state.resolved[motions]
    chaotic = positive.copy()
    chaotic[positive] = ~_linear(state, motions[positive])
    state.chaotic_so_far[motions] |= chaotic
    return positive


def _end_unstable(state: ClassificationState, motions: np.ndarray) -> None:
    """Label motions with a positive exponent: they are chaotic unless they surely are linear."""
    linear = _linear(state, motions)
    state.assign(motions[~linear], Label.CHAOTIC, Reason.POSITIVE_EXPONENT)
    state.assign(motions[linear], Label.UNDECIDED, Reason.LINEAR)


def _linear(state: ClassificationState, motions: np.ndarray) -> np.ndarray:
    """Whether motions (M,) are linear for the mesh periods of an exponent run, since no contact of one spring changes.

    Then no exponent is positive; one that seems so is of a run shorter than the slowest modes. Contacts of tooth pairs
    may change while their mesh keeps contact: of them nothing is said.
    """
    contacts, linear = state.flow.system.contacts, np.zeros(len(motions), bool)
    if len(motions) == 0 or contacts is None or np.bincount(contacts.meshes).max() > _FLANKS:
        return linear
    linear[:] = True
    for periods in (1, _SOON, state.settings.exponent_run):  # most chaotic motions change contact in the first
        some = np.flatnonzero(linear)
        measures = state.advance(motions[some], periods, measured=True).measures
        linear[some] = of_meshes(measures)[:, Measure.SWITCHES].sum(axis=0) == 0
    return linear


def _classify_tori(state: ClassificationState, motions: np.ndarray, z: np.ndarray, growth: np.ndarray) -> None:
    """Classify motions as quasi-periodic if their sections z (N, motions) fill a smooth curve and their λ1 is zero.

    A slow spiral onto an orbit looks smooth too. Therefore λ1 must be zero in both halves of the run. It is taken from
    weighted Birkhoff averages of ``growth`` (N, K, motions): tangent vectors on a torus grow slower than exponentially,
    and an interval from block means would not contain zero.
    """
    # damping excludes a torus of two coordinates, or of three if one is a mean rotation with weak bearing damping
    neutral_rotation = state.flow.system.rotation_decay[state.points[motions]] < _ZERO_EXPONENT
    planar = neutral_rotation & (state.flow.dimension <= 3)
    if np.all(planar):
        return
    halves = np.stack(time_series.half_averages(growth)) / state.period_length(motions)
    zero = np.abs(halves[:, 0]).max(axis=0) < _ZERO_EXPONENT
    smooth = (time_series.agreeing_digits(z) >= _TORUS_DIGITS) & zero & ~state.resolved[motions] & ~planar
    tori = motions[smooth]
    state.assign(tori, Label.QUASI_PERIODIC, Reason.SMOOTH_CURVE)
    state.verdicts.rotation[tori] = time_series.dominant_frequency(z[:, smooth])
    low, high = np.sort(halves[:, :, smooth], axis=0)
    state.set_exponents(tori, (low + high) / 2, low, high)
