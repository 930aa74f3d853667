"""The rotation of the wheels, integrated along a motion where the two bearings differ, so that it has no closed form.

The integral over each mesh period is computed from the state recorded at its start. It is exact to rounding errors, and
all periods of a motion are computed in parallel.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import Batch
from gearchaos.model.coordinates import initial_values, relative_rotation, transmission_error_at_start
from gearchaos.model.switched import rotation_decay, switched_system


def at_sections(
    batch: Batch, flow: ExactFlow, points: np.ndarray, initial: np.ndarray, before: np.ndarray, sections: np.ndarray,
    orbit: np.ndarray | None = None,
) -> np.ndarray:
    """x2 of L motions after ``before`` mesh periods and at the S sections that follow, (L, S + 1).

    Parameters
    ----------
    batch : Batch
        Parameters and initial values of the L motions.
    flow : ExactFlow
    points : (L,)
        Parameter point of each motion.
    initial : (d, L)
        States at τ = 0.
    before : (L,)
        Mesh periods before the sections.
    sections : (S, d, L)
        States after each of the next S periods.
    orbit : (d, L), optional
        States from which the sections follow; by default those that the motions have reached. The mean rotation of the
        motions is kept.
    """
    names, error = flow.system.names, transmission_error_at_start(batch)[0]
    end = flow.advance(initial, before, points=points, measured=True)
    first = end.w if orbit is None else orbit
    x1 = initial_values(batch)["x1"] + end.measures[Measure.VELOCITY]
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    x1 = x1 + J2 / (J1 + J2) * (relative_rotation(names, first.T, error) - relative_rotation(names, end.w.T, error))
    states = np.concatenate([first[None], sections])
    x1 = np.concatenate([x1[None], _x1_changes(flow, points, states[:-1])]).cumsum(axis=0).T
    decay = _decaying_rotation(batch, flow, points, end.w - first, len(sections))
    return x1 + decay - relative_rotation(names, np.moveaxis(states, 1, 2), error).T


def _decaying_rotation(
    batch: Batch, flow: ExactFlow, points: np.ndarray, difference: np.ndarray, count: int
) -> np.ndarray:
    """The rotation (L, count + 1) due to the difference in mean velocity between motions and their orbits.

    ``difference`` (d, L) is the difference of the states, ``points`` (L,) as of `at_sections`. The velocity v e^(−rτ),
    which bearing damping makes decay with the rate r, has the integral v τ (1 − e^(−rτ))/(rτ) at τ = 0, T, 2T, ...
    """
    names = flow.system.names
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    relative = relative_rotation(names, difference.T, np.zeros(1), "_dot")
    velocity = difference[names.index("x2_dot")] + J1 / (J1 + J2) * relative
    tau = np.arange(count + 1) * flow.system.period[points, None]
    from scipy.special import hyp1f1  # here, since it takes a tenth of a second to load

    return velocity[:, None] * tau * hyp1f1(1, 2, -rotation_decay(batch)[:, None] * tau)


def _x1_changes(flow: ExactFlow, points: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The change of x1 in the mesh period that follows each state w (S, d, L), (S, L); ``points`` (L,) as of
    `at_sections`."""
    count, d, motions = w.shape
    flat = np.moveaxis(w, 1, 0).reshape(d, count * motions)
    bounded = np.all(np.isfinite(flat), axis=0)
    out = flow.advance(np.where(bounded, flat, 0.0), 1, points=np.tile(points, count), measured=True)
    return np.where(bounded, out.measures[Measure.VELOCITY], np.nan).reshape(count, motions)


def within_periods(batch: Batch, names: tuple[str, ...], samples: np.ndarray) -> np.ndarray:
    """The change of x2 (N, M) since the start of the mesh period, at M samples (N, M, d) of each of N periods."""
    periods, count, d = samples.shape
    first = np.nan_to_num(samples[:, 0].T)
    flow = ExactFlow(switched_system(batch, (*names, "x2")), count)
    w = np.concatenate([first, np.zeros((1, periods))])
    return flow.advance(w, 1, points=np.zeros(periods, dtype=int), sample=True).samples[0, :, d].T
