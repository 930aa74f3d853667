"""The stiffness of one spring of a mesh of a gear train, in N/m: one number, in steps, or a Fourier series."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, singledispatch
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Record, check_plausible, convert_fields, each, one, read_by, record
from gearchaos.model import SteppedStiffness, Stiffness
from gearchaos.quantities import POSITIVE
from gearchaos.validation import to_floats

STEPS = 48
"""Steps in which a Fourier series of a mesh stiffness is followed."""


BOUNDS = 1.0, 1e14
"""Of a mesh stiffness, N/m, beyond which only a slip of units explains it: steel 1 m wide has 2e10."""


@dataclass(frozen=True, kw_only=True)
class SeriesStiffness(Record):
    """A mesh stiffness c(ψ) = ``mean`` + Σ ``amplitudes[j - 1]`` cos(j ψ − ``phases[j - 1]``), N/m, ψ the phase of the
    mesh cycle. It is followed in `STEPS` steps, each the mean of the series over it."""

    mean: Any = field(metadata=read_by(one(units.STIFFNESS, POSITIVE, BOUNDS)))
    amplitudes: Any = field(metadata=read_by(each(units.STIFFNESS)))
    phases: Any = field(default=(), metadata=read_by(each(units.ANGLE)))

    def __post_init__(self) -> None:
        convert_fields(self)
        if len(self.phases) > len(self.amplitudes):
            raise InputError("phases", "must not be longer than amplitudes", len(self.phases))
        if not self.amplitudes:
            raise InputError("amplitudes", "must have at least one value", [], "A constant stiffness is one number.")
        if (least := float(self._levels().min())) <= 0:
            raise InputError("amplitudes", "must leave the stiffness positive", list(self.amplitudes),
                             f"With a mean of {self.mean:.6g} N/m it falls to {least:.6g} N/m.")

    def _levels(self) -> np.ndarray:
        """The means of the series over equal steps of the mesh cycle, N/m."""
        edges = np.arange(STEPS + 1) / STEPS
        levels = np.full(STEPS, float(self.mean))
        for j, amplitude in enumerate(self.amplitudes, 1):
            phase = self.phases[j - 1] if j <= len(self.phases) else 0.0
            levels += amplitude * np.diff(np.sin(2 * np.pi * j * edges - phase)) * STEPS / (2 * np.pi * j)
        return levels

    @cached_property
    def steps(self) -> SteppedStiffness:
        """The same stiffness in steps, N/m."""
        return SteppedStiffness(tuple(self._levels().tolist()), tuple((np.arange(STEPS) / STEPS).tolist()))



def read_stiffness(field: str, value: Any) -> Any:
    """A stiffness in N/m, or a table: one in steps with ``levels`` in N/m and ``starts``, or a `SeriesStiffness`."""
    if isinstance(value, (SteppedStiffness, SeriesStiffness)):
        return value
    if not isinstance(value, Mapping):
        return one(units.STIFFNESS, POSITIVE, BOUNDS)(field, value)
    if "mean" in value:
        return record(SeriesStiffness)(field, value)
    if set(value) != {"levels", "starts"}:
        raise InputError(field, "must be a stiffness, or a table with levels and starts, or with mean, amplitudes and "
                         "phases", dict(value), "Starts are shares of the mesh cycle.")
    levels = each(units.STIFFNESS)(f"{field}.levels", value["levels"])
    check_plausible(f"{field}.levels", max(levels), *BOUNDS, dimension=units.STIFFNESS)
    return SteppedStiffness(levels, to_floats(f"{field}.starts", value["starts"]))


def of_model(stiffness: Stiffness, c0: float) -> SteppedStiffness | SeriesStiffness:
    """The stiffness of a model whose reference stiffness is c0, N/m."""
    if stiffness.families:
        amplitudes, phases = stiffness.harmonics()
        return SeriesStiffness(mean=c0, phases=phases, amplitudes=tuple(a * c0 for a in amplitudes))
    parts = stiffness.parts(stiffness.numbers())
    return SteppedStiffness(tuple(float(level) * c0 for _, level in parts), tuple(float(start) for start, _ in parts))


@singledispatch
def in_steps(stiffness: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The levels of a stiffness in steps of the mesh cycle, N/m, and where each begins, as a share of the cycle."""
    return (stiffness,), (0.0,)


@singledispatch
def with_mean(stiffness: Any, mean: float, own: float) -> Any:
    """A stiffness of the same form with another mean than its ``own`` one."""
    return mean


in_steps.register(SteppedStiffness, lambda stiffness: (stiffness.levels, stiffness.starts))
in_steps.register(SeriesStiffness, lambda stiffness: in_steps(stiffness.steps))


@with_mean.register
def _(stiffness: SteppedStiffness, mean: float, own: float) -> SteppedStiffness:
    return replace(stiffness, levels=tuple(level * mean / own for level in stiffness.levels))


@with_mean.register
def _(stiffness: SeriesStiffness, mean: float, own: float) -> SeriesStiffness:
    return replace(stiffness, mean=stiffness.mean * (mean / own),
                   amplitudes=tuple(a * (mean / own) for a in stiffness.amplitudes))
