"""From a model to its equations in SymPy, and back."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError
from gearchaos.gears.operating import AnyModel, as_model
from gearchaos.interchange.symbolic_model import (
    TAU,
    SymbolicModel,
    check_equal,
    check_symbols,
    function,
    symbol,
    sympy,
)
from gearchaos.model import (
    SCALARS,
    STIFFNESS_KINDS,
    SUPPORTS,
    HarmonicStiffness,
    MeshModel,
    Stiffness,
    TransmissionError,
    has_effect,
)
from gearchaos.model.waveforms import harmonics
from gearchaos.quantities import HARMONICS
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from sympy import Eq
    from sympy.core.function import AppliedUndef


def to_sympy(model: AnyModel) -> SymbolicModel:
    """The equations of motion of a model in SymPy, with its parameters as symbols.

    It needs the extra ``sympy``: ``pip install "gearchaos[sympy]"``.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign

    Returns
    -------
    SymbolicModel
        (2.12) or (2.17) of Łuczko (2008) with the definitions (2.5), (2.13)-(2.16) and (2.7), and the values of the
        parameters. `from_sympy` makes an equal `MeshModel` of it.

    Raises
    ------
    InputError
        If SymPy is not installed, or for what is no model.

    Examples
    --------
    >>> symbolic = to_sympy(MeshModel.of(kind="single", omega=0.8, eps1=0.1))
    >>> [str(f) for f in symbolic.coordinates]
    ['z(tau)']
    >>> from_sympy(symbolic) == MeshModel.of(kind="single", omega=0.8, eps1=0.1)
    True
    """
    found = as_model(model)
    values = {name: getattr(found, name) for name in SCALARS if has_effect(name, found.kind)}
    values |= {**harmonics(found.error, "eps", "theta"), **_numbered(found.stiffness.numbers())}
    return SymbolicModel(
        equations=_rows(found.kind),
        definitions=_definitions(found),
        values={symbol(name): value for name, value in values.items()},
        initial=found.initial,
    )


def from_sympy(symbolic: SymbolicModel) -> MeshModel:
    """The model of equations in SymPy, for which their parameters need the names of `MeshModel.of`.

    The values may be others than those that `to_sympy` gave, and the equations may be written in another way:
    rearranged, multiplied by factors, with definitions inserted or parameters replaced by their numbers. They are
    compared with those of the model that is returned, at random times and states in all contact states.

    Parameters
    ----------
    symbolic : SymbolicModel
        E.g. ``dataclasses.replace(to_sympy(model), values=…)``.

    Returns
    -------
    MeshModel
        Parameters for which there is no value have the defaults of `MeshModel`, if the equations agree with these.

    Raises
    ------
    InputError
        If SymPy is not installed, for a symbol without value, a value without a parameter of its name, or equations
        that are not those of the model.

    Examples
    --------
    >>> from dataclasses import replace
    >>> symbolic = to_sympy(MeshModel.of(kind="single", omega=0.8, eps1=0.1))
    >>> faster = {symbol: 1.6 if symbol.name == "omega" else value for symbol, value in symbolic.values.items()}
    >>> from_sympy(replace(symbolic, values=faster)).omega
    1.6
    """
    if not isinstance(symbolic, SymbolicModel):
        raise InputError("symbolic", "must be a SymbolicModel", f"a {type(symbolic).__name__}",
                         "E.g. gearchaos.to_sympy(model).")
    names = {f.func.__name__ for f in symbolic.coordinates}
    kinds = {frozenset({"z"}): "single", frozenset({"x1", "x2"}): "torsional",
             frozenset({"x1", "x2", "y1", "y2"}): "full"}
    if frozenset(names) not in kinds:
        raise InputError("equations", "must be those of x1, x2, or of x1, x2, y1, y2, or of z", sorted(names),
                         "Other functions of τ need a definition.")
    check_symbols(symbolic)
    values = {s.name: float(v) for s, v in symbolic.values.items()}
    scalars, parts = _named(values)
    if symbolic.definitions.get(function("chi")) == 1:  # constant, and so without symbols by which it could be known
        parts = {"stiffness": HarmonicStiffness(()), **parts}
    if symbolic.definitions.get(function("epsilon")) == 0:
        parts = {"error": TransmissionError(()), **parts}
    model = MeshModel.of(kinds[frozenset(names)], **scalars, **parts, initial=symbolic.initial)
    check_equal(symbolic, to_sympy(model))
    return model


def _rows(kind: str) -> tuple[Eq, ...]:
    """The equations of motion: (2.12) of both wheels, or (2.17) with (2.18) of the relative motion."""
    sp, tau, force = sympy(), TAU(), function("S")
    if kind == "single":
        z, J1, J2 = function("z"), symbol("J1"), symbol("J2")
        q0 = symbol("q1") / J1 + symbol("q2") / J2
        return (sp.Eq(z.diff(tau, 2) + (1 / J1 + 1 / J2) * force, q0 - function("epsilon").diff(tau, 2)),)
    rows = []
    for n, sign in ((1, 1), (2, -1)):
        x, J, beta, q = function(f"x{n}"), symbol(f"J{n}"), symbol(f"beta{n}"), symbol(f"q{n}")
        rows.append(sp.Eq(J * x.diff(tau, 2) + 2 * beta * x.diff(tau) + sign * force, sign * q))
    for n, sign in ((1, 1), (2, -1)) if kind == "full" else ():
        y, mu, kappa, zeta = (function(f"y{n}"), *(symbol(f"{name}{n}") for name in SUPPORTS))
        rows.append(sp.Eq(mu * y.diff(tau, 2) + 2 * mu * zeta * y.diff(tau) + kappa * y + sign * force, 0))
    return tuple(rows)


def _definitions(model: MeshModel) -> dict[AppliedUndef, Any]:
    """The functions in the equations that are no coordinates: (2.5), (2.14), (2.13), (2.16) or (2.7), (2.15)."""
    sp, tau, z = sympy(), TAU(), function("z")
    lateral = function("y1") - function("y2") if model.kind == "full" else 0
    relative = {} if model.kind == "single" else {z: function("x1") - function("x2") + lateral - function("epsilon")}
    return {
        function("S"): 2 * symbol("zeta") * z.diff(tau) + function("chi") * function("f"),
        **relative,
        function("f"): sp.Piecewise((z - 1, z > 1), (z + 1, z < -1), (0, True)),
        function("chi"): _stiffness(model.stiffness),
        function("epsilon"): _series(len(model.error.amplitudes), "eps", "theta"),
    }


def _stiffness(stiffness: Stiffness) -> Any:
    """χ(τ) of (2.16), of (2.7), or with steps."""
    sp = sympy()
    symbols = {name: [symbol(n) for n in _numbered({name: value})] if isinstance(value, tuple) else symbol(name)
               for name, value in stiffness.numbers().items()}
    series = _series(len(stiffness.harmonics()[0]), "c", "alpha")
    parts = stiffness.parts(symbols)
    if not parts:
        return 1 + series
    share = sp.Mod(symbol("omega") * TAU() / (2 * sp.pi), 1)  # of the mesh period that has passed
    (first, _), (_, last) = parts[0], parts[-1]
    before = [] if first == 0 else [(last, share < first)]
    ends = (start for start, _ in parts[1:])
    within = [(level, share < end) for (_, level), end in zip(parts[:-1], ends, strict=True)]
    return sp.Piecewise(*before, *within, (last, True)) + series


def _series(count: int, amplitude: str, phase: str) -> Any:
    """Σ a_j cos(jωτ − p_j) with symbols for amplitudes and phases."""
    sp, angle = sympy(), symbol("omega") * TAU()
    return sum((symbol(f"{amplitude}{j}") * sp.cos(j * angle - symbol(f"{phase}{j}")) for j in range(1, count + 1)),
               sp.S.Zero)


def _numbered(numbers: Mapping[str, Any]) -> dict[str, float]:
    """Numbers by the names of their symbols: those of a list are in the singular, and have its index from 1 on."""
    out: dict[str, float] = {}
    for name, value in numbers.items():
        many = isinstance(value, tuple)
        out |= {f"{_singular(name)}{i}": v for i, v in enumerate(value, start=1)} if many else {name: value}
    return out


def _named(values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, Any]]:
    """Values by the names of symbols as arguments of `MeshModel.of`: single values, and waveforms by their field."""
    owners: dict[str, tuple[str, Any, str]] = {
        "eps": ("error", TransmissionError, "amplitudes"), "theta": ("error", TransmissionError, "phases")}
    for kind in STIFFNESS_KINDS.values():
        owners |= {_singular(kind.letters.get(field, field)): ("stiffness", kind, field) for field in kind.lists()}
    numbers: dict[str, dict[int, float]] = {}
    single = {}
    for name, value in values.items():
        found = re.fullmatch(r"([a-z]+)([1-9]\d*)", name)
        if found and found[1] in owners:
            if int(found[2]) > MAX_HARMONICS:  # as many as levels
                raise InputError("values", f"must have numbers of at most {MAX_HARMONICS} in their names", name)
            numbers.setdefault(found[1], {})[int(found[2])] = value
        else:
            single[name] = value
    parts: dict[tuple[str, Any], dict[str, tuple[float, ...]]] = {}
    for name, (part, kind_of_part, field) in owners.items():
        if name in numbers:
            parts.setdefault((part, kind_of_part), {})[field] = _list(name, numbers[name])
    return single, {  # lists without value are empty
        part: kind(**{f.name: lists.get(f.name, ()) for f in fields(kind) if "tuple" in str(f.type)})
        for (part, kind), lists in parts.items()
    }


def _singular(name: str) -> str:
    """The name of one of the numbers of a list: level of levels."""
    return name if name in HARMONICS else name.removesuffix("s")


def _list(name: str, numbers: Mapping[int, float]) -> tuple[float, ...]:
    """The values of a series by their numbers 1, 2, …, without gaps except for harmonics, which are 0 there."""
    if name not in HARMONICS and sorted(numbers) != list(range(1, len(numbers) + 1)):
        raise InputError("values", f"must have {name}1, {name}2, … without gaps", sorted(numbers))
    return tuple(numbers.get(i, 0.0) for i in range(1, max(numbers) + 1))
