"""This installation: its packages, versions and machine for reports of errors, and checks that it works."""

from __future__ import annotations

import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib import import_module, metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from gearchaos.execute.machine import cores, memory

if TYPE_CHECKING:
    from gearchaos.model import MeshModel

DEVELOPERS_EXTRAS = ("test", "bench", "mutation", "docs")
"""Extras that no command needs."""

EXTRAS = {
    "app": "the explorer (gearchaos explore)",
    "cluster": "runs on Dask and Slurm (gearchaos run --scheduler, --cluster)",
    "proof": "proofs (gearchaos regime --prove, prove-chaos)",
    "sympy": "equations in SymPy (gearchaos.to_sympy)",
    "object": "stores in object storage",
    "tables": "tables of designs in workbooks (.xlsx, .xls, .ods)",
    "uff": "signals and order spectra for and from programs of test benches (.uff)",
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
        modules = _modules().get(canonicalize_name(name), [])  # flint of python-flint
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
            out.setdefault(canonicalize_name(package), []).append(module)
    return out


_VARIABLES = ("GEARCHAOS_", "NUMBA_", "MPLBACKEND", "OMP_NUM_THREADS", "PYTHONPATH")
"""Beginnings of the names of environment variables that change how gearchaos runs."""


def report() -> dict[str, Any]:
    """Versions, machine and kernel cache of this installation, and the variables that change how gearchaos runs.

    Packages that are missing have None for their version; ``processor`` is a `gearchaos.flow.Processor`.
    """
    from gearchaos.flow import cache_directory, processor  # here, since packages are checked where this may fail

    needed: dict[str, str | None] = {"llvmlite": None}
    needed |= dict.fromkeys(r.name for extra in ("", *extras()) for r in requirements(extra))
    for name in needed:
        with suppress(metadata.PackageNotFoundError):
            needed[name] = metadata.version(name)
    folder = cache_directory()
    kernels = [f for f in folder.rglob("*") if f.suffix in (".nbi", ".nbc")]
    return {
        "gearchaos": metadata.version("gearchaos"),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "platform": platform.platform(),
        "packages": needed,
        "processor": vars(processor()),
        "cores": cores(),
        "memory": memory(),
        "kernel_cache": {
            "folder": str(folder), "kernels": sum(f.suffix == ".nbi" for f in kernels),
            "bytes": sum(f.stat().st_size for f in kernels),
        },
        "environment": {n: v for n, v in sorted(os.environ.items()) if n.startswith(_VARIABLES)},
    }


TOLERANCE = 1e-12
"""Largest difference allowed, in half backlashes and per unit of τ. Other versions of NumPy and SciPy, and other
processors, may round differently, by which the polished orbit moves some 1e-15."""

STORED = (
    (0.3320708861077118, 0.06785315128540206),
    (0.9251966176933386, 0.031235235156708053),
    (0.7527561012182468, 0.16782381879674596),
)
"""z and z' of a periodic orbit, that of `model`, at τ = 0, T, 2T, from the state with the least z on."""


@dataclass(frozen=True)
class Check:
    """The outcome of one check."""

    name: str
    status: str  # "ok", "failed", or of optional parts alone "missing"
    detail: str  # what was found
    mend: str = ""  # what to do, unless it is ok


class _FailedError(Exception):
    """A check that failed: what was found, and what to do."""

    def __init__(self, detail: str, mend: str) -> None:
        super().__init__(detail)
        self.detail, self.mend = detail, mend


_REQUIRED: dict[str, Callable[[], str]] = {}
"""The checks of what every command needs, in their order: functions that return what they found."""


def _required(name: str) -> Callable[[Callable[[], str]], Callable[[], str]]:
    """The decorator of a check in `_REQUIRED`."""
    return lambda check: _REQUIRED.setdefault(name, check)


@_required("packages")
def _packages() -> str:
    """All packages that every command needs."""
    needed = requirements()
    if wrong := list(problems(needed)):
        raise _FailedError("; ".join(wrong), "pip install --upgrade --force-reinstall gearchaos")
    return f"{len(needed)} required packages can be imported"


@_required("temporary folder")
def _temporary_folder() -> str:
    """A file can be written to the folder of temporary files."""
    try:
        with tempfile.NamedTemporaryFile() as file:
            file.write(b"x")
            return str(Path(file.name).parent)
    except OSError as error:
        raise _FailedError(f"cannot be written ({error})", "Set TMPDIR to a folder that you may write in.") from None


_EARLIEST = time.mktime((2026, 11, 1, 0, 0, 0, 0, 0, 0))
"""No clock can show a time before this version."""


@_required("clock")
def _clock() -> str:
    """The clock shows a possible time, and that of the file system of temporary files."""
    with tempfile.NamedTemporaryFile() as file:
        written = os.stat(file.name).st_mtime
    now = time.time()
    shown = time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(now))
    if now < _EARLIEST:
        raise _FailedError(f"it shows {shown}, before this version of gearchaos was written",
                           "Set the clock of this machine.")
    if abs(now - written) > 60:
        raise _FailedError(f"it differs by {abs(now - written):.0f} s from that of the temporary folder's file system",
                           "Set the clocks of this machine and of its file server: runs on several machines compare "
                           "times.")
    return shown


@_required("kernel cache")
def _kernel_cache() -> str:
    """A file can be written to the folder of compiled kernels."""
    from gearchaos.flow import cache_directory

    folder = cache_directory()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return str(folder)
    except OSError as error:
        raise _FailedError(f"{folder} cannot be written ({error.strerror}): every process would compile for itself",
                           "Allow writing to it, or set NUMBA_CACHE_DIR to a folder that you may write in.") from None


def model() -> MeshModel:
    """The model of the stored orbit, a stable one of three mesh periods on which the teeth separate."""
    from gearchaos.model import MeshModel

    return MeshModel.of(kind="torsional", omega=0.8, q0=0.1, eps1=0.1)


def computed() -> list[tuple[float, float]]:
    """z and z' of the orbit as this installation computes them, from the state with the least z on."""
    from gearchaos.studies.motion.regime import regime

    section = regime(model()).section
    states = list(zip(map(float, section["z"]), map(float, section["z_dot"]), strict=True))
    least = states.index(min(states))
    return states[least:] + states[:least]


@_required("kernels")
def _kernels() -> str:
    """The kernels of the smallest state are compiled, or loaded from the cache."""
    from gearchaos.flow import on_compile, processor

    compiled: list[int] = []
    on_compile(lambda: compiled.append(1))
    begin = time.perf_counter()
    computed()
    done = f"compiled {len(compiled)}" if compiled else "loaded"
    target = processor()
    slow = "" if target.fma else "; without fused multiply-add they are slow"
    return f"{done} in {time.perf_counter() - begin:.1f} s for {target.name} with {target.instruction_set}{slow}"


@_required("orbit")
def _orbit() -> str:
    """A known orbit has its stored values."""
    found = computed()
    pairs = zip(sum(found, ()), sum(STORED, ()), strict=False)
    difference = max(abs(a - b) for a, b in pairs) if len(found) == len(STORED) else float("inf")
    if not difference <= TOLERANCE:
        raise _FailedError(f"it differs by {difference:.1e} from its stored values, more than {TOLERANCE:.0e}",
                           "Do not use results of this installation. Report the output of gearchaos --version "
                           "--verbose, and install the tested versions of all packages (constraints.txt).")
    return "equal to its stored values, bit for bit" if difference == 0 else (
        f"equal to its stored values to {difference:.0e}")


@_required("files")
def _files() -> str:
    """A result is written as NetCDF and read again."""
    import gearchaos as gc

    with tempfile.TemporaryDirectory() as folder:
        written = gc.simulate(model(), 3)
        gc.save(written, Path(folder) / "orbit.nc")
        if not gc.load(Path(folder) / "orbit.nc").equals(written):
            raise _FailedError("a result that was written is another one when it is read",
                          "pip install --upgrade --force-reinstall h5netcdf h5py xarray")
    return "a result is written as NetCDF and read again"


def _proof() -> str:
    """The known orbit is proved."""
    import gearchaos as gc
    from gearchaos.proof.certificate import Unproved

    result = gc.prove(model())
    if isinstance(result, Unproved):
        raise _FailedError(f"a known orbit cannot be proved: {result.in_words()}",
                           'pip install --upgrade --force-reinstall "gearchaos[proof]"')
    return "a known orbit is proved in ball arithmetic"


def _outcome(name: str, run: Callable[[], str]) -> Check:
    """The outcome of a check that returns what it found."""
    try:
        return Check(name, "ok", run())
    except _FailedError as failure:
        return Check(name, "failed", failure.detail, failure.mend)
    except Exception as error:  # a broken installation may raise anything, and the next checks are wanted as well
        return Check(name, "failed", f"{type(error).__name__}: {error}",
                     "Mend the checks above first. If they are ok, report this error together with the output of "
                     "gearchaos --version --verbose.")


def checks() -> Iterator[Check]:
    """Check this installation; yields each outcome as soon as it is known. No check raises an error."""
    for name, run in _REQUIRED.items():
        yield _outcome(name, run)
    whole = []
    for extra in extras():
        install, purpose = f'pip install "gearchaos[{extra}]"', EXTRAS.get(extra, "")
        wrong = list(problems(requirements(extra)))
        if not wrong:
            whole.append(extra)
            yield Check(extra, "ok", purpose)
        elif all(problem.endswith("is missing") for problem in wrong):
            yield Check(extra, "missing", f"{purpose}: {'; '.join(wrong)}", install)
        else:
            yield Check(extra, "failed", f"{purpose}: {'; '.join(wrong)}", f"{install} --upgrade")
    if "proof" in whole:
        yield _outcome("a proof", _proof)
