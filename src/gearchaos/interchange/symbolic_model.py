"""The equations of a gear mesh in SymPy: symbols, the model as a value, and whether two of them agree."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError

if TYPE_CHECKING:
    from sympy import Basic, Eq, Expr, Symbol
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


def TAU() -> Any:  # the letter of time in the equations
    """The symbol of the time τ."""
    return sympy().Symbol("tau", real=True)


def symbol(name: str) -> Any:
    """The symbol of a parameter."""
    return sympy().Symbol(name, real=True)


def function(name: str) -> Any:
    """The function of τ with this name."""
    return sympy().Function(name)(TAU())


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
        for symbol, value in self.values.items():
            if not isinstance(symbol, sympy().Symbol):
                raise InputError("values", "must have symbols of SymPy as keys", symbol,
                                 "Use those of gearchaos.to_sympy(model).")
            try:
                float(value)
            except (TypeError, ValueError):
                raise InputError("values", "must be real numbers", f"{symbol} = {value}") from None
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

        All definitions are inserted; the parameters remain symbols.

        Raises
        ------
        InputError
            If the equations do not determine the second derivatives.
        """
        sp, coordinates = sympy(), self.coordinates
        unknown = [sp.Dummy(f"a_{f.func.__name__}") for f in coordinates]
        second = {f.diff(TAU(), 2): a for f, a in zip(coordinates, unknown, strict=True)}
        rows = sp.Matrix([_inserted(e.lhs - e.rhs, self.definitions).xreplace(second) for e in self.equations])
        matrix = rows.jacobian(unknown)
        if matrix.rows != matrix.cols or matrix.atoms(sp.Dummy) or matrix.det() == 0:
            raise InputError("equations", "must determine the second derivative of each coordinate", self.equations,
                             f"There are {len(self.equations)} equations for {', '.join(map(str, coordinates))}.")
        rest = rows.xreplace(dict.fromkeys(unknown, sp.S.Zero))
        return dict(zip(coordinates, -matrix.LUsolve(rest), strict=True))


def _inserted(expression: Basic, definitions: Mapping[AppliedUndef, Expr]) -> Basic:
    """An expression with definitions inserted until none of their functions is left, and derivatives carried out."""
    for _ in range(len(definitions) + 1):
        expression = expression.subs(definitions).doit()
    if circular := expression.atoms(*map(type, definitions)) & set(definitions):
        raise InputError("definitions", "must not lead back to themselves", ", ".join(sorted(map(str, circular))))
    return expression


_STATES, _SEED = 400, 1  # number of random states at which equations are compared, and the seed of the random numbers
# Relative difference up to which two accelerations are called equal: many times the rounding of their terms:
_TOLERANCE = 1e-10


def check_symbols(symbolic: SymbolicModel) -> None:
    """Raise `InputError` if the equations contain a symbol that has no value."""
    free = set().union(*(e.free_symbols for e in (*symbolic.equations, *symbolic.definitions.values())))
    missing = sorted(s.name for s in free - set(symbolic.values) - {TAU()})
    if missing:
        raise InputError("values", "must have a value for each symbol of the equations", missing,
                         "Symbols are compared by name and assumptions: use those of gearchaos.to_sympy(model).")


def check_equal(given: SymbolicModel, expected: SymbolicModel) -> None:
    """Raise `InputError` unless both have the same accelerations at random times and states."""
    names = [f.func.__name__ for f in given.coordinates]
    random = np.random.default_rng(_SEED)
    omega = next((float(v) for s, v in given.values.items() if s.name == "omega"), 1.0)
    tau = random.uniform(0, 6 * math.pi / omega, _STATES)  # in three mesh periods
    state = random.uniform(-2, 2, (2 * len(names), _STATES))  # in all contact states
    for name, ours, theirs in zip(names, *(_accelerations(s, tau, state) for s in (expected, given)), strict=True):
        wrong = np.abs(theirs - ours) > _TOLERANCE * (1 + np.abs(ours))
        if np.any(wrong) or not np.all(np.isfinite(theirs)):
            i = int(np.argmax(wrong))
            raise InputError(f"equation of {name}", "must be that of docs/model.md with the given values",
                             f"{name}'' = {theirs[i]:.12g} instead of {ours[i]:.12g} at τ = {tau[i]:.6g}",
                             "Print gearchaos.to_sympy(model).equations and .definitions for the form.")


def _accelerations(symbolic: SymbolicModel, tau: np.ndarray, state: np.ndarray) -> list[np.ndarray]:
    """The second derivative of each coordinate at times (N,) and states (2 count, N): x, x', …, each (N,)."""
    sp, coordinates = sympy(), symbolic.coordinates
    plain = [sp.Dummy() for _ in range(2 * len(coordinates))]
    values = dict(zip(coordinates, plain[::2], strict=True))
    rates = {f.diff(TAU()): rate for f, rate in zip(coordinates, plain[1::2], strict=True)}
    numbers = {s: sp.Float(float(v), 17) for s, v in symbolic.values.items()}
    expressions = [e.xreplace(rates).xreplace(values).xreplace(numbers) for e in symbolic.accelerations().values()]
    compute = sp.lambdify([TAU(), *plain], expressions, "numpy", cse=True)
    return [np.broadcast_to(np.asarray(a, dtype=float), tau.shape) for a in compute(tau, *state)]
