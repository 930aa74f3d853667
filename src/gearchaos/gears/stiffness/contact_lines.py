"""Total length of the contact lines of a cylindrical pair over the mesh period.

In the plane of action, in units of the transverse base pitch p_et, the zone of contact is ε_α long and contact lines
enter it at intervals of 1. Across the face width each line is inclined by ε_β. Its length is therefore the convolution
of two rectangles, of widths ε_α and ε_β (M. Maatar and P. Velex, *J. Mech. Des.* 118, 1996, 307-311; the quantities are
those of ISO 21771:2007).
"""

from __future__ import annotations

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve

_SAME_POSITION = 1e-12
"""Positions that are closer to each other than this, in mesh periods, are one."""


def relative_length(contact_ratio: float, overlap_ratio: float = 0.0) -> PeriodicCurve:
    """Total length of the contact lines over the mesh period, relative to its mean b ε_α/cos β_b.

    At position 0 a tooth pair enters contact, of helical gears at one end of the face width. The curve of spur gears
    has two levels, that of helical gears is continuous; its corners are at 0, ε_α, ε_β and ε_α + ε_β. Raises
    `InputError` for ratios with which contact is lost during a part of the period.
    """
    _check(contact_ratio, overlap_ratio)
    corners = np.mod([0.0, contact_ratio, overlap_ratio, contact_ratio + overlap_ratio], 1.0)
    knots = np.sort(corners[corners < 1 - _SAME_POSITION])
    knots = np.append(knots[np.diff(knots, prepend=-1.0) > _SAME_POSITION], 1.0)
    if overlap_ratio < _SAME_POSITION:
        pairs = np.ceil(contact_ratio - (knots[:-1] + np.diff(knots) / 2))
        levels = pairs / contact_ratio
        return PeriodicCurve(knots, levels, levels)
    # a line whose leading end is u behind the entry of the zone of contact is in it from max(0, u − ε_β) to min(u, ε_α)
    u = knots[:, None] + np.arange(np.ceil(contact_ratio + overlap_ratio) + 1)
    lengths = np.maximum(np.minimum(u, contact_ratio) - np.maximum(u - overlap_ratio, 0.0), 0.0)
    values = lengths.sum(axis=1) / (contact_ratio * overlap_ratio)
    return PeriodicCurve(knots, values[:-1], np.append(values[1:-1], values[0]))


def fourier_coefficients(contact_ratio: float, overlap_ratio: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes c_j ≥ 0 and phases α_j, in (−π, π], of the relative length 1 + Σ c_j cos(2πjt − α_j), in closed form.

    The transform of a rectangle of width ε is sin(πjε)/(πj), that of a convolution the product: c_j = 2 |s(jε_α)
    s(jε_β)| with s(x) = sin(πx)/(πx). α_j is πj(ε_α + ε_β), and π more where the product is negative. Both are arrays
    (count,), from harmonic 1 on.
    """
    _check(contact_ratio, overlap_ratio)
    j = np.arange(1, count + 1)
    factor = 2 * np.sinc(j * contact_ratio) * np.sinc(j * overlap_ratio)
    phase = np.pi * np.mod(j * (contact_ratio + overlap_ratio) + (factor < 0), 2.0)
    return np.abs(factor), np.where(phase > np.pi, phase - 2 * np.pi, phase)


def _check(contact_ratio: float, overlap_ratio: float) -> None:
    """Raise `InputError` unless contact is never lost and no ratio is negative."""
    if not 0 <= overlap_ratio < np.inf:
        raise InputError("overlap_ratio", "must be a finite number, at least 0", overlap_ratio)
    if not 0 < contact_ratio < np.inf or contact_ratio + overlap_ratio < 1:
        raise InputError("contact_ratio", "must be at least 1 together with the overlap ratio", contact_ratio,
                         "Otherwise no teeth are in contact during a part of the mesh period.")
