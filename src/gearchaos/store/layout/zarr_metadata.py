"""Schemas of what ``zarr.json`` files say of the division of an array into files and chunks."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel


class NodeSchema(BaseModel):
    """What a ``zarr.json`` describes: an array or a group."""

    node_type: Literal["array", "group"]


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
