"""The dimensionless equations of a gear mesh: parameters, waveforms, batches, coordinates, the switched affine form."""

from gearchaos.model.mesh import (
    COORDINATES,
    KINDS,
    PAIRS,
    SCALARS,
    Batch,
    HarmonicStiffness,
    Kind,
    MeshModel,
    Stiffness,
    TransmissionError,
    TwoLevelStiffness,
    backlash,
    check,
    check_one_description,
    check_state_name,
    default_stiffness,
    expand,
    known_names,
    mesh_stiffness,
    state_names,
    transmission_error,
    vary,
)

__all__ = [
    "COORDINATES", "KINDS", "PAIRS", "SCALARS", "Batch", "HarmonicStiffness", "Kind", "MeshModel", "Stiffness",
    "TransmissionError", "TwoLevelStiffness", "backlash", "check", "check_one_description", "check_state_name",
    "default_stiffness", "expand", "known_names", "mesh_stiffness", "state_names", "transmission_error", "vary",
]
