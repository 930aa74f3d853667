"""Fourier series of a model: the transmission error, (2.15), and what it has in common with a stiffness, (2.7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError
from gearchaos.quantities import parse_harmonic
from gearchaos.validation import to_floats


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
        set_series(self, "error")


def set_series(series: Any, kind: str) -> None:
    """Check the amplitudes and phases of a Fourier series that is being created, and set missing phases to 0."""
    amplitudes = to_floats(f"{kind}.amplitudes", series.amplitudes)
    phases = to_floats(f"{kind}.phases", series.phases)
    if len(phases) > len(amplitudes):
        raise InputError(f"{kind}.phases", f"must not be longer than amplitudes ({len(amplitudes)})", len(phases),
                         "Give one phase per harmonic; missing ones are 0.")
    object.__setattr__(series, "amplitudes", amplitudes)
    object.__setattr__(series, "phases", phases + (0.0,) * (len(amplitudes) - len(phases)))


def harmonics(series: Any, amplitude: str, phase: str) -> dict[str, float]:
    """Amplitudes and phases of a Fourier series by name."""
    flat = {}
    for j, (a, p) in enumerate(zip(series.amplitudes, series.phases, strict=True), start=1):
        flat[f"{amplitude}{j}"], flat[f"{phase}{j}"] = a, p
    return flat


def with_harmonics(series: Any, values: Mapping[str, Any], amplitude: str, phase: str) -> Any:
    """A Fourier series with amplitudes and phases replaced by name; lower harmonics that are not given are 0."""
    flat = {**harmonics(series, amplitude, phase), **values}
    n = max((p.order or 0 for p in map(parse_harmonic, flat) if p and p.family in (amplitude, phase)), default=0)
    return type(series)(*(tuple(flat.get(f"{name}{j}", 0.0) for j in range(1, n + 1)) for name in (amplitude, phase)))
