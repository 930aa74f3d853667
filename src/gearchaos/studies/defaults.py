"""How long each kind of study waits where nobody says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gearchaos.dynamics import Classification
from gearchaos.studies.bifurcation import PER_COLUMN
from gearchaos.studies.regime import REGIME_SETTINGS

_DEFAULTS = {"bifurcation": PER_COLUMN, "regime": REGIME_SETTINGS}


def settings_for_kind(kind: str, given: Mapping[str, Any]) -> Classification:
    """The classification settings of a kind of study, with the given fields over it."""
    changed: dict[str, Any] = {n: tuple(v) if isinstance(v, list) else v for n, v in given.items()}
    return replace(_DEFAULTS.get(kind, Classification()), **changed)
