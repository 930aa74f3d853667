"""The methods by which the mesh stiffness of a pair is computed from its drawing.

To add a method, add a module to this folder with a function of a `Drawing`, and a `StiffnessMethod` with the name
``METHOD``. The function returns a `MeshStiffness`, for example by `from_curve`. Designs, study files, messages, the
datasheet and pictures then know the method.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

import gearchaos.gears.stiffness as folder
from gearchaos.gears.formulas import declared

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.materials import Material
    from gearchaos.gears.stiffness.mesh_stiffness import MeshStiffness


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
