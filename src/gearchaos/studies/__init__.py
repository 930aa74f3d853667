"""Studies: models and axes in, labelled Datasets out."""

from gearchaos.datasets import load, motions, save
from gearchaos.studies.attractors import attractors
from gearchaos.studies.axis import Axis
from gearchaos.studies.basins import basins
from gearchaos.studies.bifurcation import bifurcation
from gearchaos.studies.regime import regime
from gearchaos.studies.simulate import simulate
from gearchaos.studies.steady import steady
from gearchaos.studies.verdict import Verdict
from gearchaos.studies.zones import zones

__all__ = [
    "Axis", "Verdict", "attractors", "basins", "bifurcation", "load", "motions", "regime", "save", "simulate", "steady",
    "zones",
]
