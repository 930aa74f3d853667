"""Files written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from uuid import uuid4


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file whole or not at all; several processes and machines may do so at once. Who dies in the middle leaves
    a file that ends in ``.partial``."""
    draft = path.with_name(f".{path.name}.{uuid4().hex}.partial")
    try:
        draft.write_bytes(content)
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)
