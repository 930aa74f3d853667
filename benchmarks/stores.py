"""The cost of stores, from 10^3 to 10^5 tiles and up to 10^12 cells, where cells take no time to compute.

``python benchmarks/stores.py --list`` names the measurements and ``--only NAME …`` chooses some. Each prints one line
for each value, with its goal. Commands run in processes of their own; their memory is the peak of the largest process.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from storage import needs, scaling, workers
from storage.lines import Line

MEASUREMENTS: dict[str, Callable[[Path], Iterator[Line]]] = {
    "tiles-1000": partial(scaling.tiles, count=1000),
    "tiles-10000": partial(scaling.tiles, count=10_000),
    "tiles-100000": partial(scaling.tiles, count=100_000),
    "begin": scaling.begin_large,
    "begin-10": partial(scaling.begin_large, side=100_000),
    "full": scaling.full_store,
    "paper": needs.on_paper,
    "shard": workers.one_shard_of_many,
    "slow-disk": workers.slow_disk,
    "cluster": needs.cluster,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=MEASUREMENTS, default=list(MEASUREMENTS))
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--folder", type=Path, help="where stores are made and removed; a temporary folder by default")
    given = parser.parse_args()
    if given.list:
        print("\n".join(MEASUREMENTS))
        return
    missed = [line.name for name in given.only for line in _measured(name, given.folder) if line.reached is False]
    print(f"goals missed: {', '.join(missed) or 'none'}")


def _measured(name: str, parent: Path | None) -> Iterator[Line]:
    """Print the lines of a measurement as they come."""
    with tempfile.TemporaryDirectory(dir=parent) as folder:
        for line in MEASUREMENTS[name](Path(folder).resolve()):
            print(line, f" load {os.getloadavg()[0]:.1f}", flush=True)
            yield line


if __name__ == "__main__":
    main()
