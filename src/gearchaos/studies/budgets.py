"""How long each kind of study waits where nobody says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gearchaos.motion import Budget
from gearchaos.studies.bifurcation import PER_COLUMN
from gearchaos.studies.regime import PATIENT

_DEFAULTS = {"bifurcation": PER_COLUMN, "regime": PATIENT}


def budget_for(kind: str, given: Mapping[str, Any]) -> Budget:
    """The budget of a kind of study, with the given fields over it."""
    changed: dict[str, Any] = {n: tuple(v) if isinstance(v, list) else v for n, v in given.items()}
    return replace(_DEFAULTS.get(kind, Budget()), **changed)
