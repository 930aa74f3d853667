"""Schemas of ``run/study.json`` and ``run/sums.json``, checked at every reading: they may be damaged or edited.

`gearchaos.store.running.create` and `gearchaos.store.store` write them.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BaseModel, Field, FiniteFloat, StrictInt, model_validator

from gearchaos.store.files.parsing import Positive, StrictSchema, Whole
from gearchaos.store.tiles import Grid

_Shape = Annotated[tuple[Positive, ...], Field(min_length=1, max_length=2)]
_Name = Annotated[str, Field(pattern=r"^\w+$")]


def _number_type(text: str) -> str:
    """The text, if it is the name of a NumPy dtype of numbers; otherwise raises ValueError."""
    try:
        if np.dtype(text).kind in "biufc":
            return text
    except TypeError:
        pass
    raise ValueError("must be a kind of number")


class _Grid(StrictSchema):
    """See `tiles.Grid`; format 1 has neither chunks nor groups."""

    shape: _Shape
    tile: _Shape
    chunk: _Shape | None = None
    group: _Shape | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.grid()
        return self

    def grid(self) -> Grid:
        """The grid; raises ValueError if its tiles, chunks and groups do not fit each other."""
        return Grid(self.shape, self.tile, self.chunk or (), self.group or ())


class _ArraySpec(StrictSchema):
    """See `layout.specs.ArraySpec`."""

    dtype: Annotated[str, AfterValidator(_number_type)]
    shape: tuple[Whole, ...]


class _Axis(StrictSchema):
    name: str
    start: FiniteFloat
    stop: FiniteFloat
    count: Positive


class _Budget(StrictSchema):
    """Classification settings by their names in format 1; `FORMER_NAMES` has the present ones."""

    looks: tuple[int, ...]  # lengths of the transient runs, in mesh periods
    longest: int  # longest period searched for
    exponent: int  # length of the first exponent run
    extensions: int  # doublings of that length
    patience: int  # longest transient before a motion is called chaotic
    measured: int  # periods over which response measures are averaged


class _Study(StrictSchema):
    """See `record.to_record`."""

    kind: str
    model: dict[str, Any]
    axes: tuple[_Axis, ...]
    options: dict[str, Any]
    budget: _Budget | None
    gears: dict[str, Any] | None = None
    carried_gears: dict[str, Any] | None = None


class FormatSchema(BaseModel):
    """The part of ``run/study.json`` that all versions have: the format."""

    format: StrictInt


class StudySchema(StrictSchema):
    """``run/study.json``; the values of the study are checked when it is created from its record."""

    format: int
    study: _Study
    grid: _Grid
    arrays: dict[_Name, _ArraySpec]
    versions: dict[str, str]
    machine: dict[str, Any]


Checksums = dict[str, int]
"""``run/sums.json``: the CRC-32 of each file by its path."""
