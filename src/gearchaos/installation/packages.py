"""The packages that gearchaos requires, by the metadata of its installation."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module, metadata

from packaging.requirements import Requirement

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
    found = map(Requirement, metadata.requires("gearchaos") or [])
    return [r for r in found if r.name != "gearchaos" and _belongs(r, extra)]


def _belongs(requirement: Requirement, extra: str) -> bool:
    """Whether a requirement is one of an extra, or, for "", one of all installations."""
    marker = requirement.marker
    if not extra or marker is None:
        return not extra and (marker is None or marker.evaluate({"extra": ""}))
    return marker.evaluate({"extra": extra}) and not marker.evaluate({"extra": ""})


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
        try:
            import_module(_module(name))
        except Exception as error:  # whatever a broken package raises while it is imported
            yield f"{name} cannot be imported ({type(error).__name__}: {error})"


def _module(package: str) -> str:
    """The module that a package installs, e.g. flint of python-flint."""
    names = _modules().get(_normal(package), [])
    return next((n for n in names if not n.startswith("_")), package.replace("-", "_"))


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
