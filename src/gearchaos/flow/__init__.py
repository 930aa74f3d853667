"""The exact flow: affine steps between contact switches, located switches, tangent vectors and measures."""

from gearchaos.flow.batch import ExactFlow, Flowed
from gearchaos.flow.layout import CHATTER, DIVERGED, OK
from gearchaos.flow.returns import near_returns

__all__ = ["CHATTER", "DIVERGED", "OK", "ExactFlow", "Flowed", "near_returns"]
