"""A new store, and one whose own files are made anew."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

from gearchaos.datasets import provenance
from gearchaos.errors import InputError
from gearchaos.files import write_bytes
from gearchaos.store.arrays import FORMAT, PIECES, Layout, lay_out, restore
from gearchaos.store.machine import machine, name
from gearchaos.store.resolved import Resolved
from gearchaos.store.store import Mark, Store
from gearchaos.store.tiles import Grid
from gearchaos.studies.plan import Plan


def versions(study: Resolved) -> dict[str, str]:
    """Of the packages that decide the numbers."""
    return {n: v for n, v in provenance(study.kind, study.model).items() if n.endswith("_version")}


def create(path: Path, study: Resolved, grid: Grid) -> Store:
    """A new store, whole or not at all; a study of a single tile is computed with it."""
    if not path.parent.is_dir():
        raise InputError("--out", "must lie in an existing folder", str(path), "Create the folder first.")
    plan, begin = study.plan(), time.perf_counter()
    sample = _sample(plan, grid)
    arrays = {n: Layout(v.dtype.str, v.shape[1:]) for n, v in sample.items()}
    store = Store(path, study, grid, arrays, versions(study))
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".gearchaos-") as folder:
        draft = Store(Path(folder) / "draft", study, grid, arrays, store.versions)
        lay_out(draft.path, plan, arrays, grid)
        _describe(draft)
        draft.seal()
        if grid.count == 1:
            draft.write(0, sample)
            draft.mark(0, Mark(True, time.perf_counter() - begin, name()))
        os.rename(draft.path, path)
    return store


def _sample(plan: Plan, grid: Grid) -> dict[str, np.ndarray]:
    """What is found of some piece, or of the only tile there is: it tells which arrays there are."""
    error: Exception | None = None
    some = [np.array([n]) for n in dict.fromkeys((0, plan.count // 2, plan.count - 1))]
    for pieces in [grid.pieces(0)] if grid.count == 1 else some:
        try:
            return plan.compute(pieces)
        except Exception as failure:  # a piece may fail: its tile is reported by the run
            error = failure
    raise InputError("study", "must have pieces that can be computed", type(error).__name__, f"{error}")


def _describe(store: Store) -> None:
    """Write what is computed, with what, and the folders of marks and locks."""
    words = {
        "format": FORMAT, "study": store.study.to_dict(), "grid": asdict(store.grid),
        "arrays": {n: asdict(a) for n, a in store.arrays.items()}, "versions": store.versions, "machine": machine(),
    }
    for folder in ("tiles", "writers"):
        (store.path / "run" / folder).mkdir()
    write_bytes(store.path / "run" / "study.json", json.dumps(words, indent=2).encode())


def mend(store: Store) -> None:
    """Make a store's own files anew: metadata, coordinates, and at the next finish the results."""
    if not store.plan.labelled:
        for result in (f for f in store.path.iterdir() if f.is_dir() and f.name not in ("run", PIECES)):
            shutil.rmtree(result)
    with tempfile.TemporaryDirectory(dir=store.path.parent, prefix=".gearchaos-") as folder:
        lay_out(Path(folder) / "fresh", store.plan, store.arrays, store.grid)
        restore(store.path, Path(folder) / "fresh")
    (store.path / "run" / "finished").unlink(missing_ok=True)
    store.seal()
