"""The sums that tell whether files are still what was written."""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from pathlib import Path


def sums(root: Path, files: Iterable[Path]) -> dict[str, int]:
    """A checksum for each file, by its name below ``root``."""
    return {str(f.relative_to(root)): zlib.crc32(f.read_bytes()) for f in files}


def differing(root: Path, expected: dict[str, int]) -> list[str]:
    """Names of files that are missing or have another checksum."""
    return [n for n, s in expected.items() if not (root / n).is_file() or zlib.crc32((root / n).read_bytes()) != s]
