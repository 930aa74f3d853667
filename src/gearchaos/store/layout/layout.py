"""The files of a store: their names, and the shapes, dtypes and fill values of what they hold."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gearchaos.store.errors import damaged_description
from gearchaos.store.files.folder import Folder
from gearchaos.store.layout.segments import record_length
from gearchaos.store.layout.specs import FORMAT, ITEMS, ArraySpec, not_computed
from gearchaos.store.tiles import Grid, Shape
from gearchaos.studies.study import Study


@dataclass(frozen=True)
class Layout:
    """Which files a store has, and what is in them; `gearchaos.store.store.Store` also reads them.

    Attributes
    ----------
    folder : Folder
        Where its files are.
    study : Study
    grid : Grid
        The division of the study into tiles, chunks and groups.
    arrays : dict of str to ArraySpec
        The arrays of the results of work items, by name.
    versions : dict of str to str
        Versions of the packages on which results depend, when the store was created.
    format : int
        Version of its layout, one of `specs.FORMATS`.
    """

    folder: Folder
    study: Study
    grid: Grid
    arrays: dict[str, ArraySpec]
    versions: dict[str, str]
    format: int = FORMAT

    def __post_init__(self) -> None:
        shape, block, tile = tuple(self.study.grid.values()), self.study.block.values(), self.grid.tile
        if shape != self.grid.shape or not all(b <= t <= n for b, t, n in zip(block, tile, shape, strict=True)):
            why = f"tiles of {tile} over {self.grid.shape} do not fit the study's {shape}"
            raise damaged_description(self.folder, why)

    @property
    def sharded(self) -> bool:
        """Whether the files of groups are shards; in format 1 they are single chunks."""
        return self.format > 1

    def array_folder(self, name: str) -> str:
        """Name of the folder of an array of results."""
        return name if self.study.gridded else f"{ITEMS}/{name}"

    def group_file(self, name: str, group: int) -> str:
        """Name of the file of a group in an array."""
        position = self.full_position(name, self.grid.group_position(group))
        return f"{self.array_folder(name)}/c/{'/'.join(map(str, position))}"

    def chunk_shape(self, name: str) -> Shape:
        """Shape of a chunk of an array: that of the work items, then that of the result of one item."""
        return (*self.grid.chunk, *self.arrays[name].shape)

    def chunk_counts(self, name: str) -> Shape:
        """Number of chunks of a group along each dimension of an array."""
        return (*self.grid.chunks_per_group, *[1] * len(self.arrays[name].shape))

    def full_position(self, name: str, position: Shape) -> Shape:
        """Position of a chunk or group in an array: dimensions after those of the grid are not divided."""
        return (*position, *[0] * len(self.arrays[name].shape))

    def fill(self, name: str) -> Any:
        """The value of an array where nothing is computed."""
        return not_computed(name, np.dtype(self.arrays[name].dtype), self.format)

    def record_length(self, tile: int) -> int:
        """Size of the record of a tile in bytes."""
        return self._record_length(self.grid.size(tile))

    @cached_property
    def _record_length(self) -> Callable[[int], int]:
        return record_length(self.arrays)
