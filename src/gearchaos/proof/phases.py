"""The proof of a periodic orbit at the first phase of the section at which no tooth just touches."""

from __future__ import annotations

import numpy as np

from gearchaos.model.parameters import MeshModel
from gearchaos.proof.certificate import Certificate, Unproved
from gearchaos.proof.prove import prove_orbit
from gearchaos.proof.section import at_phase

_OTHER_PHASES = (0.375, 0.15625, 0.71875)
"""Phases of the section that are tried where teeth may just touch at τ = k T."""


def prove_at_some_phase(model: MeshModel, points: np.ndarray, bits: int = 128) -> Certificate | Unproved:
    """Prove a periodic orbit by its states (n, d) at τ = k T, or where these are on a contact boundary at other times.

    See `prove_orbit`.
    """
    result = prove_orbit(model, points, bits)
    for phase in _OTHER_PHASES:
        if not isinstance(result, Unproved) or result.reason != "section on the contact boundary":
            break
        if (shifted := at_phase(model, points, phase)) is not None:
            result = prove_orbit(model, shifted, bits, phase)
    return result
