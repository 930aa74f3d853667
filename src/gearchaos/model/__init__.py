"""The dimensionless equations of a gear mesh: parameters, waveforms, batches, coordinates, the switched affine form."""

from gearchaos.model.batch import Batch, vary
from gearchaos.model.excitation import backlash, mesh_stiffness, transmission_error
from gearchaos.model.names import (
    COORDINATES,
    KINDS,
    SCALARS,
    Kind,
    check_initial_consistent,
    check_state_name,
    default_stiffness,
    expand_pairs,
    known_names,
    state_names,
)
from gearchaos.model.parameters import MeshModel
from gearchaos.model.waveforms import (
    STIFFNESS_KINDS,
    HarmonicStiffness,
    SteppedStiffness,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
    stiffness_kind,
)
from gearchaos.quantities import PARAMETER_PAIRS
from gearchaos.validation import check

__all__ = [
    "COORDINATES", "KINDS", "PARAMETER_PAIRS", "SCALARS", "STIFFNESS_KINDS", "Batch", "HarmonicStiffness", "Kind",
    "MeshModel", "SteppedStiffness", "Stiffness", "TransmissionError", "TwoLevelStiffness", "backlash", "check",
    "check_initial_consistent", "check_state_name", "default_stiffness", "expand_pairs", "known_names",
    "mesh_stiffness", "state_names", "stiffness_kind", "transmission_error", "vary",
]
