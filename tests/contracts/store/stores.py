"""A small map whose results are instant, for tests of stores: 8 × 12 cells, 12 tiles, 6 chunks and 3 blocks."""

import json
import os
from pathlib import Path

import numpy as np

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.store.run import run
from gearchaos.store.store import _checksum

MAP = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.1:12", "eps1=0.05:0.3:8")
BASINS = gc.Basins(gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1), "z=-3:3:8", "z_dot=-2:2:6",
                   settings=Classification(longest_transient=800, doublings=1, averaging_periods=16))


def use_instant_results(monkeypatch):
    """Let maps be computed at once, stores of few work items have several chunks and blocks, and a disk synchronise at
    once."""
    monkeypatch.setattr(os, "fsync", lambda file: None)
    monkeypatch.setattr(gc.Zones, "compute", computed)
    monkeypatch.setattr("gearchaos.store.tiles._CHUNK_BYTES", 128)
    monkeypatch.setattr("gearchaos.store.tiles._SMALLEST_BLOCK", 32)


def computed(study, items, **_):
    return {"label": (1 + items % 5).astype(np.int8), "period": (items % 3).astype(np.int32), "v_rms": items / 7}


def counted(monkeypatch, fails=lambda items: False):
    """The list of the first items of all tiles that are computed from now on, some of which may fail."""
    tiles = []

    def compute(study, items, **_):
        tiles.append(int(items[0]))
        if fails(items):
            raise ArithmeticError("no")
        return computed(study, items)

    monkeypatch.setattr(gc.Zones, "compute", compute)
    return tiles


def half_done(path, monkeypatch):
    """A store with the blocks 1 and 2, and the tiles 1, 6 and 7 of block 0, whose tile 0 has failed."""
    with monkeypatch.context() as patch:
        counted(patch, lambda items: items[0] == 0 and len(items) > 1)
        assert run(MAP, path, tile=8).failed == {0: "ArithmeticError: no"}
    return path


def files(path):
    """The bytes of all files by name, but of the records of blocks, which have the times of their tiles."""
    every = {p.relative_to(path).as_posix(): p.read_bytes() for p in Path(path).rglob("*") if p.is_file()}
    return {name: json.loads(data[:-4])["shards"] if name.startswith("run/blocks/") else data
            for name, data in every.items()}


def describe(path, **changes):
    """Change the description of a store, with a right checksum."""
    file = Path(path) / "run/study.json"
    content = json.loads(file.read_text()) | changes
    content.pop("checksum")
    file.write_text(json.dumps({**content, "checksum": _checksum(content)}))
