"""The grid of a study's work items divided into tiles; one tile is one chunk of every array of the store."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

import numpy as np

from gearchaos.studies.study import Study

TILE = 16384
"""Motions in a tile: some seconds of work, so that little is lost with one, and enough chaotic ones for all lanes."""

_LEAST, _MANY = 64, 8


@dataclass(frozen=True)
class Grid:
    """Tiles of shape ``tile`` over a grid of work items of this ``shape``; the last along a dimension may be smaller.

    Tiles are numbered along rows, as work items are.
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
        """Numbers of a tile's work items, along its rows."""
        ranges = [np.arange(p.start, p.stop) for p in self.region(number)]
        return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), self.shape).ravel()


def cut(study: Study, size: int | None = None) -> Grid:
    """Divide a study into tiles of up to ``size`` work items, as square as its blocks allow.

    By default tiles are so large that they fill the kernels' lanes, and small enough to be shared by several workers.
    """
    if size is None:
        motions = study.count * study.motions_per_item
        size = int(min(TILE, max(_LEAST, motions // _MANY)) / study.motions_per_item)
    shape, tile = tuple(study.grid.values()), list(study.block.values())
    while 2 * prod(tile) <= size and (growing := [i for i, n in enumerate(shape) if tile[i] < n]):
        shortest = min(growing, key=lambda i: tile[i])
        tile[shortest] = min(shape[shortest], 2 * tile[shortest])
    return Grid(shape, tuple(tile))
