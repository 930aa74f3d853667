"""Creating a store, and repairing those of its files that are not chunks."""

from __future__ import annotations

import json
import os
import shutil
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

from gearchaos.datasets import provenance
from gearchaos.errors import InputError
from gearchaos.files import temporary_folder, write_bytes
from gearchaos.store.arrays import FORMAT, ITEMS, ArraySpec, create_arrays, restore_metadata
from gearchaos.store.machine import machine, process_name
from gearchaos.store.record import to_record
from gearchaos.store.schema import NodeSchema, read_as
from gearchaos.store.store import Store, TileStatus
from gearchaos.store.tiles import Grid
from gearchaos.studies.study import Study


def versions(study: Study) -> dict[str, str]:
    """The versions of the packages on which results depend, by attribute of a Dataset."""
    return {n: v for n, v in provenance(study.kind, study.model).items() if n.endswith("_version")}


def create(path: Path, study: Study, grid: Grid) -> Store:
    """Create a store, completely or not at all. A study that is a single tile is computed at the same time."""
    if not path.parent.is_dir():
        raise InputError("out", "must lie in an existing folder", str(path), "Create the folder first.")
    started = time.perf_counter()
    sample = _sample(study, grid)
    arrays = {n: ArraySpec(v.dtype.str, v.shape[1:]) for n, v in sample.items()}
    store = Store(path, study, grid, arrays, versions(study))
    with temporary_folder(path.parent) as folder:
        draft = Store(folder / "draft", study, grid, arrays, store.versions)
        create_arrays(draft.path, study, arrays, grid)
        _write_description(draft)
        draft.write_checksums()
        if grid.count == 1:
            draft.write(0, sample)
            draft.set_status(0, TileStatus(True, time.perf_counter() - started, process_name()))
        os.rename(draft.path, path)
    return store


def _sample(study: Study, grid: Grid) -> dict[str, np.ndarray]:
    """Results (L, ...) of one work item, or of the only tile: the arrays get their names, dtypes and shapes."""
    error: Exception | None = None
    single = [np.array([n]) for n in dict.fromkeys((0, study.count // 2, study.count - 1))]
    for items in [grid.items(0)] if grid.count == 1 else single:
        try:
            return study.compute(items)
        except Exception as failure:  # one of the items may fail; the run will report its tile
            error = failure
    raise InputError("study", "must have work items that can be computed", type(error).__name__, f"{error}")


def _write_description(store: Store) -> None:
    """Write ``run/study.json``, and create the folders for the statuses of tiles and the locks of writers."""
    description = {
        "format": FORMAT, "study": to_record(store.study), "grid": asdict(store.grid),
        "arrays": {n: asdict(a) for n, a in store.arrays.items()}, "versions": store.versions, "machine": machine(),
    }
    for folder in ("tiles", "writers"):
        (store.path / "run" / folder).mkdir()
    write_bytes(store.path / "run" / "study.json", json.dumps(description, indent=2).encode())


def repair(store: Store) -> None:
    """Write metadata and coordinates again.

    Results that are computed from all tiles are deleted; they are written again when the run finishes.
    """
    if not store.study.gridded:
        for result in (f for f in store.path.iterdir() if f.name not in ("run", ITEMS) and _is_array(f)):
            shutil.rmtree(result)
    with temporary_folder(store.path.parent) as folder:
        create_arrays(folder / "fresh", store.study, store.arrays, store.grid)
        restore_metadata(store.path, folder / "fresh")
    (store.path / "run" / "finished").unlink(missing_ok=True)
    store.write_checksums()


def _is_array(folder: Path) -> bool:
    """Whether a folder is a Zarr array, perhaps with damaged metadata; any other folder was put there by the user."""
    metadata = folder / "zarr.json"
    found = read_as(NodeSchema, metadata)
    return metadata.is_file() and (found is None or found.node_type == "array")
