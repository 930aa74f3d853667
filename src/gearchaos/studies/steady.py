"""The steady motion behind a verdict, sampled in time."""

from __future__ import annotations

from dataclasses import replace

import xarray as xr

from gearchaos.model import COORDINATES, MeshModel
from gearchaos.studies.regime import Regime
from gearchaos.studies.simulate import simulate

_SAMPLES = 64
_PERIODS = 512
_ROUNDS = 8


def steady(model: MeshModel, verdict: Regime) -> xr.Dataset:
    """The motion that `regime` found, from one of its stroboscopic points on, as `simulate` gives it.

    Eight rounds of a periodic motion, 512 mesh periods of any other.
    """
    start = {name: verdict.section[name][-1] for name in COORDINATES[model.kind]}
    periods = _ROUNDS * verdict.period if verdict.period else _PERIODS
    return simulate(replace(model, initial=start), periods, samples=_SAMPLES)
