"""What is installed: the packages that gearchaos requires, and what a report of an error says of an installation."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module, metadata
from typing import Any

from packaging.requirements import Requirement

from gearchaos.execute.machine import cores, memory

DEVELOPERS_EXTRAS = ("test", "bench", "mutation", "docs")
"""Extras that no command needs."""

EXTRAS = {
    "app": "the explorer (gearchaos explore)",
    "cluster": "runs on Dask and Slurm (gearchaos run --scheduler, --cluster)",
    "proof": "proofs (gearchaos regime --prove, prove-chaos)",
    "sympy": "equations in SymPy (gearchaos.to_sympy)",
    "object": "stores in object storage",
    "tables": "tables of designs in workbooks (.xlsx, .xls, .ods)",
}
"""What the extras are for."""


def extras() -> list[str]:
    """The extras of this version, without those for its developers."""
    return [e for e in metadata.metadata("gearchaos").get_all("Provides-Extra") or [] if e not in DEVELOPERS_EXTRAS]


def requirements(extra: str = "") -> list[Requirement]:
    """What an extra requires on this platform; without one, what every command requires."""

    def belongs(requirement: Requirement) -> bool:
        marker = requirement.marker
        if not extra or marker is None:
            return not extra and (marker is None or marker.evaluate({"extra": ""}))
        return marker.evaluate({"extra": extra}) and not marker.evaluate({"extra": ""})

    found = map(Requirement, metadata.requires("gearchaos") or [])
    return [r for r in found if r.name != "gearchaos" and belongs(r)]


def problems(found: list[Requirement]) -> Iterator[str]:
    """What is wrong with required packages: one text for each that is missing, broken or of a wrong version."""
    for requirement in found:
        name = requirement.name
        try:
            version = metadata.version(name)
        except metadata.PackageNotFoundError:
            yield f"{name} is missing"
            continue
        if not requirement.specifier.contains(version, prereleases=True):
            yield f"{name} {version} is installed, but {name}{requirement.specifier} is needed"
        modules = _modules().get(_normal(name), [])  # flint of python-flint
        try:
            import_module(next((n for n in modules if not n.startswith("_")), name.replace("-", "_")))
        except Exception as error:  # whatever a broken package raises while it is imported
            yield f"{name} cannot be imported ({type(error).__name__}: {error})"


@cache
def _modules() -> dict[str, list[str]]:
    """The modules of each installed package."""
    out: dict[str, list[str]] = {}
    for module, packages in sorted(metadata.packages_distributions().items()):
        for package in packages:
            out.setdefault(_normal(package), []).append(module)
    return out


def _normal(package: str) -> str:
    """The name of a package in the form in which names are compared."""
    return re.sub(r"[-_.]+", "-", package).lower()


_VARIABLES = ("GEARCHAOS_", "NUMBA_", "MPLBACKEND", "OMP_NUM_THREADS", "PYTHONPATH")
"""Beginnings of the names of environment variables that change how gearchaos runs."""


def report() -> dict[str, Any]:
    """Versions, machine and kernel cache of this installation, and the variables that change how gearchaos runs.

    Packages that are missing have None for their version; ``processor`` is a `gearchaos.flow.Processor`.
    """
    from gearchaos.flow import cache_directory, processor  # here, since packages are checked where this may fail

    needed = [r for extra in ("", *extras()) for r in requirements(extra)]
    folder = cache_directory()
    kernels = [f for f in folder.rglob("*") if f.suffix in (".nbi", ".nbc")]
    return {
        "gearchaos": metadata.version("gearchaos"),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "platform": platform.platform(),
        "packages": {name: _version(name) for name in ("llvmlite", *dict.fromkeys(r.name for r in needed))},
        "processor": vars(processor()),
        "cores": cores(),
        "memory": memory(),
        "kernel_cache": {
            "folder": str(folder), "kernels": sum(f.suffix == ".nbi" for f in kernels),
            "bytes": sum(f.stat().st_size for f in kernels),
        },
        "environment": {n: v for n, v in sorted(os.environ.items()) if n.startswith(_VARIABLES)},
    }


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None
