"""How near the kernels are to what one core can do: operations a mesh period needs, the machine's rates, the ratio.

Prints the table of docs/limit.md for the trajectories of `throughput.py`'s mixed setting.
"""

from __future__ import annotations

import ctypes
import os
import time

import numpy as np
from peers.c_rk4 import compiled
from throughput import LANES, ROUNDS, Bench, timed

from gearchaos.flow.kernels.constants import ORDER

_WIDE = 4
_DOUBLE = 8
_COLUMNS = {"steps": 1, "switches": 2, "affine": 0, "segments": 0, "bytes": 0}


def rates() -> tuple[float, float, float]:
    """Multiply-adds per µs, and bytes per µs loaded and added from the first- and from the second-level cache."""
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


def _best(call, amount: float) -> float:
    times = []
    for _ in range(5):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return amount / min(times) / 1e6


def needs(bench: Bench) -> dict[str, float]:
    """What a period needs on the average, in multiply-adds and bytes; see docs/limit.md."""
    d, n = bench.system.dimension, float(bench.flow.step_count.mean())
    wave, series = 3 * (ORDER + 1), ORDER * (1 + (d - 1) * (d + 2))
    exits, finish = ORDER - 2 + 2 * 3 * ORDER, ORDER * d
    return {
        "steps": n, "switches": bench.switches,
        "affine": n * d * (d + 3), "segments": 2 * bench.switches * (wave + series + exits + finish),
        "bytes": n * _DOUBLE * (d * (d + 3) + 2 * d + d + 5),
    }


def main() -> None:
    """Measure the machine, then both cases."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    fused, first, second = rates()
    print(f"\n{fused / 1e3:.1f} billion multiply-adds a second; {first / 1e3:.0f} GB/s from the first-level cache, "
          f"{second / 1e3:.0f} GB/s from the second.\n")
    print("| | steps | switches | multiply-adds: steps | switches | bytes | µs: arithmetic | µs: loads | µs measured | "
          "limit / measured |\n|" + " --- |" * 10)
    for kind in ("d2", "d4"):
        bench = Bench(kind, "mixed")
        need = needs(bench)
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
