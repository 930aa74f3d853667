"""gearchaos: the motions of gear pairs with backlash, from periodic to chaotic.

>>> import gearchaos as gc
>>> gc.regime(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)).label
'8T'
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from gearchaos.catalogue import STUDIES as _STUDIES
from gearchaos.display import make_cards_by

_OTHERS = {
    "InputError": "errors",
    "HarmonicStiffness": "model", "MeshModel": "model", "SteppedStiffness": "model", "ToothPairStiffness": "model",
    "TransmissionError": "model",
    "TwoLevelStiffness": "model",
    "Body": "gears.train.parts", "Mesh": "gears.train.mesh", "Shaft": "gears.train.parts",
    "PlanetarySet": "gears.train.planets", "Train": "gears.train.train",
    "GearDesign": "gears.design.gear_design", "GearPair": "gears.mesh.pair", "physical": "gears.operation.results",
    "Axis": "studies.core.axis", "Classification": "dynamics.settings", "Verdict": "studies.motion.regime",
    "orbit": "continuation.orbit", "orbits": "continuation.orbit",
    "agreement": "studies.orbits.agreement", "static_deflection": "model.static",
    "natural_frequencies": "studies.vibration.natural_frequencies", "open": "studyfile.loading",
    "steady": "studies.motion.regime", "operating_map": "studies.speeds.speed_and_torque",
    "dynamic_factor": "studies.speeds.speed_and_torque", "speeds_to_avoid": "studies.speeds.speeds_to_avoid",
    "assess": "studies.speeds.assess",
    "prove": "studies.proofs.proofs", "prove_event": "studies.proofs.proofs", "prove_box": "studies.proofs.proofs",
    "prove_chaos": "studies.proofs.chaos_proof",
    "card": "cards.card", "save": "formats",
    "load": "store.read", "run": "store.run", "Outcome": "store.run",
    "explore": "explorer.web.server",
    "SymbolicModel": "interchange.symbolic", "script": "interchange.scripts",
    "from_sympy": "interchange.symbolic", "to_sympy": "interchange.symbolic",
}
"""The submodule that defines each public name that is no study."""

_MODULES = _OTHERS | {
    name: entry["module"] for kind, entry in _STUDIES.items() for name in (entry["class"], kind)
}
"""The submodule that defines each public name. ``__init__.pyi`` has the same names for type checkers and editors."""

_SUBPACKAGES = ("dynamics", "flow", "plot", "studies")

__version__: str
"""Version of the package."""

__all__ = [*_MODULES, *_SUBPACKAGES, "__version__"]


def __getattr__(name: str) -> Any:
    """Import a public name on first use: `import gearchaos` and `gearchaos --help` load neither Numba nor xarray."""
    if name == "__version__":
        from importlib.metadata import version

        return version("gearchaos")
    if name in _SUBPACKAGES:
        return import_module(f"gearchaos.{name}")
    if name in _MODULES:
        return getattr(import_module(f"gearchaos.{_MODULES[name]}"), name)
    raise AttributeError(f"module 'gearchaos' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)


make_cards_by(lambda value: str(__getattr__("card")(value).html))  # cards are imported when a notebook asks for one
