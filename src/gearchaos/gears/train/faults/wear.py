"""Wear of the driving flank, by its depth along the line of action."""

from gearchaos.gears.io.fields import one
from gearchaos.gears.io.units import LENGTH
from gearchaos.gears.train.faults.base import FaultKind
from gearchaos.quantities import NOT_NEGATIVE

FAULT = FaultKind(name="wear", read=one(LENGTH, NOT_NEGATIVE), back=lambda value: value)
