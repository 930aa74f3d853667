"""The periodic functions of a model: transmission error, (2.15), and mesh stiffness: (2.16), (2.7), or steps."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float, to_floats

_POSITIVE_STIFFNESS = Rule(
    lambda v: v > 0, "must keep the mesh stiffness above 0 (its least value is given)", "Lower the amplitudes.")
_POSITIVE_LEVEL = Rule(lambda v: v > 0, "must be greater than 0", "A level is the mesh stiffness over c0.")
_IN_PERIOD = Rule(
    lambda v: (v >= 0) & (v < 1), "must lie in [0, 1)", "A start is a fraction of the mesh period, τ/T.")

MAX_LEVELS = 64
"""Most levels of a `SteppedStiffness`."""


@dataclass(frozen=True)
class TransmissionError:
    """Static transmission error ε(τ) = Σ a_j cos(jωτ − θ_j), (2.15).

    Attributes
    ----------
    amplitudes : tuple of float
        a_j in half backlashes Δ, from harmonic 1 on.
    phases : tuple of float
        θ_j in radians; those left out are 0.

    Raises
    ------
    InputError
        If a value is not a finite number.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(error=gc.TransmissionError((0.1, 0.02)))
    >>> model.parameters()["eps2"]
    0.02
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

    Raises
    ------
    InputError
        If a value breaks its rule.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(stiffness=gc.TwoLevelStiffness(chi1=0.2, chi2=0.3, contact_ratio=1.6))
    >>> model.stiffness.chi2
    0.3
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

    Raises
    ------
    InputError
        If a value is not a finite number, or χ would not stay positive.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(stiffness=gc.HarmonicStiffness((0.2, 0.05), (0.0, 1.0)))
    >>> model.stiffness.amplitudes
    (0.2, 0.05)
    """

    amplitudes: tuple[float, ...] = (0.0,)
    phases: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _set_series(self, "stiffness")
        check_stiffness(np.array(self.amplitudes)[:, None], np.array(self.phases)[:, None])


@dataclass(frozen=True)
class SteppedStiffness:
    """Piecewise constant mesh stiffness over the reference stiffness c0.

    χ(τ) = ``levels[i]`` for ``starts[i]`` <= τ/T < ``starts[i + 1]``, with the mesh period T. The last level lasts
    until the first start of the next period, so that it also covers 0 <= τ/T < ``starts[0]``. The time mean of χ, the
    sum of the levels weighted with their durations, may differ from 1: ω0 and ζ refer to the reference stiffness c0,
    where χ = 1, and not to the mean.

    Attributes
    ----------
    levels : tuple of float
        1 to 64 values of χ, each greater than 0.
    starts : tuple of float
        Where each level begins, as a fraction of the mesh period; they increase strictly, and lie in [0, 1).

    Raises
    ------
    InputError
        For a value that breaks a rule.

    Examples
    --------
    Two pairs of teeth in contact for 0.4 of the mesh period, one pair for the rest:

    >>> SteppedStiffness(levels=(1.25, 0.75), starts=(0.0, 0.4))
    SteppedStiffness(levels=(1.25, 0.75), starts=(0.0, 0.4))
    """

    levels: tuple[float, ...]
    starts: tuple[float, ...]

    def __post_init__(self) -> None:
        levels = to_floats("stiffness.levels", self.levels, MAX_LEVELS, "levels")
        starts = to_floats("stiffness.starts", self.starts, MAX_LEVELS, "levels")
        if not levels:
            raise InputError("stiffness.levels", f"must have 1 to {MAX_LEVELS} levels", len(levels))
        if len(starts) != len(levels):
            raise InputError("stiffness.starts", f"must have as many values as levels ({len(levels)})", len(starts),
                             "Give the start of each level as a fraction of the mesh period.")
        check_rule("stiffness.levels", np.array(levels), _POSITIVE_LEVEL)
        check_rule("stiffness.starts", np.array(starts), _IN_PERIOD)
        if np.any(np.diff(starts) <= 0):
            raise InputError("stiffness.starts", "must increase strictly", starts,
                             "Sort the levels by their starts, and give each start once.")
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "starts", starts)


Stiffness = TwoLevelStiffness | HarmonicStiffness | SteppedStiffness

STIFFNESS_KINDS: dict[str, type[Stiffness]] = {
    "two-level": TwoLevelStiffness, "harmonics": HarmonicStiffness, "steps": SteppedStiffness,
}
"""The kinds of mesh stiffness by the names that files and pages use."""


def stiffness_kind(stiffness: Stiffness) -> str:
    """The name of the kind of a stiffness, a key of `STIFFNESS_KINDS`."""
    return next(name for name, kind in STIFFNESS_KINDS.items() if isinstance(stiffness, kind))


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
