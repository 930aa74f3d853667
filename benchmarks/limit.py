"""How close the kernels are to the limit of one core: operations per mesh period, rates of the machine, their ratio.

Prints the table of docs/limit.md for the trajectories of `throughput.py`'s mixed setting.
"""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable

import numpy as np
from peers.c_rk4 import compiled
from throughput import LANES, ROUNDS, Bench, timed

from gearchaos.flow.kernels.vector.constants import ORDER

_WIDE = 4
"""Doubles in a vector register."""

_DOUBLE = 8
"""Bytes of a double."""

_COLUMNS = {"steps": 1, "switches": 2, "affine": 0, "segments": 0, "bytes": 0}
"""Columns of the table, with the number of digits after the point."""


def rates() -> tuple[float, float, float]:
    """Rates of this machine: multiply-adds per µs, and bytes per µs loaded from the first- and second-level caches."""
    library = compiled("rates.c")
    library.multiply_adds.restype = library.loads.restype = ctypes.c_double
    rounds = 3_000_000
    fused = _best(lambda: library.multiply_adds(ctypes.c_long(rounds)), rounds * 10 * _WIDE)
    found = [fused]
    for size in (16 * 1024, 256 * 1024):
        data = np.ones(size // _DOUBLE + _WIDE)
        begin = data.ctypes.data + (-data.ctypes.data) % 32
        count, rounds = size // (_WIDE * _DOUBLE), 200_000_000 // size * 10
        arguments = ctypes.c_void_p(begin), ctypes.c_long(count), ctypes.c_long(rounds)
        found.append(_best(lambda a=arguments: library.loads(*a), rounds * (count // 10 * 10) * _WIDE * _DOUBLE))
    return found[0], found[1], found[2]


def _best(call: Callable[[], object], amount: float) -> float:
    """``amount`` per µs, in the fastest of five calls."""
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return amount / min(times) / 1e6


def operations(bench: Bench) -> dict[str, float]:
    """Mean steps, switches, multiply-adds and loaded bytes per trajectory and mesh period; see docs/limit.md."""
    d, n = bench.system.dimension, float(bench.flow.step_count.mean())
    wave, series = 3 * (ORDER + 1), ORDER * (1 + (d - 1) * (d + 2))
    exits, finish = ORDER - 2 + 2 * 3 * ORDER, ORDER * d
    return {
        "steps": n, "switches": bench.switches,
        "affine": n * d * (d + 3), "segments": 2 * bench.switches * (wave + series + exits + finish),
        "bytes": n * _DOUBLE * (d * (d + 3) + 2 * d + d + 5),
    }


def main() -> None:
    """Measure the rates of the machine, then print the table for d = 2 and 4."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    fused, first, second = rates()
    print(f"\n{fused / 1e3:.1f} billion multiply-adds a second; {first / 1e3:.0f} GB/s from the first-level cache, "
          f"{second / 1e3:.0f} GB/s from the second.\n")
    print("| | steps | switches | multiply-adds: steps | switches | bytes | µs: arithmetic | µs: loads | µs measured | "
          "limit / measured |\n|" + " --- |" * 10)
    for kind in ("d2", "d4"):
        bench = Bench(kind, "mixed")
        need = operations(bench)
        advance = bench.running["gearchaos"]["advance"]
        ours = float(np.median([timed(advance, bench.w, 50) for _ in range(ROUNDS)]))
        arithmetic = (need["affine"] + need["segments"]) / fused
        loads = need["bytes"] / (first if kind == "d2" else second)
        counts = " | ".join(f"{need[n]:.{digits}f}" for n, digits in _COLUMNS.items())
        share = (arithmetic + loads) / ours
        print(f"| {kind} | {counts} | {arithmetic:.3f} | {loads:.3f} | {ours:.3f} | {share:.0%} |")
    print(f"\n({LANES} trajectories.)")


if __name__ == "__main__":
    main()
