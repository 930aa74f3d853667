"""Kinds of mesh stiffness, one file each; `Stiffness` says how to add one."""

from __future__ import annotations

from collections.abc import Iterable

from gearchaos.model.stiffness.base import Stiffness
from gearchaos.model.stiffness.harmonic import HarmonicStiffness
from gearchaos.model.stiffness.stepped import MAX_LEVELS, SteppedStiffness
from gearchaos.model.stiffness.tooth_pairs import ToothPairStiffness
from gearchaos.model.stiffness.two_level import TwoLevelStiffness
from gearchaos.quantities import declare

__all__ = [
    "MAX_LEVELS", "STIFFNESS_FORMS", "STIFFNESS_KINDS", "HarmonicStiffness", "SteppedStiffness", "Stiffness",
    "ToothPairStiffness", "TwoLevelStiffness", "default_stiffness",
]

STIFFNESS_KINDS: dict[str, type[Stiffness]] = {
    found.kind: found for found in (TwoLevelStiffness, HarmonicStiffness, SteppedStiffness, ToothPairStiffness)
}
"""The kinds of mesh stiffness by the names that files and pages use; the first is that of the paper."""

STIFFNESS_FORMS: dict[str, type[Stiffness]] = {found.form: found for found in STIFFNESS_KINDS.values()}
"""The kinds of mesh stiffness by their names in certificates."""

for _found in STIFFNESS_KINDS.values():
    declare(_found.rows, _found.families)


def default_stiffness(names: Iterable[str]) -> Stiffness:
    """The stiffness of a model of which these names will be set.

    It is a Fourier series, or of any later kind, if one of them is a parameter of that and not of the paper's two
    levels.
    """
    own = [name for name in names if not TwoLevelStiffness.accepts(name)]
    return next((kind() for kind in STIFFNESS_KINDS.values() if any(map(kind.accepts, own))), TwoLevelStiffness())
