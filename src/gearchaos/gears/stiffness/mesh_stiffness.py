"""Mesh stiffness of a gear pair over the mesh period, as reference stiffness and waveform of a model.

The reference is the time mean of the curve, to which ω0 and ζ then refer, and the waveform has the mean 1. At the
beginning of the mesh period a tooth pair enters contact, at the root of wheel 1, which drives. All stiffnesses are in
the transverse plane along the line of action.

To add a method, add a module to this folder with a function of a `Drawing`, and a `StiffnessMethod` with the name
``METHOD``. The function returns a `MeshStiffness`, for example by `from_curve`. Designs, study files, messages, the
datasheet and pictures then know the method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

import gearchaos.gears.stiffness as folder
from gearchaos.errors import InputError
from gearchaos.gears.formulas import declared
from gearchaos.gears.stiffness.contact_lines import fourier_coefficients, relative_length
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, approximate, truncated_series
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, Stiffness, TwoLevelStiffness
from gearchaos.model import mesh_stiffness as stiffness_over_reference
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.materials import Material

TOLERANCE = 2e-3
"""Default bound of the root mean square error of a waveform, relative to the mean stiffness: small beside the 20 % by
which accepted methods of computing the stiffness differ."""

ISO = "ISO 6336-1"


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
        model = MeshModel(omega=2 * np.pi, stiffness=self.waveform)  # of period 1
        return self.reference * stiffness_over_reference(model, positions)

    @property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest stiffness, N/m; of a Fourier series, on a grid of 64 positions per harmonic."""
        if isinstance(self.waveform, HarmonicStiffness):
            positions = np.arange(64 * len(self.waveform.amplitudes)) / (64 * len(self.waveform.amplitudes))
        elif isinstance(self.waveform, SteppedStiffness):
            positions = np.array(self.waveform.starts)
        else:
            positions = np.array([0.0, self.waveform.contact_ratio - 1])
        values = self(positions)
        return float(values.min()), float(values.max())


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


class Drawing(Protocol):
    """What methods take from a `GearDesign`, whose module imports this one; the tooth stiffness is that by ISO 6336-1.
    """

    @property
    def geometry(self) -> Geometry: ...

    @property
    def material(self) -> tuple[Material, Material]: ...

    @property
    def tooth_stiffness(self) -> Any: ...

    def given(self, name: str) -> Any: ...


@dataclass(frozen=True, kw_only=True)
class StiffnessMethod:
    """A method of computation.

    Attributes
    ----------
    name : str
        What a design says for it as its ``stiffness``.
    compute : callable
        Takes a `Drawing` and returns its `MeshStiffness`; raises `InputError` where the method has none.
    needs : tuple of str
        Inputs that a design may leave out, but not for this method.
    spur_only : bool
        Whether the method is for spur gears alone.
    warnings : callable
        Takes a `Drawing` and returns what the designer should know of this stiffness, without full stops.
    """

    name: str
    compute: Callable[[Drawing], MeshStiffness]
    needs: tuple[str, ...] = ()
    spur_only: bool = False
    warnings: Callable[[Drawing], Sequence[str]] = lambda design: ()


@cache
def methods() -> dict[str, StiffnessMethod]:
    """All methods by name, in the order of their modules."""
    return {each.name: each for each in declared(folder, "METHOD")}


def other_methods(name: str, geometry: Geometry) -> str:
    """The advice to take another method than this one, of those that the pair can have."""
    names = [each.name for each in methods().values() if not (each.spur_only and geometry.helix_angle)]
    others = "".join(f'stiffness = "{other}", or ' for other in names if other != name)
    return f'Write {others}stiffness = {{ table = "tvms.csv" }}.'
