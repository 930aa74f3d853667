"""Batches: one model at many parameter points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.parameters import STATE_NAMES, MeshModel, check_has_effect, check_initial_consistent
from gearchaos.quantities import parse_harmonic
from gearchaos.validation import check


@dataclass(frozen=True)
class Batch:
    """A model with some of its values replaced by arrays of one length P: P parameter points."""

    model: MeshModel  # has the values that all points share
    values: Mapping[str, np.ndarray]  # (P,), by the names of parameters (no pairs such as ``q0``) and initial values
    size: int  # P

    def __getitem__(self, name: str) -> np.ndarray | float:
        """The value of a parameter: an array (P,) if it varies, else a float; 0 for a harmonic that is not given.

        Raises KeyError for a name that is not a parameter.
        """
        if name in self.values:
            return self.values[name]
        if name in self._shared:
            return self._shared[name]
        if parse_harmonic(name):
            return 0.0
        raise KeyError(name)

    @cached_property
    def _shared(self) -> dict[str, float]:
        """The parameters of the model by name; those in ``values`` replace them."""
        return self.model.parameters()

    def harmonics(self, amplitude: str, phase: str) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes and phases of a Fourier series by their families, (H, P) for harmonics 1 to H; H may be 0."""
        found = map(parse_harmonic, {**self._shared, **self.values})
        n = max((p.order or 0 for p in found if p and p.family in (amplitude, phase)), default=0)
        rows = [[np.broadcast_to(self[f"{k}{j}"], self.size) for j in range(1, n + 1)] for k in (amplitude, phase)]
        a, p = (np.array(r, dtype=float).reshape(n, self.size) for r in rows)
        return a, p

    def take(self, index: np.ndarray) -> Batch:
        """The batch of the points with these indices (N,), in that order."""
        return Batch(self.model, {k: v[index] for k, v in self.values.items()}, len(index))


def vary(model: MeshModel, values: Mapping[str, Any]) -> Batch:
    """A batch: a model with arrays (P,) for some of its parameters or initial values, checked like single values.

    Names are those of `MeshModel.with_values`; a scalar is an array of length 1. Raises `InputError` also for arrays of
    several lengths or shapes, and for a parameter that has no effect in this kind of model.
    """
    flat = {k: np.atleast_1d(np.asarray(v, dtype=float)) for k, v in model.expand(values).items()}
    sizes = {v.shape for v in flat.values()} or {(1,)}
    if len(sizes) > 1 or any(len(s) != 1 for s in sizes):
        raise InputError("values", "must be one-dimensional arrays of one common length", sorted(sizes))
    for name, value in flat.items():
        check(name, value)
        check_has_effect(name, model.kind)
    check_initial_consistent(n for n in {**model.initial, **flat} if n in STATE_NAMES)
    batch = Batch(model, MappingProxyType(flat), next(iter(sizes))[0])
    model.stiffness.check(flat, *batch.harmonics("c", "alpha"))
    return batch
