"""Kinds of mesh stiffness, one file each; `Stiffness` says how to add one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from gearchaos.model.stiffness.base import Stiffness
from gearchaos.model.stiffness.harmonic import HarmonicStiffness
from gearchaos.model.stiffness.stepped import MAX_LEVELS, SteppedStiffness
from gearchaos.model.stiffness.tooth_pairs import ToothPairStiffness
from gearchaos.model.stiffness.two_level import TwoLevelStiffness
from gearchaos.plugins import Register, class_of, modules
from gearchaos.quantities import HARMONICS, ask_if_unknown, declare, find

__all__ = [
    "MAX_LEVELS", "STIFFNESS_FORMS", "STIFFNESS_KINDS", "HarmonicStiffness", "SteppedStiffness", "Stiffness",
    "ToothPairStiffness", "TwoLevelStiffness", "default_stiffness",
]


def _fault(name: str, kind: Any) -> str:
    """What is wrong with a kind of stiffness of another package; empty if nothing is."""
    if wrong := class_of(Stiffness, "kind")(name, kind):
        return wrong
    taken = [q.name for q in kind.rows if find(q.name) not in (None, q)]
    taken += [q.name for q in kind.families if HARMONICS.get(q.name, q) != q]
    return f"it must have parameters of its own, not {', '.join(taken)}" if taken else ""


modules(__name__)  # each defines a kind
STIFFNESS_KINDS: Register[type[Stiffness]] = Register("gearchaos.stiffness", {
    found.kind: found for found in sorted(Stiffness.__subclasses__(), key=lambda kind: kind is not TwoLevelStiffness)
}, _fault, admit=lambda kind: declare(kind.rows, kind.families))
"""The kinds of mesh stiffness by the names that files and pages use; the first is that of the paper."""

STIFFNESS_FORMS: dict[str, type[Stiffness]] = {found.form: found for found in STIFFNESS_KINDS.own.values()}
"""The kinds of mesh stiffness by their names in certificates: those that can be proved."""

for _found in STIFFNESS_KINDS.own.values():
    declare(_found.rows, _found.families)
ask_if_unknown(STIFFNESS_KINDS.take_in_all)


def default_stiffness(names: Iterable[str]) -> Stiffness:
    """The stiffness of a model of which these names will be set.

    It is a Fourier series, or of any later kind, if one of them is a parameter of that and not of the paper's two
    levels.
    """
    own = [name for name in names if not TwoLevelStiffness.accepts(name) and find(name)]  # asks other packages, too
    return next((kind() for kind in STIFFNESS_KINDS.loaded() if any(map(kind.accepts, own))), TwoLevelStiffness())
