"""What the modules of a folder declare: a standard or a method is a file of its own, and no list names it."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any


def declared(folder: ModuleType, name: str) -> list[Any]:
    """What the modules of a package call ``name``, in the order of the modules; not every module must have it."""
    modules = (import_module(f"{folder.__name__}.{found.name}") for found in iter_modules(folder.__path__))
    return [getattr(module, name) for module in modules if hasattr(module, name)]
