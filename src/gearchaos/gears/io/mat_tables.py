"""MAT-files of version 5 as tables: a column for each variable of numbers, also within structures."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from gearchaos.errors import InputError


def mat_rows(content: bytes, path: str, field: str) -> list[list[str]]:
    """The header and the rows of the table that the variables of a MAT-file are.

    A variable is a column by its name, a field of a structure by ``name.field``, the columns of a matrix by ``name 1``,
    ``name 2``, …. Their length is the one that most of them have, the greater one of two alike; single numbers hold in
    all rows, and others are left out. Names have no units. Raises `InputError` for a file that cannot be read, or that
    has no variable with two numbers or more.
    """
    from scipy.io import loadmat  # here, since it takes a third of a second to load

    try:
        variables = loadmat(io.BytesIO(content), squeeze_me=True)
    except Exception as error:  # scipy raises many for a damaged file
        raise InputError(field, "must be a MAT-file that can be read", path, f"{error}.") from None
    columns = {name: values for key, value in variables.items() if not key.startswith("__")
               for name, values in _columns(key, value)}
    lengths = Counter(values.size for values in columns.values() if values.size > 1)
    if not lengths:
        raise InputError(field, "must have variables with two numbers or more", path,
                         f"It has {', '.join(columns) or 'no numbers'}.")
    length = max(lengths, key=lambda n: (lengths[n], n))
    kept = {name: np.broadcast_to(values, length) for name, values in columns.items() if values.size in (1, length)}
    return [[*kept], *([*map(repr, row)] for row in np.stack([*kept.values()], axis=1).tolist())]


def _columns(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """The columns (rows,) of a variable by their names."""
    value = np.asarray(value)
    if value.dtype.names and not value.shape:
        for key in value.dtype.names:
            yield from _columns(f"{name}.{key}", value[key].item())
    elif value.dtype.kind in "fiub" and value.ndim < 3:
        table = value.reshape(len(value), -1) if value.ndim else value.reshape(1, 1)
        if table.shape[0] < table.shape[1]:
            table = table.T
        for i, column in enumerate(table.T.astype(float), 1):
            yield f"{name} {i}" if table.shape[1] > 1 else name, column
