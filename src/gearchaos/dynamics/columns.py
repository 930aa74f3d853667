"""Tables of arrays over many motions, whose columns are declared once: meaning, type, dimensions, name in results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, Self, get_args, get_type_hints

import numpy as np

MOTION = "motion"
"""Name of the dimension along which the motions lie."""


@dataclass(frozen=True)
class Column:
    """Declaration of a column.

    Attributes
    ----------
    meaning : str
        What it is, with its unit.
    dtype : type
        Type of the array.
    dims : tuple of str
        Names of its dimensions.
    missing : scalar
        Value where nothing is known.
    variable : str or None
        Name of the variable in results that it becomes; None for a column that results do not contain.
    stored : type or None
        Type of that variable, if it is another one.
    reduce : callable or None
        Function of the array that gives the values (L,) of the variable, if they are not the array itself.
    """

    meaning: str
    dtype: type = float
    dims: tuple[str, ...] = (MOTION,)
    missing: Any = np.nan
    variable: str | None = None
    stored: type | None = None
    reduce: Callable[[np.ndarray], np.ndarray] | None = None

    def empty(self, sizes: Mapping[str, int]) -> np.ndarray:
        """An array of missing values."""
        return np.full([sizes[dim] for dim in self.dims], self.missing, self.dtype)

    def index(self, motions: Any) -> tuple[Any, ...]:
        """The index of some motions into the array."""
        return tuple(motions if dim == MOTION else slice(None) for dim in self.dims)


@dataclass
class Columns:
    """Base of tables.

    Each field of a derived dataclass is a column, ``name: Annotated[np.ndarray, Column(...)]``, or another table of
    the same motions, ``name: Table``.
    """

    @classmethod
    @cache
    def _kinds(cls) -> dict[str, Column | type[Columns]]:
        """The declaration of each field, or the class of the table it is."""
        hints = get_type_hints(cls, include_extras=True)
        return {f.name: (get_args(hints[f.name]) or (None, hints[f.name]))[1] for f in fields(cls)}

    @classmethod
    def declared(cls) -> dict[str, Column]:
        """The declarations of all columns by name, those of nested tables included."""
        out: dict[str, Column] = {}
        for name, kind in cls._kinds().items():
            out |= {name: kind} if isinstance(kind, Column) else kind.declared()
        return out

    @classmethod
    def empty(cls, sizes: Mapping[str, int]) -> Self:
        """A table of missing values; ``sizes`` are those of the dimensions by name."""
        return cls(**{name: kind.empty(sizes) for name, kind in cls._kinds().items()})

    def __getitem__(self, name: str) -> np.ndarray:
        """A column by its name, of this table or a nested one; raises `KeyError`."""
        for own, kind in self._kinds().items():
            if isinstance(kind, Column):
                if own == name:
                    return getattr(self, name)
            elif name in kind.declared():
                return getattr(self, own)[name]
        raise KeyError(name)

    def take(self, motions: Any) -> Self:
        """A copy of the table for some motions."""
        values = {}
        for name, kind in self._kinds().items():
            value = getattr(self, name)
            values[name] = value[kind.index(motions)].copy() if isinstance(kind, Column) else value.take(motions)
        return type(self)(**values)

    def put(self, motions: Any, other: Self) -> None:
        """Overwrite some motions by those of another table."""
        for name, kind in self._kinds().items():
            if isinstance(kind, Column):
                getattr(self, name)[kind.index(motions)] = getattr(other, name)
            else:
                getattr(self, name).put(motions, getattr(other, name))

    def variables(self, *, double: bool = False) -> dict[str, np.ndarray]:
        """The variables (L,) that results contain, by the names and with the types that they have there.

        With ``double``, those that results store in single precision are in double precision.
        """
        out: dict[str, np.ndarray] = {}
        for name, column in self.declared().items():
            if column.variable is not None:
                values = self[name] if column.reduce is None else column.reduce(self[name])
                kind = column.stored or column.dtype
                out[column.variable] = values.astype(float if double and kind is np.float32 else kind, copy=False)
        return out
