"""Mesh stiffness as a Fourier series, (2.7)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from gearchaos.model.stiffness.base import Stiffness
from gearchaos.model.waveforms import harmonics, set_series, with_harmonics
from gearchaos.quantities import Quantity, Range, Rule
from gearchaos.validation import check_rule

_POSITIVE_STIFFNESS = Rule(
    lambda v: v > 0, "must keep the mesh stiffness above 0 (its least value is given)", "Lower the amplitudes.")


@dataclass(frozen=True)
class HarmonicStiffness(Stiffness):
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

    kind, form = "harmonics", "fourier"
    noun, predicate = "a Fourier stiffness, (2.7)", "is a Fourier series"
    keys = "amplitudes and phases"
    equation = "(2.7)"
    families = (
        Quantity("c", "c", "c", title="stiffness amplitude", range=Range(-0.5, 0.5, -0.95, 0.95),
                 toml_table="[model.stiffness]"),
        Quantity("alpha", "α", r"\alpha", title="stiffness phase", range=Range(-3.2, 3.2, -100.0, 100.0),
                 toml_table="[model.stiffness]"),
    )
    letters = {"amplitudes": "c", "phases": "alpha"}  # noqa: RUF012 -- no field, and never changed
    pair_fields = {"amplitudes": "stiffness_amplitudes", "phases": "stiffness_phases"}  # noqa: RUF012
    stiffness_fields = ("amplitudes",)

    def __post_init__(self) -> None:
        set_series(self, "stiffness")
        self.check_together({}, np.array(self.amplitudes)[:, None], np.array(self.phases)[:, None])

    @classmethod
    def parts(cls, values: Mapping[str, Any]) -> tuple[()]:
        return ()

    def describe(self) -> str:
        count = len(self.amplitudes)
        return f"{count} harmonic{'s' * (count != 1)}"

    @classmethod
    def example(cls) -> Self:
        return cls((0.25,))

    @classmethod
    def advice(cls, name: str, present: Stiffness) -> str:
        return (f"This model's {present.predicate}. Begin with MeshModel.of({name}=...) or "
                f"stiffness={cls.__name__}(...), a study file with kind = {cls.kind!r} in [model.stiffness].")

    def parameters(self) -> dict[str, float]:
        return harmonics(self, "c", "alpha")

    def with_values(self, values: Mapping[str, Any]) -> Self:
        return with_harmonics(self, values, "c", "alpha")

    @classmethod
    def check_together(cls, values: Mapping[str, Any], amplitudes: np.ndarray, phases: np.ndarray) -> None:
        """Raise `InputError` unless χ(θ) = 1 + Σ c_j cos(jθ − α_j) is positive for all θ at every point.

        Between samples at a distance h, 256 per harmonic, χ is at most h²/8 max|χ″| below the lower of the two.
        """
        if np.all(np.abs(amplitudes).sum(axis=0) < 1):
            return
        order = np.arange(1, len(amplitudes) + 1)[:, None]
        theta = np.linspace(0, 2 * np.pi, 256 * len(amplitudes), endpoint=False)
        lowest = np.full(amplitudes.shape[1], np.inf)
        for t in theta:
            lowest = np.minimum(lowest, 1 + (amplitudes * np.cos(order * t - phases)).sum(axis=0))
        curvature = (np.abs(amplitudes) * order**2).sum(axis=0)
        check_rule("stiffness.amplitudes", lowest - curvature * (theta[1] - theta[0]) ** 2 / 8, _POSITIVE_STIFFNESS)
