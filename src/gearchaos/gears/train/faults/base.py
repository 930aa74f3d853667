"""What a kind of tooth fault says of itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gearchaos.gears.io.fields import Convert


@dataclass(frozen=True)
class FaultKind:
    """A way in which a tooth differs from the others, by one number, a field of `Fault`: 0 where it does not.

    **To add a kind,** write it as ``FAULT`` in a file of its own in this folder. Another package offers one in the
    group ``gearchaos.faults``: the name of the entry point is its key in ``others``.
    """

    read: Convert  # how its number is read
    stiffness_share: Callable[[float], float] = lambda value: 1.0  # left of pairs in which the tooth meshes
    back: Callable[[float], float] = lambda value: 0.0  # by how much its driving flank stands back, m
    gives: str = ""  # the field that follows from it and the drawing of the gears, if it is nothing by itself
    given: Callable[[Any, int, float], float] = lambda pairs, wheel, value: 0.0  # its value, by tooth pairs as drawn
    advice: str = ""  # what to do without a drawing
    name: str = ""  # the field of `Fault`; of another package the entry point says it
