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

from gearchaos.errors import InputError
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, approximate
from gearchaos.model import Stiffness
from gearchaos.plugins import declared

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.geometry.mechanics import Material

# default bound of the root mean square error of a waveform, relative to the mean stiffness: small beside the 20 % by
# which accepted methods of computing the stiffness differ
TOLERANCE = 2e-3


@dataclass(frozen=True)
class MeshStiffness:
    """Mesh stiffness over the mesh period: the time mean ``reference``, N/m, times a ``waveform`` of mean 1.

    ``truncation`` is the root mean square over the period of the waveform less the curve of the method, relative to the
    mean; 0 where the waveform is the curve. The notes say what limits the result.
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


def from_curve(
    curve: PeriodicCurve, method: str, notes: Sequence[str] = (), *, tolerance: float = TOLERANCE,
) -> MeshStiffness:
    """Mesh stiffness by a curve in N/m, as `gearchaos.gears.stiffness.periodic_curves.approximate` approximates it."""
    check_positive("tolerance", tolerance)
    waveform, error = approximate(curve, tolerance)
    return MeshStiffness(curve.mean, waveform, error, method, (*notes, *truncation_note(error, tolerance)))


def truncation_note(error: float, tolerance: float) -> tuple[str, ...]:
    """The note on a waveform that is not as exact as it should be; none for one that is."""
    if error <= tolerance:
        return ()
    return (f"the waveform differs from the curve by {error:.2g} of its mean (root mean square), more than the bound "
            f"{tolerance:g}: the largest number of levels or harmonics is too small for it",)


def check_positive(name: str, value: float) -> None:
    if not 0 < value < np.inf:
        raise InputError(name, "must be a positive finite number", value)


class Drawing(Protocol):
    """What methods take from a `GearDesign`, whose module imports this one; the tooth stiffness is by ISO 6336-1."""

    @property
    def geometry(self) -> Geometry: ...
    @property
    def material(self) -> tuple[Material, Material]: ...
    @property
    def tooth_stiffness(self) -> Any: ...
    def given(self, name: str) -> Any: ...


@dataclass(frozen=True, kw_only=True)
class StiffnessMethod:
    """A method of computation, which raises `InputError` where it has no stiffness; its warnings have no full stops."""

    name: str  # what a design says for it as its ``stiffness``
    compute: Callable[[Drawing], MeshStiffness]
    needs: tuple[str, ...] = ()  # inputs that a design may leave out, but not for this method
    spur_only: bool = False
    external_only: bool = False
    pair: Callable[[Drawing], tuple[tuple[float, ...], tuple[float, ...]]] | None = None  # stiffness of one tooth pair
    # of a spur gear over the reference, and where on its path each part begins; None if there is the sum alone
    warnings: Callable[[Drawing], Sequence[str]] = lambda design: ()


@cache
def methods() -> dict[str, StiffnessMethod]:
    """All methods by name, in the order of their modules."""
    return declared(__name__, "METHOD")


def other_methods(name: str, geometry: Geometry) -> str:
    """The advice to take another method than this one, of those that the pair can have."""
    names = [each.name for each in methods().values() if not (each.spur_only and geometry.helix_angle) and not (
        each.external_only and geometry.signs[1] < 0)]
    others = "".join(f'stiffness = "{other}", or ' for other in names if other != name)
    return f'Write {others}stiffness = {{ table = "tvms.csv" }}.'
