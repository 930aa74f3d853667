"""Speed of gearchaos and of other integrators on the same trajectories, on one core in one run; then on all cores.

Prints tables; ``--json FILE`` also writes {"ratios": {"d2": {peer: …}, …}, "errors": {…}, "us": {…}, "settings": {…},
"two_cores": …, "two_cores_arithmetic": …}, where a ratio is the time of a peer divided by that of gearchaos, the
median over interleaved rounds; ``--plot FILE`` draws time against error. On a shared machine only
ratios from one run are meaningful.
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import time
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np

from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system

KINDS: dict[str, dict[str, Any]] = {
    "d2": {"kind": "torsional"},
    "d4": {"kind": "full", "kappa": 0.5},
    "d7": {"kind": "full", "kappa1": 0.5, "kappa2": 0.8, "beta1": 0.02},
}
SETTINGS: dict[str, tuple[float, float, dict[str, float]]] = {
    "mixed": (0.4, 3.0, {"q0": 0.1, "eps1": 0.1}),
    "regular": (0.4, 3.0, {"q0": 1.0, "eps1": 0.01}),
    "chaotic": (0.95, 1.05, {"q0": 0.05, "eps1": 0.1}),
    "impacts": (1.5, 2.5, {"q0": 0.02, "eps1": 0.3}),
}
"""Range of ω, and the other parameters, of each setting."""

LANES = 4096
"""Trajectories of gearchaos in a round."""

FEW_LANES = 256
"""Trajectories of slower peers in a round."""

ROUNDS = 7
CORES = os.cpu_count() or 1
Advance = Callable[[np.ndarray, int], np.ndarray]
PEERS: dict[str, tuple[str, str, tuple, int, int]] = {
    "c_rk4_200": ("c_rk4", "CRk4", (200,), LANES, 20),
    "c_rk4_1000": ("c_rk4", "CRk4", (1000,), LANES // 4, 10),
    "numba_rk4_200": ("numba_rk4", "NumbaRk4", (200,), FEW_LANES, 10),
    "heyoka": ("heyoka_peer", "Heyoka", (1,), FEW_LANES, 10),
    "heyoka_batch": ("heyoka_peer", "Heyoka", (4,), FEW_LANES, 10),
    "pynamicalsys_200": ("pynamicalsys_peer", "Pynamicalsys", (200,), 8, 2),
    "jitcode_1e-9": ("jitcode_peer", "Jitcode", (1e-9,), 8, 2),
    "diffrax_1e-9": ("diffrax_peer", "Diffrax", (1e-9,), 64, 2),
    "scipy_dop853_1e-9": ("scipy_peer", "Scipy", ("DOP853", 1e-9), 4, 2),
    "scipy_lsoda_1e-9": ("scipy_peer", "Scipy", ("LSODA", 1e-9), 4, 2),
}
"""Of each peer its module, class, arguments, trajectories and mesh periods in a round."""

SPECIAL_PEERS = ("c_rk4_200", "heyoka", "heyoka_batch")
"""Peers that run in all settings; the others run in the mixed setting only."""

_PRECISION = {
    "C RK4": ("c_rk4", "CRk4", [(n,) for n in (100, 200, 500, 1000, 2000)], FEW_LANES),
    "SciPy DOP853": ("scipy_peer", "Scipy", [("DOP853", 10.0**-k) for k in (5, 7, 9, 11)], 4),
    "SciPy LSODA": ("scipy_peer", "Scipy", [("LSODA", 10.0**-k) for k in (5, 7, 9, 11)], 4),
    "heyoka": ("heyoka_peer", "Heyoka", [(1,)], FEW_LANES),
}


class Bench:
    """Trajectories of one model in one setting, and the results of every peer on them."""

    def __init__(self, kind: str, setting: str) -> None:
        low, high, values = SETTINGS[setting]
        batch = vary(MeshModel.of(**KINDS[kind], **values), {"omega": np.linspace(low, high, LANES)})
        self.name, self.system = f"{kind} {setting}", switched_system(batch)
        assert self.system.dimension == int(kind[1:])
        self.flow = ExactFlow(self.system)
        self.w = self.flow.advance(initial_state(batch, self.system).T.copy(), 200).w
        counted = self.flow.advance(self.w, 20, measured=True)
        self.switches = float(counted.measures[Measure.SWITCHES].mean() / 20)
        self.reference = self.flow.advance(self.w, 1).w
        self.rows: dict[str, dict[str, Any] | str] = {
            "gearchaos": self._row(lambda w, n: self.flow.advance(w, n).w, np.arange(LANES), 50)
        }

    def add(self, name: str) -> None:
        """Set up a peer and compare its first period with the reference; a peer that cannot run is reported."""
        module, kind, arguments, lanes, periods = PEERS[name]
        try:
            self.rows[name] = self._row(*self.peer(module, kind, arguments, lanes), periods)
        except Exception as failure:
            self.rows[name] = f"not run: {type(failure).__name__}: {failure}"

    def peer(self, module: str, kind: str, arguments: tuple, lanes: int) -> tuple[Advance, np.ndarray]:
        """``advance`` of a peer, and its lanes (L,): equidistant ones, so that all peers cover the range of ω."""
        chosen = np.arange(lanes) * (LANES // lanes)
        make = getattr(importlib.import_module(f"peers.{module}"), kind)
        return make(self.system.take(chosen), *arguments).advance, chosen

    def _row(self, advance: Advance, chosen: np.ndarray, periods: int) -> dict[str, Any]:
        w = np.ascontiguousarray(self.w[:, chosen])
        error = float(np.abs(advance(w, 1) - self.reference[:, chosen]).max())
        return {"advance": advance, "w": w, "periods": periods, "error": error, "times": []}

    @property
    def running(self) -> dict[str, dict[str, Any]]:
        return {name: row for name, row in self.rows.items() if not isinstance(row, str)}

    def run(self) -> None:
        """Time every peer in each round, so that variations of the machine's speed affect all of them."""
        for _ in range(ROUNDS):
            for row in self.running.values():
                row["times"].append(timed(row["advance"], row["w"], row["periods"]))
        ours = self.running["gearchaos"]
        for row in self.running.values():
            row["ratio"] = float(np.median(np.array(row["times"]) / np.array(ours["times"])))
        exact = self.running.get("heyoka")  # the only peer of the same accuracy: their difference is the error of both
        ours["error"] = exact["error"] if exact else float("nan")

    def print(self) -> None:
        print(f"\n{self.name}: {self.switches:.2f} contact switches per mesh period")
        print(f"{'':18} {'us/period':>10} {'ratio':>8} {'error of a period':>18}")
        for name, row in self.rows.items():
            if isinstance(row, str):
                print(f"{name:18} {row}")
            else:
                print(f"{name:18} {np.median(row['times']):10.3f} {row['ratio']:8.2f} {row['error']:18.1e}")

    def column(self, key: Callable[[dict], float]) -> dict[str, float | str]:
        """One number for every peer, or the reason why it did not run."""
        return {name: row if isinstance(row, str) else key(row) for name, row in self.rows.items()}


def timed(advance: Advance, w: np.ndarray, periods: int) -> float:
    """Microseconds per trajectory and mesh period of one call."""
    begin = time.perf_counter()
    advance(w, periods)
    return (time.perf_counter() - begin) / w.shape[1] / periods * 1e6


def all_cores(bench: Bench) -> tuple[float, float]:
    """Throughput of all cores relative to one: of the flow, and of arithmetic without shared memory.

    The second is the limit of the machine. As in a map, every thread has a flow of its own. A round takes seconds,
    since an idle core reaches its full clock rate only after some tenths of a second, and threads that start together
    may share a core until the scheduler moves them.
    """
    parts = [np.ascontiguousarray(bench.w[:, i::CORES]) for i in range(CORES)]
    flows = [ExactFlow(bench.system.take(np.arange(LANES)[i::CORES])) for i in range(CORES)]
    numbers = np.ones((CORES, 2048))[:, :1024]  # no two rows share a cache line
    works: tuple[Callable[[int], Any], ...] = (
        lambda i: flows[i].advance(parts[i], 6000), lambda i: _arithmetic(numbers[i], 24_000_000),
    )
    _arithmetic(numbers[0], 1)  # compiles it
    with ThreadPoolExecutor(CORES) as pool:
        flow, arithmetic = np.median([[_together(pool, work) for work in works] for _ in range(ROUNDS)], axis=0)
    return float(flow), float(arithmetic)


def _together(pool: Executor, work: Callable[[int], Any]) -> float:
    """Time of one part per core in sequence, divided by the time of all parts in parallel."""
    begin = time.perf_counter()
    for i in range(CORES):
        work(i)
    alone = time.perf_counter() - begin
    begin = time.perf_counter()
    list(pool.map(work, range(CORES)))
    return alone / (time.perf_counter() - begin)


@numba.njit(nogil=True)
def _arithmetic(x, times):
    for _ in range(times):
        for i in range(x.size):
            x[i] = 0.999 * x[i] + 0.001


def draw_precision(bench: Bench, path: Path) -> None:
    """Draw the time of a mesh period against its error, for every peer at several settings."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for (name, (module, kind, options, lanes)), mark in zip(_PRECISION.items(), "osvD", strict=True):
        points = []
        for arguments in options:
            advance, chosen = bench.peer(module, kind, arguments, lanes)
            w = np.ascontiguousarray(bench.w[:, chosen])
            error = np.median(np.abs(advance(w, 1) - bench.reference[:, chosen]).max(axis=0))
            points.append((max(error, 1e-16), min(timed(advance, w, 2) for _ in range(3))))
        ax.loglog(*zip(*points, strict=True), mark + "-", label=name)
    ours = bench.running["gearchaos"]  # its error is the difference from heyoka, drawn last
    ax.loglog(points[-1][0], np.median(ours["times"]), "*", color="black", markersize=14, label="gearchaos")
    ax.set(xlabel="median error of one mesh period", ylabel="µs per trajectory and mesh period",
           title=f"Work and precision, {bench.name}")
    ax.grid(alpha=0.3)
    ax.legend()
    figure.savefig(path, dpi=150)


def _parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--settings", default=",".join(SETTINGS))
    return parser.parse_args()


def main() -> None:
    """Run the models and settings that the arguments choose."""
    given = _parsed()
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_setaffinity") else set()
    if cores:
        os.sched_setaffinity(0, {min(cores)})
    benches: dict[str, dict[str, Bench]] = {}
    for setting in given.settings.split(","):
        for kind in given.kinds.split(","):
            bench = benches.setdefault(setting, {})[kind] = Bench(kind, setting)
            for name in PEERS if setting == "mixed" else SPECIAL_PEERS:
                bench.add(name)
            bench.run()
            bench.print()
    first = next(iter(next(iter(benches.values())).values()))
    if given.plot:
        draw_precision(first, given.plot)
    if cores:
        os.sched_setaffinity(0, cores)
    flow, arithmetic = all_cores(first)
    print(f"\n{CORES} cores: {flow:.2f} times one; arithmetic that shares nothing: {arithmetic:.2f} times")
    if given.json:
        given.json.write_text(json.dumps(_document(benches, flow, arithmetic), indent=2) + "\n")


def _document(benches: dict[str, dict[str, Bench]], flow: float, arithmetic: float) -> dict[str, Any]:
    mixed = benches.get("mixed", {})
    special = {
        setting: {kind: {"switches": b.switches, "ratios": b.column(_ratio)} for kind, b in kinds.items()}
        for setting, kinds in benches.items() if setting != "mixed"
    }
    return {
        "ratios": {kind: b.column(_ratio) for kind, b in mixed.items()},
        "errors": {kind: b.column(lambda r: r["error"]) for kind, b in mixed.items()},
        "us": {kind: b.column(lambda r: float(np.median(r["times"]))) for kind, b in mixed.items()},
        "settings": special, "two_cores": flow, "two_cores_arithmetic": arithmetic,
    }


def _ratio(row: dict[str, Any]) -> float:
    return row["ratio"]


if __name__ == "__main__":
    main()
