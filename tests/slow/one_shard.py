"""Computes one shard of a small map, in a process whose tiles can be made slow and whose files can be out of date.

``python -m tests.slow.one_shard STORE I/N [--sleep SECONDS] [--stale SECONDS]`` prints what `Outcome` says as JSON.
"""

import argparse
import json
import os
import time
from dataclasses import asdict

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.execute import pools
from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.running.run import run_into_store
from gearchaos.store.writers.shards import Shard

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
STUDY = gc.Zones(
    gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.5, 1.1, 16), gc.Axis("eps1", 0.05, 0.3, 12), settings=SHORT
)


def slowly(seconds):
    """Make every tile take at least this long."""
    true = gc.Zones.compute

    def compute(study, items, **options):
        time.sleep(seconds if len(items) > 1 else 0)
        return true(study, items, **options)

    gc.Zones.compute = compute


def out_of_date(seconds):
    """Hide files that another process has written or changed in the last seconds, as network file systems may do."""
    own, true_size, true_read, true_list = set(), LocalFolder.size, LocalFolder.read, LocalFolder.list

    def hidden(folder, name):
        if name in own or name in ("run/study.json", "run/sums.json") or name.endswith("zarr.json"):
            return False
        try:
            return time.time() - os.stat(folder.path / name).st_mtime < seconds
        except FileNotFoundError:
            return False

    def noting(method):
        def noted(folder, name, *arguments):
            own.add(name)
            return method(folder, name, *arguments)

        return noted

    def read(folder, name, *arguments):
        if hidden(folder, name):
            raise FileNotFoundError(name)
        return true_read(folder, name, *arguments)

    LocalFolder.read = read
    LocalFolder.size = lambda folder, name: None if hidden(folder, name) else true_size(folder, name)
    LocalFolder.list = lambda folder, prefix="": (f for f in true_list(folder, prefix) if not hidden(folder, f[0]))
    for method in ("write", "append"):
        setattr(LocalFolder, method, noting(getattr(LocalFolder, method)))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("store")
    parser.add_argument("shard")
    parser.add_argument("--sleep", type=float, default=0.0)
    parser.add_argument("--stale", type=float, default=0.0)
    given = parser.parse_args()
    if given.sleep:
        slowly(given.sleep)
    if given.stale:
        out_of_date(given.stale)
    shard = Shard.parse(given.shard)
    print(json.dumps(asdict(run_into_store(STUDY, given.store, pool=pools.thread_pool(1), shard=shard))))


if __name__ == "__main__":
    main()
