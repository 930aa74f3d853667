"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import Batch
from gearchaos.motion import Verdicts
from gearchaos.switched import coordinates, error_at_start, lift, start, switched, to_physical


def steady_sections(batch: Batch, verdicts: Verdicts, count: int) -> dict[str, np.ndarray]:
    """``count`` sections of each steady motion, arrays (L, count) by coordinate name.

    They start from the polished orbit, or from where the verdict left the trajectory; the mean motions, which the
    dynamic state lacks, are those of the whole model after the same time.
    """
    system = switched(batch, whole=True)
    flow, w = ExactFlow(system), start(batch, system).T.copy()
    for spent in np.unique(verdicts.spent):
        mine = np.flatnonzero(verdicts.spent == spent)
        w[:, mine] = flow.advance(w[:, mine], int(spent), points=mine).w
    w = lift(batch, system.names, w.T, coordinates(batch), verdicts.w.T).T.copy()
    out = flow.advance(w, count, sections=count).sections
    error, error_dot = error_at_start(batch)
    return to_physical(system.names, np.moveaxis(out, (0, 1, 2), (1, 2, 0)), error[:, None], error_dot[:, None])
