"""Print as JSON how maps of side x side cells are divided into files: ``python division.py SIDE``.

A process of its own: the peak memory that the kernel reports of a process includes that of the one that started it,
which therefore imports little.
"""

from __future__ import annotations

import json
import sys
from math import prod

import numpy as np
from gearchaos.store.journals.journal import LINES_PER_FILE
from instant import DTYPES

import gearchaos as gc
from gearchaos.store.tiles import divide, grouped

_OTHER_FILES = 5
"""Files of every finished store: metadata of the group, study, checksums, the mark that it is finished, a lock."""


def division(side: int) -> dict[str, int]:
    """The division that a run would choose for a map, and the number of files when a single run has finished it.

    ``tile_bytes`` and ``group_bytes`` are results of a tile in all arrays, and of a group in the largest array, before
    compression.
    """
    sizes = [np.dtype(dtype).itemsize for dtype in DTYPES.values()]
    axes = gc.Axis("omega", 0.5, 1.1, side), gc.Axis("eps1", 0.05, 0.3, side)
    grid = grouped(divide(gc.Zones(gc.MeshModel.of(q0=0.1), *axes)), max(sizes))
    of_arrays = len(sizes) * (grid.group_count + 1) + 2 * len(axes)
    return {
        "cells": prod(grid.shape), "tiles": grid.count, "groups": grid.group_count,
        "files": of_arrays + _OTHER_FILES + 1 + grid.count // LINES_PER_FILE,
        "tile_bytes": prod(grid.tile) * sum(sizes), "group_bytes": prod(grid.group) * max(sizes),
    }


if __name__ == "__main__":
    print(json.dumps(division(int(sys.argv[1]))))
