"""Files that may be damaged: read with care, and the sums that tell whether they are still what was written."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read_json(path: Path) -> Any:
    """What a file holds, None if it is missing or damaged."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def sums(root: Path, files: Iterable[Path]) -> dict[str, int]:
    """A checksum for each file, by its name below ``root``."""
    return {str(f.relative_to(root)): zlib.crc32(f.read_bytes()) for f in files}


def differing(root: Path, expected: dict[str, int]) -> list[str]:
    """Names of files that are missing or have another checksum."""
    return [n for n, s in expected.items() if not (root / n).is_file() or zlib.crc32((root / n).read_bytes()) != s]
