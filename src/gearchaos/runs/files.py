"""Small files written whole or not at all, and the sums that tell whether they are still what was written."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from uuid import uuid4


def write_text(path: Path, text: str) -> None:
    """Write a small file whole or not at all; several machines may do so at once."""
    draft = path.with_name(f".{path.name}.{uuid4().hex}")
    try:
        draft.write_text(text)
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)


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
