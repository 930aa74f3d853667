"""What a damping law of the mesh says of itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


def unchanged(omega: Any) -> float:
    """The coefficient 1 of ζ."""
    return 1.0


@dataclass(frozen=True)
class DampingLaw:
    """Where the mesh damping 2ζz' acts. Whatever depends on it asks its law; `gearchaos.flow` knows it by its name.

    The kernels know three laws. One of another package ``acts_as`` one of these, whose `in_contact` and `releases` it
    has, with a ζ that is ``coefficient`` times as large: a function of ω, which may be an array, as 1/ω for hysteretic
    damping. Its ``script`` has the coefficient in it.
    """

    name: str  # in files, on pages and in ``damping_law``
    words: str  # where it acts, after "damping"
    in_contact: bool  # whether it acts in contact alone: it is no part of A then, and contact adds to the trace
    releases: bool  # whether contact ends where the force does: it never pulls, and grazes are border collisions
    comment: str  # the mesh force in words, for files of results
    script: str  # the mesh force in Python, from z', the spring force, and the side of the contact, 0 for none
    acts_as: str = ""  # the name of the law that the kernels know; empty for one of these
    coefficient: Callable[[Any], Any] = unchanged
