"""Schemas of the JSON files of a store. They are checked at every reading, since the files may be damaged or edited.

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

_MAX_INT = 2**31 - 1
_Whole = Annotated[int, Field(ge=0, le=_MAX_INT)]
_Positive = Annotated[int, Field(ge=1, le=_MAX_INT)]
_Seconds = Annotated[float, Field(ge=0, le=1e12)]
_Shape = Annotated[tuple[_Positive, ...], Field(min_length=1, max_length=2)]
_Name = Annotated[str, Field(pattern=r"^\w+$")]


def _number_type(text: str) -> str:
    """The text, if it is the name of a NumPy dtype of numbers; otherwise raises ValueError."""
    try:
        if np.dtype(text).kind in "biufc":
            return text
    except TypeError:
        pass
    raise ValueError("must be a kind of number")


class _Schema(BaseModel):
    """A JSON object: unknown keys are refused, and types must match exactly."""

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
    """See `tiles.Grid`."""

    shape: _Shape
    tile: _Shape

    @model_validator(mode="after")
    def _same_dimensions(self) -> Self:
        if len(self.shape) != len(self.tile):
            raise ValueError("must have tiles with as many dimensions as the grid")
        return self


class _ArraySpec(_Schema):
    """See `arrays.ArraySpec`."""

    dtype: Annotated[str, AfterValidator(_number_type)]
    shape: tuple[_Whole, ...]


class _Axis(_Schema):
    name: str
    start: FiniteFloat
    stop: FiniteFloat
    count: _Positive


class _Budget(_Schema):
    """Classification settings by their names in format 1; `FORMER_NAMES` has the present ones."""

    looks: tuple[int, ...]  # lengths of the transient runs, in mesh periods
    longest: int  # longest period searched for
    exponent: int  # length of the first exponent run
    extensions: int  # doublings of that length
    patience: int  # longest transient before a motion is called chaotic
    measured: int  # periods over which response measures are averaged


class _Study(_Schema):
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


class NodeSchema(BaseModel):
    """What a ``zarr.json`` describes: an array or a group."""

    node_type: str


class StudySchema(_Schema):
    """``run/study.json``; the values of the study are checked when it is created from its record."""

    format: int
    study: _Study
    grid: _Grid
    arrays: dict[_Name, _ArraySpec]
    versions: dict[str, str]
    machine: dict[str, Any]


Checksums = dict[str, int]
"""``run/sums.json``: the CRC-32 of each file by its path."""

Schema = TypeVar("Schema")


def read_as(schema: type[Schema], path: Path) -> Schema | None:
    """The content of a file by its schema; None if it is missing or damaged, or does not fit the schema."""
    try:
        return parse_as(schema, read_bytes(path))
    except (OSError, ValueError):
        return None


def parse_as(schema: type[Schema], content: bytes) -> Schema:
    """The content of a file by its schema; raises ValueError that names the first wrong field and its fault."""
    try:
        return TypeAdapter(schema).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "it"
        raise ValueError(f"{where}: {first['msg']}") from None
