"""The cost of storing a map while it is computed, and of computing it in other processes.

Compares, on the same cells of figure 2a: the function in memory; a run into a store in threads; in two processes; on
two Dask workers, both started for the run. The methods alternate, so that variations of the machine's speed affect all
of them. Prints all wall and CPU times, then the medians and their ratios; the goal of a store is at most 1.05.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from itertools import product
from math import isqrt
from pathlib import Path

import numpy as np

from gearchaos.dynamics import Classification
from gearchaos.execute import pools
from gearchaos.model import MeshModel
from gearchaos.store.run import run_into_store
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.maps.zones import Zones


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and CPU seconds of a call, with its child processes that have ended."""
    begin, before = time.perf_counter(), _cpu()
    work()
    return time.perf_counter() - begin, _cpu() - before


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def study(cells: int, longest_transient: int) -> Zones:
    """The study of figure 2a with about this number of cells."""
    side = isqrt(cells)
    axes = Axis("omega", 0.2, 3.0, side), Axis("eps1", 0.0, 0.3, side)
    return Zones(MeshModel.of(q0=0.1), *axes, settings=Classification(longest_transient=longest_transient))


def store(chosen: Zones, path: Path, pool: pools.PoolFactory) -> None:
    """Compute a study into a store."""
    outcome = run_into_store(chosen, path, pool=pool)
    assert outcome.done == outcome.count, outcome.failed


def into_store(chosen: Zones, pool: pools.PoolFactory) -> Callable[[], object]:
    """A function that computes a study into a store in a temporary folder."""
    def work() -> None:
        with tempfile.TemporaryDirectory() as folder:
            store(chosen, Path(folder) / "s.zarr", pool)

    return work


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--longest-transient", type=int, default=800)
    parser.add_argument("--methods", default="memory,threads")
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    chosen = study(given.cells, given.longest_transient)
    study(100, given.longest_transient).run()  # compiled, or loaded from the cache
    methods = {name: _method(name, chosen) for name in given.methods.split(",")}
    times = dict[str, list[tuple[float, float]]]((name, []) for name in methods)
    for _, (name, work) in product(range(given.rounds), methods.items()):
        times[name].append(timed(work))
        print(f"{name:10} {times[name][-1][0]:8.1f} s wall {times[name][-1][1]:8.1f} s CPU", flush=True)
    middle = {name: np.median(every, axis=0) for name, every in times.items()}
    first = next(iter(middle.values()))
    for name, (wall, cpu) in middle.items():
        ratios = f"{wall / first[0]:.3f} and {cpu / first[1]:.3f} of the first"
        print(f"{name:10} {wall:8.1f} s wall {cpu:8.1f} s CPU, medians: {ratios}")


def _method(method: str, chosen: Zones) -> Callable[[], object]:
    """The function to time for a method: "memory", "threads", "processes" or "dask"."""
    if method == "memory":
        return lambda: chosen.run(threads=2)
    if method == "dask":
        return into_store(chosen, pools.local_cluster(2))
    return into_store(chosen, pools.thread_pool(2) if method == "threads" else pools.process_pool(2))


if __name__ == "__main__":
    main()
