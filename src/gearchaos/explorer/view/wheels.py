"""The two wheels of a pair: whether their values are equal, and how to make them so."""

from __future__ import annotations

from gearchaos.explorer.view.state import View
from gearchaos.model import PARAMETER_PAIRS, MeshModel

_WHEELS = ("J", "beta", "mu", "kappa", "zeta_support")
"""Pairs of values that belong to the wheels and their supports."""


def equal(model: MeshModel, pair: str) -> bool:
    """Whether both members of a pair of `PARAMETER_PAIRS` have the same value; true also if the model has neither."""
    values = model.parameters()
    return len({values.get(name) for name in PARAMETER_PAIRS[pair]}) == 1


def are_alike(model: MeshModel) -> bool:
    """Whether both wheels and their supports have the same values."""
    return all(equal(model, pair) for pair in _WHEELS)


def made_alike(view: View) -> View:
    """The view with the values of wheel 1 for both wheels."""
    for pair in _WHEELS:
        if not equal(view.operating_point, pair):
            view = view.with_value(pair, view.operating_point.parameters()[PARAMETER_PAIRS[pair][0]])
    return view
