"""What a report of an error should say of the installation: versions, processor, memory, kernel cache."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from gearchaos.execute.machine import cores, memory
from gearchaos.flow import cache_directory, processor
from gearchaos.installation.packages import extras, requirements

_VARIABLES = ("GEARCHAOS_", "NUMBA_", "MPLBACKEND", "OMP_NUM_THREADS", "PYTHONPATH")
"""Beginnings of the names of environment variables that change how gearchaos runs."""


def report() -> dict[str, Any]:
    """Versions, machine and kernel cache of this installation, as it can be written as JSON.

    Returns
    -------
    dict
        ``gearchaos``, ``python``, ``platform``; ``packages``: the version of each package that is used, None if it is
        missing; ``processor``: see `gearchaos.flow.Processor`; ``cores``: those that this process may use; ``memory``
        in bytes; ``kernel_cache`` with ``folder``, ``kernels`` and ``bytes`` of this version; ``environment``:
        variables that change how gearchaos runs.
    """
    needed = [r for extra in ("", *extras()) for r in requirements(extra)]
    return {
        "gearchaos": metadata.version("gearchaos"),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "platform": platform.platform(),
        "packages": {name: _version(name) for name in ("llvmlite", *dict.fromkeys(r.name for r in needed))},
        "processor": vars(processor()),
        "cores": cores(),
        "memory": memory(),
        "kernel_cache": _cache(cache_directory()),
        "environment": {n: v for n, v in sorted(os.environ.items()) if n.startswith(_VARIABLES)},
    }


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _cache(folder: Path) -> dict[str, Any]:
    """The folder of compiled kernels, their number and size."""
    files = [f for f in folder.rglob("*") if f.suffix in (".nbi", ".nbc")]
    return {"folder": str(folder), "kernels": sum(f.suffix == ".nbi" for f in files),
            "bytes": sum(f.stat().st_size for f in files)}
