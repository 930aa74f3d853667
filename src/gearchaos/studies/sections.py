"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included."""

from __future__ import annotations

import numpy as np

from gearchaos.coordinates import error_at_start, to_physical
from gearchaos.flow import ExactFlow
from gearchaos.model import Batch
from gearchaos.motion import Verdicts


def steady_sections(
    batch: Batch, flow: ExactFlow, points: np.ndarray, verdicts: Verdicts, count: int
) -> dict[str, np.ndarray]:
    """``count`` sections of each steady motion, arrays (L, count) by coordinate name.

    They start from the polished orbit, or from where the verdict left the trajectory. ``batch`` holds the parameters
    of the L motions, and ``points`` (L,) says at which point of the flow each runs.
    """
    out = flow.advance(verdicts.w, count, points=points, sections=count).sections
    number = verdicts.spent[:, None] + np.arange(1, count + 1)
    error, error_dot = error_at_start(batch)
    return to_physical(
        batch, flow.system.names, np.moveaxis(out, (0, 1, 2), (1, 2, 0)), number * flow.system.period[points, None],
        error[:, None], error_dot[:, None],
    )
