"""The kernels of a first run compiled at the same time, in processes beside the one that waits for them.

Numba compiles one kernel after the other in a process. While that of the step tables is compiled, the first one that a
motion needs, two processes compile the others, which are then loaded from the cache. If one of them fails or is killed,
whoever needs its kernel compiles it, as without them.
"""

from __future__ import annotations

import pickle
import subprocess
from contextlib import suppress
from threading import Thread
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.flow.kernels.compilation import is_missing
from gearchaos.flow.kernels.one_spring.advance import advance_packs
from gearchaos.flow.kernels.orbits.correction import correct_orbit
from gearchaos.flow.kernels.vector.arrays import dimensions
from gearchaos.processes import python_command

if TYPE_CHECKING:
    from gearchaos.flow.system import SwitchedSystem

_allowed = False
_begun: set[tuple[Any, ...]] = set()
"""Jobs and arguments ``dims`` for whose kernels processes were started, or which were found on disk."""


def compile_beside() -> None:
    """Let this process start others that compile kernels, where those of a motion are not on disk.

    It is for processes of our own, with more than one core: they run ``sys.executable``.

    Examples
    --------
    >>> from gearchaos.flow import compile_beside
    >>> compile_beside()
    """
    global _allowed
    _allowed = True


def compile_others(system: SwitchedSystem) -> None:
    """Begin to compile in other processes what motions of a system need once their step tables are made."""
    _begin(("advance", "orbits"), advance_packs, system)


def compile_corrections(system: SwitchedSystem) -> None:
    """Begin to compile in another process what orbits along parameters need, unless they are corrected without it.

    Parameters
    ----------
    system : SwitchedSystem

    Examples
    --------
    >>> import gearchaos as gc
    >>> from gearchaos.flow import compile_corrections
    >>> from gearchaos.studies.core.initial_value_problems import initial_value_problems
    >>> compile_corrections(initial_value_problems(gc.MeshModel.of(q0=0.1)).flow.system)
    """
    if not system.law.releases:
        _begin(("corrections",), correct_orbit, system)


def _begin(jobs: tuple[str, ...], kernel: Any, system: SwitchedSystem) -> None:
    """Start a process for each job unless this kernel, one of theirs, is on disk."""
    dims = dimensions(system.dimension, system.law.name)
    if not _allowed or (jobs, dims) in _begun:
        return
    _begun.add((jobs, dims))
    if is_missing(kernel, dims):
        given = pickle.dumps(system.take(np.zeros(1, int)))
        for job in jobs:
            Thread(target=_start, args=(job, given), daemon=True).start()


def _start(job: str, given: bytes) -> None:
    """Run `first_kernels.main` in a process for one job, and wait for it."""
    command = python_command(f"from gearchaos.flow.first_kernels import main; main({job!r})")
    with suppress(OSError):  # no program, or no memory for one
        subprocess.run(command, input=given, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
