"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included."""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.flow import ExactFlow
from gearchaos.model import Batch
from gearchaos.model.coordinates import bearings_differ, to_physical, transmission_error_at_start, weakly_damped
from gearchaos.studies import rotation


def steady_sections(
    batch: Batch, flow: ExactFlow, points: np.ndarray, begin: np.ndarray, verdicts: Verdicts, count: int
) -> dict[str, np.ndarray]:
    """``count`` sections of each steady motion, arrays (L, count) by coordinate name.

    They start from the polished orbit, with the mean rotation that the trajectory had there, or from where the verdict
    left the trajectory. ``batch`` holds the parameters of the L motions, ``points`` (L,) says at which point of the
    flow each runs, and ``begin`` (d, L) where each began.
    """
    out = flow.advance(verdicts.w, count, points=points, sections=count).sections
    number = verdicts.periods_run[:, None] + np.arange(1, count + 1)
    error, error_dot = transmission_error_at_start(batch)
    return to_physical(
        batch, flow.system.names, np.moveaxis(out, (0, 1, 2), (1, 2, 0)), number * flow.system.period[points, None],
        error[:, None], error_dot[:, None], _rotation(batch, flow, points, begin, verdicts, out),
    )


def _rotation(
    batch: Batch, flow: ExactFlow, points: np.ndarray, begin: np.ndarray, verdicts: Verdicts, sections: np.ndarray
) -> np.ndarray:
    """x2 (L, S) at the sections (S, d, L), NaN where it follows from them: on a trajectory of well braked wheels."""
    x2 = np.full((len(points), len(sections)), np.nan)
    mine = np.flatnonzero(bearings_differ(batch, flow.system.names) & ((verdicts.period > 0) | weakly_damped(batch)))
    if len(mine):
        x2[mine] = rotation.at_sections(
            batch.take(mine), flow, points[mine], begin[:, mine], verdicts.periods_run[mine], sections[:, :, mine],
            verdicts.w[:, mine],
        )[:, 1:]
    return x2
