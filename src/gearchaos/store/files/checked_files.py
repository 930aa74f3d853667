"""Reading of the JSON files of a store, which may be damaged or edited."""

from __future__ import annotations

from gearchaos.store.files.folder import UNREACHABLE, Folder
from gearchaos.store.files.parsing import Schema, parse_as


def read_as(schema: type[Schema], folder: Folder, name: str) -> Schema | None:
    """The content of a file by its schema; None if it is missing or damaged, or does not fit the schema."""
    try:
        return parse_as(schema, folder.read(name))
    except UNREACHABLE:
        raise
    except (OSError, ValueError):
        return None
