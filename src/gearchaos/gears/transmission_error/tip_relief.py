"""Tip relief of both wheels, and the transmission error that it makes in rigid gears without load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io.units import Length
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics, check_orders, evaluate

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry

_EXPONENTS = {"linear": 1, "parabolic": 2}
_ROUNDING = 1e-12  # by which lengths over the whole path may exceed it
_SAMPLES = 8192  # samples of a mesh period from which the harmonics are computed


@dataclass(frozen=True)
class TipRelief:
    """Tip relief of both wheels along the line of action in the transverse plane, m: C_a1, C_a2, its beginnings."""

    amount: tuple[float, float]
    length: tuple[float, float]  # of the relieved profile
    shape: str = "linear"  # how the removed depth grows to the tip; or "parabolic"

    def __post_init__(self) -> None:
        if self.shape not in _EXPONENTS:
            raise unknown_name("tip_relief.shape", str(self.shape), _EXPONENTS)
        for name in ("amount", "length"):
            for i, value in enumerate(getattr(self, name)):
                if not 0 <= value < math.inf:
                    raise InputError(f"tip_relief.{name}[{i}]", "must be a finite length of at least 0", value)


def relief_error(geometry: Geometry, relief: TipRelief, tau: np.ndarray) -> np.ndarray:
    """Error of rigid, unloaded gears with tip relief, m, exact, at times ``tau`` in mesh periods.

    At each instant the flanks touch where the least material is missing among all points of the contact lines: e ≥ 0 is
    the minimum of the removed depth over all tooth pairs on the path of contact and, of helical gears, over the face
    width. It is 0 throughout where `unrelieved_length` is at least one base pitch. A tooth pair enters contact at τ =
    0.
    """
    pitch, path = geometry.base_pitch, geometry.contact_ratio * geometry.base_pitch
    unrelieved_length(geometry, relief)
    begin, end = relief.length[1], path - relief.length[0]
    overlap = geometry.overlap_ratio
    pairs = np.arange(math.ceil(geometry.contact_ratio + overlap) + 1)
    front = (np.mod(tau, 1.0)[..., None] + pairs) * pitch
    low, high = np.maximum(front - overlap * pitch, 0.0), np.minimum(front, path)
    nearest = np.minimum(np.maximum((begin + end) / 2, low), high)
    power = _EXPONENTS[relief.shape]  # tip 2 is relieved at the start of the path, tip 1 at its end
    first = np.clip((begin - nearest) / begin, 0.0, 1.0) if begin else np.zeros_like(nearest)
    last = np.clip((nearest - end) / (path - end), 0.0, 1.0) if path > end else np.zeros_like(nearest)
    depth = relief.amount[1] * first**power + relief.amount[0] * last**power
    return np.where(low <= high, depth, np.inf).min(axis=-1)


def unrelieved_length(geometry: Geometry, relief: TipRelief) -> float:
    """The part of the path of contact without relief, m, prolonged by the overlap ε_β p_et; raises `InputError` if the
    relieved lengths overlap, or contact could be lost between two pairs.
    """
    path = geometry.contact_ratio * geometry.base_pitch
    if sum(relief.length) > path * (1 + _ROUNDING):
        raise InputError("tip_relief.length", f"must have a sum of at most the path of contact, {Length(path)}",
                         tuple(map(Length, relief.length)), "The reliefs of both wheels would overlap.")
    if geometry.contact_ratio < 1:
        raise InputError("contact_ratio", "must be at least 1", geometry.contact_ratio)
    return path - sum(relief.length) + geometry.overlap_ratio * geometry.base_pitch


def from_tip_relief(geometry: Geometry, relief: TipRelief, orders: int = 8) -> ErrorHarmonics:
    """Mesh harmonics of the error of rigid, unloaded gears with tip relief; see `relief_error`.

    Relief that leaves one base pitch of the profile untouched, as "short" relief does, makes no error without load;
    what it does under load is part of the mesh stiffness, which this function does not change. The residual is what the
    series leaves out of the curve.
    """
    count, tau = check_orders(orders), np.arange(_SAMPLES) / _SAMPLES
    curve = relief_error(geometry, relief, tau)
    spectrum = 2 * np.fft.rfft(curve)[1 : count + 1] / _SAMPLES
    amplitudes, phases = tuple(np.abs(spectrum).tolist()), tuple((-np.angle(spectrum)).tolist())
    rest = curve - curve.mean() - evaluate(amplitudes, phases, tau)
    return ErrorHarmonics(
        amplitudes=amplitudes, phases=phases, source=f"tip relief, {relief.shape}, rigid gears without load",
        residual_rms=float(np.sqrt(np.mean(rest**2))), residual_peak=float(np.abs(rest).max()))
