"""Print as JSON what a block of 1024 x 1024 cells takes, whose numbers do not compress: ``python one_block.py FOLDER``.

``write`` is seconds of wall time and of CPU to write the block from its tiles, ``verify`` the same to read it and to
compare its checksums, ``bytes`` its size.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

import numpy as np
from instant import DTYPES, values

import gearchaos as gc
from gearchaos.store.blocks import block_record, damaged_shards, write_block, write_tile
from gearchaos.store.objects import Objects
from gearchaos.store.store import ArraySpec, Store, create, versions
from gearchaos.store.tiles import Grid

GRID = Grid((1024, 1024), (128, 128), (512, 256), (1024, 1024))


def timed(work: Callable[[], list]) -> tuple[float, float]:
    """Seconds of wall time and CPU of a call that must find nothing damaged."""
    wall, cpu = time.perf_counter(), time.process_time()
    assert not work()
    return time.perf_counter() - wall, time.process_time() - cpu


def main() -> None:
    study = gc.Zones(gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.5, 1.1, 1024), gc.Axis("eps1", 0.05, 0.3, 1024))
    arrays = {name: ArraySpec(np.dtype(dtype).str, ()) for name, dtype in DTYPES.items()}
    store = create(Store(Objects(sys.argv[1]), study, GRID, arrays, versions(study)))
    rng = np.random.default_rng(0)
    for tile in range(GRID.count):
        results = values(GRID.items(tile))
        write_tile(store, tile, {n: rng.random(len(v)).astype(v.dtype) if v.dtype.kind == "f" else v
                                 for n, v in results.items()}, 0.0)
    write, verify = (timed(lambda: write_block(store, 0)), timed(lambda: damaged_shards(store, 0)))
    size = sum(size for size, _ in block_record(store, 0).shards.values())
    print(json.dumps({"write": write, "verify": verify, "bytes": size}))


if __name__ == "__main__":
    main()
