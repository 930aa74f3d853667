"""The cores and the memory of this machine."""

from __future__ import annotations

import os

from gearchaos.errors import InputError

_BYTES_PER_ITEM = 400
"""Upper bound of the memory that a study needs for each cell or initial state."""


def memory() -> int:
    """Physical memory of this machine in bytes; 8 GiB where the system does not say."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 1 << 33


def gigabytes(size: int) -> str:
    """A number of bytes in words."""
    return f"{size / 1e9:.3g} GB"


def max_items(item_bytes: int) -> int:
    """Largest number of items of ``item_bytes`` that fit into memory."""
    return memory() // item_bytes


def check_memory(name: str, count: int, item_bytes: int = _BYTES_PER_ITEM) -> None:
    """Raise `InputError` for the field ``name`` if ``count`` items of ``item_bytes`` do not fit into memory."""
    most = max_items(item_bytes)
    if count > most:
        raise InputError(name, f"must be at most {most:,} on this machine, by its memory", count,
                         f"They need {gigabytes(count * item_bytes)} of its {gigabytes(memory())}.")


def cores() -> int:
    """Number of cores that this process may use; on a shared cluster node those of its job."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
