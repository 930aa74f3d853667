"""Tooth pairs that share the load, as the table ``tooth_pairs`` of a `GearPair` gives them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.fields import Record, name_of, number, one, read_by, record, two
from gearchaos.model.stiffness.tooth_pairs import SHAPES
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE, Rule
from gearchaos.validation import to_floats

_SHARE = Rule(lambda v: (v > 0) & (v <= 1), "must lie in (0, 1]", "It is a share of the path of contact.")
_ONE_PAIR = one(units.STIFFNESS, POSITIVE)


def _levels(field: str, value: Any) -> tuple[float, ...]:
    """The stiffness of one pair in N/m, one value or a list along its path."""
    if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__len__"):
        return (_ONE_PAIR(field, value),)
    return tuple(_ONE_PAIR(f"{field}[{i}]", v) for i, v in enumerate(value))


@dataclass(frozen=True, kw_only=True)
class Relief(Record):
    """Tip relief of both wheels: C_a, the share of the path of contact over which it goes to 0, and its shape."""

    amount: Any = field(metadata=read_by(two(one(units.LENGTH, NOT_NEGATIVE))))
    length: Any = field(default=(0.2, 0.2), metadata=read_by(two(number(_SHARE))))
    shape: str = field(default="linear", metadata=read_by(name_of(*SHAPES)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(self.length) > 1 + 1e-12:
            raise InputError("length", "must have a sum of both wheels of at most 1, the path of contact", self.length,
                             "Shorten the relief of one wheel.")


@dataclass(frozen=True, kw_only=True)
class ToothPairs(Record):
    """The stiffness of one tooth pair, and the parts of its path of contact where it is that; relief and crowning."""

    stiffness: Any = field(metadata=read_by(_levels))
    starts: Any = field(default=(0.0,), metadata=read_by(to_floats))
    contact_ratio: float = field(metadata=read_by(number()))
    relief: Any = field(default=None, metadata=read_by(record(Relief)))
    crowning: Any = field(default=0.0, metadata=read_by(one(units.LENGTH, NOT_NEGATIVE)))
    back_phase: float = field(default=0.5, metadata=read_by(number()))

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.starts) != len(self.stiffness) or self.starts[0] != 0:
            raise InputError("starts", f"must have as many values as stiffness ({len(self.stiffness)}), the first 0",
                             self.starts, "The stiffness of one pair must be given on its whole path of contact, from 0 on.")
