"""Schemas of the JSON files of a store. They are checked at every reading, since the files may be damaged or edited.

`gearchaos.store.create` and `gearchaos.store.store` write them.
"""

from __future__ import annotations

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

from gearchaos.store.tiles import Grid

_MAX_INT = 2**31 - 1
Whole = Annotated[int, Field(ge=0, le=2**63 - 1)]
Positive = Annotated[int, Field(ge=1, le=_MAX_INT)]
Seconds = Annotated[float, Field(ge=0, le=1e12)]
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


class _Schema(BaseModel):
    """A JSON object: unknown keys are refused, and types must match exactly."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class TileStatusSchema(_Schema):
    """``run/tiles/<number>.json`` of a store of format 1: the status of a tile."""

    done: bool
    seconds: Seconds
    machine: str
    attempt: Positive
    error: str | None
    at: Seconds


class _Grid(_Schema):
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


class _ArraySpec(_Schema):
    """See `arrays.ArraySpec`."""

    dtype: Annotated[str, AfterValidator(_number_type)]
    shape: tuple[Whole, ...]


class _Axis(_Schema):
    name: str
    start: FiniteFloat
    stop: FiniteFloat
    count: Positive


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


class _ChunkShape(BaseModel):
    chunk_shape: tuple[int, ...]


class _ChunkGrid(BaseModel):
    configuration: _ChunkShape


class _Codec(BaseModel):
    name: str
    configuration: dict[str, Any] = {}


class ArraySchema(BaseModel):
    """The part of the ``zarr.json`` of an array that says how it is divided into files and chunks."""

    shape: tuple[int, ...]
    chunk_grid: _ChunkGrid
    codecs: tuple[_Codec, ...]

    @property
    def layout(self) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
        """Shapes of the array, of what one of its files holds, and of a chunk."""
        file = self.chunk_grid.configuration.chunk_shape
        inner = [c.configuration.get("chunk_shape") for c in self.codecs if c.name == "sharding_indexed"]
        return self.shape, file, (tuple(inner[0]) if isinstance(inner[0], list) else ()) if inner else file


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


def parse_as(schema: type[Schema], content: bytes) -> Schema:
    """The content of a file by its schema; raises ValueError that names the first wrong field and its fault."""
    try:
        return TypeAdapter(schema).validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "it"
        raise ValueError(f"{where}: {first['msg']}") from None
