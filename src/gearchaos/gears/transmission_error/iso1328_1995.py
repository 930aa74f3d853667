"""Flank tolerances by ISO 1328-1:1995, grades 0 to 12.

The formulae are given the geometric mean of the range in which a diameter, module or face width lies, so that the
tolerances are steps. ISO 6336-1:2006 and the examples of ISO/TR 6336-30:2017 refer to this edition.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass

from gearchaos.gears.io.fields import described
from gearchaos.gears.transmission_error import Edition, Size, Tolerances

ISO_1995 = "ISO 1328-1:1995"


@dataclass(frozen=True, kw_only=True)
class Tolerances1995(Tolerances):
    """`Tolerances` with the formulae of ISO 1328-1:1995; d, m and b are geometric means of ranges, in mm."""

    single_pitch: float = described("f_pt", "(0.3 m + 0.12 √d + 4) 2^((Q−5)/2)", f"{ISO_1995}, 6.1", "µm", 1e6)
    cumulative_pitch: float = described("F_p", "(0.3 m + 1.25 √d + 7) 2^((Q−5)/2)", f"{ISO_1995}, 6.3", "µm", 1e6)
    profile: float = described("F_α", "(3.2 √m + 0.22 √d + 0.7) 2^((Q−5)/2)", f"{ISO_1995}, 6.4", "µm", 1e6)
    profile_form: float = described("f_fα", "(2.5 √m + 0.17 √d + 0.5) 2^((Q−5)/2)", f"{ISO_1995}, B.2.1", "µm", 1e6)
    profile_slope: float = described("f_Hα", "(2 √m + 0.14 √d + 0.5) 2^((Q−5)/2)", f"{ISO_1995}, B.2.2", "µm", 1e6)
    helix: float = described("F_β", "(0.1 √d + 0.63 √b + 4.2) 2^((Q−5)/2)", f"{ISO_1995}, 6.5", "µm", 1e6)
    runout: float = described("F_r", "(0.24 m + √d + 5.6) 2^((Q−5)/2)", "ISO 1328-2:1997, B", "µm", 1e6)


_DIAMETERS = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000)
_MODULES = (0.5, 2, 3.5, 6, 10, 16, 25, 40, 70)
# limits of the ranges of ISO 1328-1:1995, mm; each range includes its upper limit, the first one also its lower
_FACE_WIDTHS = (4, 10, 20, 40, 80, 160, 250, 400, 650, 1000)


def _at_grade_5(size: Size) -> tuple[float, ...]:
    """The tolerances of grade 5 in µm before rounding, in the order of the fields of `Tolerances`."""
    ranges = ((edges, max(bisect_left(edges, value), 1))
              for value, edges in zip(size, (_DIAMETERS, _MODULES, _FACE_WIDTHS), strict=True))
    d, m, b = (math.sqrt(edges[upper - 1] * edges[upper]) for edges, upper in ranges)
    root_d, root_m = math.sqrt(d), math.sqrt(m)
    return (0.3 * (m + 0.4 * root_d) + 4, 0.3 * m + 1.25 * root_d + 7, 3.2 * root_m + 0.22 * root_d + 0.7,
            2.5 * root_m + 0.17 * root_d + 0.5, 2.0 * root_m + 0.14 * root_d + 0.5,
            0.1 * root_d + 0.63 * math.sqrt(b) + 4.2, 0.24 * m + root_d + 5.6)


EDITION = Edition(
    name=ISO_1995, grades=(0, 12), result=Tolerances1995, at_grade_5=_at_grade_5,
    scope={"reference_diameter": (5, 10000), "module": (0.5, 70), "face_width": (4, 1000)},
    adopted={"JIS B 1702-1:1998": "N"},
    near=(
        (r"DIN ?396[1-3]", lambda n: n, "DIN 3962:1978 has tables of its own, with other ranges of sizes"),
        (r"AGMA (2000|390)", lambda n: 17 - n, "a grade is about 17 less the quality number (AGMA 2001-D04, annex A), "
         "whose tolerances are others, of the helix above all (E. Lawson, Gear Technology, March 2004)"),
        (r"AGMA 2015", lambda n: n, "its grades have the same numbers and nearly the same tolerances, which are based "
         "on ISO 1328 (E. Lawson, Gear Technology, March 2004) but not identical"),
        (r"JIS B ?1702(?!-)", lambda n: n + 4, "a grade is about the old one plus 4 (Kyouiku Gear, catalogue of stock "
         "gears, 5.7), which has other ranges of sizes")))
