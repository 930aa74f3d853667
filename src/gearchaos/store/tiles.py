"""Division of a study into tiles: blocks of its grid of work items, each one chunk of every array of the store."""

from __future__ import annotations

from dataclasses import dataclass
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


@dataclass(frozen=True)
class Grid:
    """A grid of work items divided into tiles. Work items and tiles are numbered in C order.

    Attributes
    ----------
    shape : tuple of int
        Shape of the grid of work items.
    tile : tuple of int
        Shape of a tile, of the same length. The last tile along a dimension may be smaller.
    """

    shape: tuple[int, ...]
    tile: tuple[int, ...]

    @property
    def tiles(self) -> tuple[int, ...]:
        """Number of tiles along each dimension."""
        return tuple(-(-n // m) for n, m in zip(self.shape, self.tile, strict=True))

    @property
    def count(self) -> int:
        """Number of tiles."""
        return prod(self.tiles)

    def position(self, number: int) -> tuple[int, ...]:
        """Position of a tile in the grid of tiles."""
        return tuple(int(i) for i in np.unravel_index(number, self.tiles))

    def region(self, number: int) -> tuple[slice, ...]:
        """The part of the grid of work items that a tile covers."""
        at = self.position(number)
        return tuple(slice(i * m, min((i + 1) * m, n)) for i, m, n in zip(at, self.tile, self.shape, strict=True))

    def size(self, number: int) -> int:
        """Number of work items of a tile."""
        return prod(p.stop - p.start for p in self.region(number))

    def items(self, number: int) -> np.ndarray:
        """The numbers of the work items of a tile, (L,), in C order."""
        ranges = [np.arange(p.start, p.stop) for p in self.region(number)]
        return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), self.shape).ravel()


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
    shape, tile = tuple(study.grid.values()), list(study.block.values())
    while 2 * prod(tile) <= size and (growing := [i for i, n in enumerate(shape) if tile[i] < n]):
        shortest = min(growing, key=lambda i: tile[i])
        tile[shortest] = min(shape[shortest], 2 * tile[shortest])
    return Grid(shape, tuple(tile))
