"""Sentences on what is missing of a store."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import replace

import numpy as np

from gearchaos.store.reading.missing import MissingParts, missing_parts
from gearchaos.store.store import Store
from gearchaos.studies.attractor_set import NOT_COMPUTED

_NAMED = 3
"""Largest number of missing blocks of work items, and of variables, that are named."""


def missing_in_words(store: Store) -> str:
    """What is not computed and what is lost of a store, and what the values there are; empty if nothing is missing."""
    if store.finished and not store.study.gridded:  # the Dataset is stored beside the results of work items
        return ""
    progress = store.progress()
    missing = missing_parts(store, progress)
    never = replace(missing, tiles=progress.missing(missing.tiles))
    lost = replace(missing, tiles=[tile for tile in missing.tiles if progress.done(tile)])
    sentences = []
    if never.tiles:
        sentences.append(f"{_tiles(store, never)} are not computed{_where(store, never)}")
    if lost.tiles:
        sentences.append(f"files of {listed(lost.arrays)} are missing or damaged for {_tiles(store, lost)}"
                         f"{_where(store, lost)}{_intact(store, lost)}. To repair it: {store.repair_command(progress)}")
    return ". ".join(sentences)


def listed(names: list[str]) -> str:
    """Names in words, of which the first are named."""
    return ", ".join(names[:_NAMED]) + _more(names)


def _more(names: Sized) -> str:
    """How many there are beyond those that are named."""
    return f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""


def _tiles(store: Store, missing: MissingParts) -> str:
    return f"{len(missing.tiles)} of {store.grid.count} tiles"


def _where(store: Store, missing: MissingParts) -> str:
    """Where these tiles are, and what the values there are."""
    boxes = missing.boxes(store.grid)
    named = [", ".join(f"{dim}={first}:{end}" for dim, (first, end) in zip(store.study.grid, box, strict=True))
             for box in boxes[:_NAMED]]
    return f", by position from 0: {'; '.join(named)}{_more(boxes)}; {_values(store)}"


def _values(store: Store) -> str:
    """What the values are that are missing."""
    if not store.study.gridded:
        return f"the attractor there is {NOT_COMPUTED}"
    fills = {store.fill(n) for n, a in store.arrays.items() if np.dtype(a.dtype).kind in "iu"}
    return f"values there are NaN, {' or '.join(map(str, sorted(fills)))} in integers"


def _intact(store: Store, lost: MissingParts) -> str:
    """That other variables are intact, where they are; attractors are compared by all of them."""
    return ", other variables are intact" if store.study.gridded and len(lost.arrays) < len(store.arrays) else ""
