"""The teeth of a drawing as they turn with the motion at the point: gaps and deflections are enlarged."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearchaos.explorer.features.drawing.panel import points, section_in_mm
from gearchaos.gears.design.gear_design import GearDesign

_ENLARGED = (100, 50, 20, 10, 5, 2)  # factors of gaps and deflections, one of which is taken
_WIDEST = 0.2  # enlarged backlash that teeth still have the room for, over the base pitch
_VIEW = 0.5  # part of the picture that is shown then
_REPEATED = 8  # most mesh periods of a motion that are repeated


def turning_teeth(design: GearDesign) -> dict[str, Any]:
    """What a page turns: outlines of the teeth with the enlarged backlash, and their geometry, in mm."""
    geometry, backlash = design.geometry, design.backlash_line_of_action
    enlarged = next((each for each in _ENLARGED if each * backlash <= _WIDEST * geometry.base_pitch), 1)
    section, outlines = section_in_mm(design, enlarged * backlash)
    (x, y), width = section.pitch_point * (1e3, -1e3), _VIEW * 4e3 * geometry.base_pitch
    return {"outlines": [points(each) for each in outlines], "centres": (section.centres * (1e3, -1e3)).tolist(),
            "bases": [500 * each for each in geometry.base_diameter], "pitch": 1e3 * geometry.base_pitch,
            "phase": section.phase, "enlarged": enlarged,
            "box": f"{x - width / 2:.3f} {y - 0.275 * width:.3f} {width:.3f} {0.55 * width:.3f}"}


def gaps(motion: xr.Dataset, period: int | None, half_backlash: float) -> dict[str, Any]:
    """The gap at the driving flanks along a steady motion, µm, negative where the mesh is deflected, in a mesh period
    that repeats ``period`` times, or else some periods of it."""
    count = min(period or _REPEATED, motion.sizes["period"], _REPEATED)
    samples = motion.sizes["tau"] // motion.sizes["period"]
    gap = 1e6 * half_backlash * (1 - motion["z"].values[: count * samples])
    return {"gaps": np.round(gap, 3).tolist(), "samples": samples}
