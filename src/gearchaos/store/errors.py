"""Errors of stores."""

from __future__ import annotations

from gearchaos.errors import InputError
from gearchaos.store.files.folder import Folder

_REMEDY = ("Copy run/study.json from a new store of the same study, computed by the same version, or begin a new "
           "store in another folder.")


def damaged_description(folder: Folder, why: str) -> InputError:
    """The error for a store whose ``run/study.json`` is damaged or does not fit its arrays."""
    advice = f"It is damaged, or not a store: {why}. {_REMEDY}"
    return InputError("store", "must hold an undamaged run/study.json", str(folder), advice)


def missing_description(folder: Folder) -> InputError:
    """The error for a folder that has other files of a store but no ``run/study.json``."""
    advice = f"That file is missing, other files of a store are there. {_REMEDY}"
    return InputError("store", "must hold run/study.json", str(folder), advice)
