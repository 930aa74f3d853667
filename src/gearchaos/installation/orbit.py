"""A periodic orbit whose states are stored, to check what an installation computes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gearchaos.model import MeshModel

TOLERANCE = 1e-12
"""Largest difference allowed, in half backlashes and per unit of τ. Other versions of NumPy and SciPy, and other
processors, may round differently, by which the polished orbit moves some 1e-15."""

STORED = (
    (0.3320708861077118, 0.06785315128540206),
    (0.9251966176933386, 0.031235235156708053),
    (0.7527561012182468, 0.16782381879674596),
)
"""z and z' of the orbit of `model` at τ = 0, T, 2T, from the state with the least z on."""


def model() -> MeshModel:
    """Its model: torsional, with a stable orbit of three mesh periods on which the teeth separate."""
    from gearchaos.model import MeshModel

    return MeshModel.of(kind="torsional", omega=0.8, q0=0.1, eps1=0.1)


def computed() -> list[tuple[float, float]]:
    """z and z' of the orbit as this installation computes them, from the state with the least z on."""
    from gearchaos.studies.regime import regime

    section = regime(model()).section
    states = list(zip(map(float, section["z"]), map(float, section["z_dot"]), strict=True))
    least = states.index(min(states))
    return states[least:] + states[:least]


def difference() -> float:
    """The largest difference between computed and stored values; infinite if the numbers of states differ."""
    found = computed()
    if len(found) != len(STORED):
        return float("inf")
    pairs = zip(sum(found, ()), sum(STORED, ()), strict=True)
    return max(abs(a - b) for a, b in pairs)
