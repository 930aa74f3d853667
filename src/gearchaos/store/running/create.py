"""Creating a store, and repairing those of its files that are not results."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, replace

import numpy as np

from gearchaos.datasets import provenance
from gearchaos.errors import InputError
from gearchaos.store.files.checked_files import read_as
from gearchaos.store.files.folder import Folder, LocalFolder
from gearchaos.store.journals.journal import WHOLE, Journal, Packed, TileEntry
from gearchaos.store.layout.arrays import create_arrays, restore_metadata
from gearchaos.store.layout.groups import write_group
from gearchaos.store.layout.specs import FORMAT, ITEMS, ArraySpec
from gearchaos.store.layout.zarr_metadata import NodeSchema
from gearchaos.store.machine import machine, process_name
from gearchaos.store.record import to_record
from gearchaos.store.store import FINISHED, STUDY, Store
from gearchaos.store.tiles import Grid, grouped
from gearchaos.studies.study import Study


def versions(study: Study) -> dict[str, str]:
    """The versions of the packages on which results depend, by attribute of a Dataset."""
    return {n: v for n, v in provenance(study.kind, study.model).items() if n.endswith("_version")}


def create(folder: Folder, study: Study, tiles: Grid) -> bool:
    """Create a store, completely or not at all. A study that is a single tile is computed at the same time.

    Parameters
    ----------
    folder : Folder
        Where the store is to be.
    study : Study
    tiles : Grid
        The division of the study into tiles; chunks and groups are chosen here.

    Returns
    -------
    bool
        False if another process has created a store there meanwhile.

    Raises
    ------
    InputError
        If the folder cannot be created, or no work item of the study can be computed.
    OSError
        If a file cannot be written.
    """
    folder.check_creatable()
    started = time.perf_counter()
    sample = _sample(study, tiles)
    arrays = {n: ArraySpec(v.dtype.str, v.shape[1:]) for n, v in sample.items()}
    grid = grouped(tiles, max(spec.item_bytes for spec in arrays.values()))
    with folder.draft() as path:
        draft = Store(LocalFolder(path), study, grid, arrays, versions(study))
        create_arrays(draft)
        _write_description(draft)
        draft.write_checksums()
        if grid.count == 1:
            _write_only_tile(draft, sample, time.perf_counter() - started)
        return folder.publish(path)


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


def _write_only_tile(store: Store, results: dict[str, np.ndarray], seconds: float) -> None:
    """Write the results of the only tile of a store as those of a packed group."""
    shape = store.grid.shape
    files = {n: write_group(store, 0, n, v.reshape(*shape, *v.shape[1:])) for n, v in results.items()}
    entry = TileEntry(0, None, 0, 0, 0, seconds, process_name())
    Journal(store.folder, WHOLE).append(entry, Packed(0, files, entry.at))


def _write_description(store: Store) -> None:
    """Write ``run/study.json``."""
    description = {
        "format": FORMAT, "study": to_record(store.study), "grid": asdict(store.grid),
        "arrays": {n: asdict(a) for n, a in store.arrays.items()}, "versions": store.versions, "machine": machine(),
    }
    store.folder.write(STUDY, json.dumps(description, indent=2).encode())


def repair(store: Store) -> None:
    """Write metadata and coordinates again.

    Results that are computed from all tiles are deleted; they are written again when the run finishes.
    """
    if not store.study.gridded:
        _delete_finished_arrays(store)
    with store.folder.draft() as path:
        fresh = LocalFolder(path)
        create_arrays(replace(store, folder=fresh))
        restore_metadata(store.folder, fresh)
    store.folder.delete(FINISHED)
    store.write_checksums()


def _delete_finished_arrays(store: Store) -> None:
    """Delete the arrays that finishing has added to the store; what the user has put there is kept."""
    nodes = {name.split("/")[0] for name, _ in store.folder.list() if "/" in name} - {"run", ITEMS}
    for node in nodes:
        metadata = f"{node}/zarr.json"
        found = read_as(NodeSchema, store.folder, metadata)
        if store.folder.size(metadata) is not None and (found is None or found.node_type == "array"):
            store.folder.delete_tree(node)
