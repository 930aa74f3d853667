"""Division of the work items of a study into tiles, chunks and groups.

A *tile* is computed at once; it is what is lost if a run is killed. A *chunk* is compressed at once, and has a
checksum. A *group* is the tiles whose results lie in one file of each array, a shard of Zarr's sharding codec.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import prod

import numpy as np

from gearchaos.studies.study import Study

LARGEST_TILE = 16384
"""Most motions in a tile by default: some seconds of work, which are lost if the run is killed, and enough chaotic
motions to fill the lanes of the kernels."""

_SMALLEST_TILE = 64
"""Fewest motions in a tile by default."""

_SHARED = 8
"""Number of tiles that a study has at least, if they are not smaller than the smallest: several workers share them."""

_CHUNK_BYTES = 2**20
"""Largest size of a chunk of the largest array before compression, unless a tile is larger."""

_GROUP_BYTES = 2**23
"""Largest size of a group file of the largest array before compression, unless there would be more than `_MOST_GROUPS`
groups or a tile is larger."""

_LARGEST_GROUP_BYTES = 2**27
"""Largest size of a group file of the largest array before compression, however many groups there are, unless a tile is
larger. A packing process holds one such file in memory per thread."""

_MOST_GROUPS = 4096
"""Number of groups from which larger ones are preferred."""

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Grid:
    """A grid of work items divided into tiles, chunks and groups, all blocks. Each is numbered in C order.

    Attributes
    ----------
    shape : tuple of int
        Shape of the grid of work items.
    tile : tuple of int
        Shape of a tile, of the same length. The last tile along a dimension may be smaller.
    chunk : tuple of int
        Shape of a chunk, along each dimension a multiple of that of a tile, or one chunk for all tiles; by default that
        of a tile.
    group : tuple of int
        Shape of a group, a multiple of that of a chunk; by default that of a chunk.
    """

    shape: Shape
    tile: Shape
    chunk: Shape = ()
    group: Shape = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "chunk", self.chunk or self.tile)
        object.__setattr__(self, "group", self.group or self.chunk)
        if len({len(part) for part in (self.shape, self.tile, self.chunk, self.group)}) > 1:
            raise ValueError("tiles, chunks and groups must have as many dimensions as the grid")
        for size, tile, chunk, group in zip(self.shape, self.tile, self.chunk, self.group, strict=True):
            if min(size, tile, chunk, group) < 1 or group % chunk or (chunk % tile and chunk < size):
                raise ValueError(f"groups of {self.group}, chunks of {self.chunk} and tiles of {self.tile} do not fit")

    @cached_property
    def tiles(self) -> Shape:
        """Number of tiles along each dimension."""
        return tuple(-(-n // m) for n, m in zip(self.shape, self.tile, strict=True))

    @cached_property
    def count(self) -> int:
        """Number of tiles."""
        return prod(self.tiles)

    @cached_property
    def groups(self) -> Shape:
        """Number of groups along each dimension."""
        return tuple(-(-n // m) for n, m in zip(self.shape, self.group, strict=True))

    @cached_property
    def group_count(self) -> int:
        """Number of groups."""
        return prod(self.groups)

    @property
    def chunks_per_group(self) -> Shape:
        """Number of chunks of a group along each dimension, also of those beyond the end of the grid."""
        return tuple(g // c for g, c in zip(self.group, self.chunk, strict=True))

    def position(self, number: int) -> Shape:
        """Position of a tile in the grid of tiles."""
        return _position(number, self.tiles)

    def group_position(self, group: int) -> Shape:
        """Position of a group in the grid of groups."""
        return _position(group, self.groups)

    def region(self, number: int) -> tuple[slice, ...]:
        """The part of the grid of work items that a tile covers."""
        return _block(self.position(number), self.tile, self.shape)

    def group_region(self, group: int) -> tuple[slice, ...]:
        """The part of the grid of work items that a group covers."""
        return _block(self.group_position(group), self.group, self.shape)

    def group_of(self, number: int) -> int:
        """The group of a tile."""
        origin = (i * t // g for i, t, g in zip(self.position(number), self.tile, self.group, strict=True))
        return _number(origin, self.groups)

    def tiles_of(self, group: int) -> list[int]:
        """The tiles of a group, in C order."""
        return self.tiles_in(self.group_region(group))

    def tiles_in(self, region: tuple[slice, ...]) -> list[int]:
        """The tiles that share work items with a part of the grid, in C order."""
        ranges = (range(p.start // t, -(-p.stop // t)) for p, t in zip(region, self.tile, strict=True))
        return [_number(position, self.tiles) for position in product(*ranges)]

    def groups_in(self, region: tuple[slice, ...]) -> list[int]:
        """The groups that share work items with a part of the grid, in C order."""
        ranges = (range(p.start // g, -(-p.stop // g)) for p, g in zip(region, self.group, strict=True))
        return [_number(position, self.groups) for position in product(*ranges)]

    def tile_count(self, group: int) -> int:
        """Number of tiles of a group."""
        return prod(-(-(p.stop - p.start) // t) for p, t in zip(self.group_region(group), self.tile, strict=True))

    def chunk_regions(self, group: int) -> Iterator[tuple[Shape, tuple[slice, ...]]]:
        """The position in its group, and the part of the grid, of each chunk of a group that has work items."""
        start = [p.start for p in self.group_region(group)]
        for position in np.ndindex(self.chunks_per_group):
            region = tuple(
                slice(s + i * c, min(s + (i + 1) * c, n))
                for s, i, c, n in zip(start, position, self.chunk, self.shape, strict=True)
            )
            if all(p.start < p.stop for p in region):
                yield position, region

    def size(self, number: int) -> int:
        """Number of work items of a tile."""
        return prod(p.stop - p.start for p in self.region(number))

    def items(self, number: int) -> np.ndarray:
        """The numbers of the work items of a tile, (L,), in C order."""
        ranges = [np.arange(p.start, p.stop) for p in self.region(number)]
        return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), self.shape).ravel()


def _position(number: int, shape: Shape) -> Shape:
    """Position of a block in a grid of blocks of this shape, in C order."""
    out = []
    for count in reversed(shape):
        number, along = divmod(number, count)
        out.append(along)
    return tuple(reversed(out))


def _number(position: Iterable[int], shape: Shape) -> int:
    """Inverse of `_position`."""
    number = 0
    for along, count in zip(position, shape, strict=True):
        number = number * count + along
    return number


def _block(position: Shape, block: Shape, shape: Shape) -> tuple[slice, ...]:
    """The part of a grid that the block at a position covers."""
    return tuple(slice(i * m, min((i + 1) * m, n)) for i, m, n in zip(position, block, shape, strict=True))


def divide(study: Study, size: int | None = None) -> Grid:
    """Divide a study into tiles.

    Parameters
    ----------
    study : Study
        A tile has the shape of its block, with dimensions doubled as long as ``size`` allows, the shortest first.
    size : int, optional
        Largest number of work items in a tile, unless the block of the study is larger. By default tiles are large
        enough to fill the lanes of the kernels, and small enough to be shared by several workers.
    """
    if size is None:
        motions = study.count * study.motions_per_item
        size = int(min(LARGEST_TILE, max(_SMALLEST_TILE, motions // _SHARED)) / study.motions_per_item)
    shape = tuple(study.grid.values())
    return Grid(shape, _doubled(tuple(study.block.values()), shape, size))


def grouped(grid: Grid, item_bytes: int) -> Grid:
    """The same tiles, in chunks and groups of a size that suits files.

    Parameters
    ----------
    grid : Grid
    item_bytes : int
        Size of the result of one work item in the largest array.
    """
    item_bytes = max(1, item_bytes)
    chunk = _doubled(grid.tile, grid.shape, _CHUNK_BYTES // item_bytes)
    most = min(_LARGEST_GROUP_BYTES, max(_GROUP_BYTES, prod(grid.shape) * item_bytes // _MOST_GROUPS))
    group = _doubled(chunk, grid.shape, most // item_bytes)
    whole = (-(-g // c) * c for g, c in zip(group, chunk, strict=True))
    return Grid(grid.shape, grid.tile, chunk, tuple(whole))


def _doubled(block: Shape, shape: Shape, most: int) -> Shape:
    """A block with dimensions doubled, the shortest first, at most to those of the grid, up to ``most`` work items."""
    out = list(block)
    while 2 * prod(out) <= most and (growing := [i for i, n in enumerate(shape) if out[i] < n]):
        shortest = min(growing, key=lambda i: out[i])
        out[shortest] = min(shape[shortest], 2 * out[shortest])
    return tuple(out)
