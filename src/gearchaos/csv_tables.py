"""Results as tables of text, CSV: a row for each cell, column, point or event, units in the header."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.files import check_target, partial_file

if TYPE_CHECKING:
    import xarray as xr

# units that are not those of SI: the unit of SI, and how many of them it is
_SI = {"µm": ("m", 1e6), "mm/s": ("m/s", 1e3), "µrad": ("rad", 1e6), "mrad/s": ("rad/s", 1e3), "ms": ("s", 1e3),
       "rpm": ("rad/s", 30 / math.pi)}
_ROWS = 20_000  # most rows of a table that are in memory at once, if the caller does not say how many


def save_csv(
    dataset: xr.Dataset, path: Path, convert: Callable[[xr.Dataset], xr.Dataset] = lambda part: part, step: int = 0,
) -> list[Path]:
    """Write a Dataset as CSV, a file for each set of dimensions of its variables; all appear, or none does.

    The file at ``path`` has the variables with the dimensions of the first one. Those over other dimensions, e.g.
    ``number``, have a file with that name in its own: ``x_number.csv``; those over none have ``x_values.csv``. All are
    returned, ``path`` first. ``convert`` is applied to each part that is written; it may change values and attributes,
    but no names and dimensions. ``step`` is the size of these parts along the first dimension; by default that of about
    `_ROWS` rows.
    """
    tables: dict[tuple[str, ...], list[str]] = {}
    for name, variable in dataset.data_vars.items():
        tables.setdefault(tuple(map(str, variable.dims)), []).append(str(name))
    out = [path, *(path.with_stem(f"{path.stem}_{'_'.join(dims) or 'values'}") for dims in [*tables][1:])]
    for each in out:
        check_target("path", each)
    with ExitStack() as stack:
        partials = [
            stack.enter_context(partial_file(file, map(str.encode, _lines(dataset[names], dims, convert, step)), False))
            for file, (dims, names) in zip(out, tables.items(), strict=True)]
        for partial, file in zip(partials, out, strict=True):
            os.replace(partial, file)
    return out


def _lines(
    dataset: xr.Dataset, dims: tuple[str, ...], convert: Callable[[xr.Dataset], xr.Dataset], step: int
) -> Iterator[str]:
    """The text of a table, part by part along the first dimension; coordinates are repeated in every row."""
    shape = tuple(dataset.sizes[dim] for dim in dims)
    step = step or max(1, _ROWS // max(1, math.prod(shape[1:])))
    for start in range(0, max(1, shape[0]), step) if dims else [0]:
        part = convert(dataset.isel({dims[0]: slice(start, start + step)}) if dims else dataset)
        sizes = {dim: part.sizes[dim] for dim in dims}
        columns: dict[str, list[str]] = {}
        for name in dims:
            if name not in part.coords:
                first = start if name == dims[0] else 0
                part = part.assign_coords({name: np.arange(first, first + sizes[name])})
        for name in (*dims, *(n for n in part.coords if n not in dims), *part.data_vars):
            if set(part[name].dims) <= set(dims):
                columns |= _columns(str(name), part[name], sizes)
        text = io.StringIO()
        rows = csv.writer(text, lineterminator="\n")
        if start == 0:
            rows.writerow(columns)
        rows.writerows(zip(*columns.values(), strict=True))
        yield text.getvalue()


def _columns(name: str, array: xr.DataArray, sizes: dict[str, int]) -> dict[str, list[str]]:
    """The columns of a variable by their titles: codes in words, a value in its unit and, if it is another, in SI."""
    values, attrs = array.variable.set_dims(sizes).values.ravel(), array.attrs
    if "flag_values" in attrs:
        words = dict(zip(np.atleast_1d(attrs["flag_values"]).tolist(), attrs["flag_meanings"].split(), strict=True))
        return {name: [words.get(code, "").replace("_", " ") for code in values.tolist()]}
    unit = attrs.get("units")
    if unit is None or values.dtype.kind not in "biuf":
        return {name: [*map(str, values.tolist())]}
    out = {f"{name} [{unit.replace('µ', 'u')}]": _texts(values)}
    if unit in _SI:
        si, number = _SI[unit]
        out[f"{name} [{si}]"] = _texts(values / values.dtype.type(number))
    return out


def _texts(values: np.ndarray) -> list[str]:
    """Numbers with all their digits; an empty text for NaN."""
    return np.where(values == values, values.astype(str), "").tolist()
