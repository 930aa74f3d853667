"""A loss of stiffness of known size in the pairs in which the tooth meshes, 1 for a missing tooth."""

from gearchaos.gears.io.fields import number
from gearchaos.gears.train.faults.base import FaultKind
from gearchaos.quantities import Rule

SHARE = Rule(lambda v: (v >= 0) & (v <= 1), "must lie in [0, 1]", "It is a share; 1 is a missing tooth.")
FAULT = FaultKind(name="stiffness_loss", read=number(SHARE), stiffness_share=lambda value: 1 - value)
