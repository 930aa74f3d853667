"""Compile the kernels ahead of time, one process for each dimension of the dynamic state."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from typing import Any

from gearchaos.dynamics import classify
from gearchaos.execute.machine import cores
from gearchaos.flow import ExactFlow, correct_any
from gearchaos.model import DEFAULT_LAW, DEFAULT_LAW_OF_GEARS, MeshModel, ToothPairStiffness, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from gearchaos.processes import end_with_parent

MODELS: dict[int, dict[str, Any]] = {
    2: {"kind": "torsional"},
    3: {"kind": "torsional", "beta1": 0.02},
    4: {"kind": "full"},
    5: {"kind": "full", "beta1": 0.02},
    6: {"kind": "full", "kappa1": 0.4},
    7: {"kind": "full", "beta1": 0.02, "kappa1": 0.4},
}
"""Parameters of a model for each dimension d: unequal bearings add one coordinate, unequal supports two."""


def warmup(
    dimensions: Sequence[int] = tuple(MODELS), damping_laws: Sequence[str] = (DEFAULT_LAW, DEFAULT_LAW_OF_GEARS)
) -> Iterator[tuple[int, str, float]]:
    """Compile the kernels of these dimensions and damping laws in parallel, unless they are in the disk cache.

    Yields each dimension and law with the compilation time in seconds, in the order of completion.
    """
    with ProcessPoolExecutor(cores(), mp_context=get_context("spawn"), initializer=end_with_parent) as pool:
        for done in as_completed([pool.submit(_run, d, law) for law in damping_laws for d in dimensions]):
            yield done.result()


def _run(dimension: int, damping_law: str) -> tuple[int, str, float]:
    """Classify one motion of these, differentiate it and correct its orbit, which compiles all kernels; both and the
    seconds."""
    begin = time.perf_counter()
    batch = vary(MeshModel.of(**MODELS[dimension], damping_law=damping_law), {})
    system = switched_system(batch)
    assert system.dimension == dimension
    w = initial_state(batch, system)
    classify(ExactFlow(system), w.T.copy())
    correct_any(system)
    if not system.law.releases:
        pairs = vary(batch.model.with_values({"stiffness": ToothPairStiffness()}), {})
        classify(ExactFlow(switched_system(pairs)), w.T.copy())
    return dimension, damping_law, time.perf_counter() - begin
