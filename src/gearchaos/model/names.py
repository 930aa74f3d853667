"""The names by which values of a model are set: parameters, pairs of parameters, harmonics and initial values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, Protocol

from gearchaos.errors import InputError, unknown_name
from gearchaos.model.waveforms import HarmonicStiffness, SteppedStiffness, Stiffness, TwoLevelStiffness
from gearchaos.quantities import PARAMETER_PAIRS, PARAMETERS, STIFFNESS_LEVELS, parse, parse_harmonic
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

_LEVELS = tuple(q.name for q in STIFFNESS_LEVELS)

_STIFFNESS_NAMES: dict[type[Stiffness], tuple[str, ...]] = {
    TwoLevelStiffness: _LEVELS, HarmonicStiffness: ("c1", "alpha1"), SteppedStiffness: (),
}
"""The names of the values of each kind of stiffness; of the harmonics only the first of each family."""


def is_stiffness_harmonic(name: str) -> bool:
    """Whether a name is an amplitude or a phase of a Fourier stiffness, (2.7)."""
    parts = parse_harmonic(name)
    return parts is not None and parts.family in ("c", "alpha")


def known_names(model: HasKindAndStiffness) -> tuple[str, ...]:
    """All names by which a value of this model can be set; of the harmonics only the first of each family."""
    stiffness = _STIFFNESS_NAMES[type(model.stiffness)]
    pairs = tuple(pair for pair in PARAMETER_PAIRS if pair not in _LEVELS)
    return (*SCALARS, *pairs, *stiffness, "eps1", "theta1", *state_names(model.kind))


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


def default_stiffness(names: Iterable[str]) -> Stiffness:
    """The stiffness of a model of which these names will be set: a Fourier series if one of them is a harmonic of the
    stiffness, otherwise the two levels of the paper."""
    return HarmonicStiffness() if any(map(is_stiffness_harmonic, names)) else TwoLevelStiffness()


def _check_name(name: str, model: HasKindAndStiffness) -> None:
    """Raise `InputError` unless the model accepts this name."""
    parts = parse_harmonic(name)
    if parts is not None and (isinstance(model.stiffness, HarmonicStiffness) or not is_stiffness_harmonic(name)):
        if parts.order is not None and parts.order > MAX_HARMONICS:
            raise InputError(name, f"must be a harmonic of order at most {MAX_HARMONICS}", parts.order)
        return
    if name in known_names(model):
        return
    stepped = isinstance(model.stiffness, SteppedStiffness)
    if name in _LEVELS:
        has = "has steps: set" if stepped else "is a Fourier series: set c1, alpha1, ..., or"
        raise InputError(name, "must be a parameter of a two-level stiffness, (2.16)", name,
                         f"This model's {has} stiffness=TwoLevelStiffness().")
    if is_stiffness_harmonic(name):
        raise InputError(name, "must be a parameter of a Fourier stiffness, (2.7)", name,
                         f"This model's has {'steps' if stepped else 'two levels'}. "
                         f"Begin with MeshModel.of({name}=...) or stiffness=HarmonicStiffness(...), "
                         "a study file with kind = 'harmonics' in [model.stiffness].")
    raise unknown_name("parameter", name, known_names(model))


def check_has_effect(name: str, kind: str) -> None:
    """Raise `InputError` if a parameter has no effect in a kind of model.

    Only the full model has parameters of lateral motion, and the single model has no bearing friction.
    """
    family = parse(name).family
    lateral = family in ("mu", "kappa", "zeta_support")
    if (lateral and kind != "full") or (family == "beta" and kind == "single"):
        advice = "Use kind='full'." if lateral else "Use kind='torsional'."
        raise InputError(name, f"must be a parameter of the {kind} model", name, advice)
