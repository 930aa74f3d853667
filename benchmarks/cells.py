"""What a cell of a map costs, and whether that depends on how many there are.

    python benchmarks/cells.py                       figure 2a with 10^4 to 10^6 cells, and the memory it takes
    python benchmarks/cells.py --refine 8            the same, refined from every eighth row and column

Prints CPU and wall time per cell, the best of some rounds for small maps, and the mesh periods that the cells took.
"""

from __future__ import annotations

import argparse
import resource
import time
from math import isqrt

import xarray as xr

from gearchaos.dynamics import Classification
from gearchaos.paper.settings import all_figures
from gearchaos.studies import zones
from gearchaos.studies.axis import Axis

STUDY = all_figures()[2].studies["a"]
_ENOUGH = 100_000


def mapped(cells: int, refine: int, patience: int, threads: int | None) -> xr.Dataset:
    side = isqrt(cells)
    x, y = (Axis(name, r.start, r.stop, side) for name, r in STUDY.axes.items())
    return zones(STUDY.mesh_model, x, y, refine=refine, settings=Classification(longest_transient=patience),
                 threads=threads)


def cost(cells: int, chosen: argparse.Namespace) -> tuple[float, float, xr.Dataset]:
    """CPU and wall seconds, each the least of some rounds, and the map."""
    spent = []
    for _ in range(max(1, min(chosen.rounds, _ENOUGH // cells))):
        wall, cpu = time.perf_counter(), time.process_time()
        found = mapped(cells, chosen.refine, chosen.patience, chosen.threads)
        spent.append((time.process_time() - cpu, time.perf_counter() - wall))
    return min(cpu for cpu, _ in spent), min(wall for _, wall in spent), found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=float, nargs="+", default=[1e4, 3e4, 1e5, 1e6])
    parser.add_argument("--refine", type=int, default=1)
    parser.add_argument("--patience", type=int, default=3000)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--rounds", type=int, default=5, help="at most, of small maps")
    chosen = parser.parse_args()
    mapped(10_000, chosen.refine, 1000, chosen.threads)  # kernels loaded
    for cells in map(int, chosen.cells):
        cpu, wall, found = cost(cells, chosen)
        n, periods = found["label"].size, float(found["periods_spent"].sum())
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{n:10,} cells: {1e6 * cpu / n:6.1f} us CPU, {1e6 * wall / n:6.1f} us wall a cell, "
              f"{periods:.3g} periods, {memory:,.0f} MiB at most", flush=True)


if __name__ == "__main__":
    main()
