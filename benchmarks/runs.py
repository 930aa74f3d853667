"""What it costs to write a map to disk as it is computed, and to compute it elsewhere.

Compares, on the same cells of figure 2a: the function in memory; a run into a store in threads; in two processes; on
two Dask workers. Prints wall and CPU times (children included) and their ratios.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from math import isqrt
from pathlib import Path

from gearchaos.axis import Axis
from gearchaos.model import MeshModel
from gearchaos.motion import Budget
from gearchaos.runs import engines
from gearchaos.runs.resolved import Resolved
from gearchaos.runs.run import run


def timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and CPU seconds."""
    begin, before = time.perf_counter(), _cpu()
    work()
    return time.perf_counter() - begin, _cpu() - before


def _cpu() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def study(cells: int, patience: int) -> Resolved:
    side = isqrt(cells)
    axes = Axis("omega", 0.2, 3.0, side), Axis("eps1", 0.0, 0.3, side)
    return Resolved("zones", MeshModel.of(q0=0.1), axes, {}, Budget(patience=patience))


def into_store(chosen: Resolved, engine: engines.Engine) -> Callable[[], object]:
    def work() -> None:
        with tempfile.TemporaryDirectory() as folder:
            outcome = run(chosen, Path(folder) / "s.zarr", engine=engine)
            assert outcome.done == outcome.count

    return work


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1_000_000)
    parser.add_argument("--patience", type=int, default=800)
    parser.add_argument("--ways", default="memory,threads")
    given = parser.parse_args()
    chosen, first = study(given.cells, given.patience), None
    study(100, given.patience).plan().run()  # compiled, or loaded from the cache
    with ExitStack() as stack:
        for way in given.ways.split(","):
            wall, cpu = timed(_way(way, chosen, stack))
            first = first or (wall, cpu)
            ratio = f"{wall / first[0]:.3f} of the first, CPU {cpu / first[1]:.3f}"
            print(f"{way:10} {wall:8.1f} s wall {cpu:8.1f} s CPU  {ratio}", flush=True)


def _way(way: str, chosen: Resolved, stack: ExitStack) -> Callable[[], object]:
    if way == "memory":
        return lambda: chosen.plan().run(threads=2)
    if way == "dask":
        from distributed import LocalCluster

        local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
        cluster = stack.enter_context(LocalCluster(**local))
        return into_store(chosen, engines.scheduler(cluster.scheduler_address))
    return into_store(chosen, engines.threads(2) if way == "threads" else engines.processes(2))


if __name__ == "__main__":
    main()
