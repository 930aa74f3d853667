"""What it costs to write a map to disk as it is computed, and to compute it elsewhere.

Compares, on the same cells of figure 2a: the function in memory; a run into a store in threads; in two processes; on
two Dask workers. They take turns, so that a slow moment of the machine meets them all; prints every wall and CPU time
(of processes, too, but not of Dask's workers), and at last the medians and their ratios.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from itertools import product
from math import isqrt
from pathlib import Path

import numpy as np

from gearchaos.dynamics import Classification
from gearchaos.execute import pools
from gearchaos.model import MeshModel
from gearchaos.store.run import run_into_store
from gearchaos.studies.axis import Axis
from gearchaos.studies.zones import Zones


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and CPU seconds."""
    begin, before = time.perf_counter(), _cpu()
    work()
    return time.perf_counter() - begin, _cpu() - before


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def study(cells: int, patience: int) -> Zones:
    side = isqrt(cells)
    axes = Axis("omega", 0.2, 3.0, side), Axis("eps1", 0.0, 0.3, side)
    return Zones(MeshModel.of(q0=0.1), *axes, settings=Classification(longest_transient=patience))


def store(chosen: Zones, path: Path, pool: pools.PoolFactory) -> None:
    """Compute a whole study into a store."""
    outcome = run_into_store(chosen, path, pool=pool)
    assert outcome.done == outcome.count, outcome.failed


def into_store(chosen: Zones, pool: pools.PoolFactory) -> Callable[[], object]:
    def work() -> None:
        with tempfile.TemporaryDirectory() as folder:
            store(chosen, Path(folder) / "s.zarr", pool)

    return work


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--patience", type=int, default=800)
    parser.add_argument("--ways", default="memory,threads")
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    chosen = study(given.cells, given.patience)
    study(100, given.patience).run()  # compiled, or loaded from the cache
    with ExitStack() as stack:
        ways = {name: _way(name, chosen, stack) for name in given.ways.split(",")}
        times = dict[str, list[tuple[float, float]]]((name, []) for name in ways)
        for _, (name, work) in product(range(given.rounds), ways.items()):
            times[name].append(timed(work))
            print(f"{name:10} {times[name][-1][0]:8.1f} s wall {times[name][-1][1]:8.1f} s CPU", flush=True)
    middle = {name: np.median(every, axis=0) for name, every in times.items()}
    first = next(iter(middle.values()))
    for name, (wall, cpu) in middle.items():
        ratios = f"{wall / first[0]:.3f} and {cpu / first[1]:.3f} of the first"
        print(f"{name:10} {wall:8.1f} s wall {cpu:8.1f} s CPU, medians: {ratios}")


def _way(way: str, chosen: Zones, stack: ExitStack) -> Callable[[], object]:
    if way == "memory":
        return lambda: chosen.run(threads=2)
    if way == "dask":
        from distributed import LocalCluster

        local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
        cluster = stack.enter_context(LocalCluster(**local))
        return into_store(chosen, pools.dask_workers(cluster.scheduler_address))
    return into_store(chosen, pools.thread_pool(2) if way == "threads" else pools.process_pool(2))


if __name__ == "__main__":
    main()
