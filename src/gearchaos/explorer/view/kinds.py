"""Changing the kind of a model: full, torsional or single."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from gearchaos.model import SUPPORTS, MeshModel, state_names

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
