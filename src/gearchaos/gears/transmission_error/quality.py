"""Flank tolerances of cylindrical gears from their accuracy grade: ISO 1328-1:1995 and ISO 1328-1:2013.

The two editions have different formulae, and the number of a grade does not mean the same in both. The edition of 1995
(grades 0 to 12) inserts the geometric mean of the range in which a diameter, module or face width lies, so its
tolerances are steps. The edition of 2013 (flank tolerance classes 1 to 11) inserts the values themselves.

National standards that are the text of one of these editions are read as it. Grades of others are refused, with the
nearest grade of ISO 1328-1, since their tolerances are not the same.

ISO 6336-1:2006 and the examples of ISO/TR 6336-30:2017 refer to the edition of 1995.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, NamedTuple

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.formulas import Formula

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry

ISO_1995, ISO_2013 = "ISO 1328-1:1995", "ISO 1328-1:2013"

GRADES = {ISO_1995: (0, 12), ISO_2013: (1, 11)}
"""Lowest and highest grade of each edition."""

ADOPTIONS = {"JIS B 1702-1:1998": (ISO_1995, "N"), "ANSI/AGMA ISO 1328-1-B14": (ISO_2013, "A")}
"""National standards that are the text of an edition, and the letter that they write before a grade."""

_OTHERS: tuple[tuple[str, str, Callable[[int], int], str], ...] = (
    (r"DIN ?396[1-3]", ISO_1995, lambda n: n, "DIN 3962:1978 has tables of its own, with other ranges of sizes"),
    (r"AGMA (2000|390)", ISO_1995, lambda n: 17 - n, "a grade is about 17 less the quality number (AGMA 2001-D04, "
     "annex A), whose tolerances are others, of the helix above all (E. Lawson, Gear Technology, March 2004)"),
    (r"AGMA 2015", ISO_1995, lambda n: n, "its grades have the same numbers and nearly the same tolerances, which are "
     "based on ISO 1328 (E. Lawson, Gear Technology, March 2004) but not identical"),
    (r"JIS B ?1702-1:20", ISO_2013, lambda n: n, "it follows this edition, but could not be compared with it"),
    (r"JIS B ?1702(?!-)", ISO_1995, lambda n: n + 4, "a grade is about the old one plus 4 (Kyouiku Gear, catalogue of "
     "stock gears, 5.7), which has other ranges of sizes"),
)
"""Other standards: a pattern of the name, the edition and the grade that are nearest, and why they are not the same."""


@dataclass(frozen=True)
class Quality:
    """Accuracy grade of the teeth.

    Attributes
    ----------
    standard : str
        "ISO 1328-1:1995" or "ISO 1328-1:2013"; one of `ADOPTIONS` is kept as its edition.
    grade : int or tuple of int
        Of both wheels, or of each: 0 to 12 in the edition of 1995, 1 to 11 in that of 2013. The deviations grow with
        the number, by √2 from grade to grade. Adoptions may have their letter before it, e.g. "N8".

    Raises
    ------
    InputError
        For an unknown standard, with the nearest grade of an edition if there is one, or a grade that is no whole
        number or outside the range of the edition.
    """

    standard: str
    grade: int | tuple[int, int]

    def __post_init__(self) -> None:
        if isinstance(self.grade, list):
            object.__setattr__(self, "grade", tuple(self.grade))
        if isinstance(self.grade, tuple) and len(self.grade) != 2:
            raise InputError("quality.grade", "must be one grade or a list of two", self.grade)
        if self.standard in ADOPTIONS:
            edition, letter = ADOPTIONS[self.standard]
            grades = tuple(_number(grade, letter) for grade in self.grades)
            object.__setattr__(self, "grade", grades if isinstance(self.grade, tuple) else grades[0])
            object.__setattr__(self, "standard", edition)
        if self.standard not in GRADES:
            raise self._unknown_standard()
        low, high = GRADES[self.standard]
        for grade in self.grades:
            if isinstance(grade, bool) or not isinstance(grade, int) or not low <= grade <= high:
                rule = f"must be a whole number from {low} to {high} in {self.standard}"
                raise InputError("quality.grade", rule, self.grade, "The deviations grow with the number.")

    def _unknown_standard(self) -> InputError:
        """The error for another standard, with the grade of ISO 1328-1 that is nearest if that is known."""
        error = unknown_name("quality.standard", str(self.standard), (*GRADES, *ADOPTIONS))
        for pattern, edition, nearest, why in _OTHERS:
            if re.search(pattern, str(self.standard)):
                grades = [_number(grade, "[A-Z]?") for grade in self.grades]
                low, high = GRADES[edition]
                found = [nearest(n) if isinstance(n, int) else None for n in dict.fromkeys(grades)]
                if not all(n is None or low <= n <= high for n in found):
                    return InputError(error.field, error.rule, self.standard,
                                      f"{edition} has no grade near it, only {low} to {high}: {why}.")
                near = ", ".join("…" if n is None else str(n) for n in found)
                shown = f"[{near}]" if "," in near else near
                return InputError(error.field, error.rule, self.standard,
                                  f"The nearest is {{ standard = '{edition}', grade = {shown} }}, not the same: {why}.")
        return error

    @property
    def grades(self) -> tuple[int, int]:
        """The grade of each wheel."""
        return self.grade if isinstance(self.grade, tuple) else (self.grade, self.grade)

    @property
    def coarsest(self) -> int:
        """The grade of the less accurate wheel."""
        return max(self.grades)


def _number(grade: Any, letter: str) -> Any:
    """The number of a grade that is a text such as "N8"; anything else as it is."""
    match = re.fullmatch(rf"(?:{letter})?(\d+)", grade) if isinstance(grade, str) else None
    return int(match[1]) if match else grade


@dataclass(frozen=True, kw_only=True)
class Tolerances:
    """Flank tolerances of one wheel, m.

    Attributes
    ----------
    single_pitch : float
        f_pt, single pitch deviation.
    cumulative_pitch : float
        F_p, total cumulative pitch deviation.
    profile : float
        F_α, total profile deviation.
    profile_form, profile_slope : float
        f_fα and f_Hα.
    helix : float
        F_β, total helix deviation.
    runout : float
        F_r.
    """

    single_pitch: float
    cumulative_pitch: float
    profile: float
    profile_form: float
    profile_slope: float
    helix: float
    runout: float


class _Size(NamedTuple):
    """What the tolerances of a wheel depend on, mm."""

    d: float
    m: float
    b: float


def _tolerance(symbol: str, text: str, source: str, of_grade_5: Callable[[_Size], float]) -> Any:
    """A field of `Tolerances`, with its `Formula` and its value for grade 5 in µm before rounding."""
    return field(metadata={"formula": Formula(symbol, "µm", 1e6, text, source), "value": of_grade_5})


@dataclass(frozen=True, kw_only=True)
class Tolerances1995(Tolerances):
    """`Tolerances` with the formulae of ISO 1328-1:1995; d, m and b are geometric means of ranges, in mm."""

    single_pitch: float = _tolerance("f_pt", "(0.3 m + 0.12 √d + 4) 2^((Q−5)/2)", f"{ISO_1995}, 6.1",
                                     lambda s: 0.3 * (s.m + 0.4 * math.sqrt(s.d)) + 4)
    cumulative_pitch: float = _tolerance("F_p", "(0.3 m + 1.25 √d + 7) 2^((Q−5)/2)", f"{ISO_1995}, 6.3",
                                         lambda s: 0.3 * s.m + 1.25 * math.sqrt(s.d) + 7)
    profile: float = _tolerance("F_α", "(3.2 √m + 0.22 √d + 0.7) 2^((Q−5)/2)", f"{ISO_1995}, 6.4",
                                lambda s: 3.2 * math.sqrt(s.m) + 0.22 * math.sqrt(s.d) + 0.7)
    profile_form: float = _tolerance("f_fα", "(2.5 √m + 0.17 √d + 0.5) 2^((Q−5)/2)", f"{ISO_1995}, B.2.1",
                                     lambda s: 2.5 * math.sqrt(s.m) + 0.17 * math.sqrt(s.d) + 0.5)
    profile_slope: float = _tolerance("f_Hα", "(2 √m + 0.14 √d + 0.5) 2^((Q−5)/2)", f"{ISO_1995}, B.2.2",
                                      lambda s: 2.0 * math.sqrt(s.m) + 0.14 * math.sqrt(s.d) + 0.5)
    helix: float = _tolerance("F_β", "(0.1 √d + 0.63 √b + 4.2) 2^((Q−5)/2)", f"{ISO_1995}, 6.5",
                              lambda s: 0.1 * math.sqrt(s.d) + 0.63 * math.sqrt(s.b) + 4.2)
    runout: float = _tolerance("F_r", "(0.24 m + √d + 5.6) 2^((Q−5)/2)", "ISO 1328-2:1997, B",
                               lambda s: 0.24 * s.m + math.sqrt(s.d) + 5.6)


def _cumulative_2013(s: _Size) -> float:
    """F_pT of class 5, µm."""
    return 0.002 * s.d + 0.55 * math.sqrt(s.d) + 0.7 * s.m + 12


def _form_2013(s: _Size) -> float:
    """f_fαT of class 5, µm."""
    return 0.55 * s.m + 5


def _slope_2013(s: _Size) -> float:
    """f_HαT of class 5, µm."""
    return 0.4 * s.m + 0.001 * s.d + 4


@dataclass(frozen=True, kw_only=True)
class Tolerances2013(Tolerances):
    """`Tolerances` with the formulae of ISO 1328-1:2013; d, m_n and b in mm."""

    single_pitch: float = _tolerance("f_pT", "(0.001 d + 0.4 m_n + 5) √2^(A−5)", f"{ISO_2013}, (5)",
                                     lambda s: 0.001 * s.d + 0.4 * s.m + 5)
    cumulative_pitch: float = _tolerance("F_pT", "(0.002 d + 0.55 √d + 0.7 m_n + 12) √2^(A−5)", f"{ISO_2013}, (6)",
                                         _cumulative_2013)
    profile: float = _tolerance("F_αT", "√(f_HαT² + f_fαT²)", f"{ISO_2013}, (9)",
                                lambda s: math.hypot(_slope_2013(s), _form_2013(s)))
    profile_form: float = _tolerance("f_fαT", "(0.55 m_n + 5) √2^(A−5)", f"{ISO_2013}, (8)", _form_2013)
    profile_slope: float = _tolerance("f_HαT", "(0.4 m_n + 0.001 d + 4) √2^(A−5)", f"{ISO_2013}, (7)", _slope_2013)
    helix: float = _tolerance("F_βT", "√(f_HβT² + f_fβT²)", f"{ISO_2013}, (12)", lambda s: math.hypot(
        0.05 * math.sqrt(s.d) + 0.35 * math.sqrt(s.b) + 4, 0.07 * math.sqrt(s.d) + 0.45 * math.sqrt(s.b) + 4))
    runout: float = _tolerance("F_rT", "0.9 (0.002 d + 0.55 √d + 0.7 m_n + 12) √2^(A−5)", f"{ISO_2013}, annex E",
                               lambda s: 0.9 * _cumulative_2013(s))


_DIAMETERS = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000)
_MODULES = (0.5, 2, 3.5, 6, 10, 16, 25, 40, 70)
_FACE_WIDTHS = (4, 10, 20, 40, 80, 160, 250, 400, 650, 1000)
"""Limits of the ranges of ISO 1328-1:1995, mm; each range includes its upper limit, the first one also its lower."""

_SCOPE: dict[str, dict[str, tuple[float, float]]] = {
    ISO_1995: {"reference_diameter": (5, 10000), "module": (0.5, 70), "face_width": (4, 1000)},
    ISO_2013: {"reference_diameter": (5, 15000), "module": (0.5, 70), "face_width": (4, 1200), "teeth": (5, 1000),
               "helix_angle": (0, 45)},
}
"""The ranges to which each edition applies; lengths in mm, the helix angle in degrees."""


def tolerances(quality: Quality, geometry: Geometry) -> tuple[Tolerances, Tolerances]:
    """The flank tolerances of both wheels.

    Parameters
    ----------
    quality : Quality
        Standard and grade.
    geometry : Geometry
        Gives the reference diameters d, the normal module m_n and the face widths b.

    Returns
    -------
    tuple of Tolerances
        Of wheel 1 and wheel 2, rounded as the standard says: to 1 µm from 10 µm on, to 0.5 µm from 5 µm on, and to 0.1
        µm below.

    Raises
    ------
    InputError
        If a size of the pair is outside the scope of the standard.

    Notes
    -----
    The standard forbids extrapolation beyond its scope. F_α, F_β and F_r of the edition of 2013 are computed from
    values before rounding. All formulae were compared with a public code, the scope of 2013 with the published
    abstract, but those of the runout (ISO 1328-2:1997, annex B, and ISO 1328-1:2013, annex E), which could be
    compared with one source only.
    """
    first, second = (_wheel_tolerances(quality, geometry, wheel) for wheel in (0, 1))
    return first, second


def _wheel_tolerances(quality: Quality, geometry: Geometry, wheel: int) -> Tolerances:
    """The flank tolerances of one wheel."""
    _check_scope(quality.standard, geometry, wheel)
    size = _Size(*(1e3 * v for v in (
        geometry.reference_diameter[wheel], geometry.normal_module, geometry.face_width[wheel])))
    if quality.standard == ISO_1995:
        size = _Size(*(_mean(v, edges) for v, edges in zip(size, (_DIAMETERS, _MODULES, _FACE_WIDTHS), strict=True)))
    step = 2 ** ((quality.grades[wheel] - 5) / 2)
    edition = Tolerances1995 if quality.standard == ISO_1995 else Tolerances2013
    return edition(**{f.name: rounded(step * f.metadata["value"](size)) / 1e6 for f in fields(edition)})


def _mean(value: float, edges: tuple[float, ...]) -> float:
    """The geometric mean of the limits of the range in which a value lies."""
    upper = max(bisect_left(edges, value), 1)
    return math.sqrt(edges[upper - 1] * edges[upper])


def rounded(micrometres: float) -> float:
    """A tolerance in µm, rounded by ISO 1328-1:1995, 5.3, or ISO 1328-1:2013, 5.2.3, which are equal."""
    step = 1.0 if micrometres >= 10 else 0.5 if micrometres >= 5 else 0.1
    return round(math.floor(micrometres / step + 0.5) * step, 1)


def _check_scope(standard: str, geometry: Geometry, wheel: int) -> None:
    """Raise `InputError` if a wheel is outside the scope of a standard."""
    sizes = {
        "reference_diameter": 1e3 * geometry.reference_diameter[wheel],
        "module": 1e3 * geometry.normal_module,
        "face_width": 1e3 * geometry.face_width[wheel],
        "teeth": geometry.teeth[wheel],
        "helix_angle": math.degrees(geometry.helix_angle),
    }
    for name, (low, high) in _SCOPE[standard].items():
        unit = {"teeth": "", "helix_angle": " deg"}.get(name, " mm")
        if not low <= round(sizes[name], 9) <= high:
            field = name if name in ("module", "helix_angle") else f"{name}[{wheel}]"
            raise InputError(
                field, f"must lie in [{low:g}, {high:g}]{unit} for tolerances by {standard}",
                f"{sizes[name]:.6g}{unit}", "The standard does not allow extrapolation; give measured deviations.",
            )
