"""What a process does that compiles kernels beside another, see `beside`."""

from __future__ import annotations

import os
import pickle
import sys

import numpy as np

from gearchaos.flow import exact, step_tables
from gearchaos.flow.kernels.orbits.orbits import near_returns, newton_iteration, start_newton_search
from gearchaos.flow.polynomials import correct_any


def main(job: str) -> None:
    """Compile the kernels of one job for the system on stdin, from arguments of the right types."""
    system = pickle.load(sys.stdin.buffer)
    w = np.zeros((system.dimension, 1))
    if job == "advance":
        step_tables.tabulate_steps = lambda *_: None  # tables of zeros will do
        exact.ExactFlow(system).advance(w, 1)
    elif job == "corrections":
        correct_any(system)
    else:
        near_returns(np.zeros((5, *w.shape)), 2, 0.1, 0.1, 1)
        tangent = np.zeros((system.dimension, *w.shape))
        newton_iteration(start_newton_search(w), np.arange(1), w, tangent, np.zeros(1, np.int64), 0.1, 0.1)
    os._exit(0)  # nothing else is to be done
