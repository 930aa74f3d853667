"""The inputs of the form of a drawing: made from the readers of `Inputs`, in groups."""

from __future__ import annotations

import inspect
import re
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any

from gearchaos.gears.design.gear_design import OPERATION, GearDesign
from gearchaos.gears.design.inputs import Inputs
from gearchaos.gears.design.values import module_of
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Convert, Reader, one, two

GROUPS: dict[str, tuple[str, ...]] = {
    "Teeth": ("teeth", "module", "pressure_angle", "helix_angle", "face_width"),
    "Pair": ("centre_distance", "profile_shift", "tip_diameter", "backlash", "damping_ratio"),
    "Flanks": ("tip_relief", "quality", "transmission_error"),
    "Wheels": ("material", "bore"),
    "Operation": ("speed", "torque"),
    "More": ("rack", "tip_alteration", "inertia", "mass", "stiffness", "load_sharing", "damping_law", "lead_crowning",
             "lead_slope", "supports", "application_factor"),
}
"""Headings of the form, each with its inputs; the last one is folded. Inputs that are files or lists stand in none."""


RANGES = "range"  # the table of the ranges of the map
MODULE, PITCH = "design.module", units.DIAMETRAL_PITCH
_FINE = ("tip_relief.amount", "lead_crowning", "lead_slope")  # lengths that drawings have in µm


@dataclass(frozen=True)
class Input:
    """One row of the form, by its key in a study file: how it is read, what it means, and what it is if left out."""

    key: str
    reader: Reader
    words: str
    default: Any = None

    @property
    def path(self) -> str:
        """Its name within its table."""
        return self.key.partition(".")[2]

    @property
    def label(self) -> str:
        table, _, path = self.key.partition(".")
        return f"{path}, map from, to" if table == RANGES else path.replace("_", " ").replace(".", ": ")

    @property
    def second(self) -> str:
        """What the second of two values is of."""
        return "to" if self.key.startswith(RANGES) else "wheel 2"

    @property
    def units(self) -> Sequence[str]:
        """The units that it is offered in, the usual one first."""
        dimension = self.reader.dimension
        if dimension is None:
            return ()
        usual = dimension.drawn or (dimension.example.partition(" ")[2],)
        if self.path in _FINE:
            return sorted(usual, key=lambda unit: unit != "um")
        return (*usual, PITCH.unit) if self.key == MODULE else usual

    def read(self, text: str) -> Any:
        """The value that a study file has for a text: texts, numbers, or a list of those of both wheels."""
        if not self.reader.both:
            return self._one(text)
        items = [self._one(part.strip()) for part in text.split(";")]
        return items if len(items) > 1 else items[0]

    def _one(self, text: str) -> Any:
        if self.reader.dimension is None and not self.reader.names:
            for kind in (int, float):
                try:
                    return kind(text)
                except ValueError:
                    continue
        return text

    def parts(self, text: str) -> tuple[list[str], str]:
        """The numbers of a text of the form, and their unit; a number in another one keeps it."""
        texts = [part.strip() for part in text.split(";")]
        unit = next((u for u in self.units if texts[0].endswith(f" {u}")), "")
        return [part.removesuffix(f" {unit}") if unit else part for part in texts], unit

    def shown(self, value: Any, unit: str) -> list[str]:
        """A value in SI as numbers in a unit, those of both wheels once if they are the same."""
        size = units.to_si(self.path, f"1 {unit}", self.reader.dimension) if self.reader.dimension and unit else 1.0
        if unit == PITCH.unit:
            return [f"{module_of(1.0) / value:.6g} {unit}"]
        values = value if isinstance(value, (tuple, list)) else (value,)
        return [f"{v / size:.6g}{f' {unit}' * bool(unit)}" if isinstance(v, (int, float)) else str(v) for v in values]


@cache
def inputs() -> dict[str, Input]:
    """The inputs of the form by key, in their order."""
    words, own = _words(), {f.name: f for f in fields(Inputs)}
    found = {}
    for name in (name for names in GROUPS.values() for name in names):
        key, declared = f"{'operation' if name in OPERATION else 'design'}.{name}", own[name]
        default = None if declared.default is MISSING else declared.default
        reader = _reader(declared.metadata["convert"])
        for part, convert in (reader.parts or {"": reader}).items():
            dotted = f"{key}.{part}" if part else key
            found[dotted] = Input(dotted, _reader(convert), words.get(name, ""),
                                  getattr(default, part, None) if part else default)
        if name in ("speed", "torque"):
            ends = two(one(units.SPEED if name == "speed" else units.TORQUE), "must be two values: from and to")
            found[f"{RANGES}.{name}"] = Input(f"{RANGES}.{name}", ends, f"The {name}s of the map.")
    return found


def _reader(convert: Convert) -> Reader:
    return convert if isinstance(convert, Reader) else Reader(convert, names=getattr(convert, "names", ()))


def _words() -> dict[str, str]:
    """What the inputs mean, by name, from the docstring of `GearDesign`."""
    found = re.findall(r"^(\w[\w, ]*) : .*\n((?:    .+\n)+)", inspect.cleandoc(GearDesign.__doc__ or ""), re.MULTILINE)
    return {name: " ".join(text.replace("``", "").split()) for names, text in found for name in names.split(", ")}
