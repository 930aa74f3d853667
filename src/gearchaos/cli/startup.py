"""Faster start of commands: Numba is imported without what the kernels do not need."""

from __future__ import annotations

import sys

own_process = False
"""Whether this process runs a command and nothing else; `gearchaos.cli.main` says so."""

_BLAS = "scipy.linalg.cython_blas"


def load_numba() -> None:
    """Import Numba; in a command's own process without SciPy's linear algebra, which takes up to a quarter of a second.

    With its first compiled function Numba imports SciPy's BLAS, for functions that use `numpy.dot` or `numpy.linalg`.
    The kernels use neither, and no other compiled functions run there. SciPy itself can be imported afterwards.
    """
    if not own_process or _BLAS in sys.modules:
        return
    sys.modules[_BLAS] = None  # type: ignore[assignment]  # importing it fails, and Numba goes on without
    try:
        import numba.np.arraymath  # noqa: F401
    finally:
        del sys.modules[_BLAS]
