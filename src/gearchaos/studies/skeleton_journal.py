"""The journal of a skeleton: a text file with the lines and curves that are finished, one per line."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.continuation.curve_data import CurveData
from gearchaos.continuation.defining import EventSeed
from gearchaos.errors import InputError

_ARRAYS = ("points", "values", "residual", "angle")
"""Fields that are arrays of real numbers."""


class SkeletonJournal(MutableMapping[str, Any]):
    """Finished work by name, kept in a file; see `gearchaos.continuation.skeleton.Journal`.

    The file is JSON, one document per line: first the settings, then a name and its result each. An item is appended
    when it is set. A line that was not written to its end is removed when the file is opened again.

    Parameters
    ----------
    path : Path
        The file, which is created if it does not exist.
    settings : mapping
        All on which the results depend.

    Raises
    ------
    InputError
        If the file has other settings, is no journal, or cannot be written.
    """

    def __init__(self, path: Path, settings: Mapping[str, Any]) -> None:
        self._path, self._found = path, dict[str, Any]()
        try:
            content = path.read_bytes() if path.exists() else b""
            complete = content[: content.rfind(b"\n") + 1]
            path.touch()
            os.truncate(path, len(complete))
        except OSError as error:
            raise InputError("journal", "must be a file that can be written", str(path), f"{error.strerror}.") from None
        own = json.loads(json.dumps(dict(settings)))
        if complete:
            self._read(complete.splitlines(), own)
        else:
            self._write(own)

    def _read(self, lines: list[bytes], settings: dict[str, Any]) -> None:
        """Take the results from the lines of a journal."""
        try:
            first, *documents = (json.loads(line) for line in lines)
            found = {name: _decoded(value) for name, value in documents} if first == settings else {}
        except (AttributeError, KeyError, TypeError, ValueError):
            raise InputError("journal", "must be a journal of a skeleton, whole and readable", str(self._path),
                             "Delete it, or choose another file.") from None
        if first != settings:
            raise InputError("journal", "must be one of the same model, axes, settings and versions",
                             str(self._path), "Delete it, or choose another file.")
        self._found = found

    def _write(self, document: Any) -> None:
        """Append one document as a line."""
        with self._path.open("ab") as file:
            file.write(json.dumps(document).encode() + b"\n")

    def __getitem__(self, name: str) -> Any:
        return self._found[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self._found[name] = value
        self._write([name, _encoded(value)])

    def __delitem__(self, name: str) -> None:
        raise TypeError("finished work is not deleted")

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)


def _encoded(value: Any) -> Any:
    """The result of a line or a curve as JSON: a list of events, a curve, or why there is none."""
    if isinstance(value, list):
        return [_fields(seed) for seed in value]
    return {"why": value} if isinstance(value, str) else _fields(value)


def _fields(value: EventSeed | CurveData) -> dict[str, Any]:
    """The fields of a value as JSON."""
    out = {f.name: getattr(value, f.name) for f in fields(value)}
    if "multipliers" in out:
        out["multipliers"] = out["multipliers"].view(float).tolist()
        out["special"] = [[kind, values.tolist()] for kind, values in out["special"]]
    return {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in out.items()}


def _decoded(value: Any) -> Any:
    """The result of a line or a curve from JSON."""
    if isinstance(value, list):
        return [EventSeed(**_arrays(seed)) for seed in value]
    if "why" in value:
        return value["why"]
    out = _arrays(value)
    out["multipliers"] = np.array(out["multipliers"], float).view(complex)
    out["special"] = [(kind, np.array(values)) for kind, values in out["special"]]
    out["ends"] = [tuple(end) for end in out["ends"]]
    return CurveData(**out)


def _arrays(value: dict[str, Any]) -> dict[str, Any]:
    """The fields of a value with its arrays of real numbers."""
    return {name: np.array(v, float) if name in _ARRAYS and isinstance(v, list) else v for name, v in value.items()}
