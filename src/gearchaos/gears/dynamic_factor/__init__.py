"""The standards for the dynamic factor K_v: the ratio of the largest tooth force, with its dynamic part, to F_t K_A.

To add a standard, add a module to this folder. It has a function of a `GearDesign`, which returns `Refused` outside its
validity, a frozen dataclass for its result, whose numbers are `described`, and a `Standard` with the name ``STANDARD``.
Datasheet, JSON, printed tables, Datasets and pictures then have it. Another package offers its `Standard` in the group
``gearchaos.standards``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from gearchaos.gears.io.fields import formulas
from gearchaos.plugins import Register, declared, value_of

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.geometry.dimensions import Geometry

class DynamicFactor(Protocol):
    """What a standard says of a pair: ``value`` is K_v, or None with a ``reason``."""

    @property
    def value(self) -> float | None: ...
    @property
    def reason(self) -> str: ...


@dataclass(frozen=True)
class Refused:
    """Why a standard gives no dynamic factor, in a sentence: outside its validity, or where an input is missing."""

    reason: str
    value: ClassVar[None] = None


@dataclass(frozen=True, kw_only=True)
class Standard:
    """A standard, or one of its methods.

    ``label`` is what the legend of a picture says, ``words`` the name with edition or method, ``beside`` other fields
    of the result for the datasheet, by their names there. The field ``value`` of the result has the `Formula` of K_v.
    """

    name: str  # of K_v on the datasheet and in a Dataset: "Kv_" and what tables print above its column
    label: str
    words: str
    result: type
    compute: Callable[[GearDesign], DynamicFactor]
    needs: tuple[str, ...] = ("quality", "speed", "torque")  # inputs that designs may leave out, but not for this
    beside: Mapping[str, str] = field(default_factory=dict)

    @property
    def long_name(self) -> str:
        """K_v of this standard in words."""
        return f"dynamic factor by {self.words}"

    @property
    def heading(self) -> str:
        """K_v of this standard above a column of a table."""
        return f"K_v {self.name.removeprefix('Kv_').replace('_', ' ')}"

    def factor(self, design: GearDesign) -> DynamicFactor:
        """The dynamic factor of a design at its speed and torque, or `Refused`, also where an input is left out."""
        missing = [name for name in self.needs if getattr(design, name) is None]
        return Refused(f"The design gives no {' and no '.join(missing)}.") if missing else self.compute(design)


def _fault(name: str, found: Any) -> str:
    """What is wrong with a standard of another package; empty if nothing is."""
    if wrong := value_of(Standard, "name")(name, found):
        return wrong
    if not name.startswith("Kv_"):
        return "its name must begin with Kv_"
    lacks = [field for field in ("value", *found.beside.values()) if field not in formulas(found.result)]
    return f"its result must have {', '.join(lacks)}, described with a formula" if lacks else ""


@cache
def _register() -> Register[Standard]:
    return Register("gearchaos.standards", declared(__name__, "STANDARD"), _fault)


def standards() -> tuple[Standard, ...]:
    """All standards, of other packages as well: those of ISO first, then the others by name."""
    return tuple(sorted(_register().values(), key=lambda each: (not each.name.startswith("Kv_ISO"), each.name)))


def velocity_parameter(geometry: Geometry, velocity: float) -> float:
    """(v z1/100) √(u²/(1 + u²)), m/s, at a pitch line velocity v, where 1 is the pinion; ISO 6336-1:2006, 6.3.2."""
    pinion, ratio = min(geometry.teeth), max(geometry.teeth) / min(geometry.teeth)
    return velocity * pinion / 100 * math.sqrt(ratio**2 / (1 + ratio**2))
