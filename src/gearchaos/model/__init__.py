"""The dimensionless equations of a gear mesh: parameters, waveforms, batches, coordinates, the switched affine form."""

from gearchaos.model.base import GearModel
from gearchaos.model.damping import DAMPING_LAWS, DEFAULT_LAW, DEFAULT_LAW_OF_GEARS, SHARED_LAWS, Damped, DampingLaw
from gearchaos.model.parameters import (
    COORDINATES,
    KINDS,
    SCALARS,
    SUPPORTS,
    MeshModel,
    backlash,
    check_is_pair,
    check_state_name,
    has_effect,
    mesh_stiffness,
    state_names,
    transmission_error,
)
from gearchaos.model.stiffness import (
    MAX_LEVELS,
    STIFFNESS_FORMS,
    STIFFNESS_KINDS,
    HarmonicStiffness,
    SteppedStiffness,
    Stiffness,
    ToothPairStiffness,
    TwoLevelStiffness,
    default_stiffness,
)
from gearchaos.model.switched import Batch, vary
from gearchaos.model.waveforms import TransmissionError
from gearchaos.quantities import PARAMETER_PAIRS
from gearchaos.validation import check

__all__ = [
    "COORDINATES", "DAMPING_LAWS", "DEFAULT_LAW", "DEFAULT_LAW_OF_GEARS", "KINDS", "MAX_LEVELS", "PARAMETER_PAIRS",
    "SCALARS", "SHARED_LAWS", "STIFFNESS_FORMS", "STIFFNESS_KINDS", "SUPPORTS", "Batch", "Damped", "DampingLaw",
    "GearModel", "HarmonicStiffness", "MeshModel", "SteppedStiffness", "Stiffness", "ToothPairStiffness",
    "TransmissionError", "TwoLevelStiffness", "backlash", "check", "check_is_pair", "check_state_name",
    "default_stiffness", "has_effect", "mesh_stiffness", "state_names", "transmission_error", "vary",
]
