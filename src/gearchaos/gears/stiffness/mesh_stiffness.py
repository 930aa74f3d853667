"""Mesh stiffness of a gear pair over the mesh period, as reference stiffness and waveform of a model.

The reference is the time mean of the curve, to which ω0 and ζ then refer, and the waveform has the mean 1. At the
beginning of the mesh period a tooth pair enters contact, at the root of wheel 1, which drives. All stiffnesses are in
the transverse plane along the line of action.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.stiffness.contact_lines import fourier_coefficients, relative_length
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, approximate, truncated_series
from gearchaos.gears.stiffness.potential_energy import ToothPairs
from gearchaos.gears.stiffness.table import read_curve
from gearchaos.model import Stiffness, TwoLevelStiffness
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.materials import Material

TOLERANCE = 2e-3
"""Default bound of the root mean square error of a waveform, relative to the mean stiffness: small beside the 20 % by
which accepted methods of computing the stiffness differ."""

ISO, POTENTIAL_ENERGY = "ISO 6336-1", "potential energy"
"""The methods of computation by name."""


@dataclass(frozen=True)
class MeshStiffness:
    """Mesh stiffness over the mesh period, ``reference`` times ``waveform``.

    Attributes
    ----------
    reference : float
        Time mean of the stiffness, N/m.
    waveform : Stiffness
        The stiffness over its mean; its own mean is 1.
    truncation : float
        Root mean square over the period of the difference between the waveform and the curve of the method, relative to
        the mean; 0 where the waveform is the curve.
    method : str
        Where the curve comes from.
    notes : tuple of str
        What limits the result, in sentences.
    """

    reference: float
    waveform: Stiffness
    truncation: float
    method: str
    notes: tuple[str, ...] = ()

    def __call__(self, positions: np.ndarray) -> np.ndarray:
        """Stiffness in N/m at positions of any shape in mesh periods; at a jump, the value after it."""
        return self.reference * self.waveform.at(positions, 2 * np.pi)  # of period 1

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest stiffness, N/m; of a Fourier series, on a grid of 64 positions per harmonic."""
        least, greatest = self.waveform.extremes()
        return self.reference * least, self.reference * greatest


def from_iso(geometry: Geometry, mesh_stiffness: float, *, tolerance: float = TOLERANCE) -> MeshStiffness:
    """Mesh stiffness with the mean c_γα b of ISO 6336-1:2006, 9.3.

    The standard gives the mean alone, c_γα = c′ (0.75 ε_α + 0.25). The waveform is an assumption: the same law at each
    instant, c′ b (0.75 n + 0.25), where n is the number of tooth pairs in contact, of helical gears the total length of
    the contact lines over that of one pair across the whole face width (`gearchaos.gears.stiffness.contact_lines`).
    The mean of n is ε_α, so that of the stiffness is c_γα b. Spur gears have two levels, for ε_α < 2 c′ b and
    1.75 c′ b, helical gears a Fourier series, unless ε_β is so small that steps are more exact. The waveform of helical
    gears tends to that of spur gears as β tends to 0.

    Parameters
    ----------
    geometry : Geometry
        The gear pair.
    mesh_stiffness : float
        c_γα, N/m², see `gearchaos.gears.stiffness.iso6336.tooth_stiffness`.
    tolerance : float
        Bound of ``truncation`` for helical gears, unless `MAX_HARMONICS` harmonics are too few.

    Raises
    ------
    InputError
        If no teeth are in contact during a part of the mesh period, or a value is not a positive number.
    """
    _check_positive("mesh_stiffness", mesh_stiffness)
    _check_positive("tolerance", tolerance)
    ratio, overlap = geometry.contact_ratio, geometry.overlap_ratio
    share = 0.75 * ratio / (0.75 * ratio + 0.25)  # of the mean stiffness that is proportional to the number of pairs
    length = relative_length(ratio, overlap)
    curve = PeriodicCurve(length.knots, 1 + share * (length.first - 1), 1 + share * (length.last - 1))
    reference = mesh_stiffness * geometry.common_face_width
    if overlap == 0 and ratio < 2:
        single = 1 / (0.75 * ratio + 0.25)
        return MeshStiffness(reference, TwoLevelStiffness(1.75 * single - 1, 1 - single, ratio), 0.0, ISO)
    if overlap == 0:
        waveform, error = approximate(curve, tolerance)
        return MeshStiffness(reference, waveform, error, ISO)
    amplitudes, phases = fourier_coefficients(ratio, overlap, MAX_HARMONICS)
    series = truncated_series(curve, share * amplitudes, phases, tolerance)
    waveform, error = series if series and series[1] <= tolerance else approximate(curve, tolerance)
    return MeshStiffness(reference, waveform, error, ISO, _truncation_note(error, tolerance))


def from_energy(
    geometry: Geometry, materials: tuple[Material, Material], bore: tuple[float, float], *,
    tolerance: float = TOLERANCE,
) -> MeshStiffness:
    """Mesh stiffness by the potential-energy method, see `gearchaos.gears.stiffness.potential_energy`.

    Parameters
    ----------
    geometry : Geometry
        Spur gears.
    materials : tuple of Material
        Of wheel 1 and wheel 2.
    bore : tuple of float
        Diameters of the bores, at which the wheel bodies are fixed, m.
    tolerance : float
        Bound of ``truncation``, unless the largest number of levels or harmonics is too small.

    Raises
    ------
    InputError
        For helical gears, contact with gaps or below the involute, or a body outside the range of the method.
    """
    pairs = ToothPairs(geometry, materials, bore)
    return from_curve(pairs.curve(), POTENTIAL_ENERGY, pairs.notes, tolerance=tolerance)


def from_table(
    path: str | Path, *, teeth: int, speed: float | None = None, face_width: float | None = None,
    columns: Mapping[str, str] | None = None, tolerance: float = TOLERANCE, field: str = "stiffness.table",
) -> MeshStiffness:
    """Mesh stiffness from a table over whole mesh periods, for example computed by finite elements.

    The abscissa is the ``fraction`` of the mesh period, from 0 to 1, the ``roll angle`` of wheel 1, from 0 to 2π/z1, or
    the ``time``, from 0 to the mesh period at the given speed. At 0 a tooth pair enters contact. The other column is

    - either ``stiffness``: points of a curve that is linear between them. Two rows with the same abscissa are a jump.
      The last row is the end of the period; its value must equal the first one. If the curve jumps there, as that of
      spur gears does, the last two rows have the same abscissa, with the values before and after the jump. Rows in
      equal steps may lack the one that closes the period.
    - or ``level``: steps, each of which begins at its abscissa. The first begins at 0, the last one ends with the
      period.

    A table over several mesh periods, such as a turn of wheel 1, becomes the mean of them. The notes of the result say
    so, and which columns were taken, unless they have the names above.

    Parameters
    ----------
    path : str or Path
        The file, see `gearchaos.gears.inputs.csvtable.read_table`.
    teeth : int
        z1.
    speed : float, optional
        Of wheel 1, rpm, at which the times hold; for a table over time, and only for one.
    face_width : float, optional
        Common face width, m, by which a stiffness in N/(mm µm) is multiplied.
    columns : mapping of str to str, optional
        Headers in the file of ``fraction``, ``angle`` or ``time`` and of ``stiffness`` (or ``value``) or ``level``.
    tolerance : float
        Bound of ``truncation``, unless the largest number of levels or harmonics is too small. Up to 64 steps are taken
        over exactly.
    field : str
        Name of the path in error messages.

    Raises
    ------
    InputError
        With the number of the line, for a table that is not as described or has a value that is not positive. The last
        abscissa may differ from whole periods by 0.1 % of one, the last value from the first one by 0.01 %, for
        rounding in the file. What does not repeat with the mesh may be a tenth of the variation of the stiffness.
    """
    curve, notes = read_curve(path, field=field, teeth=teeth, speed=speed, face_width=face_width, columns=columns)
    return from_curve(curve, f"table {Path(path).name}", notes, tolerance=tolerance)


def from_curve(
    curve: PeriodicCurve, method: str, notes: Sequence[str] = (), *, tolerance: float = TOLERANCE,
) -> MeshStiffness:
    """Mesh stiffness by a curve in N/m: exact if it has constant pieces only, else steps or a Fourier series.

    See `gearchaos.gears.stiffness.periodic_curves.approximate` for the choice between the two; ``tolerance`` bounds
    ``truncation``.
    """
    _check_positive("tolerance", tolerance)
    waveform, error = approximate(curve, tolerance)
    return MeshStiffness(curve.mean, waveform, error, method, (*notes, *_truncation_note(error, tolerance)))


def _truncation_note(error: float, tolerance: float) -> tuple[str, ...]:
    """The note on a waveform that is not as exact as it should be; none for one that is."""
    if error <= tolerance:
        return ()
    return (f"the waveform differs from the curve by {error:.2g} of its mean (root mean square), more than the bound "
            f"{tolerance:g}: the largest number of levels or harmonics is too small for it",)


def _check_positive(name: str, value: float) -> None:
    """Raise `InputError` unless a value is a positive finite number."""
    if not 0 < value < np.inf:
        raise InputError(name, "must be a positive finite number", value)


@dataclass(frozen=True)
class Comparison:
    """Mesh stiffnesses of one pair by two methods.

    Attributes
    ----------
    first, second : MeshStiffness
        The stiffness by either method.
    """

    first: MeshStiffness
    second: MeshStiffness

    @property
    def ratio(self) -> float:
        """The mean by the second method over that by the first."""
        return self.second.reference / self.first.reference

    def __str__(self) -> str:
        """Mean, least and greatest stiffness by each method, and how far the means are apart."""
        rows = [f"{'':24}{'mean':>10}{'least':>10}{'greatest':>10}   N/um"]
        for result in (self.first, self.second):
            values = (result.reference, *result.extremes)
            rows.append(f"{result.method:24}" + "".join(f"{1e-6 * value:10.2f}" for value in values))
        rows.append(f"The mean by {self.second.method} is {abs(self.ratio - 1):.0%} "
                    f"{'above' if self.ratio >= 1 else 'below'} that by {self.first.method}. "
                    "Accepted methods differ that much; neither is validated by measurements here.")
        return "\n".join(rows)


def compare(
    geometry: Geometry, mesh_stiffness: float, materials: tuple[Material, Material], bore: tuple[float, float],
) -> Comparison:
    """Mesh stiffness of a pair of spur gears by ISO 6336-1 and by the potential-energy method, side by side.

    The parameters are those of `from_iso` and `from_energy`.
    """
    return Comparison(from_iso(geometry, mesh_stiffness), from_energy(geometry, materials, bore))
