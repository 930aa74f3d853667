"""Parsing of names into prefix, family, order and derivative."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache

PREFIXES = (
    "attractor_section_", "attractor_start_", "attractor_", "event_section_", "event_", "jump_", "section_", "start_",
    "special_", "curve_", "manifold_", "saddle_section_", "saddle_", "cell_", "neighbour_", "orbit_",
)
"""Prefixes of variables of a result: ``attractor_`` one value per attractor, ``event_`` and ``jump_`` one per event and
jump, ``section_`` values at the stroboscopic section, ``start_`` initial values, ``special_`` one value per point of
codimension 2, ``curve_``, ``manifold_``, ``saddle_`` and ``orbit_`` one per curve, branch of a manifold, saddle and
period of orbits, ``cell_`` and ``neighbour_`` those of the two cells at a side."""

_PARTS = re.compile(r"([A-Za-z_]+?)(0|[1-9][0-9]{0,17})?(_dot)?")


@dataclass(frozen=True)
class Name:
    """The parts of a name: those of ``section_x1_dot`` are prefix "section_", family "x", order 1 and derivative 1.

    Attributes
    ----------
    family : str
        The name without prefix, order and derivative.
    order : int or None
        The number in the name: the harmonic order in ``eps3``, the wheel in ``J1`` and ``x1``, 0 in the parameter pairs
        ``q0`` and ``chi0``; None without a number.
    derivative : int
        1 where the name ends in ``_dot``, for the derivative with respect to τ; else 0.
    prefix : str
        One of `PREFIXES`, or empty.
    """

    family: str
    order: int | None = None
    derivative: int = 0
    prefix: str = ""

    @property
    def base(self) -> str:
        """The name without its prefix."""
        return f"{self.family}{'' if self.order is None else self.order}{'_dot' * self.derivative}"

    def __str__(self) -> str:
        return self.prefix + self.base


@lru_cache(maxsize=4096)
def parse(name: str) -> Name:
    """The parts of a name. Of a text that does not match the pattern of names, all but the prefix is the family."""
    prefix = next((p for p in PREFIXES if name.startswith(p)), "")
    parts = _PARTS.fullmatch(name, len(prefix))
    if parts is None:
        return Name(name[len(prefix):], prefix=prefix)
    return Name(parts[1], None if parts[2] is None else int(parts[2]), int(parts[3] is not None), prefix)
