"""What tolerances do at the point of a page: a scatter of the designs of its pair at one speed and torque."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.explorer.jobs.progress import with_progress
from gearchaos.explorer.view.state import View
from gearchaos.gears.geometry.backlash import Backlash
from gearchaos.gears.operating import Gears
from gearchaos.gears.transmission_error.harmonics import BOUND
from gearchaos.gears.units import LENGTH
from gearchaos.studies.axis import Axis
from gearchaos.studies.distributions import WITHIN
from gearchaos.studies.quasi_static import quasi_static_ratio
from gearchaos.studies.regime import regime
from gearchaos.studies.scatter import Scatter
from gearchaos.studies.scattered_models import DEVIATIONS, present_value

SPREAD = 0.3  # half the range of an input whose scatter is assumed, over its value
_DESIGNS = 512


@dataclass(frozen=True)
class Cloud:
    """Random designs at a point, and the gears as they are."""

    dataset: xr.Dataset  # of the scatter
    factor: float  # dynamic factor of the gears as they are over their quasi-static ratio; NaN if their motion diverges
    contact: str  # their contact state, one of `CONTACTS`
    values: tuple[float | None, ...]  # their values of the inputs; None where they have none


def assumed(gears: Gears) -> tuple[str, ...]:
    """Inputs of a pair whose study file names none: deviations within the grade, uniform damping and backlash."""
    made: Any = gears
    backlash, unit = made.backlash, "mm"
    if isinstance(backlash, Backlash):
        backlash, unit = backlash.value, unit if backlash.dimension is LENGTH else ""
    elif not isinstance(backlash, float):  # allowances of the teeth
        backlash = None
    given = {"damping_ratio": (getattr(made, "damping_ratio", None), ""), "k": (getattr(made, "k", None), "N*s/m"),
             "backlash": (backlash and backlash * (1e3 if unit else 1), unit)}
    of_grade = getattr(made, "transmission_error", None) == BOUND and made.quality.deviations is None
    return (*[f"{DEVIATIONS}={WITHIN}"] * of_grade, *(
        f"{name}={(1 - SPREAD) * value:.4g}:{(1 + SPREAD) * value:.4g} {unit}".rstrip()
        for name, (value, unit) in given.items() if value))


def tolerances(view: View) -> Generator[float | Cloud]:
    """The share of the motions that are followed, again and again, then the designs at the point of a view.

    The scatter is that of `gearchaos.scatter` without indices.
    """
    model, gears = view.operating_point, view.gears
    assert gears is not None  # it is a pair
    speed, torque = (float(model.value(name) or 0.0) for name in ("speed", "torque"))
    study = Scatter(model, view.vary or assumed(gears), Axis("speed", speed, speed, 1), (torque,), samples=_DESIGNS,
                    indices=False)
    dataset = yield from with_progress(partial(study.run, progress=True))
    verdict = regime(model, settings=study.classification)
    factor = np.nan if verdict.dynamic_factor is None else verdict.dynamic_factor / quasi_static_ratio(model)
    yield Cloud(dataset, factor, verdict.contact, tuple(present_value(gears, each) for each in study.inputs))
