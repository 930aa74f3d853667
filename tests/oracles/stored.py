"""Results of the oracles in files, so that what has been integrated once is not integrated at every run.

A result is found by its function and the inputs; inputs without a result, such as those whose last bits another
processor computes otherwise, are integrated. A file says of which sources its results are: if these have changed, all
of them are integrated, and ``test_stored.py`` fails until ``make oracles`` has written the file anew.
``GEARCHAOS_ORACLES=anew`` integrates everything, as ``make slow`` does, and ``write`` also writes the files.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
RESULTS = HERE / "results"
MODE = os.environ.get("GEARCHAOS_ORACLES", "")


def stored(*others: str, digits: int = 17) -> Callable[[Callable], Callable]:
    """Decorates an oracle that returns an array, or arrays by name; ``others`` are sources beside its own file.

    Inputs are the same if they agree in so many digits: 17 tell all numbers apart."""
    def decorate(oracle: Callable) -> Callable:
        file = _file(Path(sys.modules[oracle.__module__].__file__).stem, others)

        @wraps(oracle)
        def found(*inputs: Any) -> Any:
            key = digest([oracle.__name__, *(rounded(plain(value), digits) for value in inputs)])
            if not MODE and file.valid and key in file.results:
                return _arrays(file.results[key])
            result = oracle(*inputs)
            file.integrated[key] = plain(result)
            return result
        return found
    return decorate


def plain(value: Any) -> Any:
    """A value as what JSON has, without the fields of a dataclass that have their default."""
    if is_dataclass(value):
        changed = {f.name: plain(getattr(value, f.name)) for f in fields(value) if not _is_default(value, f)}
        return {type(value).__name__: changed}
    if isinstance(value, dict):
        return {str(name): plain(inner) for name, inner in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return [plain(inner) for inner in value] if isinstance(value, (list, tuple)) else value


def rounded(value: Any, digits: int) -> Any:
    """Of what JSON has, every float with so many digits."""
    if isinstance(value, dict):
        return {name: rounded(inner, digits) for name, inner in value.items()}
    if isinstance(value, list):
        return [rounded(inner, digits) for inner in value]
    return f"{value:.{digits - 1}e}" if isinstance(value, float) else value


def digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True, default=repr).encode()).hexdigest()[:16]


class File:
    """The results of an oracle's module: its digests, then a line for each."""

    def __init__(self, name: str, sources: tuple[str, ...]) -> None:
        self.path = RESULTS / f"{name}.json"
        self.source = digest([(HERE / f"{source}.py").read_text(encoding="utf-8") for source in (name, *sources)])
        content = json.loads(self.path.read_text(encoding="utf-8")) if self.path.exists() else {}
        self.results, self.integrated = content.get("results", {}), {}
        self.valid = content.get("source") == self.source
        self.whole = content.get("digest") == digest(self.results)

    def write(self) -> None:
        """Write what this process has integrated, and nothing else."""
        self.path.parent.mkdir(exist_ok=True)
        head = {"source": self.source, "digest": digest(self.integrated)}
        rows = ",\n".join(f"{json.dumps(key)}: {json.dumps(self.integrated[key])}" for key in sorted(self.integrated))
        self.path.write_text(f'{json.dumps(head)[:-1]}, "results": {{\n{rows}\n}}}}\n', encoding="utf-8")


FILES: dict[str, File] = {}


def _file(name: str, sources: tuple[str, ...]) -> File:
    if name not in FILES:
        FILES[name] = File(name, sources)
    return FILES[name]


def _arrays(result: Any) -> Any:
    return {name: np.array(values) for name, values in result.items()} if isinstance(result, dict) else np.array(result)


def _is_default(value: Any, field: Any) -> bool:
    default = field.default if field.default_factory is MISSING else field.default_factory()
    own = getattr(value, field.name)
    return type(own) is type(default) and plain(own) == plain(default) if default is not MISSING else False
