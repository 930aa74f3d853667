"""Backlash: the ways in which a drawing gives it, and its value along the line of action.

All lengths are in m. The model needs the total backlash j_bt in the transverse plane along the line of action: the
distance that the flanks travel from one contact to the other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.geometry.checks import SHIFT_TOLERANCE
from gearchaos.gears.geometry.dimensions import Geometry, Pair
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Record, check_plausible, name_of, one, read_by, record, two
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE, Rule

_ANGLES = ("angle of wheel 1", "angle of wheel 2")
_KINDS = ("line of action", "circumferential", "reference circle", "normal", "radial", *_ANGLES)
OF = tuple(f"{kind}, {part}" for kind in _KINDS for part in ("total", "half"))
"""What a backlash can be of: a direction, and whether the value is all of it or half of it.

- ``line of action``: j_bt, in the transverse plane along the line of action;
- ``circumferential``: j_wt, the arc on the working pitch circles;
- ``reference circle``: j_t, the arc on the reference circle of the wheel that is turned while the other is held;
- ``normal``: j_bn, the shortest distance of the flanks, normal to them;
- ``radial``: j_r, the decrease of the centre distance that closes the backlash, of an internal pair the increase;
- ``angle of wheel 1``: j_φ, the angle by which wheel 1 turns while wheel 2 is held; or the other way round.

ISO 21771:2007 and ISO/TR 10064-2:1996 define j_wt, j_bn and j_r. A direction alone means the total.
"""

# other words for a direction, whose letters are nearer to those of another one
_OTHER_WORDS = {"tangential": "circumferential", "working pitch circle": "circumferential",
                "pitch circle": "circumferential", "pitch diameter": "circumferential"}
_NOT_POSITIVE = Rule(lambda v: v <= 0, "must not be greater than 0")


@dataclass(frozen=True, kw_only=True)
class Backlash:
    """A backlash by its value, a length or an angle, and what it is of, one of `OF`; a direction means the total."""

    value: Any
    of: str

    def __post_init__(self) -> None:
        if self.of in _KINDS:
            object.__setattr__(self, "of", f"{self.of}, total")
        if self.of not in OF:
            # "half" is suggested only where the text has it
            suggested = [name for name in (*_KINDS, *OF) if not name.endswith("half") or "half" in str(self.of)]
            quoted = ", ".join(map(repr, _KINDS))
            rule = f"must be one of {quoted}, alone or followed by ', total', which means the same, or by ', half'"
            said = str(self.of).casefold()
            meant = next((name for words, name in _OTHER_WORDS.items() if words in said), str(self.of))
            raise InputError("of", rule, self.of, unknown_name("of", meant, suggested).advice)
        try:
            object.__setattr__(self, "value", units.to_si("value", self.value, self.dimension, POSITIVE))
        except InputError as error:
            which = f"With of = {self.of!r} it is {self.dimension.name}; of = {_ANGLES[0]!r} takes an angle."
            raise InputError(error.field, error.rule, error.value, f"{error.advice} {which}") from None

    @property
    def dimension(self) -> units.Dimension:
        return units.ANGLE if self.of.startswith(_ANGLES) else units.LENGTH

    def along_line_of_action(self, geometry: Geometry) -> float:
        """j_bt, total, m; raises `InputError` if the centre distance alone makes more backlash."""
        kind, part = self.of.split(", ")
        total = self.value * (2 if part == "half" else 1) * base_tangent_length(geometry, kind)
        excess = geometry.theoretical_backlash - total
        if excess > SHIFT_TOLERANCE * geometry.normal_module:
            shown = units.Shown if self.dimension is units.ANGLE else units.Length
            raise InputError(
                "backlash.value", f"must give at least the {geometry.theoretical_backlash * 1e3:.4g} mm along the line "
                "of action that teeth of nominal thickness have at this centre distance", shown(self.value, self.value),
                f"It gives {total * 1e3:.4g} mm. Check the centre distance, the profile shifts, and whether the "
                "value is the total or half of it.")
        return total


def _thickness_allowances(name: str, value: Any) -> tuple[Pair, Pair]:
    items = list(value) if isinstance(value, (list, tuple)) else []
    if len(items) != 2:
        raise InputError(name, "must be a list of upper and lower allowance, or of two such lists", value,
                         "E.g. [['-70 um', '-110 um'], ['-100 um', '-150 um']].")
    if not any(isinstance(item, (list, tuple)) for item in items):
        both = _limits(name, items, _NOT_POSITIVE)
        return both, both
    return _limits(f"{name}[0]", items[0], _NOT_POSITIVE), _limits(f"{name}[1]", items[1], _NOT_POSITIVE)


def _limits(name: str, value: Any, rule: Rule | None = None) -> Pair:
    """Upper and lower allowance in m; raises `InputError` if the lower one is greater."""
    if not isinstance(value, (list, tuple)):
        raise InputError(name, "must be a list of upper and lower allowance", value)
    upper, lower = two(one(units.LENGTH, rule))(name, value)
    if lower > upper:
        raise InputError(name, "must have the upper allowance first", value)
    return upper, lower


def _distance_allowance(name: str, value: Any) -> Pair:
    """Upper and lower allowance of the centre distance in m, from both or from one length for ± that length."""
    if isinstance(value, (list, tuple)):
        return _limits(name, value)
    length = units.to_si(name, value, units.LENGTH, NOT_NEGATIVE)
    return length, -length


@dataclass(frozen=True, kw_only=True)
class ThicknessAllowances(Record):
    """Backlash given by the allowances of tooth thickness and centre distance, as in DIN 3967:1978 and DIN 3964:1980.

    E_sns and E_sni of each wheel are not greater than 0; a single pair holds for both. The thickness is meant in this
    plane, by default the normal one, as in DIN 3967. One length for the centre distance is ± that length.
    """

    tooth_thickness_allowances: Any = field(metadata=read_by(_thickness_allowances))
    plane: str = field(default="normal", metadata=read_by(name_of("normal", "transverse")))
    centre_distance_allowance: Any = field(default=(0.0, 0.0), metadata=read_by(_distance_allowance))
    at: str = field(default="mean", metadata=read_by(name_of("mean", "minimum", "maximum")))

    def along_line_of_action(self, geometry: Geometry) -> float:
        """j_bt, total, m, at the limit ``at``."""
        nearest = int(geometry.signs[1] > 0)  # teeth are closest at the least distance, of a ring at the greatest
        least, greatest = self._limit(geometry, 0, nearest), self._limit(geometry, 1, 1 - nearest)
        return {"minimum": least, "maximum": greatest, "mean": (least + greatest) / 2}[self.at]

    def _limit(self, geometry: Geometry, thickness: int, distance: int) -> float:
        """j_bt for the upper (0) or lower (1) allowance of thickness and of centre distance: the theoretical backlash
        there, plus what teeth are thinner than nominal by, −E_sn/cos β on the reference circle, times cos α_t.
        """
        moved = replace(geometry, centre_distance=geometry.centre_distance + self.centre_distance_allowance[distance])
        thinner = -sum(allowance[thickness] for allowance in self.tooth_thickness_allowances)
        if self.plane == "normal":
            thinner /= math.cos(geometry.helix_angle)
        return moved.theoretical_backlash + thinner * math.cos(geometry.transverse_pressure_angle)


AnyBacklash = Backlash | ThicknessAllowances


def backlash_of(field: str, value: Any) -> AnyBacklash:
    """A backlash from a table with ``value`` and ``of``, or with ``tooth_thickness_allowances``."""
    if isinstance(value, ThicknessAllowances) or (isinstance(value, Mapping) and "tooth_thickness_allowances" in value):
        return record(ThicknessAllowances)(field, value)
    return record(Backlash, "must say what it is of", "Write { value = '0.12 mm', of = 'line of action, total' }, or "
                  "give tooth_thickness_allowances.")(field, value)


def check_backlash(given: AnyBacklash, geometry: Geometry) -> float:
    """j_bt, total, m; raises `InputError` if it is not positive, or more than half a module: a slip of units."""
    total = given.along_line_of_action(geometry)
    if total <= 0:
        raise InputError("backlash", "must be greater than 0", units.Length(total),
                         "The allowances leave no backlash at this centre distance.")
    if isinstance(given, Backlash):
        most = geometry.normal_module / 2 * given.value / total
        check_plausible("backlash.value", given.value, 0.0, most, "It is at most half a module.", given.dimension)
    check_plausible("backlash", total, 0.0, geometry.normal_module / 2, "It is at most half a module.")
    return total


def base_tangent_length(geometry: Geometry, kind: str) -> float:
    """Backlash j_bt along the line of action over a total backlash of another kind, see `OF`; m/rad for an angle.

    j_bt = j_wt cos α_wt = j_t cos α_t = j_bn/cos β_b = j_φ d_b/2 = 2 j_r sin α_wt, ISO 21771:2007; the last one holds
    for a backlash that is small beside the centre distance.
    """
    working, base = geometry.working_pressure_angle, geometry.base_diameter
    return {
        "line of action": 1.0, "circumferential": math.cos(working), "radial": 2 * math.sin(working),
        "reference circle": math.cos(geometry.transverse_pressure_angle),
        "normal": 1 / math.cos(geometry.base_helix_angle),
        "angle of wheel 1": base[0] / 2, "angle of wheel 2": base[1] / 2}[kind]
