"""Static transmission error of unloaded, rigid gears as harmonics of the mesh frequency, and that of a grade.

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
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import whole_number
from gearchaos.gears.io.fields import described
from gearchaos.gears.transmission_error import PERMISSIBLE_OVER_SD
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.transmission_error import Quality, Tolerances


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


def added(parts: Sequence[ErrorHarmonics]) -> ErrorHarmonics:
    """The sum of errors that act together."""
    total = np.zeros(max(len(part.amplitudes) for part in parts), complex)
    for part in parts:
        total[: len(part.amplitudes)] += np.array(part.amplitudes) * np.exp(-1j * np.array(part.phases))
    return ErrorHarmonics(amplitudes=tuple(np.abs(total).tolist()), phases=tuple((-np.angle(total)).tolist()),
                          source="; ".join(part.source for part in parts),
                          residual_rms=math.hypot(*(part.residual_rms for part in parts)),
                          residual_peak=sum(part.residual_peak for part in parts),
                          warnings=tuple(warning for part in parts for warning in part.warnings),
                          assumptions=tuple(text for part in parts for text in part.assumptions))


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
    peak_to_peak: float = described(
        "", "√(f_i1′² + f_i2′²), a third of it for a typical pair; |a_1 f_i1′ + a_2 f_i2′| for deviations a over these",
        "assumption: independent deviations", "µm", 1e6)


BOUND = "from quality"
FROM_QUALITY = {BOUND: 1.0, "from quality (typical)": 1 / PERMISSIBLE_OVER_SD}
"""What a design says for an error that follows from its grade, and the share of the permissible deviations in it."""


def from_quality(
    geometry: Geometry, quality: Quality, tolerances: tuple[Tolerances, Tolerances], orders: int = 3,
    method: str = BOUND,
) -> QualityError:
    """Mesh harmonics of a pair from the permissible deviations of its accuracy grade: both wheels at its limit, or
    with another ``method`` of `FROM_QUALITY` the root mean square of pairs of the grade.

    The peak-to-peak value over a mesh period is that of a single-flank test, the tooth-to-tooth tangential composite
    deviation f_i′ of ISO 1328-1:1995, annex A, which the standard derives from f_pt, F_α and the total contact ratio.
    The deviations of the two wheels are independent of each other: their squares are added, which is no upper bound of
    the pair. Within a period the error is a parabola, as crowned profiles or small profile slopes of both signs leave
    it (Litvin and Fuentes, *Gear Geometry and Applied Theory*, 2004, chapter 9): 0 where a tooth pair is in the middle
    of its path of contact, greatest where the next pair takes over. Its harmonics are e_j = 4 Δ/(π² j²), 0.405 Δ for
    the first, with θ_j = π j (ε_α − 1). Three of them leave 10 % of the peak-to-peak value out.

    Tolerances are limits, and part of f_pt differs from tooth to tooth and does not repeat with the mesh: a pair of
    typical wheels has less, and other phases. Tip relief and misalignment, which the grade does not limit, come on top.
    For those of typical wheels no standard has a value. Deviations of wheels are then assumed to be independent and
    normal. Their standard deviation is a third of the permissible one, as that of pitch errors drawn within a grade.
    The root mean square of each harmonic is then a third of that at the limit of the grade.

    A quality with the ``deviations`` of its wheels, over those permissible, has the sum of both instead, with their
    signs: one that is less than 0 is a parabola turned over, greatest in the middle of the path of contact.

    The formula of annex A agrees with its other form K (9 + 0.3 m + 3.2 √m + 0.34 √d) and could be compared with one
    source only. The edition of 2013 has no such formula in terms of f_pt and F_α; with its tolerances the formula of
    1995 is used all the same.
    """
    ratio = geometry.total_contact_ratio
    factor = 0.2 * (ratio + 4) / ratio if ratio < 4 else 0.4
    deviation = tuple(factor * (4.3e-6 * 2 ** ((grade - 5) / 2) + t.single_pitch + t.profile)
                      for grade, t in zip(quality.grades, tolerances, strict=True))
    total = math.hypot(*deviation) * FROM_QUALITY[method]
    if quality.deviations is not None:
        total = sum(share * each for share, each in zip(quality.deviations, deviation, strict=True))
    turned, numbers = math.pi * (total < 0), range(1, check_orders(orders) + 1)
    grades = " and ".join(map(str, dict.fromkeys(quality.grades)))
    composite = "the permissible tangential tooth-to-tooth composite deviation f_i′"
    of, meant = (f"both wheels at the limit of the grade: {composite}",
                 "both wheels at the limit of the grade, their squares added")
    if method != BOUND:
        of, meant = (f"typical of the grade: a third of {composite}",
                     "typical of the grade: the root mean square of deviations that are normal, with a third of the "
                     "permissible ones as standard deviation")
    if quality.deviations is not None:
        has = "{:g} and {:g} of the permissible tooth-to-tooth deviations".format(*quality.deviations)
        of, meant = f"wheels that have {has} f_i′", f"of wheels that have {has}"
    source = f"{quality.standard}, grade {grades}: assumption, {of} as a parabola"
    assumption = f"The accuracy grade gives no transmission error; this one is an assumption, {meant}"
    if quality.standard == ISO_1995:
        assumption += "."
    else:  # both with the edition of the formula and of its values
        source += (f"; f_i′ by the formula of {ISO_1995}, annex A, with the grade and the deviations f_pT and F_αT of "
                   f"{quality.standard}")
        assumption += (f", by the formula of {ISO_1995}, annex A, for f_i′ with the deviations of {quality.standard}, "
                       "which has no such formula.")
    return QualityError(amplitudes=tuple(4 * abs(total) / (math.pi * j) ** 2 for j in numbers),
                        phases=tuple(math.pi * j * (geometry.contact_ratio - 1) + turned for j in numbers),
                        source=source, tooth_to_tooth=(deviation[0], deviation[1]), peak_to_peak=abs(total),
                        assumptions=(assumption,))
