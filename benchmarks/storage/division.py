"""Print as JSON how maps of side x side cells are divided into files: ``python division.py SIDE``.

A process of its own: the peak memory that the kernel reports of a process includes that of the one that started it,
which therefore imports little.
"""

from __future__ import annotations

import json
import sys
from math import prod

import numpy as np
from instant import DTYPES

import gearchaos as gc
from gearchaos.store.tiles import divide, with_blocks

_OTHER_FILES = 4
"""Files of every finished store: metadata of the group and of its folder run, study, the mark that it is finished."""


def division(side: int) -> dict[str, int]:
    """The division that a run would choose for a map, and the number of files when it is finished.

    ``tile_bytes`` and ``block_bytes`` are results of a tile and of a block in all arrays before compression.
    """
    sizes = [np.dtype(dtype).itemsize for dtype in DTYPES.values()]
    axes = gc.Axis("omega", 0.5, 1.1, side), gc.Axis("eps1", 0.05, 0.3, side)
    grid = with_blocks(divide(gc.Zones(gc.MeshModel.of(q0=0.1), *axes)), max(sizes), sum(sizes))
    return {
        "cells": prod(grid.shape), "tiles": grid.count, "blocks": grid.block_count,
        "files": grid.block_count * (len(sizes) + 1) + len(sizes) + 2 * len(axes) + _OTHER_FILES,
        "tile_bytes": prod(grid.tile) * sum(sizes), "block_bytes": prod(grid.block) * sum(sizes),
    }


if __name__ == "__main__":
    print(json.dumps(division(int(sys.argv[1]))))
