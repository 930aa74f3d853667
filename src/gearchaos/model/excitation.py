"""Transmission error and mesh stiffness at given times, and the backlash function."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.model.parameters import MeshModel
from gearchaos.model.waveforms import SteppedStiffness, TwoLevelStiffness


def backlash(z: Any) -> Any:
    """The backlash function f(z) = z − clip(z, −1, 1), (2.6) and (2.13) corrected; z of any shape."""
    return z - np.clip(z, -1.0, 1.0)


def transmission_error(model: MeshModel, tau: Any, derivative: int = 0) -> np.ndarray:
    """ε(τ) of (2.15), or its derivative of order ``derivative`` with respect to τ; the shape of ``tau``."""
    tau = np.asarray(tau, dtype=float)
    total = np.zeros_like(tau)
    for j, (a, p) in enumerate(zip(model.error.amplitudes, model.error.phases, strict=True), start=1):
        total += a * (j * model.omega) ** derivative * np.cos(j * model.omega * tau - p + derivative * np.pi / 2)
    return total


def mesh_stiffness(model: MeshModel, tau: Any) -> np.ndarray:
    """χ(τ), (2.16), (2.7) or stepped: the mesh stiffness over the reference stiffness c0; the shape of ``tau``."""
    tau = np.asarray(tau, dtype=float)
    s = model.stiffness
    if isinstance(s, TwoLevelStiffness):
        return np.where(np.mod(tau / model.period, 1.0) < s.contact_ratio - 1, 1 + s.chi1, 1 - s.chi2)
    if isinstance(s, SteppedStiffness):
        last_begun = np.searchsorted(s.starts, np.mod(tau / model.period, 1.0), side="right") - 1
        return np.array(s.levels)[last_begun]  # before the first start it is -1, the last level
    chi = np.ones_like(tau)
    for j, (a, p) in enumerate(zip(s.amplitudes, s.phases, strict=True), start=1):
        chi += a * np.cos(j * model.omega * tau - p)
    return chi
