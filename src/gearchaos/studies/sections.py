"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included."""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.flow import ExactFlow
from gearchaos.model import Batch
from gearchaos.model.coordinates import bearings_differ, to_physical, transmission_error_at_start, weakly_damped
from gearchaos.studies import rotation


def steady_sections(
    batch: Batch, flow: ExactFlow, points: np.ndarray, initial: np.ndarray, verdicts: Verdicts, count: int
) -> dict[str, np.ndarray]:
    """Stroboscopic sections of steady motions in physical coordinates.

    Parameters
    ----------
    batch : Batch
        Parameters and initial values of the L motions.
    flow : ExactFlow
    points : (L,)
        Parameter point of each motion.
    initial : (d, L)
        States at τ = 0.
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
    out = flow.advance(verdicts.w, count, points=points, sections=count).sections
    number = verdicts.periods_run[:, None] + np.arange(1, count + 1)
    error, error_dot = transmission_error_at_start(batch)
    return to_physical(
        batch, flow.system.names, np.moveaxis(out, (0, 1, 2), (1, 2, 0)), number * flow.system.period[points, None],
        error[:, None], error_dot[:, None], _rotation(batch, flow, points, initial, verdicts, out),
    )


def _rotation(
    batch: Batch, flow: ExactFlow, points: np.ndarray, initial: np.ndarray, verdicts: Verdicts, sections: np.ndarray
) -> np.ndarray:
    """x2 (L, S) at the sections (S, d, L), where it has to be integrated; NaN where it follows from the sections."""
    x2 = np.full((len(points), len(sections)), np.nan)
    differ = bearings_differ(batch, flow.system.names)
    integrated = np.flatnonzero(differ & ((verdicts.period > 0) | weakly_damped(batch)))
    if len(integrated):
        x2[integrated] = rotation.at_sections(
            batch.take(integrated), flow, points[integrated], initial[:, integrated],
            verdicts.periods_run[integrated], sections[:, :, integrated], verdicts.w[:, integrated],
        )[:, 1:]
    return x2
