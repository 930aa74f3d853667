"""All kinds of studies by name, for study files, stores and the command line."""

from __future__ import annotations

from gearchaos.errors import unknown_name
from gearchaos.studies.attractors import Attractors
from gearchaos.studies.basins import Basins
from gearchaos.studies.bifurcation import Bifurcation
from gearchaos.studies.regime import Regime
from gearchaos.studies.simulate import Simulate
from gearchaos.studies.study import Study
from gearchaos.studies.zones import Zones

STUDIES: dict[str, type[Study]] = {
    study.kind: study for study in (Simulate, Regime, Attractors, Bifurcation, Zones, Basins)
}


def study_class(kind: str) -> type[Study]:
    """The class of a kind of study; raises `InputError` for an unknown one."""
    if kind not in STUDIES:
        raise unknown_name("study.kind", kind, STUDIES)
    return STUDIES[kind]
