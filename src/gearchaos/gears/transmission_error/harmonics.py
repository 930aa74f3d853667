"""Static transmission error of unloaded, rigid gears as harmonics of the mesh frequency.

The error of a `GearPair` is e(t) = Σ e_j cos(jω_z t − θ_j), (2.4), in m along the line of action in the transverse
plane, with peak amplitudes e_j. It is **positive where the driven wheel lags behind the driving one**, because with
(2.3) the flanks touch where R1 φ1 − R2 φ2 = Δ + e: material missing from a flank makes e positive. (Much of the
literature has the opposite sign, and the error loaded or peak to peak.)

The elastic part of a measured or computed error under load, F/c(t), must never enter: the model has it already in the
mesh stiffness c(t), and it would be counted twice. The mean of the error shifts only the zero of an angle and is left
out.

τ = 0 is the instant at which a tooth pair enters contact, as for the mesh stiffness.

Deviations that repeat once per turn of a wheel, such as eccentricity, have the order 1/z of the mesh frequency. A model
that is periodic with the mesh cannot contain them. An eccentricity e changes the transmission error by ±e, with
accelerations smaller than those of a mesh harmonic of equal amplitude by the factor z², and the backlash by
±2 e sin α_wt; the datasheet of a design lists both amplitudes (`gearchaos.datasheet.quantities`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.gears.fields import described
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from gearchaos.gears.units import Length
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.transmission_error import Quality, Tolerances

_EXPONENTS = {"linear": 1, "parabolic": 2}
_SAMPLES = 8192  # samples of a mesh period from which the harmonics of a tip relief are computed


@dataclass(frozen=True, kw_only=True)
class ErrorHarmonics:
    """Harmonics of a transmission error: e_j, m, peak, from order 1 on, and θ_j, rad; 0 for an order without amplitude.

    The residuals are the root mean square and the largest magnitude of what a table or curve has beside them and its
    mean, m; 0 where harmonics were given. Warnings say what the harmonics leave out, and what was probably not meant.
    """

    amplitudes: tuple[float, ...]
    phases: tuple[float, ...]
    source: str
    residual_rms: float = 0.0
    residual_peak: float = 0.0
    warnings: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()

    def at(self, tau: Any) -> np.ndarray:
        """The error, m, at times ``tau`` in mesh periods; an array of the shape of ``tau``."""
        return evaluate(self.amplitudes, self.phases, tau)


def evaluate(amplitudes: tuple[float, ...], phases: tuple[float, ...], tau: Any) -> np.ndarray:
    """Σ e_j cos(2πj τ − θ_j) at times ``tau`` in mesh periods; an array of the shape of ``tau``."""
    time, total = np.asarray(tau, dtype=float), np.zeros(np.shape(tau))
    for j, (amplitude, phase) in enumerate(zip(amplitudes, phases, strict=True), 1):
        total = total + amplitude * np.cos(2 * np.pi * j * time - phase)
    return total


def check_orders(count: Any) -> int:
    """A number of harmonics as an int; raises `InputError` unless it is a whole number from 1 to `MAX_HARMONICS`."""
    return whole_number("orders", count, 1, MAX_HARMONICS)


@dataclass(frozen=True, kw_only=True)
class QualityError(ErrorHarmonics):
    """Harmonics from an accuracy grade: f_i′ of each wheel against a perfect master wheel, and that of the pair, m."""

    tooth_to_tooth: tuple[float, float] = described(
        "f_i′", "K (4.3 2^((Q−5)/2) + f_pt + F_α), K = 0.2 (ε_γ + 4)/ε_γ, at least 0.4", "ISO 1328-1:1995, annex A",
        "µm", 1e6)
    peak_to_peak: float = described("", "√(f_i1′² + f_i2′²)", "assumption: independent deviations", "µm", 1e6)


def from_quality(
    geometry: Geometry, quality: Quality, tolerances: tuple[Tolerances, Tolerances], orders: int = 3,
) -> QualityError:
    """Mesh harmonics of a pair from the permissible deviations of its accuracy grade: an upper limit of the grade.

    The peak-to-peak value over a mesh period is that of a single-flank test, the tooth-to-tooth tangential composite
    deviation f_i′ of ISO 1328-1:1995, annex A, which the standard derives from f_pt, F_α and the total contact ratio.
    The deviations of the two wheels are independent of each other: their squares are added. Within a period the error
    is a parabola, as crowned profiles or small profile slopes of both signs leave it (Litvin and Fuentes, *Gear
    Geometry and Applied Theory*, 2004, chapter 9): 0 where a tooth pair is in the middle of its path of contact,
    greatest where the next pair takes over. Its harmonics are e_j = 4 Δ/(π² j²), 0.405 Δ for the first, with θ_j = π j
    (ε_α − 1). Three of them leave 10 % of the peak-to-peak value out.

    Tolerances are limits, and part of f_pt differs from tooth to tooth and does not repeat with the mesh: a pair of
    typical wheels has less, and other phases. Tip relief and misalignment, which the grade does not limit, come on top.
    The formula of annex A agrees with its other form K (9 + 0.3 m + 3.2 √m + 0.34 √d) and could be compared with one
    source only. The edition of 2013 has no such formula in terms of f_pt and F_α; with its tolerances the formula of
    1995 is used all the same.
    """
    ratio = geometry.total_contact_ratio
    factor = 0.2 * (ratio + 4) / ratio if ratio < 4 else 0.4
    deviation = tuple(factor * (4.3e-6 * 2 ** ((grade - 5) / 2) + t.single_pitch + t.profile)
                      for grade, t in zip(quality.grades, tolerances, strict=True))
    total = math.hypot(*deviation)
    numbers = range(1, check_orders(orders) + 1)
    grades = " and ".join(map(str, dict.fromkeys(quality.grades)))
    source = (f"{quality.standard}, grade {grades}: assumption, upper limit of the grade: the permissible "
              "tooth-to-tooth deviation f_i′ as a parabola")
    assumption = ("The accuracy grade gives no transmission error; this one is an assumption, an upper limit of the "
                  "grade from its permissible deviations")
    if quality.standard == ISO_1995:
        assumption += "."
    else:  # both with the edition of the formula and of its values
        source += (f"; f_i′ by the formula of {ISO_1995}, annex A, with the grade and the deviations f_pT and F_αT of "
                   f"{quality.standard}")
        assumption += (f", by the formula of {ISO_1995}, annex A, for f_i′ with the deviations of {quality.standard}, "
                       "which has no such formula.")
    return QualityError(amplitudes=tuple(4 * total / (math.pi * j) ** 2 for j in numbers),
                        phases=tuple(math.pi * j * (geometry.contact_ratio - 1) for j in numbers), source=source,
                        tooth_to_tooth=(deviation[0], deviation[1]), peak_to_peak=total, assumptions=(assumption,))


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
    if sum(relief.length) > path:
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
