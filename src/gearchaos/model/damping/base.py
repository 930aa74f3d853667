"""What a damping law of the mesh says of itself."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DampingLaw:
    """Where the mesh damping 2ζz' acts. Whatever depends on it asks its law; `gearchaos.flow` knows it by its name."""

    name: str  # in files, on pages and in ``damping_law``
    words: str  # where it acts, after "damping"
    in_contact: bool  # whether it acts in contact alone: it is no part of A then, and contact adds to the trace
    releases: bool  # whether contact ends where the force does: it never pulls, and grazes are border collisions
    comment: str  # the mesh force in words, for files of results
    script: str  # the mesh force in Python, from z', the spring force, and the side of the contact, 0 for none
