"""Computing time per cell of a map, and whether it depends on the number of cells.

    python benchmarks/cells.py                       figure 2a with 10^4 to 10^6 cells
    python benchmarks/cells.py --refine 8            the same, refined from every eighth row and column

Prints CPU and wall time per cell (for small maps the least of several rounds), the mesh periods computed in total, and
the peak memory of the process.
"""

from __future__ import annotations

import argparse
import resource
import time
from math import isqrt

import xarray as xr

from gearchaos.dynamics import Classification
from gearchaos.paper.settings import all_figures
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.maps.zones import zones

STUDY = all_figures()[2].studies["a"]
_CELLS_PER_SIZE = 100_000
"""Small maps are repeated until about this number of cells, or the largest number of rounds, is reached."""


def compute_map(cells: int, refine: int, longest_transient: int, threads: int | None) -> xr.Dataset:
    """The map of figure 2a with about this number of cells."""
    side = isqrt(cells)
    x, y = (Axis(name, r.start, r.stop, side) for name, r in STUDY.axes.items())
    return zones(STUDY.mesh_model, x, y, refine=refine, settings=Classification(longest_transient=longest_transient),
                 threads=threads)


def cost(cells: int, chosen: argparse.Namespace) -> tuple[float, float, xr.Dataset]:
    """CPU and wall seconds, each the least of several rounds, and the map."""
    spent = []
    for _ in range(max(1, min(chosen.rounds, _CELLS_PER_SIZE // cells))):
        wall, cpu = time.perf_counter(), time.process_time()
        found = compute_map(cells, chosen.refine, chosen.longest_transient, chosen.threads)
        spent.append((time.process_time() - cpu, time.perf_counter() - wall))
    return min(cpu for cpu, _ in spent), min(wall for _, wall in spent), found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=float, nargs="+", default=[1e4, 3e4, 1e5, 1e6])
    parser.add_argument("--refine", type=int, default=1)
    parser.add_argument("--longest-transient", type=int, default=3000)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--rounds", type=int, default=5, help="largest number of rounds of small maps")
    chosen = parser.parse_args()
    compute_map(10_000, chosen.refine, 1000, chosen.threads)  # loads the kernels
    for cells in map(int, chosen.cells):
        cpu, wall, found = cost(cells, chosen)
        n, periods = found["label"].size, float(found["periods_spent"].sum())
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{n:10,} cells: {1e6 * cpu / n:6.1f} us CPU, {1e6 * wall / n:6.1f} us wall a cell, "
              f"{periods:.3g} periods, peak memory {memory:,.0f} MiB", flush=True)


if __name__ == "__main__":
    main()
