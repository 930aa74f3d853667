"""What tolerances do at the point of a page: a scatter of the designs of its pair at one speed and torque."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import xarray as xr

from gearchaos.explorer.core.progress import Part, Progress, with_progress
from gearchaos.explorer.core.state import View
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.motion.regime import regime
from gearchaos.studies.operation.quasi_static import quasi_static_ratio
from gearchaos.studies.uncertainty.scatter import Scatter
from gearchaos.studies.uncertainty.scattered_models import present_value

_DESIGNS, _FIRST_DESIGNS = 512, 64


@dataclass(frozen=True)
class Cloud:
    """Random designs at a point, and the gears as they are."""

    dataset: xr.Dataset  # of the scatter
    factor: float  # dynamic factor of the gears as they are over their quasi-static ratio; NaN if their motion diverges
    contact: str  # their contact state, one of `CONTACTS`
    values: tuple[float | None, ...]  # their values of the inputs; None where they have none


def tolerances(view: View) -> Generator[Progress | Part | Cloud]:
    """How far it is, again and again, some of the designs, then all, at the point of a view.

    The scatter is that of `gearchaos.scatter` without indices.
    """
    model, gears = view.operating_point, view.gears
    assert gears is not None  # it is a pair
    speed, torque = (float(model.value(name) or 0.0) for name in ("speed", "torque"))
    study = Scatter(model, view.vary, Axis("speed", speed, speed, 1), (torque,), samples=_FIRST_DESIGNS, indices=False)
    verdict = regime(model, settings=study.classification)
    factor = np.nan if verdict.dynamic_factor is None else verdict.dynamic_factor / quasi_static_ratio(model)
    own = tuple(present_value(gears, each) for each in study.inputs)
    first = yield from with_progress(partial(study.run, progress=True))
    yield Part(Cloud(first, factor, verdict.contact, own), f"{_DESIGNS - _FIRST_DESIGNS} of {_DESIGNS} designs")
    dataset = yield from with_progress(partial(replace(study, samples=_DESIGNS).run, progress=True))
    yield Cloud(dataset, factor, verdict.contact, own)
