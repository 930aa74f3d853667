"""Tooth pairs that share the load, as the table ``tooth_pairs`` of a `GearPair` gives them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry
from gearchaos.gears.geometry.tooth_root import involute
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Record, each, name_of, number, one, read_by, record, two
from gearchaos.model import MAX_LEVELS, ToothPairStiffness
from gearchaos.model.stiffness.tooth_pairs import CONTACT_RATIO, PHASE, SHAPES, SHARE, check_corner
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE
from gearchaos.validation import to_floats

_ONE_PAIR = one(units.STIFFNESS, POSITIVE)


def _levels(field: str, value: Any) -> tuple[float, ...]:
    """The stiffness of one pair in N/m, one value or a list along its path."""
    if isinstance(value, (str, bytes, Mapping)) or not hasattr(value, "__len__"):
        return (_ONE_PAIR(field, value),)
    if not 0 < len(value) <= MAX_LEVELS:
        raise InputError(field, f"must have 1 to {MAX_LEVELS} values", len(value))
    return tuple(_ONE_PAIR(f"{field}[{i}]", v) for i, v in enumerate(value))


def _starts(field: str, value: Any) -> tuple[float, ...]:
    """Where the parts begin, as shares of the path."""
    starts = to_floats(field, value, MAX_LEVELS, "starts")
    if starts[:1] != (0.0,) or any(b <= a for a, b in pairwise((*starts, 1.0))):
        raise InputError(field, "must rise from 0 and stay below 1", starts,
                         "They are shares of the path of contact, on the whole of which a pair has a stiffness.")
    return starts


@dataclass(frozen=True, kw_only=True)
class Relief(Record):
    """Tip relief of both wheels: C_a, the share of the path of contact over which it goes to 0, and its shape."""

    amount: Any = field(metadata=read_by(two(one(units.LENGTH, NOT_NEGATIVE))))
    length: Any = field(default=(0.2, 0.2), metadata=read_by(two(number(SHARE))))
    shape: str = field(default="linear", metadata=read_by(name_of(*SHAPES)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if sum(self.length) > 1 + 1e-12:
            raise InputError("length", "must have a sum of both wheels of at most 1, the path of contact", self.length,
                             "Shorten the relief of one wheel.")


@dataclass(frozen=True, kw_only=True)
class CornerContact(Record):
    """Contact of the tip corners of both wheels beyond the path: how far it goes on, and the coefficients of x², x³, …
    of the gap, lengths. That distance and x, from the end of the path on, are shares of the path."""

    length: Any = field(metadata=read_by(two(number(), "must be a list of two")))
    gap: Any = field(metadata=read_by(two(each(units.LENGTH), "must be a list of two")))

    def __post_init__(self) -> None:
        super().__post_init__()
        for i, (length, gap) in enumerate(zip(self.length, self.gap, strict=True)):
            check_corner((f"length[{i}]", length), (f"gap[{i}]", gap))


@dataclass(frozen=True, kw_only=True)
class ToothPairs(Record):
    """The stiffness of one tooth pair, and the parts of its path of contact where it is that; relief and crowning."""

    stiffness: Any = field(metadata=read_by(_levels))
    starts: Any = field(default=(0.0,), metadata=read_by(_starts))
    contact_ratio: float = field(metadata=read_by(number(CONTACT_RATIO)))
    relief: Any = field(default=None, metadata=read_by(record(Relief)))
    crowning: Any = field(default=0.0, metadata=read_by(one(units.LENGTH, NOT_NEGATIVE)))
    back_phase: float = field(default=0.5, metadata=read_by(number(PHASE)))
    corner: Any = field(default=None, metadata=read_by(record(CornerContact)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.starts) != len(self.stiffness):
            raise InputError("starts", f"must have as many values as stiffness ({len(self.stiffness)})", self.starts,
                             "The stiffness of one pair begins to be each of its values there.")


class PairsAlone(NamedTuple):
    """What the stiffness of tooth pairs in a model follows from, by the names of a `GearPair`; any scale of lengths."""

    c0: float
    tooth_pairs: ToothPairs
    half_backlash: float = 1e-4

    @property
    def stiffness(self) -> ToothPairStiffness:
        found = ToothPairStiffness.from_pair(self)
        assert found is not None
        return found


def back_phase(geometry: Geometry) -> float:
    """By how much of the mesh period the back flanks enter contact later than the front flanks.

    The line of centres mirrors the path of contact of the back flanks. The back flank of a tooth of wheel 1 passes the
    pitch point C later than its front flank by the tooth thickness at the working pitch circle, s_w1 of p_w, and both
    are then at AC from the beginning of the path g_α: s_w1/p_w + (2 AC − g_α)/p_bt.
    """
    wide = involute(geometry.transverse_pressure_angle) - involute(geometry.working_pressure_angle)
    reference = 0.5 + 2 * geometry.profile_shift[0] * math.tan(geometry.pressure_angle) / math.pi
    to_pitch_point = geometry.signs[1] * (geometry.tip_tangents[1] - geometry.base_diameter[1] / 2 * math.tan(
        geometry.working_pressure_angle))
    later = reference + wide * geometry.teeth[0] / math.pi
    return (later + (2 * to_pitch_point - geometry.path_of_contact) / geometry.base_pitch) % 1.0
