"""Checksums of whole files."""

from __future__ import annotations

import zlib
from collections.abc import Iterable

from gearchaos.store.files.folder import UNREACHABLE, Folder


def checksums(folder: Folder, names: Iterable[str]) -> dict[str, int]:
    """The CRC-32 of each file by its name."""
    return {name: zlib.crc32(folder.read(name)) for name in names}


def differing(folder: Folder, expected: dict[str, int]) -> list[str]:
    """The names of the files that are missing or have a checksum other than the expected one."""
    return [name for name, checksum in expected.items() if _checksum(folder, name) != checksum]


def _checksum(folder: Folder, name: str) -> int | None:
    """The CRC-32 of a file; None if it cannot be read."""
    try:
        return zlib.crc32(folder.read(name))
    except UNREACHABLE:
        raise
    except OSError:
        return None
