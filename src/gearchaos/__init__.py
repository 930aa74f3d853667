"""gearchaos: what will this gear mesh do?

>>> import gearchaos as gc
>>> gc.regime(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)).label
'8T'
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_MODULES = {
    "GearPair": "gears.pair", "HarmonicStiffness": "model", "InputError": "errors", "MeshModel": "model",
    "TransmissionError": "model", "TwoLevelStiffness": "model", "physical": "gears.results",
    "explore": "explorer.web.notebook",
    "Axis": "studies.axis", "Classification": "dynamics.settings", "Regime": "studies.regime",
    "attractors": "studies.attractors", "basins": "studies.basins",
    "bifurcation": "studies.bifurcation", "load": "datasets", "regime": "studies.regime",
    "save": "datasets", "simulate": "studies.simulate", "steady": "studies.steady",
    "zones": "studies.zones", "run": "store.run",
    "Attractors": "studies.attractors", "Basins": "studies.basins", "Bifurcation": "studies.bifurcation",
    "Simulate": "studies.simulate", "Verdict": "studies.verdict", "Zones": "studies.zones",
}
"""The submodule that defines each public name. ``__init__.pyi`` says the same to type checkers and editors."""

_SUBPACKAGES = ("dynamics", "flow", "plot", "studies")

__all__ = [*_MODULES, *_SUBPACKAGES, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that `import gearchaos` and `gearchaos --help` load nothing heavy."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gearchaos")
    if name in _SUBPACKAGES:
        return import_module(f"gearchaos.{name}")
    if name in _MODULES:
        return getattr(import_module(f"gearchaos.{_MODULES[name]}"), name)
    if name == "Budget":
        raise AttributeError("gearchaos.Budget is now gearchaos.Classification, given as settings=…, "
                             "with other fields: see help(gearchaos.Classification)")
    raise AttributeError(f"module 'gearchaos' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
