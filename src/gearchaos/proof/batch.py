"""Proofs of many orbits in a process of their own.

The precision of ball arithmetic is global to a process, and python-flint is not safe in threads. The processes are
started by a command, neither forked nor spawned by `multiprocessing`: so a script that asks for proofs needs no guard
of its main module, and proofs can be made in the worker processes of other libraries.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearchaos.model.parameters import MeshModel
from gearchaos.processes import python_command

# Environment of the processes. With one thread NumPy's matrix routines round in the same way on every machine load:
_ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


class OrbitToProve(NamedTuple):
    """An approximate orbit."""

    model: MeshModel
    points: np.ndarray  # (n, d), its states w at τ = k T
    certificate: str | None = None  # path of the file to which the certificate is written if the orbit is proved


def prove_in_process(orbits: list[OrbitToProve]) -> np.ndarray:
    """Prove orbits one after the other in a new process; gives their codes (`Proved`, reason), (L, 2) of int8.

    Raises `RuntimeError` if the process fails; the message has the last line that it wrote to stderr.
    """
    command = python_command("from gearchaos.proof.batch import main; main()")
    done = subprocess.run(command, input=pickle.dumps(orbits, pickle.HIGHEST_PROTOCOL), capture_output=True,
                          env=os.environ | _ONE_THREAD, check=False)
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise RuntimeError(f"the process that proves orbits failed, {' '.join(last) or f'code {done.returncode}'}")
    return np.array(pickle.loads(done.stdout), dtype=np.int8).reshape(-1, 2)


def main() -> None:
    """Prove the orbits on stdin, and write their codes to stdout."""
    from gearchaos.proof.certificate import NO_REASON, REASON_CODES, Certificate, Proved
    from gearchaos.proof.prove import prove_at_some_phase

    codes, known = [], {reason: code for code, reason in REASON_CODES.items()}
    for model, points, certificate in pickle.load(sys.stdin.buffer):
        result = prove_at_some_phase(model, points)
        if certificate is not None and isinstance(result, Certificate):
            result.write(Path(certificate))
        codes.append((int(Proved.PROVED), NO_REASON) if isinstance(result, Certificate) else
                     (int(Proved.NOT_PROVED), known[result.reason]))
    sys.stdout.buffer.write(pickle.dumps(codes))
