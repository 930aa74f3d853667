"""Flank tolerances by ISO 1328-1:2013, classes 1 to 11, whose formulae are given the sizes themselves."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearchaos.gears.io.fields import described
from gearchaos.gears.transmission_error import Edition, Size, Tolerances

ISO_2013 = "ISO 1328-1:2013"


@dataclass(frozen=True, kw_only=True)
class Tolerances2013(Tolerances):
    """`Tolerances` with the formulae of ISO 1328-1:2013; d, m_n and b in mm."""

    single_pitch: float = described("f_pT", "(0.001 d + 0.4 m_n + 5) √2^(A−5)", f"{ISO_2013}, (5)", "µm", 1e6)
    cumulative_pitch: float = described(
        "F_pT", "(0.002 d + 0.55 √d + 0.7 m_n + 12) √2^(A−5)", f"{ISO_2013}, (6)", "µm", 1e6)
    profile: float = described("F_αT", "√(f_HαT² + f_fαT²)", f"{ISO_2013}, (9)", "µm", 1e6)
    profile_form: float = described("f_fαT", "(0.55 m_n + 5) √2^(A−5)", f"{ISO_2013}, (8)", "µm", 1e6)
    profile_slope: float = described("f_HαT", "(0.4 m_n + 0.001 d + 4) √2^(A−5)", f"{ISO_2013}, (7)", "µm", 1e6)
    helix: float = described("F_βT", "√(f_HβT² + f_fβT²)", f"{ISO_2013}, (12)", "µm", 1e6)
    runout: float = described(
        "F_rT", "0.9 (0.002 d + 0.55 √d + 0.7 m_n + 12) √2^(A−5)", f"{ISO_2013}, annex E", "µm", 1e6)


def _at_class_5(size: Size) -> tuple[float, ...]:
    """The tolerances of class 5 in µm before rounding, in the order of the fields of `Tolerances`."""
    d, m, b = size
    root_d, root_b = math.sqrt(d), math.sqrt(b)
    slope, form = 0.4 * m + 0.001 * d + 4, 0.55 * m + 5
    cumulative = 0.002 * d + 0.55 * root_d + 0.7 * m + 12
    helix = math.hypot(0.05 * root_d + 0.35 * root_b + 4, 0.07 * root_d + 0.45 * root_b + 4)
    return 0.001 * d + 0.4 * m + 5, cumulative, math.hypot(slope, form), form, slope, helix, 0.9 * cumulative


EDITION = Edition(
    name=ISO_2013, grades=(1, 11), result=Tolerances2013, at_grade_5=_at_class_5,
    scope={"reference_diameter": (5, 15000), "module": (0.5, 70), "face_width": (4, 1200), "teeth": (5, 1000),
           "helix_angle": (0, 45)}, adopted={"ANSI/AGMA ISO 1328-1-B14": "A"},
    near=((r"JIS B ?1702-1:20", lambda n: n, "it follows this edition, but could not be compared with it"),))
