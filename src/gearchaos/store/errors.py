"""Errors of stores."""

from __future__ import annotations

from gearchaos.errors import InputError
from gearchaos.store.files.folder import Folder


def damaged_description(folder: Folder, why: str) -> InputError:
    """The error for a store whose ``run/study.json`` is damaged or does not fit its arrays."""
    advice = f"It is damaged, or not a store: {why}."
    return InputError("store", "must hold an undamaged run/study.json", str(folder), advice)
