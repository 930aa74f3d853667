"""A crack from the root circle into the tooth, by its depth: the potential energy of the tooth gives the loss."""

from gearchaos.gears.io.fields import one
from gearchaos.gears.io.units import LENGTH
from gearchaos.gears.train.faults.base import FaultKind
from gearchaos.quantities import NOT_NEGATIVE

FAULT = FaultKind(
    name="crack_depth", read=one(LENGTH, NOT_NEGATIVE), gives="stiffness_loss",
    given=lambda pairs, wheel, depth: pairs.lost_by_crack(wheel, depth),
    advice="The loss follows from the shape of the tooth. Or give stiffness_loss.")
