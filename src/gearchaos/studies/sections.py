"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included.

Where the two bearings differ the rotation of the wheels has no closed form, and is integrated along the motion. The
integral over each mesh period is computed from the state recorded at its start. It is exact to rounding errors, and
all periods of a motion are computed in parallel.
"""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import Batch
from gearchaos.model.coordinates import (
    bearings_differ,
    initial_values,
    relative_rotation,
    to_physical,
    transmission_error_at_start,
    weakly_damped,
)
from gearchaos.model.switched import rotation_decay, switched_system
from gearchaos.studies.initial_value_problems import InitialValueProblems


def steady_sections(problems: InitialValueProblems, verdicts: Verdicts, count: int) -> dict[str, np.ndarray]:
    """Stroboscopic sections of steady motions in physical coordinates.

    Parameters
    ----------
    problems : InitialValueProblems
        The L motions, from τ = 0.
    verdicts : Verdicts
        The sections start from its states: a point of the orbit, or the last state of a motion without one. The mean
        rotation is that of the motion itself.
    count : int
        Number of sections.

    Returns
    -------
    dict of str to (L, count)
        By name of the coordinate.
    """
    batch, flow, points = problems.batch, problems.flow, problems.points
    sections = flow.advance(verdicts.w, count, points=points, sections=count).sections
    x2 = np.full((len(points), count), np.nan)  # where it follows from the sections
    differ = bearings_differ(batch, flow.system.names)
    integrated = np.flatnonzero(differ & ((verdicts.period > 0) | weakly_damped(batch)))
    if len(integrated):
        x2[integrated] = rotation_at_sections(
            problems.take(integrated), verdicts.periods_run[integrated], sections[:, :, integrated],
            verdicts.w[:, integrated])[:, 1:]
    number = verdicts.periods_run[:, None] + np.arange(1, count + 1)
    error, error_dot = transmission_error_at_start(batch)
    return to_physical(
        batch, flow.system.names, np.moveaxis(sections, (0, 1, 2), (1, 2, 0)),
        number * flow.system.period[points, None], error[:, None], error_dot[:, None], x2)


def rotation_at_sections(
    problems: InitialValueProblems, before: np.ndarray, sections: np.ndarray, orbit: np.ndarray | None = None
) -> np.ndarray:
    """x2 of L motions after ``before`` mesh periods and at the S sections that follow, (L, S + 1).

    Parameters
    ----------
    problems : InitialValueProblems
        The motions, from τ = 0.
    before : (L,)
        Mesh periods before the sections.
    sections : (S, d, L)
        States after each of the next S periods.
    orbit : (d, L), optional
        States from which the sections follow; by default those that the motions have reached. The mean rotation of the
        motions is kept.
    """
    batch, flow, points = problems.batch, problems.flow, problems.points
    names, error = flow.system.names, transmission_error_at_start(batch)[0]
    end = flow.advance(problems.w, before, points=points, measured=True)
    first = end.w if orbit is None else orbit
    x1 = initial_values(batch)["x1"] + end.measures[Measure.VELOCITY]
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    x1 = x1 + J2 / (J1 + J2) * (relative_rotation(names, first.T, error) - relative_rotation(names, end.w.T, error))
    states = np.concatenate([first[None], sections])
    x1 = np.concatenate([x1[None], _x1_changes(flow, points, states[:-1])]).cumsum(axis=0).T
    decay = _decaying_rotation(problems, end.w - first, len(sections))
    return x1 + decay - relative_rotation(names, np.moveaxis(states, 1, 2), error).T


def _decaying_rotation(problems: InitialValueProblems, difference: np.ndarray, count: int) -> np.ndarray:
    """The rotation (L, count + 1) due to the difference in mean velocity between motions and their orbits.

    ``difference`` (d, L) is the difference of the states. The velocity v e^(−rτ), which bearing damping makes decay
    with the rate r, has the integral v τ (1 − e^(−rτ))/(rτ) at τ = 0, T, 2T, ...
    """
    batch, system = problems.batch, problems.flow.system
    names = system.names
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    relative = relative_rotation(names, difference.T, np.zeros(1), "_dot")
    velocity = difference[names.index("x2_dot")] + J1 / (J1 + J2) * relative
    tau = np.arange(count + 1) * system.period[problems.points, None]
    from scipy.special import hyp1f1  # here, since it takes a tenth of a second to load

    return velocity[:, None] * tau * hyp1f1(1, 2, -rotation_decay(batch)[:, None] * tau)


def _x1_changes(flow: ExactFlow, points: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The change of x1 in the mesh period that follows each state w (S, d, L), (S, L); ``points`` (L,) as of
    `rotation_at_sections`."""
    count, d, motions = w.shape
    flat = np.moveaxis(w, 1, 0).reshape(d, count * motions)
    bounded = np.all(np.isfinite(flat), axis=0)
    out = flow.advance(np.where(bounded, flat, 0.0), 1, points=np.tile(points, count), measured=True)
    return np.where(bounded, out.measures[Measure.VELOCITY], np.nan).reshape(count, motions)


def rotation_within_periods(batch: Batch, names: tuple[str, ...], samples: np.ndarray) -> np.ndarray:
    """The change of x2 (N, M) since the start of the mesh period, at M samples (N, M, d) of each of N periods."""
    periods, count, d = samples.shape
    first = np.nan_to_num(samples[:, 0].T)
    flow = ExactFlow(switched_system(batch, (*names, "x2")), count)
    w = np.concatenate([first, np.zeros((1, periods))])
    return flow.advance(w, 1, points=np.zeros(periods, dtype=int), sample=True).samples[0, :, d].T
