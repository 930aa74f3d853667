"""Corner contact: the gap between the flanks of a tooth pair before its path of contact begins and after it ends.

Teeth bend. So a pair may touch before its flanks would meet, and after: with the tip corner of one wheel on the
involute of the other, off the line of action. Seager 1975; Lin, Wang, Oswald and Coy 1993; Munro, Morrish and
Palmer 1999. On back flanks the mirrored wheels do the same.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry

DEEPEST = 0.03
"""Gap over the normal module up to which corner contact is followed. A deflection beyond it is beyond any rating, and
the stiffness is no longer valid."""
_TOLERANCE = 2e-8  # by how much the polynomial may differ from the gap, m
_MOST_TERMS = 8
_SHORTEST = 1e-6  # distance beyond the path, over the base pitch, that the corner goes on the involute at least
_RULE = "must be false or left out for these teeth"
_POSITIONS = np.linspace(0.0, 1.0, 257)[1:]  # from which it is fitted, shares of how far it goes on


def corner_gap(geometry: Geometry, beyond: np.ndarray, *, leaving: bool) -> np.ndarray:
    """Gap (n,) of a tooth pair along the line of action, m, at distances (n,) beyond an end of its path, m.

    Leaving, the tip corner of wheel 1 goes along the involute of wheel 2; entering, the wheels change places. NaN where
    the corner does not meet the involute: inside the form circle of the mate, or outside its tip circle.

    The corner, turned on by x/r_b1, is at the radius R and the polar angle φ about the mate, from the line of centres
    on. The mate's involute through the end of the path passes it when the mate has turned by θ. With the radius of
    curvature ρ at the end, θ = ρ/r_b2 − α_wt − inv α(R) − φ and cos α(R) = r_b2/R. So the gap is x − r_b2 θ. Of a ring
    the signs change of what ISO 21771 has negative there.
    """
    own, mate = (0, 1) if leaving else (1, 0)
    sign, sign_mate = geometry.signs[own], geometry.signs[mate]
    x = np.asarray(beyond, float)
    base, base_mate = geometry.base_diameter[own] / 2, geometry.base_diameter[mate] / 2
    tangent, working = geometry.tip_tangents[own], geometry.working_pressure_angle
    turned = sign * (working - math.atan2(tangent, base)) - x / base
    tip = math.hypot(tangent, base)
    to_centre, across = sign * (geometry.centre_distance - sign_mate * tip * np.cos(turned)), tip * np.sin(turned)
    radius = np.hypot(to_centre, across)
    with np.errstate(invalid="ignore"):
        rolled = np.sqrt((radius - base_mate) * (radius + base_mate)) / base_mate  # tan α(R)
    end = sign * (geometry.tangent_length - sign_mate * tangent)
    angle = sign_mate * (end / base_mate - working - (rolled - np.arctan(rolled)))
    # the involute of a ring is known inside the circle to which its mate reaches
    root = (geometry.root_form_diameter if sign_mate > 0 else geometry.start_of_active_profile)[mate] / 2
    on_involute = (sign_mate * radius >= sign_mate * root) & (
        sign_mate * radius <= sign_mate * geometry.tip_diameter[mate] / 2)
    return np.where(on_involute, x - base_mate * (angle - np.arctan2(across, to_centre)), np.nan)


class CornerGap(NamedTuple):
    """Gap of corner contact beyond one end of the path: s = Σ_k gap[k] x^(k + 2) for x up to a length, m."""

    length: float
    gap: tuple[float, ...]  # 1/m, 1/m², ...


@lru_cache(maxsize=64)  # designs at other speeds and torques have the same
def corner_contact(geometry: Geometry, *, leaving: bool) -> CornerGap:
    """The gap of `corner_gap` as a polynomial, up to where it is `DEEPEST` modules or the involute ends.

    Raises `InputError` where the corner leaves the involute of its mate at once, or no polynomial has the gap.
    """
    def near(x: float) -> bool:
        return bool(corner_gap(geometry, np.array([x]), leaving=leaving)[0] < DEEPEST * geometry.normal_module)

    corner, (closed, open_) = f"the tip corner of wheel {1 if leaving else 2}", (0.0, geometry.base_pitch)
    if not near(_SHORTEST * geometry.base_pitch):
        raise InputError("corner_contact", _RULE, True,
                         f"Where the path of contact ends, {corner} is off the involute of its mate.")
    for _ in range(50):
        middle = (closed + open_) / 2
        closed, open_ = (middle, open_) if near(middle) else (closed, middle)
    gap = corner_gap(geometry, closed * _POSITIONS, leaving=leaving)
    for terms in range(1, _MOST_TERMS + 1):
        powers = _POSITIONS[:, None] ** np.arange(2, terms + 2)
        found = np.linalg.lstsq(powers, gap, rcond=None)[0]
        if np.abs(powers @ found - gap).max() < _TOLERANCE:
            break
    else:
        raise InputError("corner_contact", _RULE, True, f"The path of contact ends near the base circle, where the gap "
                         f"of {corner} is no polynomial of {_MOST_TERMS} terms.")
    return CornerGap(closed, tuple((found / closed ** np.arange(2, terms + 2)).tolist()))
