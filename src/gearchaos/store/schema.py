"""Schemas of the JSON files of a store, checked wherever they are read: a disk or an editor may have changed them.

`gearchaos.store.create` and `gearchaos.store.store` write them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictInt,
    TypeAdapter,
    ValidationError,
    model_validator,
)

from gearchaos.files import read_bytes

_MOST = 2**31 - 1
_Whole = Annotated[int, Field(ge=0, le=_MOST)]
_Positive = Annotated[int, Field(ge=1, le=_MOST)]
_Seconds = Annotated[float, Field(ge=0, le=1e12)]
_Shape = Annotated[tuple[_Positive, ...], Field(min_length=1, max_length=2)]
_Name = Annotated[str, Field(pattern=r"^\w+$")]


def _number_type(text: str) -> str:
    """The name of a number type of NumPy."""
    try:
        if np.dtype(text).kind in "biufc":
            return text
    except TypeError:
        pass
    raise ValueError("must be a kind of number")


class _Schema(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class TileStatusSchema(_Schema):
    """``run/tiles/<number>.json``; see `store.TileStatus`."""

    done: bool
    seconds: _Seconds
    machine: str
    attempt: _Positive
    error: str | None
    at: _Seconds


class _Grid(_Schema):
    shape: _Shape
    tile: _Shape

    @model_validator(mode="after")
    def _alike(self) -> Self:
        if len(self.shape) != len(self.tile):
            raise ValueError("must have as many sizes of tiles as of the grid")
        return self


class _Layout(_Schema):
    dtype: Annotated[str, AfterValidator(_number_type)]
    shape: tuple[_Whole, ...]


class _Axis(_Schema):
    name: str
    start: FiniteFloat
    stop: FiniteFloat
    count: _Positive


class _Budget(_Schema):
    looks: tuple[int, ...]
    longest: int
    exponent: int
    extensions: int
    patience: int
    measured: int


class _Study(_Schema):
    kind: str
    model: dict[str, Any]
    axes: tuple[_Axis, ...]
    options: dict[str, Any]
    budget: _Budget | None


class FormatSchema(BaseModel):
    """The format number in ``run/study.json`` of any version."""

    format: StrictInt


class StudySchema(_Schema):
    """``run/study.json``; the study itself is checked when it is made from its record."""

    format: int
    study: _Study
    grid: _Grid
    arrays: dict[_Name, _Layout]
    versions: dict[str, str]
    machine: dict[str, Any]


Checksums = dict[str, int]
"""``run/sums.json``."""

Schema = TypeVar("Schema")


def read_as(schema: type[Schema], path: Path) -> Schema | None:
    """The content of a file; None if it is missing, damaged or of another schema."""
    try:
        return parsed(schema, read_bytes(path))
    except (OSError, ValueError):
        return None


def parsed(schema: type[Schema], content: bytes) -> Schema:
    """The content of a file; raises ValueError with the field that is wrong, and what is wrong with it."""
    try:
        return TypeAdapter(schema).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "it"
        raise ValueError(f"{where}: {first['msg']}") from None
