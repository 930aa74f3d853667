"""Tables of arrays over many motions: base class of `Verdicts` and `Response`.

Each column is declared once, with its meaning, type, dimensions and the variable that it becomes in results.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Self, get_args, get_type_hints

import numpy as np

MOTION = "motion"
"""Name of the dimension of the L motions."""


@dataclass(frozen=True)
class Column:
    """Declaration of a column.

    Attributes
    ----------
    meaning : str
        Quantity in the column, with its unit.
    dtype : type
        Type of the array.
    dims : tuple of str
        Names of its dimensions.
    missing : scalar
        Value of an element that is not computed.
    variable : str or None
        Name of the variable in results; None for a column that results do not contain.
    stored : type or None
        Type of that variable where it differs from ``dtype``.
    reduce : callable or None
        Function from the array to the values (L,) of the variable; None where they are the array itself.
    """

    meaning: str
    dtype: type = float
    dims: tuple[str, ...] = (MOTION,)
    missing: Any = np.nan
    variable: str | None = None
    stored: type | None = None
    reduce: Callable[[np.ndarray], np.ndarray] | None = None

    def empty(self, sizes: Mapping[str, int]) -> np.ndarray:
        """An array of missing values; ``sizes`` are those of the dimensions by name."""
        return np.full([sizes[dim] for dim in self.dims], self.missing, self.dtype)

    def index(self, motions: Any) -> tuple[Any, ...]:
        """Index of the array for a selection of motions, given as an index of the motion dimension."""
        return tuple(motions if dim == MOTION else slice(None) for dim in self.dims)


@dataclass
class Columns:
    """Base class of tables.

    Each field of a derived dataclass is a column, ``name: Annotated[np.ndarray, Column(...)]``, or another table of
    the same motions, ``name: Table``.
    """

    @classmethod
    @cache
    def _declarations(cls) -> dict[str, Column | type[Columns]]:
        """By field, the declaration of the column, or the class of the nested table."""
        hints = get_type_hints(cls, include_extras=True)
        return {f.name: (get_args(hints[f.name]) or (None, hints[f.name]))[1] for f in fields(cls)}

    @classmethod
    def declared(cls) -> dict[str, Column]:
        """The declarations of all columns by name, those of nested tables included."""
        out: dict[str, Column] = {}
        for name, declaration in cls._declarations().items():
            out |= {name: declaration} if isinstance(declaration, Column) else declaration.declared()
        return out

    @classmethod
    def empty(cls, sizes: Mapping[str, int]) -> Self:
        """A table of missing values; ``sizes`` are those of the dimensions by name."""
        return cls(**{name: declaration.empty(sizes) for name, declaration in cls._declarations().items()})

    def __getitem__(self, name: str) -> np.ndarray:
        """The column of this name in this table or a nested one; raises `KeyError` if there is none."""
        for field, declaration in self._declarations().items():
            if isinstance(declaration, Column):
                if field == name:
                    return getattr(self, name)
            elif name in declaration.declared():
                return getattr(self, field)[name]
        raise KeyError(name)

    def take(self, motions: Any) -> Self:
        """A copy of the table for a selection of motions, given as an index of the motion dimension."""
        values = {}
        for name, declaration in self._declarations().items():
            value = getattr(self, name)
            if isinstance(declaration, Column):
                values[name] = value[declaration.index(motions)].copy()
            else:
                values[name] = value.take(motions)
        return type(self)(**values)

    def put(self, motions: Any, other: Self) -> None:
        """Overwrite a selection of motions with those of another table, which has as many motions as are selected."""
        for name, declaration in self._declarations().items():
            if isinstance(declaration, Column):
                getattr(self, name)[declaration.index(motions)] = getattr(other, name)
            else:
                getattr(self, name).put(motions, getattr(other, name))

    def variables(self, *, double: bool = False) -> dict[str, np.ndarray]:
        """The variables (L,) of results, by name and with the types that results store.

        With ``double`` the variables stored in single precision are returned in double precision.
        """
        out: dict[str, np.ndarray] = {}
        for name, column in self.declared().items():
            if column.variable is not None:
                values = self[name] if column.reduce is None else column.reduce(self[name])
                dtype = column.stored or column.dtype
                out[column.variable] = values.astype(float if double and dtype is np.float32 else dtype, copy=False)
        return out
