"""The periodic functions of a model: transmission error, (2.15), and mesh stiffness, (2.16) or (2.7)."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float, to_floats

_POSITIVE_STIFFNESS = Rule(
    lambda v: v > 0, "must keep the mesh stiffness above 0 (its least value is given)", "Lower the amplitudes.")


@dataclass(frozen=True)
class TransmissionError:
    """Static transmission error ε(τ) = Σ a_j cos(jωτ − θ_j), (2.15).

    Attributes
    ----------
    amplitudes : tuple of float
        a_j in half backlashes Δ, from harmonic 1 on.
    phases : tuple of float
        θ_j in radians; those left out are 0.
    """

    amplitudes: tuple[float, ...] = (0.0,)
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _set_series(self, "error")


@dataclass(frozen=True)
class TwoLevelStiffness:
    """Mesh stiffness of alternating single and double tooth contact, (2.16), over the reference stiffness c0.

    χ(τ) is 1 + χ1 for the part (α − 1)T of the mesh period, then 1 − χ2. Its time mean is
    1 + (α − 1) χ1 − (2 − α) χ2, which is 1 only where (α − 1) χ1 = (2 − α) χ2.

    Attributes
    ----------
    chi1, chi2 : float
        χ1 > −1 and χ2 < 1.
    contact_ratio : float
        α, from 1 to 2.
    """

    chi1: float = 0.25
    chi2: float = 0.25
    contact_ratio: float = 1.5

    def __post_init__(self) -> None:
        for f in fields(self):
            object.__setattr__(self, f.name, to_float(f.name, getattr(self, f.name)))


@dataclass(frozen=True)
class HarmonicStiffness:
    """Mesh stiffness as a Fourier series, χ(τ) = 1 + Σ c_j cos(jωτ − α_j), (2.7), over its mean c0.

    Attributes
    ----------
    amplitudes : tuple of float
        c_j, from harmonic 1 on; χ must stay positive.
    phases : tuple of float
        α_j in radians; those left out are 0.
    """

    amplitudes: tuple[float, ...] = (0.0,)
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _set_series(self, "stiffness")
        check_stiffness(np.array(self.amplitudes)[:, None], np.array(self.phases)[:, None])


Stiffness = TwoLevelStiffness | HarmonicStiffness


def _set_series(series: Any, kind: str) -> None:
    """Check the amplitudes and phases of a Fourier series that is being created, and set missing phases to 0."""
    amplitudes = to_floats(f"{kind}.amplitudes", series.amplitudes)
    phases = to_floats(f"{kind}.phases", series.phases)
    if len(phases) > len(amplitudes):
        raise InputError(
            f"{kind}.phases", f"must not be longer than amplitudes ({len(amplitudes)})", len(phases),
            "Give one phase per harmonic; missing ones are 0.",
        )
    object.__setattr__(series, "amplitudes", amplitudes)
    object.__setattr__(series, "phases", phases + (0.0,) * (len(amplitudes) - len(phases)))


def check_stiffness(amplitudes: np.ndarray, phases: np.ndarray) -> None:
    """Raise `InputError` unless 1 + Σ c_j cos(jθ − α_j) is positive for all θ.

    Parameters
    ----------
    amplitudes, phases : (harmonics, points)
        c_j and α_j of one series per point.
    """
    if not np.all(np.abs(amplitudes).sum(axis=0) < 1):
        check_rule("stiffness.amplitudes", _lower_bound(amplitudes, phases), _POSITIVE_STIFFNESS)


def _lower_bound(amplitudes: np.ndarray, phases: np.ndarray) -> np.ndarray:
    """A lower bound, (points,), of χ(θ) = 1 + Σ c_j cos(jθ − α_j) over all θ.

    Between samples at a distance h, χ is at most h²/8 max|χ″| below the lower of the two. There are 256 samples per
    harmonic.
    """
    order = np.arange(1, len(amplitudes) + 1)
    theta = np.linspace(0, 2 * np.pi, 256 * len(amplitudes), endpoint=False)
    lowest = np.full(amplitudes.shape[1], np.inf)
    for t in theta:
        lowest = np.minimum(lowest, 1 + (amplitudes * np.cos(order[:, None] * t - phases)).sum(axis=0))
    curvature = (np.abs(amplitudes) * order[:, None] ** 2).sum(axis=0)
    return lowest - curvature * (theta[1] - theta[0]) ** 2 / 8
