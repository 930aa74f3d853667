"""Studies: models and axes in, labelled Datasets out. Each is in a file of its own; `gearchaos` has their functions."""

from gearchaos.datasets import load, motions, save
from gearchaos.studies.axis import Axis
from gearchaos.studies.regime import Verdict, steady

__all__ = ["Axis", "Verdict", "load", "motions", "save", "steady"]
