"""What teeth cannot bear: deflections that no tooth has, and root stresses above the strength of the material."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from gearchaos.gears.geometry.root_stress import ROOT_STRESS
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import is_design
from gearchaos.studies.operation.factor_context import peak_root_stress

BEYOND = "beyond the teeth"
"""What a motion is called that teeth cannot bear, in the place of its dynamic factor."""
ROOT_STRENGTH = 1500.0
"""Of a material without one of its own, N/mm²: above the nominal root strength of any gear steel."""
_MOST_DEFLECTION = 0.25  # of the teeth, as a share of the normal module


class TeethLimits(NamedTuple):
    """What the teeth of a mesh bear at a torque: the deflection, in half backlashes, and the dynamic factor at which
    the nominal root stress reaches the strength; infinite where they are not known. Both may be arrays of one
    shape, of several meshes. ``words`` say what they are."""

    deflection: Any = math.inf
    factor: Any = math.inf
    words: str = "a motion without bound"

    @classmethod
    def of(cls, gears: Any, torque: float) -> TeethLimits:
        """Those of gears under a torque at wheel 1, N m; of a train, and of a pair without teeth, none are known."""
        if not is_design(gears):
            return cls()
        deflection = _MOST_DEFLECTION * gears.module
        known = [each.root_strength for each in gears.material]
        strengths = [ROOT_STRENGTH if each is None else each for each in known]
        stresses = peak_root_stress(gears, torque, 1.0)
        factor = math.inf if stresses is None else min(
            strength / stress for strength, stress in zip(strengths, stresses, strict=False))  # of a ring none
        shown = "/".join(dict.fromkeys(measured(each, 4) for each in strengths))
        assumed = ", assumed" * any(each is None for each in known)
        stress_words = f"a nominal root stress above {shown} {ROOT_STRESS.unit}{assumed}, or " * (stresses is not None)
        return cls(2 * deflection / gears.backlash_line_of_action, factor,
                   f"{stress_words}a deflection above {measured(1e3 * deflection, 3)} mm")

    def exceeded(self, dynamic_factor: Any, deflection: Any) -> Any:
        """Whether motions are beyond them, an array of the shape of both; one that diverges has NaN for both."""
        return np.logical_not((dynamic_factor <= self.factor) & (deflection <= self.deflection))
