"""The steady motion that a verdict is about, sampled in time."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.model import COORDINATES, MeshModel, vary
from gearchaos.model.coordinates import reset_mean_rotation, rotation_drifts, transmission_error_at_start
from gearchaos.model.switched import coordinates
from gearchaos.studies.simulate import simulate
from gearchaos.studies.verdict import Verdict

if TYPE_CHECKING:
    import xarray as xr

_SAMPLES = 64
"""Instants recorded in each mesh period."""

_ORBIT_PERIODS = 8
"""Number of periods of a periodic motion that are recorded."""

_OTHER_PERIODS = 512
"""Number of mesh periods of another motion that are recorded."""


def steady(model: AnyModel, verdict: Verdict) -> xr.Dataset:
    """The steady motion that `regime` found, sampled in time.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign
        The operating point.
    verdict : Verdict
        The verdict on this model, which contains the stroboscopic points of the motion.

    Returns
    -------
    xarray.Dataset
        As from `simulate`, starting at the last stroboscopic point of the verdict: eight periods of a periodic motion,
        512 mesh periods of any other.

    Raises
    ------
    InputError
        If the motion diverged.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    >>> motion = gc.steady(model, gc.regime(model))
    >>> motion.sizes["period"]
    64
    """
    model = as_model(model)
    if not isinstance(verdict, Verdict):
        raise InputError("verdict", "must be a Verdict, as gearchaos.regime returns", f"a {type(verdict).__name__}")
    if not verdict.section:
        raise InputError("verdict", "must be of a motion that stays bounded", verdict.label)
    start = _initial_values(model, {name: values[-1] for name, values in verdict.section.items()})
    periods = _ORBIT_PERIODS * verdict.period if verdict.period else _OTHER_PERIODS
    return simulate(replace(model, initial=start), periods, samples=_SAMPLES)


def _initial_values(model: MeshModel, point: dict[str, float]) -> dict[str, float]:
    """Initial values that start the motion at a stroboscopic point.

    A drifting mean rotation is reset to the initial one of the model, since z loses digits as the difference of large
    x1 and x2.
    """
    initial, batch = {name: point[name] for name in COORDINATES[model.kind]}, vary(model, {})
    names = coordinates(batch)
    if not rotation_drifts(batch, names)[0]:
        return initial
    if "y" in names:
        point = {**point, "y": point["y1"] - point["y2"], "y_dot": point["y1_dot"] - point["y2_dot"]}
    kept = reset_mean_rotation(batch, names, np.array([[point[n] for n in names]]), *transmission_error_at_start(batch))
    return initial | {n: float(v[0]) for n, v in kept.items()}
