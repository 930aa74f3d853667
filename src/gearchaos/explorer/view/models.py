"""What belongs to a whole model: its kind, and whether its two wheels are alike."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from gearchaos.model import PARAMETER_PAIRS, SUPPORTS, MeshModel, state_names

WHEELS = ("J", "beta", "mu", "kappa", "zeta_support")
"""Pairs of values that belong to the wheels and their supports."""

AnyModel = TypeVar("AnyModel", bound=MeshModel)


def as_kind(model: AnyModel, kind: str) -> AnyModel:
    """A model of another kind, without the initial values and the bearing friction that this kind does not have."""
    kept = {n: v for n, v in model.initial.items() if n in state_names(kind)}
    model = replace(model, initial={})
    if kind == "single":
        model = replace(model, beta1=0.01, beta2=0.01) if model.kind != "single" else model
    # those of a model whose gears have rigid supports have their default values
    supports = {f"{family}{n}": getattr(model, f"{family}{n}") for family in SUPPORTS for n in (1, 2)}
    model = model.with_values({"kind": kind, **(supports if kind == "full" else {})})
    return model.with_values(kept) if kept else model


def equal(model: MeshModel, pair: str) -> bool:
    """Whether both members of a pair of `PARAMETER_PAIRS` have the same value; true also if the model has neither."""
    values = model.parameters()
    return len({values.get(name) for name in PARAMETER_PAIRS[pair]}) == 1


def are_alike(model: MeshModel) -> bool:
    """Whether both wheels and their supports have the same values."""
    return all(equal(model, pair) for pair in WHEELS)
