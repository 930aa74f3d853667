"""The physical gear pair whose dimensionless model is the model at a point."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gearchaos.gears.pair import GearPair
from gearchaos.gears.units import RPM
from gearchaos.model import PARAMETER_PAIRS, STIFFNESS_KINDS, SUPPORTS, MeshModel

_TOLERANCE = 1e-12
"""Relative rounding error allowed for the conversion of a value to SI units and back."""

_Values = dict[str, tuple[tuple[str, ...], float]]
"""By field of a `GearPair`: the dimensionless parameters that determine it, and its value."""


def pair_at(pair: GearPair, model: MeshModel) -> GearPair | None:
    """The pair with the mass, mesh stiffness and backlash of ``pair`` whose dimensionless model is ``model``.

    The inverse of (2.11). Fields whose dimensionless parameters are those of ``pair`` keep all their digits.

    Returns
    -------
    GearPair or None
        None if there is no such pair: inertias that imply another equivalent mass, or elastic supports where those
        of ``pair`` are rigid.
    """
    if model.kind == "full" and pair.rigid:
        return None
    if model.kind == "single":
        pair = replace(pair, b1=0.0, b2=0.0)
    own = pair.to_model(model.kind)
    old, new = own.parameters(), model.parameters()
    values = {**_mesh(pair, model), **_wheel(pair, model, 1), **_wheel(pair, model, 2)}
    changed: dict[str, Any] = {
        field: value for field, (names, value) in values.items() if any(old[n] != new[n] for n in names)}
    found = replace(pair, **changed, **_transmission_error(pair, own, model), **_stiffness(pair, own, model))
    return found if _same(found.to_model(model.kind), model) else None


def _mesh(pair: GearPair, model: MeshModel) -> _Values:
    """Speed and mesh damping by (2.11)."""
    return {
        "speed": (("omega",), model.omega * pair.omega0 / pair.n1 / RPM),
        "k": (("zeta",), model.zeta * 2 * pair.mass * pair.omega0),
    }


def _wheel(pair: GearPair, model: MeshModel, n: int) -> _Values:
    """Inertia, torque and bearing friction of wheel ``n``; with elastic supports also its mass and support."""
    radius, damping = getattr(pair, f"R{n}"), 2 * pair.mass * pair.omega0
    at = {name: getattr(model, f"{name}{n}") for name in ("J", "q", "beta", *SUPPORTS)}
    values: _Values = {
        f"I{n}": ((f"J{n}",), at["J"] * pair.mass * radius**2),
        f"M{n}0": ((f"q{n}",), at["q"] * pair.scales.force * radius),
        f"b{n}": ((f"beta{n}",), at["beta"] * damping * radius**2),
    }
    if model.kind != "full":
        return values
    return {
        **values,
        f"m{n}": ((f"mu{n}",), at["mu"] * pair.mass),
        f"c{n}": ((f"kappa{n}",), at["kappa"] * pair.c0),
        f"k{n}": ((f"zeta_support{n}", f"mu{n}"), at["zeta_support"] * at["mu"] * damping),
    }


def _transmission_error(pair: GearPair, own: MeshModel, model: MeshModel) -> dict[str, Any]:
    """The fields of the transmission error, if it differs from the pair's own."""
    if model.error == own.error:
        return {}
    amplitudes = tuple(a * pair.half_backlash for a in model.error.amplitudes)
    return {"error_amplitudes": amplitudes, "error_phases": model.error.phases}


def _stiffness(pair: GearPair, own: MeshModel, model: MeshModel) -> dict[str, Any]:
    """The fields of the mesh stiffness, if it differs from the pair's own."""
    if model.stiffness == own.stiffness:
        return {}
    fields = {field for kind in STIFFNESS_KINDS.values() for field in kind.pair_fields.values()}
    unset = {field: GearPair.__dataclass_fields__[field].default for field in fields}
    return {**unset, **model.stiffness.to_pair(pair.c0)}


def _same(one: MeshModel, other: MeshModel) -> bool:
    """Whether two models are equal up to rounding; the supports of a model that is not "full" are ignored."""
    ignored = () if one.kind == "full" else [n for pair in SUPPORTS for n in PARAMETER_PAIRS[pair]]
    a, b = ({n: v for n, v in m.parameters().items() if n not in ignored} for m in (one, other))
    return one.stiffness.kind == other.stiffness.kind and a.keys() == b.keys() and bool(
        np.allclose([*a.values()], [b[n] for n in a], rtol=_TOLERANCE, atol=1e-15))
