"""Fixed-step Runge-Kutta in C, compiled for this machine and vectorised over lanes."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from gearchaos.model.switched import SwitchedAffine

_POINTER = ctypes.POINTER(ctypes.c_double)


class CRk4:
    """RK4 with a fixed number of steps a period; the contact ratio must be 1.5 and all points alike in stiffness."""

    def __init__(self, system: SwitchedAffine, steps: int) -> None:
        self.steps, self.system = steps, system
        self.function = compiled("rk4.c", f"-DD={system.dimension}").rk4
        angle = np.pi * np.arange(2 * steps + 1) / steps
        self.wave = np.cos(angle), np.sin(angle)
        self.chi = np.repeat(system.levels[0], steps // 2)
        self.arrays = [
            np.ascontiguousarray(a.reshape(system.points, -1).T)
            for a in (system.A, system.b, system.f0, system.f_cos, system.f_sin, system.omega)
        ]

    def advance(self, w: np.ndarray, periods: int) -> np.ndarray:
        """States (d, P) after whole periods."""
        w = np.ascontiguousarray(w.copy())
        arrays = [*self.arrays, self.chi, *self.wave, w]
        self.function(w.shape[1], periods, self.steps, *(a.ctypes.data_as(_POINTER) for a in arrays))
        return w


def compiled(source: str, *defines: str) -> ctypes.CDLL:
    """A C file of this folder as a library for this machine."""
    folder = Path(tempfile.mkdtemp(prefix="gearchaos-bench-"))
    library = folder / "library.so"
    flags = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC", *defines]
    subprocess.run(["gcc", *flags, str(Path(__file__).with_name(source)), "-o", str(library), "-lm"], check=True)
    return ctypes.CDLL(str(library))
