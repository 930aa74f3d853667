"""The cost of a map that is refined along boundaries, and how many of its cells equal those of the complete map.

    python benchmarks/refinement.py                  figure 2a at 2048 x 2048, from every eighth row and column
    python benchmarks/refinement.py --side 512       the same in half a minute

Computes both maps into stores, as `gearchaos run` does, and compares label and period of all cells, and of random
samples of them. Prints the cells, mesh periods, CPU and wall time of the refined map relative to the complete one.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr
from runs import store, study, timed

from gearchaos.execute import pools
from gearchaos.studies.maps.zones import Zones


def compute_map(chosen: Zones, threads: int) -> tuple[xr.Dataset, np.ndarray]:
    """The map, and the wall and CPU seconds that it took."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "s.zarr"
        times = timed(lambda: store(chosen, path, pools.thread_pool(threads)))
        return xr.open_zarr(path).load(), np.array(times)


def differing(a: xr.Dataset, b: xr.Dataset) -> np.ndarray:
    """Whether each cell (N,) differs in label or period between two maps."""
    return ((a["label"] != b["label"]) | (a["period"] != b["period"])).values.ravel()


def in_samples(differ: np.ndarray, size: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Number of cells that differ, in each of ``count`` random samples of ``size`` cells; an array (count,)."""
    return np.array([differ[rng.choice(differ.size, size, replace=False)].sum() for _ in range(count)])


def compare(refined: xr.Dataset, whole: xr.Dataset, chosen: argparse.Namespace) -> None:
    """Print how many cells are equal, among all, among those computed, and in random samples."""
    computed, differ = refined["inferred"].values.ravel() == 0, differing(refined, whole)
    size = min(chosen.sample, differ.size)
    found = in_samples(differ, size, chosen.samples, np.random.default_rng(chosen.seed))
    print(f"equal: {1 - differ.mean():.4%} of all cells; of those computed {differ[computed].sum()} differ")
    print(f"{chosen.samples} random samples of {size:,}: {found.min()} to {found.max()} differ, {found.mean():.1f} in "
          f"the mean; equal in at least 99.9 %: {(found <= size / 1000).sum()}")


def shares(refined: xr.Dataset, whole: xr.Dataset) -> tuple[float, float]:
    """Cells and mesh periods computed for the refined map, relative to the complete one."""
    computed, periods = refined["inferred"].values == 0, whole["periods_spent"].values
    return computed.mean(), periods[computed].sum() / periods.sum()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=2048)
    parser.add_argument("--step", type=int, default=8, help="stride of the first lattice")
    parser.add_argument("--longest-transient", type=int, default=3000)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--sample", type=int, default=20_000)
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args()
    every = study(chosen.side**2, chosen.longest_transient)
    study(100, chosen.longest_transient).run()  # compiled, or loaded from the cache
    refined, times = compute_map(replace(every, refine=chosen.step), chosen.threads)
    print(f"refined {times[0]:8.1f} s wall {times[1]:8.1f} s CPU", flush=True)
    whole, all_times = compute_map(every, chosen.threads)
    print(f"whole   {all_times[0]:8.1f} s wall {all_times[1]:8.1f} s CPU", flush=True)
    compare(refined, whole, chosen)
    (cells, periods), (wall, cpu) = shares(refined, whole), times / all_times
    print(f"of the whole map: {cells:.2%} of the cells, {periods:.2%} of the mesh periods, {cpu:.1%} of the CPU, "
          f"{wall:.1%} of the wall time")


if __name__ == "__main__":
    main()
