"""The transmission error of a pair, and the tolerances of accuracy grades.

`harmonics.py` has the error that follows from a grade, `tip_relief.py` that from tip relief, `tables.py` that from
measured or computed tables. Here are the grades, and the flank tolerances of both wheels that follow from them.

The editions of ISO 1328-1 have different formulae, and the number of a grade does not mean the same in both. National
standards that are the text of an edition are read as it. Grades of others are refused, with the nearest grade of an
edition, since their tolerances are not the same.

To add an edition, add a module to this folder with its `Tolerances`, and an `Edition` with the name ``EDITION``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.errors import InputError, unknown_name
from gearchaos.plugins import declared
from gearchaos.validation import to_float

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Flank tolerances of one wheel, m."""

    single_pitch: float  # f_pt
    cumulative_pitch: float  # F_p, total
    profile: float  # F_α, total
    profile_form: float  # f_fα
    profile_slope: float  # f_Hα
    helix: float  # F_β, total
    runout: float  # F_r


class Size(NamedTuple):
    """What the tolerances of a wheel depend on, mm."""

    d: float
    m: float
    b: float


@dataclass(frozen=True, kw_only=True)
class Edition:
    """A standard for the tolerances of a grade, within a scope in mm and degrees."""

    name: str
    grades: tuple[int, int]
    scope: Mapping[str, tuple[float, float]]
    result: type[Tolerances]
    at_grade_5: Callable[[Size], tuple[float, ...]]  # in µm before rounding, in the order of the fields of Tolerances
    adopted: Mapping[str, str]  # national standards with its text, and the letter before their grades
    # others: a pattern of the name, the grade that is nearest to one of theirs, and why it is not the same
    near: tuple[tuple[str, Callable[[int], int], str], ...]


@cache
def editions() -> dict[str, Edition]:
    """All editions by name, in the order of their modules."""
    return declared(__name__, "EDITION")


PERMISSIBLE_OVER_SD = 3.0
"""Permissible deviation over the standard deviation of wheels within a grade, which no standard has: a convention, the
limits at which a process has a capability index C_p of 1 (ISO 22514-2)."""


@dataclass(frozen=True)
class Quality:
    """Accuracy grade of the teeth, of both wheels or of each; the deviations grow with the number, by √2 from grade to
    grade.

    A national standard that is the text of an edition is kept as it; its grades may have their letter, e.g. "N8".
    ``deviations`` are the tooth-to-tooth deviations f_i′ that wheels 1 and 2 have, over those permissible, from −1 to
    1: positive where profiles are crowned, negative where they are hollow.

    Raises `InputError` for an unknown standard, with the nearest grade of an edition, a grade outside the edition's
    range, or deviations that are not those of the grade.
    """

    standard: str
    grade: int | tuple[int, int]
    deviations: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if self.deviations is not None:
            object.__setattr__(self, "deviations", _within(self.deviations))
        if isinstance(self.grade, list):
            object.__setattr__(self, "grade", tuple(self.grade))
        if isinstance(self.grade, tuple) and len(self.grade) != 2:
            raise InputError("quality.grade", "must be one grade or a list of two", self.grade)
        for edition in editions().values():
            if (letter := edition.adopted.get(self.standard)) is not None:
                grades = tuple(_number(grade, letter) for grade in self.grades)
                object.__setattr__(self, "grade", grades if isinstance(self.grade, tuple) else grades[0])
                object.__setattr__(self, "standard", edition.name)
        if self.standard not in editions():
            adopted = [name for edition in editions().values() for name in edition.adopted]
            error = unknown_name("quality.standard", str(self.standard), (*editions(), *adopted))
            for edition, (pattern, nearest, why) in ((e, near) for e in editions().values() for near in e.near):
                if re.search(pattern, str(self.standard)):
                    numbers = dict.fromkeys(_number(grade, "[A-Z]?") for grade in self.grades)
                    found = [nearest(n) if isinstance(n, int) else None for n in numbers]
                    low, high = edition.grades
                    near = ", ".join("…" if n is None else str(n) for n in found)
                    shown = f"[{near}]" if "," in near else near
                    advice = f"The nearest is {{ standard = '{edition.name}', grade = {shown} }}, not the same: {why}."
                    if not all(n is None or low <= n <= high for n in found):
                        advice = f"{edition.name} has no grade near it, only {low} to {high}: {why}."
                    raise InputError(error.field, error.rule, self.standard, advice)
            raise error
        low, high = editions()[self.standard].grades
        for grade in self.grades:
            if isinstance(grade, bool) or not isinstance(grade, int) or not low <= grade <= high:
                rule = f"must be a whole number from {low} to {high} in {self.standard}"
                raise InputError("quality.grade", rule, self.grade, "The deviations grow with the number.")

    @property
    def grades(self) -> tuple[int, int]:
        return self.grade if isinstance(self.grade, tuple) else (self.grade, self.grade)

    @property
    def coarsest(self) -> int:
        """The grade of the less accurate wheel."""
        return max(self.grades)


def _within(deviations: Any) -> tuple[float, float]:
    """Deviations over the permissible ones; raises `InputError` unless they are two numbers from −1 to 1."""
    if not isinstance(deviations, (list, tuple)) or len(deviations) != 2:
        raise InputError("quality.deviations", "must be a list of two, those of wheels 1 and 2", deviations,
                         "E.g. [0.5, -0.2], each over the permissible one.")
    first, second = (to_float(f"quality.deviations[{wheel}]", each) for wheel, each in enumerate(deviations))
    for wheel, each in enumerate((first, second)):
        if not -1 <= each <= 1:
            raise InputError(f"quality.deviations[{wheel}]", "must lie in [-1, 1]", each,
                             "It is over the permissible one: beyond that the wheel is of a coarser grade.")
    return first, second


def _number(grade: Any, letter: str) -> Any:
    """The number of a grade that is a text such as "N8"; anything else as it is."""
    match = re.fullmatch(rf"(?:{letter})?(\d+)", grade) if isinstance(grade, str) else None
    return int(match[1]) if match else grade


def tolerances(quality: Quality, geometry: Geometry) -> tuple[Tolerances, Tolerances]:
    """The flank tolerances of both wheels; raises `InputError` if a size is outside the scope of the standard.

    They are rounded as the standard says: to 1 µm from 10 µm on, to 0.5 µm from 5 µm on, and to 0.1 µm below. The
    standard forbids extrapolation beyond its scope. F_α, F_β and F_r of the edition of 2013 are computed from values
    before rounding. All formulae were compared with a public code, the scope of 2013 with the published abstract, but
    those of the runout (ISO 1328-2:1997, annex B, and ISO 1328-1:2013, annex E), which could be compared with one
    source only.
    """
    edition, found = editions()[quality.standard], []
    for wheel, grade in enumerate(quality.grades):
        size = Size(*(1e3 * v for v in (
            geometry.reference_diameter[wheel], geometry.normal_module, geometry.face_width[wheel])))
        checked = {"reference_diameter": size.d, "module": size.m, "face_width": size.b, "teeth": geometry.teeth[wheel],
                   "helix_angle": math.degrees(geometry.helix_angle)}
        for name, (low, high) in edition.scope.items():
            unit = {"teeth": "", "helix_angle": " deg"}.get(name, " mm")
            if not low <= round(checked[name], 9) <= high:
                field = name if name in ("module", "helix_angle") else f"{name}[{wheel}]"
                raise InputError(field, f"must lie in [{low:g}, {high:g}]{unit} for tolerances by {edition.name}",
                                 f"{checked[name]:.6g}{unit}",
                                 "The standard does not allow extrapolation; give measured deviations.")
        step, values = 2 ** ((grade - 5) / 2), zip(fields(Tolerances), edition.at_grade_5(size), strict=True)
        found.append(edition.result(**{f.name: rounded(step * value) / 1e6 for f, value in values}))
    return found[0], found[1]


def rounded(micrometres: float) -> float:
    """A tolerance in µm, rounded by ISO 1328-1:1995, 5.3, or ISO 1328-1:2013, 5.2.3, which are equal."""
    step = 1.0 if micrometres >= 10 else 0.5 if micrometres >= 5 else 0.1
    return round(math.floor(micrometres / step + 0.5) * step, 1)
