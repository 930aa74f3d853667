"""A model's equations in SymPy: the model as a value there, from it and back, and whether two of them agree."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import (
    DAMPING_LAWS,
    SCALARS,
    STIFFNESS_KINDS,
    SUPPORTS,
    DampingLaw,
    HarmonicStiffness,
    MeshModel,
    Stiffness,
    check_is_pair,
    has_effect,
)
from gearchaos.model.waveforms import TransmissionError, harmonics
from gearchaos.quantities import HARMONICS
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from sympy import Eq, Expr, Symbol
    from sympy.core.function import AppliedUndef

# The functions of τ that may be coordinates; z is none where it has a definition:
COORDINATES = ("x1", "x2", "y1", "y2", "z")


def sympy() -> Any:
    """The module `sympy`; raises `InputError` if it is not installed."""
    try:
        import sympy as module
    except ImportError:
        raise InputError("SymPy", "must be installed for symbolic equations", "missing",
                         'Run: pip install "gearchaos[sympy]".') from None
    return module


def symbol(name: str) -> Any:
    """The symbol of a parameter, or of the time τ, ``tau``."""
    return sympy().Symbol(name, real=True)


def function(name: str) -> Any:
    """The function of τ with this name."""
    return sympy().Function(name)(symbol("tau"))


@dataclass(frozen=True)
class SymbolicModel:
    """The equations of a gear mesh in SymPy.

    Attributes
    ----------
    equations : tuple of sympy.Eq
        The equations of motion: the rows of (2.12) for x1(τ), x2(τ) and, in the full model, y1(τ), y2(τ); (2.17) for
        z(τ) in the single model.
    definitions : mapping of sympy function of τ to sympy.Expr
        The functions in the equations that are no coordinates: the mesh force S, the relative displacement z, the
        backlash function f, the mesh stiffness chi and the transmission error epsilon. A definition may contain others.
    values : mapping of sympy.Symbol to float
        The parameters by their symbols, whose names are those of `MeshModel.of`; the levels of a stepped stiffness are
        level1, start1, level2, ….
    initial : mapping of str to float
        Initial values by name of coordinate, as in `MeshModel`.

    Raises
    ------
    InputError
        If SymPy is not installed, for what is no equation, or for values that are no real numbers.

    Examples
    --------
    >>> import gearchaos as gc
    >>> symbolic = gc.to_sympy(gc.MeshModel.of(kind="torsional", omega=0.8, eps1=0.1))
    >>> len(symbolic.equations), [str(f) for f in symbolic.coordinates]
    (2, ['x1(tau)', 'x2(tau)'])
    """

    equations: tuple[Eq, ...]
    definitions: Mapping[AppliedUndef, Expr]
    values: Mapping[Symbol, float]
    initial: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.equations, Sequence) or not self.equations or not all(
                isinstance(equation, sympy().Eq) for equation in self.equations):
            raise InputError("equations", "must be a sequence of sympy.Eq", self.equations,
                             "E.g. [sympy.Eq(left, right)].")
        for key, value in self.values.items():
            if not isinstance(key, sympy().Symbol):
                raise InputError("values", "must have symbols of SymPy as keys", key,
                                 "Use those of gearchaos.to_sympy(model).")
            try:
                float(value)
            except (TypeError, ValueError):
                raise InputError("values", "must be real numbers", f"{key} = {value}") from None
        object.__setattr__(self, "equations", tuple(self.equations))
        for name in ("definitions", "values", "initial"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def coordinates(self) -> tuple[AppliedUndef, ...]:
        """The functions of τ without definition, x1, x2, y1, y2, z first."""
        written = (*self.equations, *self.definitions.values())
        found = {f.func.__name__: f for e in written for f in e.atoms(sympy().core.function.AppliedUndef)}
        known = {f.func.__name__ for f in self.definitions}
        order = [*COORDINATES, *sorted(found.keys() - {*COORDINATES})]
        return tuple(found[n] for n in order if n in found and n not in known)

    def accelerations(self) -> dict[AppliedUndef, Expr]:
        """The second derivative of each coordinate as a function of τ, the coordinates and their first derivatives.

        All definitions are inserted; the parameters remain symbols. Raises `InputError` if the equations do not
        determine the second derivatives.
        """
        sp, coordinates = sympy(), self.coordinates
        unknown = [sp.Dummy(f"a_{f.func.__name__}") for f in coordinates]
        second = {f.diff(symbol("tau"), 2): a for f, a in zip(coordinates, unknown, strict=True)}
        written = [e.lhs - e.rhs for e in self.equations]
        for _ in range(len(self.definitions) + 1):  # until no function with a definition is left
            written = [each.subs(self.definitions).doit() for each in written]
        left = set().union(*(each.atoms(*map(type, self.definitions)) for each in written))
        if circular := left & set(self.definitions):
            raise InputError("definitions", "must not lead back to themselves", ", ".join(sorted(map(str, circular))))
        rows = sp.Matrix([each.xreplace(second) for each in written])
        matrix = rows.jacobian(unknown)
        if matrix.rows != matrix.cols or matrix.atoms(sp.Dummy) or matrix.det() == 0:
            raise InputError("equations", "must determine the second derivative of each coordinate", self.equations,
                             f"There are {len(self.equations)} equations for {', '.join(map(str, coordinates))}.")
        rest = rows.xreplace(dict.fromkeys(unknown, sp.S.Zero))
        return dict(zip(coordinates, -matrix.LUsolve(rest), strict=True))


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
        If SymPy is not installed, for what is no model, or where tooth pairs share the load.

    Examples
    --------
    >>> symbolic = to_sympy(MeshModel.of(kind="single", omega=0.8, eps1=0.1))
    >>> [str(f) for f in symbolic.coordinates]
    ['z(tau)']
    >>> from_sympy(symbolic) == MeshModel.of(kind="single", omega=0.8, eps1=0.1)
    True
    """
    found = as_model(model)
    check_is_pair(found, "SymPy")
    found.stiffness.check_one_spring("SymPy")
    values = {name: getattr(found, name) for name in SCALARS if has_effect(name, found.kind)}
    values |= {**harmonics(found.error, "eps", "theta"), **_numbered(found.stiffness.numbers())}
    sp, z = sympy(), function("z")
    lateral = function("y1") - function("y2") if found.kind == "full" else 0
    relative = {} if found.kind == "single" else {z: function("x1") - function("x2") + lateral - function("epsilon")}
    definitions = {
        function("S"): _mesh_force(found.law), **relative,  # (2.5), (2.14)
        function("f"): sp.Piecewise((z - 1, z > 1), (z + 1, z < -1), (0, True)),  # (2.13)
        function("chi"): _stiffness(found.stiffness),  # (2.16) or (2.7)
        function("epsilon"): _series(len(found.error.amplitudes), "eps", "theta")}  # (2.15)
    return SymbolicModel(_rows(found.kind), definitions, {symbol(name): value for name, value in values.items()},
                         found.initial)


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
    names = sorted(f.func.__name__ for f in symbolic.coordinates)
    kind = {("z",): "single", ("x1", "x2"): "torsional", ("x1", "x2", "y1", "y2"): "full"}.get(tuple(names))
    if kind is None:
        raise InputError("equations", "must be those of x1, x2, or of x1, x2, y1, y2, or of z", names,
                         "Other functions of τ need a definition.")
    free = set().union(*(e.free_symbols for e in (*symbolic.equations, *symbolic.definitions.values())))
    if missing := sorted(s.name for s in free - set(symbolic.values) - {symbol("tau")}):
        raise InputError("values", "must have a value for each symbol of the equations", missing,
                         "Symbols are compared by name and assumptions: use those of gearchaos.to_sympy(model).")
    scalars, parts = _named({s.name: float(v) for s, v in symbolic.values.items()})
    if symbolic.definitions.get(function("chi")) == 1:  # constant, and so without symbols by which it could be known
        parts = {"stiffness": HarmonicStiffness(()), **parts}
    if symbolic.definitions.get(function("epsilon")) == 0:
        parts = {"error": TransmissionError(()), **parts}
    model, errors = MeshModel.of(kind, **scalars, **parts, initial=symbolic.initial), []
    force = symbolic.definitions.get(function("S"))
    for law in sorted(DAMPING_LAWS.own.values(), key=lambda law: force != _mesh_force(law)):
        found = model.with_values({"damping_law": law.name})
        try:
            _check_equal(symbolic, to_sympy(found))
        except InputError as error:
            errors.append(error)
        else:
            return found
    raise errors[0]


def _rows(kind: str) -> tuple[Eq, ...]:
    """The equations of motion: (2.12) of both wheels, or (2.17) with (2.18) of the relative motion."""
    sp, tau, force = sympy(), symbol("tau"), function("S")
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


def _mesh_force(law: DampingLaw) -> Any:
    """The mesh force S of (2.5), whose damping may act in contact alone, or in a contact that never pulls."""
    sp, z = sympy(), function("z")
    zeta = symbol("zeta") * (law.coefficient(symbol("omega")) if law.acts_as else 1)
    force = 2 * zeta * z.diff(symbol("tau")) + function("chi") * function("f")
    if not law.in_contact:
        return force
    front, back = (sp.Max(0, force), sp.Min(0, force)) if law.releases else (force, force)
    return sp.Piecewise((front, z > 1), (back, z < -1), (0, True))


def _stiffness(stiffness: Stiffness) -> Any:
    """χ(τ) of (2.16), of (2.7), or with steps."""
    sp = sympy()
    symbols = {name: [symbol(n) for n in _numbered({name: value})] if isinstance(value, tuple) else symbol(name)
               for name, value in stiffness.numbers().items()}
    series = _series(len(stiffness.harmonics()[0]), "c", "alpha")
    parts = stiffness.parts(symbols)
    if not parts:
        return 1 + series
    share = sp.Mod(symbol("omega") * symbol("tau") / (2 * sp.pi), 1)  # of the mesh period that has passed
    (first, _), (_, last) = parts[0], parts[-1]
    before = [] if first == 0 else [(last, share < first)]
    ends = (start for start, _ in parts[1:])
    within = [(level, share < end) for (_, level), end in zip(parts[:-1], ends, strict=True)]
    return sp.Piecewise(*before, *within, (last, True)) + series


def _series(count: int, amplitude: str, phase: str) -> Any:
    """Σ a_j cos(jωτ − p_j) with symbols for amplitudes and phases."""
    sp, angle = sympy(), symbol("omega") * symbol("tau")
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
    for kind in (kind for kind in STIFFNESS_KINDS.own.values() if not kind.shared):
        owners |= {_singular(kind.letters.get(key, key)): ("stiffness", kind, key) for key in kind.lists()}
    single, numbers = {}, dict[str, dict[int, float]]()
    for name, value in values.items():
        found = re.fullmatch(r"([a-z]+)([1-9]\d*)", name)
        if found and found[1] in owners:
            if int(found[2]) > MAX_HARMONICS:  # as many as levels
                raise InputError("values", f"must have numbers of at most {MAX_HARMONICS} in their names", name)
            numbers.setdefault(found[1], {})[int(found[2])] = value
        else:
            single[name] = value
    parts: dict[tuple[str, Any], dict[str, tuple[float, ...]]] = {}
    for name, (part, kind, key) in owners.items():
        if name in numbers:  # without gaps, except for harmonics: they are 0 there
            given = numbers[name]
            if name not in HARMONICS and sorted(given) != list(range(1, len(given) + 1)):
                raise InputError("values", f"must have {name}1, {name}2, … without gaps", sorted(given))
            parts.setdefault((part, kind), {})[key] = tuple(given.get(i, 0.0) for i in range(1, max(given) + 1))
    return single, {  # lists without value are empty
        part: kind(**{f.name: lists.get(f.name, ()) for f in fields(kind) if "tuple" in str(f.type)})
        for (part, kind), lists in parts.items()
    }


def _singular(name: str) -> str:  # level of levels
    return name if name in HARMONICS else name.removesuffix("s")


_STATES, _SEED = 400, 1  # number of random states at which equations are compared, and the seed of the random numbers
# Relative difference up to which two accelerations are called equal: many times the rounding of their terms:
_TOLERANCE = 1e-10


def _check_equal(given: SymbolicModel, expected: SymbolicModel) -> None:
    """Raise `InputError` unless both have the same accelerations at random times and states."""
    names = [f.func.__name__ for f in given.coordinates]
    random = np.random.default_rng(_SEED)
    omega = next((float(v) for s, v in given.values.items() if s.name == "omega"), 1.0)
    tau = random.uniform(0, 6 * math.pi / omega, _STATES)  # in three mesh periods
    state = random.uniform(-2, 2, (2 * len(names), _STATES))  # in all contact states
    sp, found = sympy(), []  # the second derivative of each coordinate, (N,), by both
    for each in (expected, given):
        plain = [sp.Dummy() for _ in range(2 * len(names))]  # x, x', …
        values = dict(zip(each.coordinates, plain[::2], strict=True))
        rates = {f.diff(symbol("tau")): rate for f, rate in zip(each.coordinates, plain[1::2], strict=True)}
        numbers = {s: sp.Float(float(v), 17) for s, v in each.values.items()}
        terms = [e.xreplace(rates).xreplace(values).xreplace(numbers) for e in each.accelerations().values()]
        compute = sp.lambdify([symbol("tau"), *plain], terms, "numpy", cse=True)
        found.append([np.broadcast_to(np.asarray(a, dtype=float), tau.shape) for a in compute(tau, *state)])
    for name, ours, theirs in zip(names, *found, strict=True):
        wrong = np.abs(theirs - ours) > _TOLERANCE * (1 + np.abs(ours))
        if np.any(wrong) or not np.all(np.isfinite(theirs)):
            i = int(np.argmax(wrong))
            raise InputError(f"equation of {name}", "must be that of docs/model.md with the given values",
                             f"{name}'' = {theirs[i]:.12g} instead of {ours[i]:.12g} at τ = {tau[i]:.6g}",
                             "Print gearchaos.to_sympy(model).equations and .definitions for the form.")
