"""Division of the work items of a study into tiles, chunks and blocks.

A *tile* is computed at once; it is what is lost if a run is killed. A *chunk* is compressed at once, and has a
checksum. A *block* is the tiles whose results lie in one file of each array, a shard of Zarr's sharding codec.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import prod

import numpy as np

from gearchaos.studies.core.study import Study

LARGEST_TILE = 16384
"""Most motions in a tile by default: some seconds of work, which are lost if the run is killed, and enough chaotic
motions to fill the lanes of the kernels."""

_SMALLEST_TILE = 64  # fewest motions in a tile by default
_SHARED = 8  # tiles that a study has at least, if they are not smaller than the smallest, for several workers
_CHUNK_BYTES = 2**20  # of the largest array before compression, unless a tile is larger
_BLOCK_BYTES = 2**27  # of all arrays, unless a tile is larger; who writes a block has twice as much in memory
_BLOCKS_PER_SHARD = 8  # if tiles are not larger: with fewer, some shards would have much more to do
_SMALLEST_BLOCK = 2**16  # work items in a block without shards: smaller ones would only be more files

Shape = tuple[int, ...]
Region = tuple[slice, ...]


@dataclass(frozen=True)
class Grid:
    """A grid of work items divided into tiles, chunks and blocks. Tiles and blocks are numbered in C order.

    The last ones along a dimension may be smaller. By default a chunk is a tile, and a block is a chunk.
    """

    shape: Shape  # of the grid of work items
    tile: Shape
    chunk: Shape = ()  # along each dimension a multiple of the tile, or one chunk for all tiles
    block: Shape = ()  # a multiple of the chunk

    def __post_init__(self) -> None:
        for name, given in (("chunk", self.tile), ("block", self.chunk or self.tile)):
            object.__setattr__(self, name, tuple(getattr(self, name)) or given)
        for size, tile, chunk, block in zip(self.shape, self.tile, self.chunk, self.block, strict=True):
            if min(size, tile, chunk, block) < 1 or block % chunk or (chunk % tile and chunk < size):
                raise ValueError(f"blocks of {self.block}, chunks of {self.chunk} and tiles of {self.tile} do not fit")

    @cached_property
    def tiles(self) -> Shape:
        """Number of tiles along each dimension."""
        return _parts(self.shape, self.tile)

    @cached_property
    def blocks(self) -> Shape:
        """Number of blocks along each dimension."""
        return _parts(self.shape, self.block)

    @property
    def count(self) -> int:
        """Number of tiles."""
        return prod(self.tiles)

    @property
    def block_count(self) -> int:
        """Number of blocks."""
        return prod(self.blocks)

    def region(self, tile: int) -> Region:
        """The part of the grid of work items that a tile covers."""
        return _part(tile, self.tiles, self.tile, self.shape)

    def block_region(self, block: int) -> Region:
        """The part of the grid of work items that a block covers."""
        return _part(block, self.blocks, self.block, self.shape)

    def block_of(self, tile: int) -> int:
        """The block of a tile."""
        corner = [r.start // b for r, b in zip(self.region(tile), self.block, strict=True)]
        return int(np.ravel_multi_index(corner, self.blocks))

    def tiles_in(self, region: Region) -> list[int]:
        """The tiles that share work items with a part of the grid, in C order."""
        return _parts_in(region, self.tile, self.tiles)

    def blocks_in(self, region: Region) -> list[int]:
        """The blocks that share work items with a part of the grid, in C order."""
        return _parts_in(region, self.block, self.blocks)

    def tiles_of(self, block: int) -> list[int]:
        """The tiles of a block, in C order."""
        return self.tiles_in(self.block_region(block))

    def tile_count(self, block: int) -> int:
        """Number of tiles of a block."""
        return prod(-(-(p.stop - p.start) // t) for p, t in zip(self.block_region(block), self.tile, strict=True))

    def size(self, tile: int) -> int:
        """Number of work items of a tile."""
        return prod(p.stop - p.start for p in self.region(tile))

    def items(self, tile: int) -> np.ndarray:
        """The numbers of the work items of a tile, (L,), in C order."""
        ranges = [np.arange(p.start, p.stop) for p in self.region(tile)]
        return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), self.shape).ravel()


def _parts(shape: Shape, part: Shape) -> Shape:
    """Number of parts of a grid along each dimension."""
    return tuple(-(-n // m) for n, m in zip(shape, part, strict=True))


def _part(number: int, counts: Shape, part: Shape, shape: Shape) -> Region:
    """The part of a grid with a number, of ``counts`` parts along each dimension."""
    position = map(int, np.unravel_index(number, counts))
    return tuple(slice(i * m, min((i + 1) * m, n)) for i, m, n in zip(position, part, shape, strict=True))


def _parts_in(region: Region, part: Shape, counts: Shape) -> list[int]:
    """The numbers of the parts of a grid that share work items with a region."""
    ranges = [np.arange(p.start // m, -(-p.stop // m)) for p, m in zip(region, part, strict=True)]
    return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), counts).ravel().tolist()


def span(region: Region) -> Shape:
    """Numbers of work items of a region along each dimension."""
    return tuple(p.stop - p.start for p in region)


def within(part: Region, region: Region) -> Region:
    """A part of the grid as seen from the beginning of a region that contains it."""
    return tuple(slice(p.start - r.start, p.stop - r.start) for p, r in zip(part, region, strict=True))


def divide(study: Study, size: int | None = None) -> Grid:
    """Divide a study into tiles: its smallest blocks, with dimensions doubled, the shortest first, to ``size`` items.

    By default tiles are large enough to fill the lanes of the kernels, and small enough to be shared by workers.
    """
    if size is None:
        motions = study.count * study.motions_per_item
        size = int(min(LARGEST_TILE, max(_SMALLEST_TILE, motions // _SHARED)) / study.motions_per_item)
    shape = tuple(study.grid.values())
    return Grid(shape, doubled(tuple(study.block.values()), shape, size))


def with_blocks(grid: Grid, largest: int, item_bytes: int, shards: int = 1) -> Grid:
    """The same tiles, in chunks and blocks of a size that suits files and a number of shards.

    ``largest`` and ``item_bytes`` are the sizes of the result of one work item, in the largest array and in all arrays.
    """
    shared = prod(grid.shape) // (_BLOCKS_PER_SHARD * shards)
    most = min(_BLOCK_BYTES // max(1, item_bytes), shared if shards > 1 else max(shared, _SMALLEST_BLOCK))
    chunk = doubled(grid.tile, grid.shape, min(most, _CHUNK_BYTES // max(1, largest)))
    block = doubled(chunk, grid.shape, most)
    whole = (-(-b // c) * c for b, c in zip(block, chunk, strict=True))
    return Grid(grid.shape, grid.tile, chunk, tuple(whole))


def doubled(part: Shape, shape: Shape, most: int) -> Shape:
    """A part of a grid with dimensions doubled, the shortest first, at most to those of the grid, up to ``most`` work
    items."""
    out = list(part)
    while 2 * prod(out) <= most and (growing := [i for i, n in enumerate(shape) if out[i] < n]):
        shortest = min(growing, key=lambda i: out[i])
        out[shortest] = min(shape[shortest], 2 * out[shortest])
    return tuple(out)
