"""Studies: models and axes in, labelled Datasets out. `gearchaos` has their functions.

Each is in a file of its own, in the room of its question. A room knows only those below it in pyproject.toml.
"""

from gearchaos.datasets import motions
from gearchaos.formats import load, save
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.motion.regime import Verdict, steady

__all__ = ["Axis", "Verdict", "load", "motions", "save", "steady"]
