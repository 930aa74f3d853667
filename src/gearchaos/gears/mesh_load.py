"""Tangential force, line load and pitch line velocity of a gear pair at one operating point."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gearchaos.errors import InputError
from gearchaos.gears.formulas import described

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry

_SOURCE = "ISO 6336-1:2006, 4.2"


@dataclass(frozen=True, kw_only=True)
class MeshLoad:
    """Load and speed of the mesh, referred to the reference circles, in SI.

    Attributes
    ----------
    tangential_force : float
        Nominal tangential force F_t, N.
    line_load : float
        Specific load F_t K_A/b, N/m, with the common face width b.
    velocity : float
        Pitch line velocity v at the reference circles, m/s.
    """

    tangential_force: float = described("F_t", "2000 T1/d1", _SOURCE, "N")
    line_load: float = described("F_t K_A/b", "F_t K_A/b", _SOURCE, "N/mm", 1e-3)
    velocity: float = described("v", "d1 ω1/2000", _SOURCE, "m/s")


def mesh_load(geometry: Geometry, speed: float, torque: float, application_factor: float) -> MeshLoad:
    """The load of a mesh.

    Parameters
    ----------
    geometry : Geometry
        The gear pair.
    speed, torque : float
        Angular velocity (rad/s) and torque (N m) of wheel 1; only their magnitudes matter.
    application_factor : float
        K_A > 0, the ratio of the largest external load to the nominal one; 1 for a uniform load.

    Raises
    ------
    InputError
        For a value that is not finite, or an application factor that is not positive.
    """
    for name, value in (("speed", speed), ("torque", torque), ("application_factor", application_factor)):
        if not math.isfinite(value):
            raise InputError(name, "must be a finite number", value)
    if application_factor <= 0:
        advice = "Use 1 for a uniform load."
        raise InputError("application_factor", "must be greater than 0", application_factor, advice)
    diameter = geometry.reference_diameter[0]
    force = 2 * abs(torque) / diameter
    return MeshLoad(
        tangential_force=force,
        line_load=force * application_factor / geometry.common_face_width,
        velocity=abs(speed) * diameter / 2,
    )
