"""Stroboscopic sections of steady motions in physical coordinates, the mean rotation included."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import Batch
from gearchaos.motion import Label, Verdicts
from gearchaos.switched import error_at_start, start, switched, to_physical

_LONGEST_WAIT = 4096


def settled_after(verdicts: Verdicts) -> np.ndarray:
    """Periods after which each trajectory is within 1e-10 of its polished orbit, (L,), in few distinct numbers.

    Verdicts on periodic motions come early, because Newton runs ahead of the trajectory; a picture of the trajectory
    has to wait for it.
    """
    slowest = np.abs(verdicts.multipliers).max(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        rounds = np.log(1e-10) / np.log(slowest)
    wait = np.where(verdicts.label == Label.PERIODIC, np.nan_to_num(rounds, nan=0.0) * verdicts.period, 0.0)
    total = verdicts.spent + np.clip(wait, 0, _LONGEST_WAIT)
    return (2 ** np.ceil(np.log2(np.maximum(total, 64)))).astype(int)


def steady_sections(batch: Batch, verdicts: Verdicts, count: int) -> dict[str, np.ndarray]:
    """The last ``count`` sections of each trajectory once it is steady, arrays (L, count) by coordinate name."""
    system = switched(batch, whole=True)
    flow, w = ExactFlow(system), start(batch, system).T.copy()
    out = np.empty((count, system.dimension, batch.size))
    waits = settled_after(verdicts)
    for wait in np.unique(waits):
        mine = np.flatnonzero(waits == wait)
        out[:, :, mine] = flow.advance(w[:, mine], int(wait) + count, points=mine, sections=count).sections
    error, error_dot = error_at_start(batch)
    return to_physical(system.names, np.moveaxis(out, (0, 1, 2), (1, 2, 0)), error[:, None], error_dot[:, None])
