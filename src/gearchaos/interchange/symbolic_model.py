"""The equations of a gear mesh in SymPy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError
from gearchaos.interchange.symbols import COORDINATES, TAU, sympy

if TYPE_CHECKING:
    from sympy import Basic, Eq, Expr, Symbol
    from sympy.core.function import AppliedUndef


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
        _check_equations(self.equations)
        _check_values(self.values)
        object.__setattr__(self, "equations", tuple(self.equations))
        for name in ("definitions", "values", "initial"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @property
    def coordinates(self) -> tuple[AppliedUndef, ...]:
        """The functions of τ without definition, x1, x2, y1, y2, z first."""
        written = (*self.equations, *self.definitions.values())
        found = {f.func.__name__: f for e in written for f in e.atoms(sympy().core.function.AppliedUndef)}
        known = {f.func.__name__ for f in self.definitions}
        return tuple(found[n] for n in sorted(found, key=_position) if n not in known)

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


def _check_equations(equations: Any) -> None:
    """Raise `InputError` unless these are equations."""
    if not isinstance(equations, Sequence) or not equations or not all(
            isinstance(equation, sympy().Eq) for equation in equations):
        raise InputError("equations", "must be a sequence of sympy.Eq", equations, "E.g. [sympy.Eq(left, right)].")


def _check_values(values: Mapping[Any, Any]) -> None:
    """Raise `InputError` unless these are real numbers by symbol."""
    for symbol, value in values.items():
        if not isinstance(symbol, sympy().Symbol):
            raise InputError("values", "must have symbols of SymPy as keys", symbol,
                             "Use those of gearchaos.to_sympy(model).")
        try:
            float(value)
        except (TypeError, ValueError):
            raise InputError("values", "must be real numbers", f"{symbol} = {value}") from None


def _position(name: str) -> tuple[int, str]:
    """The place of a function among the coordinates; unknown ones are last."""
    return COORDINATES.index(name) if name in COORDINATES else len(COORDINATES), name
