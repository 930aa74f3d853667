"""The machine that computes: its cores and its memory."""

from __future__ import annotations

import os

from gearchaos.errors import InputError

_BYTES = 400
"""What a study keeps of each cell or start, at most."""


def memory() -> int:
    """Bytes of memory that this machine has."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 1 << 33


def check_memory(name: str, count: int, each: int = _BYTES) -> None:
    """Raise `InputError` if ``count`` items of ``each`` bytes do not fit into memory."""
    most = memory() // each
    if count > most:
        raise InputError(name, f"must be at most {most:,} on this machine, by its memory", count)


def cores() -> int:
    """Cores that this process may use: on a shared cluster node those of its job."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
