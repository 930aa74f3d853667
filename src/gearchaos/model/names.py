"""The names by which values of a model are set: parameters, pairs of parameters, harmonics and initial values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, Protocol

from gearchaos.errors import InputError, unknown_name
from gearchaos.model.stiffness import STIFFNESS_KINDS, Stiffness
from gearchaos.quantities import PARAMETER_PAIRS, PARAMETERS, parse, parse_harmonic
from gearchaos.validation import MAX_HARMONICS


class HasKindAndStiffness(Protocol):
    """The fields of `MeshModel` on which the names depend that it accepts."""

    @property
    def kind(self) -> str: ...

    @property
    def stiffness(self) -> Stiffness: ...


Kind = Literal["single", "torsional", "full"]
KINDS: tuple[str, ...] = ("single", "torsional", "full")

_TORSION = ("x1", "x1_dot", "x2", "x2_dot")
COORDINATES: dict[str, tuple[str, ...]] = {
    "single": ("z", "z_dot"),
    "torsional": _TORSION,
    "full": (*_TORSION, "y1", "y1_dot", "y2", "y2_dot"),
}
"""The coordinates of each kind of model for which initial values and results are given, in this order."""

RELATIVE = COORDINATES["single"]
"""Initial values of the relative motion alone, which do not determine x1 and x2."""

STATE_NAMES = (*RELATIVE, *COORDINATES["full"])
"""All names of initial values."""

SCALARS: tuple[str, ...] = tuple(q.name for q in PARAMETERS if not q.members)
"""Names of the scalar parameters, in the order of the fields of `MeshModel`."""

_LATERAL = ("mu", "kappa", "zeta_support")
"""The families of parameters of lateral motion."""

_PAIRS = tuple(q.name for q in PARAMETERS if q.members)


def known_names(model: HasKindAndStiffness) -> tuple[str, ...]:
    """All names by which a value of this model can be set; of the harmonics only the first of each family."""
    return (*SCALARS, *_PAIRS, *model.stiffness.parameter_names(), "eps1", "theta1", *state_names(model.kind))


def state_names(kind: str) -> tuple[str, ...]:
    """The coordinates for which a model of this kind takes initial values."""
    return (*RELATIVE, *_TORSION) if kind == "single" else COORDINATES[kind]


def check_initial_consistent(names: Iterable[str]) -> None:
    """Raise `InputError` if initial values are given both for z and for the coordinates that determine z."""
    given = set(names)
    if given & set(RELATIVE) and given - set(RELATIVE):
        raise InputError("initial", "must give either z, z_dot or the x coordinates, not both", sorted(given))


def check_state_name(kind: str, name: str) -> None:
    """Raise `InputError` unless a model of this kind can have an initial value of this name."""
    if name not in state_names(kind):
        raise unknown_name(f"initial value of a {kind} model", name, state_names(kind))


def expand_pairs(values: Mapping[str, Any], model: HasKindAndStiffness) -> dict[str, Any]:
    """The same values with each pair of parameters, such as ``q0``, replaced by its two members with its value.

    Raises
    ------
    InputError
        For a name that the model does not have; the advice is the most similar known name.
    """
    flat: dict[str, Any] = {}
    for name, value in values.items():
        _check_name(name, model)
        for single in PARAMETER_PAIRS.get(name, (name,)):
            flat[single] = value
    return flat


def _check_name(name: str, model: HasKindAndStiffness) -> None:
    """Raise `InputError` unless the model accepts this name."""
    own = None if model.stiffness.accepts(name) else next(
        (kind for kind in STIFFNESS_KINDS.values() if kind.accepts(name)), None)
    if own is not None:
        raise InputError(name, f"must be a parameter of {own.noun}", name, own.advice(name, model.stiffness))
    if parts := parse_harmonic(name):
        if parts.order is not None and parts.order > MAX_HARMONICS:
            raise InputError(name, f"must be a harmonic of order at most {MAX_HARMONICS}", parts.order)
        return
    if name in known_names(model):
        return
    raise unknown_name("parameter", name, known_names(model))


def check_has_effect(name: str, kind: str) -> None:
    """Raise `InputError` if a parameter has no effect in a kind of model.

    Only the full model has parameters of lateral motion, and the single model has no bearing friction.
    """
    if not has_effect(name, kind):
        advice = "Use kind='full'." if parse(name).family in _LATERAL else "Use kind='torsional'."
        raise InputError(name, f"must be a parameter of the {kind} model", name, advice)


def has_effect(name: str, kind: str) -> bool:
    """Whether a parameter has an effect in a kind of model."""
    family = parse(name).family
    return kind == "full" if family in _LATERAL else not (family == "beta" and kind == "single")
