"""Checksums of whole files."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from pathlib import Path


def checksums(root: Path, files: Iterable[Path]) -> dict[str, int]:
    """The CRC-32 of each file by its path relative to ``root``."""
    return {str(f.relative_to(root)): zlib.crc32(f.read_bytes()) for f in files}


def differing(root: Path, expected: dict[str, int]) -> list[str]:
    """The names of the files that are missing or have a checksum other than the expected one."""
    return [n for n, s in expected.items() if not (root / n).is_file() or zlib.crc32((root / n).read_bytes()) != s]
