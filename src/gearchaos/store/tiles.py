"""A study's grid of pieces cut in tiles; one tile is one chunk of the store."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

import numpy as np

from gearchaos.studies.plan import Plan

TILE = 16384
"""Motions in a tile: some seconds of work, so that little is lost with it, and enough chaos to fill blocks of lanes."""

_LEAST, _MANY = 64, 8


@dataclass(frozen=True)
class Grid:
    """Tiles of shape ``tile`` over a grid of pieces of this ``shape``; those at the ends may be smaller."""

    shape: tuple[int, ...]
    tile: tuple[int, ...]

    @property
    def tiles(self) -> tuple[int, ...]:
        """How many tiles there are along each dim."""
        return tuple(-(-n // m) for n, m in zip(self.shape, self.tile, strict=True))

    @property
    def count(self) -> int:
        return prod(self.tiles)

    def place(self, number: int) -> tuple[int, ...]:
        """The tile's place among the tiles."""
        return tuple(int(i) for i in np.unravel_index(number, self.tiles))

    def part(self, number: int) -> tuple[slice, ...]:
        """The tile's part of the grid."""
        place = self.place(number)
        return tuple(slice(i * m, min((i + 1) * m, n)) for i, m, n in zip(place, self.tile, self.shape, strict=True))

    def size(self, number: int) -> int:
        """How many pieces the tile has."""
        return prod(p.stop - p.start for p in self.part(number))

    def pieces(self, number: int) -> np.ndarray:
        """Numbers of the tile's pieces, along its rows."""
        ranges = [np.arange(p.start, p.stop) for p in self.part(number)]
        return np.ravel_multi_index(np.meshgrid(*ranges, indexing="ij"), self.shape).ravel()


def cut(plan: Plan, size: int | None = None) -> Grid:
    """Tiles of up to ``size`` pieces, as square as the plan allows, but no smaller than what it computes together; by
    default so large that they fill the kernels, and small enough that some can share."""
    if size is None:
        size = int(min(TILE, max(_LEAST, plan.count * plan.motions // _MANY)) / plan.motions)
    shape, tile = tuple(plan.shape.values()), list(plan.block.values())
    while 2 * prod(tile) <= size and (growing := [i for i, n in enumerate(shape) if tile[i] < n]):
        shortest = min(growing, key=lambda i: tile[i])
        tile[shortest] = min(shape[shortest], 2 * tile[shortest])
    return Grid(shape, tuple(tile))
