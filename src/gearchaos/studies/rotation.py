"""The rotation of the wheels integrated along a motion, where both bearings differ: no closed form gives it then.

Integrals are taken mesh period by mesh period from the states recorded there: each is exact to rounding, and all of a
motion are computed side by side.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import Batch
from gearchaos.model.coordinates import initial_values, relative_rotation, transmission_error_at_start
from gearchaos.model.switched import rotation_decay, switched_system


def at_sections(
    batch: Batch, flow: ExactFlow, points: np.ndarray, begin: np.ndarray, spent: np.ndarray, sections: np.ndarray,
    orbit: np.ndarray | None = None,
) -> np.ndarray:
    """x2 of L motions after ``spent`` mesh periods and at the S sections that follow, (L, S + 1).

    Parameters
    ----------
    batch : Batch
        Parameters and initial values of the L motions.
    flow : ExactFlow
    points : (L,)
        Point of the flow at which each motion runs.
    begin : (d, L)
        States at τ = 0.
    spent : (L,)
        Mesh periods before the sections.
    sections : (S, d, L)
        States after each of the next S periods.
    orbit : (d, L), optional
        States from which the sections follow, with the same mean rotation; by default where the motion then was.
    """
    names, error = flow.system.names, transmission_error_at_start(batch)[0]
    before = flow.advance(begin, spent, points=points, measured=True)
    first = before.w if orbit is None else orbit
    x1 = initial_values(batch)["x1"] + before.measures[Measure.VELOCITY]
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    x1 = x1 + J2 / (J1 + J2) * (relative_rotation(names, first.T, error) - relative_rotation(names, before.w.T, error))
    states = np.concatenate([first[None], sections])
    gained = np.concatenate([x1[None], _gained(flow, points, states[:-1])]).cumsum(axis=0).T
    slowing = _slowing(batch, flow, points, before.w - first, len(sections))
    return gained + slowing - relative_rotation(names, np.moveaxis(states, 1, 2), error).T


def _slowing(batch: Batch, flow: ExactFlow, points: np.ndarray, ahead: np.ndarray, count: int) -> np.ndarray:
    """How far the wheels yet turn, (L, count + 1), until the bearings have braked what velocity their mean rotation has
    ``ahead`` (d, L) of the orbit: its part of velocity v e^(−rτ) grows to v τ (1 − e^(−rτ))/rτ."""
    names = flow.system.names
    J1, J2 = np.asarray(batch["J1"]), np.asarray(batch["J2"])
    velocity = ahead[names.index("x2_dot")] + J1 / (J1 + J2) * relative_rotation(names, ahead.T, np.zeros(1), "_dot")
    tau = np.arange(count + 1) * flow.system.period[points, None]
    from scipy.special import hyp1f1  # here, since it takes a tenth of a second to load

    return velocity[:, None] * tau * hyp1f1(1, 2, -rotation_decay(batch)[:, None] * tau)


def _gained(flow: ExactFlow, points: np.ndarray, w: np.ndarray) -> np.ndarray:
    """By how much x1 grows in the mesh period that follows each state (S, d, L); (S, L)."""
    count, d, lanes = w.shape
    flat = np.moveaxis(w, 1, 0).reshape(d, count * lanes)
    bounded = np.all(np.isfinite(flat), axis=0)
    out = flow.advance(np.where(bounded, flat, 0.0), 1, points=np.tile(points, count), measured=True)
    return np.where(bounded, out.measures[Measure.VELOCITY], np.nan).reshape(count, lanes)


def within_periods(batch: Batch, names: tuple[str, ...], samples: np.ndarray) -> np.ndarray:
    """By how much x2 has grown at each sample (N, M, d) since its mesh period began, (N, M)."""
    periods, count, d = samples.shape
    first = np.nan_to_num(samples[:, 0].T)
    flow = ExactFlow(switched_system(batch, (*names, "x2")), count)
    w = np.concatenate([first, np.zeros((1, periods))])
    return flow.advance(w, 1, points=np.zeros(periods, dtype=int), sample=True).samples[0, :, d].T
