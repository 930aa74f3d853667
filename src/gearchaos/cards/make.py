"""The card of each kind of value."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import xarray as xr

from gearchaos.cards.card import Card
from gearchaos.cards.inputs import design_card, model_card, pair_card, study_card
from gearchaos.cards.motions import edge_card, orbit_card, verdict_card
from gearchaos.cards.results import result_card
from gearchaos.continuation.edge import EdgeState
from gearchaos.continuation.orbit import Orbit
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.pair import GearPair
from gearchaos.model import MeshModel
from gearchaos.studies.regime import Verdict
from gearchaos.studies.study import Study

__all__ = ["card"]


@singledispatch
def card(value: Any) -> Card:
    """What a notebook shows of a value: its main numbers and a small picture.

    Notebooks show models, gears, verdicts, orbits and studies as cards by themselves. A result, which is an xarray
    Dataset, is shown by xarray with all its variables; ``gc.card(result)`` is a card of it.

    Parameters
    ----------
    value : MeshModel, GearPair, GearDesign, Verdict, Orbit, EdgeState, Study or Dataset
        The value; a Dataset must be the result of a study.

    Returns
    -------
    Card
        A notebook shows it; ``html`` is its text.

    Raises
    ------
    InputError
        For a value of another kind.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.card(gc.MeshModel.of(kind="single", omega=0.8, eps1=0.1))
    Single-degree-of-freedom model
      mesh frequency ω: 0.8
      mesh damping ζ: 0.025
      static load q₀: 0.1
      transmission error ε: 0.1
      mesh stiffness χ: two levels, 1.25 and 0.75, contact ratio 1.5
    """
    raise InputError("value", "must be a model, gears, a verdict, an orbit, a study or a result of one",
                     f"a {type(value).__name__}")


card.register(MeshModel, model_card)
card.register(GearPair, pair_card)
card.register(GearDesign, design_card)
card.register(Verdict, verdict_card)
card.register(Orbit, orbit_card)
card.register(EdgeState, edge_card)
card.register(Study, study_card)
card.register(xr.Dataset, result_card)
