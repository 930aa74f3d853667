"""What is to be avoided in the cells of a map of gears, by the motions found in each: in operation, or after a load
change alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gearchaos.dynamics import Verdicts
from gearchaos.gears.operation.operating import gears_of
from gearchaos.model import MeshModel
from gearchaos.studies.core.initial_value_problems import Motions
from gearchaos.studies.core.proportions import proportion
from gearchaos.studies.motion.batch_classification import signature
from gearchaos.studies.operation.beyond_the_teeth import TeethLimits
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studies.operation.severities import SEVERITIES, SUDDEN, separated

BEYOND_CODE = len(SEVERITIES) - 1
AFTER_A_LOAD_CHANGE = "after a load change alone"
TO_AVOID = {0: "nothing to avoid", **dict(enumerate(SEVERITIES[1:], 1)),
            **{n + BEYOND_CODE: f"{words}, {AFTER_A_LOAD_CHANGE}" for n, words in enumerate(SEVERITIES[1:], 1)}}
"""The codes of ``to_avoid``: what happens in operation, then what happens after a load change alone."""


def force_and_signature(final: Motions, found: Verdicts) -> dict[str, np.ndarray]:
    """The `signature` (L,) of motions of gears by name, with what their teeth have to bear."""
    return {**signature(final, found), "dynamic_factor": found.variables()["dynamic_factor"],
            "deflection": found["deflection"]}


def to_avoid(
    model: MeshModel, at: Mapping[str, np.ndarray], motions: Mapping[str, np.ndarray], after: slice
) -> dict[str, np.ndarray]:
    """What is to be avoided in cells (N,), which have the values ``at`` (N,) by name, and to which share of the load
    changes leads there, with its 95 % interval.

    ``motions`` (N, M) are those of `force_and_signature`; those in the slice ``after`` follow load changes.
    """
    names = [n for n in at if n not in ("speed", "omega")]  # on which no limit depends
    index, each = np.zeros(1, int), [model]
    if names:
        points, index = np.unique(np.stack([at[n] for n in names]), axis=1, return_inverse=True)
        each = [model.with_values(dict(zip(names, point, strict=True))) for point in points.T.tolist()]
    hits, factor, deflection, loaded = np.array(list(map(_limits_of, each))).T[:, index.ravel(), None]
    found = np.where(loaded, motions["dynamic_factor"], 0.0)
    beyond = TeethLimits(deflection, factor).exceeded(found, motions["deflection"])
    severity = np.where(beyond, BEYOND_CODE, separated(motions["contact"] == 2, found > hits))
    severity = np.where((motions["contact"] > 0) | beyond, severity, 0)
    changes = severity[:, after]
    operation, other = _worst(np.delete(severity, after, axis=1)), _worst(changes)
    share, low, high = proportion((changes > 0).sum(axis=1), changes.shape[1])
    code = np.where((operation == 0) & (other > 0), BEYOND_CODE + other, operation).astype(np.int8)
    return {"to_avoid": code, "share_of_load_changes": share, "share_of_load_changes_lo": low,
            "share_of_load_changes_hi": high}


def _worst(severity: np.ndarray) -> np.ndarray:
    """The worst (N,) that happens in motions (N, M) and that teeth bear, or if they bear none, that they do not."""
    borne = np.where(severity < BEYOND_CODE, severity, 0).max(axis=1)
    return np.where(borne > 0, borne, severity.max(axis=1))


def _limits_of(model: MeshModel) -> tuple[float, float, float, bool]:
    """The dynamic factor above which teeth hit, the factor and the deflection that they bear, and whether there is a
    load."""
    torque = model.value("torque")
    if not torque:
        return np.inf, np.inf, np.inf, False
    ratio = quasi_static_ratio(model)
    limits = TeethLimits.of(gears_of(model), torque)
    return SUDDEN * float(np.nan_to_num(ratio, nan=1.0)), limits.factor, limits.deflection, True
