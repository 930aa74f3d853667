"""Whether equations in SymPy are those of a model, by their values at random times and states."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.interchange.symbols import TAU, sympy

if TYPE_CHECKING:
    from gearchaos.interchange.symbolic_model import SymbolicModel

_STATES, _SEED = 400, 1
"""Number of random states at which equations are compared, and the seed of the random numbers."""

_TOLERANCE = 1e-10
"""Relative difference up to which two accelerations are called equal: many times the rounding of their terms."""


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
    tau, state = _points(given, len(names))
    for name, ours, theirs in zip(names, *(_accelerations(s, tau, state) for s in (expected, given)), strict=True):
        wrong = np.abs(theirs - ours) > _TOLERANCE * (1 + np.abs(ours))
        if np.any(wrong) or not np.all(np.isfinite(theirs)):
            i = int(np.argmax(wrong))
            raise InputError(f"equation of {name}", "must be that of docs/model.md with the given values",
                             f"{name}'' = {theirs[i]:.12g} instead of {ours[i]:.12g} at τ = {tau[i]:.6g}",
                             "Print gearchaos.to_sympy(model).equations and .definitions for the form.")


def _points(symbolic: SymbolicModel, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Random times (N,) in three mesh periods, and states (2 count, N) in all contact states."""
    random = np.random.default_rng(_SEED)
    omega = next((float(v) for s, v in symbolic.values.items() if s.name == "omega"), 1.0)
    tau = random.uniform(0, 6 * math.pi / omega, _STATES)
    return tau, random.uniform(-2, 2, (2 * count, _STATES))


def _accelerations(symbolic: SymbolicModel, tau: np.ndarray, state: np.ndarray) -> list[np.ndarray]:
    """The second derivative of each coordinate at times (N,) and states (2 count, N): x, x', …, each (N,)."""
    sp, coordinates = sympy(), symbolic.coordinates
    plain = [sp.Dummy() for _ in range(2 * len(coordinates))]
    pairs = zip(coordinates, plain[::2], plain[1::2], strict=True)
    replaced: dict[Any, Any] = {}
    for f, value, rate in pairs:
        replaced |= {f.diff(TAU()): rate, f: value}
    found = symbolic.accelerations().values()
    values = {s: sp.Float(float(v), 17) for s, v in symbolic.values.items()}
    expressions = [_with_rates(e, replaced).xreplace(values) for e in found]
    compute = sp.lambdify([TAU(), *plain], expressions, "numpy", cse=True)
    return [np.broadcast_to(np.asarray(a, dtype=float), tau.shape) for a in compute(tau, *state)]


def _with_rates(expression: Any, replaced: dict[Any, Any]) -> Any:
    """An expression with derivatives replaced first, then the functions themselves."""
    rates = {k: v for k, v in replaced.items() if k.is_Derivative}
    return expression.xreplace(rates).xreplace({k: v for k, v in replaced.items() if not k.is_Derivative})
