"""The steady motion behind a verdict, sampled in time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import COORDINATES, MeshModel, vary
from gearchaos.model.coordinates import drifts, error_at_start, without_drift
from gearchaos.model.switched import coordinates
from gearchaos.studies.regime import Regime
from gearchaos.studies.simulate import simulate

if TYPE_CHECKING:
    import xarray as xr

_SAMPLES = 64
_PERIODS = 512
_ROUNDS = 8


def steady(model: MeshModel | GearPair, verdict: Regime) -> xr.Dataset:
    """The motion that `regime` found, from one of its stroboscopic points on, as `simulate` gives it.

    Eight rounds of a periodic motion, 512 mesh periods of any other.
    """
    model = as_model(model)
    if not isinstance(verdict, Regime):
        raise InputError("verdict", "must be a Regime, as gearchaos.regime returns", f"a {type(verdict).__name__}")
    if not verdict.section:
        raise InputError("verdict", "must be of a motion that stays bounded", verdict.label)
    start = _last(model, {name: values[-1] for name, values in verdict.section.items()})
    periods = _ROUNDS * verdict.period if verdict.period else _PERIODS
    return simulate(replace(model, initial=start), periods, samples=_SAMPLES)


def _last(model: MeshModel, at: dict[str, float]) -> dict[str, float]:
    """Initial values at a stroboscopic point; a mean rotation that drifts is left at its start, since z would lose the
    digits that it takes."""
    start, batch = {name: at[name] for name in COORDINATES[model.kind]}, vary(model, {})
    names = coordinates(batch)
    if not drifts(batch, names)[0]:
        return start
    if "y" in names:
        at = {**at, "y": at["y1"] - at["y2"], "y_dot": at["y1_dot"] - at["y2_dot"]}
    kept = without_drift(batch, names, np.array([[at[n] for n in names]]), *error_at_start(batch))
    return start | {n: float(v[0]) for n, v in kept.items()}
