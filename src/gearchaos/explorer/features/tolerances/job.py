"""What tolerances do at the point of a page: a scatter of the designs of its pair at one speed and torque."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr

from gearchaos.explorer.core.progress import with_progress
from gearchaos.explorer.core.state import View
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.motion.regime import regime
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studies.uncertainty.scatter import Scatter
from gearchaos.studies.uncertainty.scattered_models import present_value

_DESIGNS = 512


@dataclass(frozen=True)
class Cloud:
    """Random designs at a point, and the gears as they are."""

    dataset: xr.Dataset  # of the scatter
    factor: float  # dynamic factor of the gears as they are over their quasi-static ratio; NaN if their motion diverges
    contact: str  # their contact state, one of `CONTACTS`
    values: tuple[float | None, ...]  # their values of the inputs; None where they have none


def tolerances(view: View) -> Generator[float | Cloud]:
    """The share of the motions that are followed, again and again, then the designs at the point of a view.

    The scatter is that of `gearchaos.scatter` without indices.
    """
    model, gears = view.operating_point, view.gears
    assert gears is not None  # it is a pair
    speed, torque = (float(model.value(name) or 0.0) for name in ("speed", "torque"))
    study = Scatter(model, view.vary, Axis("speed", speed, speed, 1), (torque,), samples=_DESIGNS,
                    indices=False)
    dataset = yield from with_progress(partial(study.run, progress=True))
    verdict = regime(model, settings=study.classification)
    factor = np.nan if verdict.dynamic_factor is None else verdict.dynamic_factor / quasi_static_ratio(model)
    yield Cloud(dataset, factor, verdict.contact, tuple(present_value(gears, each) for each in study.inputs))
