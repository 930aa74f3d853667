"""gearchaos against its peers on the same trajectories, side by side in one run on one core.

Prints a table; ``--json FILE`` also writes {"ratios": {"d2": {peer: ...}, ...}, "errors": {...}, "us": {...}}, a
ratio being the peer's time over ours, the median over interleaved rounds. Absolute times mean little on a shared
machine; ratios from one run mean more.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from gearchaos.coordinates import start
from gearchaos.flow import ExactFlow
from gearchaos.flow import layout as at
from gearchaos.model import MeshModel, vary
from gearchaos.switched import SwitchedAffine, switched

CASES = {
    "d2": MeshModel.of(kind="torsional", q0=0.1, eps1=0.1),
    "d4": MeshModel.of(kind="full", q0=0.1, eps1=0.1, kappa=0.5),
    "d7": MeshModel.of(kind="full", q0=0.1, eps1=0.1, kappa1=0.5, kappa2=0.8, beta1=0.02),
}
LANES = 4096
FEW = 32
ROUNDS = 7
Advance = Callable[[np.ndarray, int], np.ndarray]


def peers(system: SwitchedAffine) -> dict[str, tuple[Advance, int, int] | str]:
    """Each peer as (advance, lanes, periods a round), or why it is not here."""
    flow = ExactFlow(system)
    found: dict[str, tuple[Advance, int, int] | str] = {
        "gearchaos": (lambda w, n: flow.advance(w, n).w, LANES, 50)
    }
    for name, make in {
        "c_rk4_200": lambda: (_c_rk4(system, 200), LANES, 50),
        "c_rk4_1000": lambda: (_c_rk4(system, 1000), LANES, 10),
        "heyoka": lambda: (_heyoka(system, 1), 8 * FEW, 10),
        "heyoka_batch": lambda: (_heyoka(system, 4), 8 * FEW, 10),
        "scipy_dop853": lambda: (_scipy(system), 4, 2),
    }.items():
        try:
            found[name] = make()
        except Exception as failure:  # a peer that cannot run is reported, whatever the cause
            found[name] = f"not run: {type(failure).__name__}: {failure}"
    return found


def _c_rk4(system: SwitchedAffine, steps: int) -> Advance:
    from peers.c_rk4 import CRk4

    return CRk4(system, steps).advance


def _heyoka(system: SwitchedAffine, batch: int) -> Advance:
    from peers.heyoka_peer import Heyoka

    chosen = system.take(_spread(system.points, 8 * FEW))
    return Heyoka(chosen, batch).advance


def _spread(points: int, lanes: int) -> np.ndarray:
    """Evenly spread points, so that every peer sees all of the range."""
    return np.arange(lanes) * (points // lanes)


def _scipy(system: SwitchedAffine) -> Advance:
    """DOP853 at 1e-9, stopped at the stiffness jumps but not at contact switches, as a user would run it."""

    def one(lane: int, w: np.ndarray, periods: int) -> np.ndarray:
        A, b, f0 = system.A[lane], system.b[lane], system.f0[lane]
        f_cos, f_sin, omega = system.f_cos[lane, 0], system.f_sin[lane, 0], system.omega[lane]

        def slope(t, w, chi):
            out = A @ w + f0 - b * chi * (w[0] - min(max(w[0], -1.0), 1.0))
            out[1] += f_cos * np.cos(omega * t) + f_sin * np.sin(omega * t)
            return out

        for half in range(2 * periods):
            ends = half * np.pi / omega, (half + 1) * np.pi / omega
            chi = system.levels[lane, half % 2]
            w = solve_ivp(slope, ends, w, "DOP853", rtol=1e-9, atol=1e-9, args=(chi,)).y[:, -1]
        return w

    lanes = _spread(system.points, 4)
    return lambda w, n: np.stack([one(lane, w[:, i], n) for i, lane in enumerate(lanes)], axis=1)


def measure(case: str, model: MeshModel) -> dict[str, dict]:
    """Times, ratios and one-period errors of every peer on one case."""
    batch = vary(model, {"omega": np.linspace(0.4, 3.0, LANES)})
    system = switched(batch)
    assert system.dimension == int(case[1:])
    flow = ExactFlow(system)
    w = flow.advance(start(batch, system).T.copy(), 20).w
    switches = flow.advance(w, 20, measured=True).measures[at.SWITCHES].mean() / 20
    reference = flow.advance(w, 1).w
    rows = {name: p if isinstance(p, str) else _timed(p, w, reference) for name, p in peers(system).items()}
    _interleave(rows)
    ours = rows["gearchaos"]
    for row in rows.values():
        if not isinstance(row, str):
            row["ratio"] = float(np.median(np.array(row["times"]) / np.array(ours["times"])))
    _print(case, rows, switches)
    return rows


def _timed(peer: tuple[Advance, int, int], w: np.ndarray, reference: np.ndarray) -> dict:
    advance, lanes, periods = peer
    chosen = _spread(w.shape[1], lanes)
    first = np.ascontiguousarray(w[:, chosen])
    error = float(np.abs(advance(first, 1) - reference[:, chosen]).max())
    return {"advance": advance, "w": first, "periods": periods, "error": error, "times": []}


def _interleave(rows: dict) -> None:
    """One round after another, every peer in each, so that a slow spell of the machine hits all alike."""
    for _ in range(ROUNDS):
        for row in rows.values():
            if not isinstance(row, str):
                begin = time.perf_counter()
                row["advance"](row["w"], row["periods"])
                row["times"].append((time.perf_counter() - begin) / row["w"].shape[1] / row["periods"] * 1e6)


def _print(case: str, rows: dict, switches: float) -> None:
    print(f"\n{case}: {switches:.2f} contact switches per mesh period")
    print(f"{'':14} {'us/period':>10} {'ratio':>8} {'error of a period':>18}")
    for name, row in rows.items():
        if isinstance(row, str):
            print(f"{name:14} {row}")
        else:
            print(f"{name:14} {np.median(row['times']):10.3f} {row['ratio']:8.2f} {row['error']:18.1e}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--cases", default=",".join(CASES))
    arguments = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    results = {case: measure(case, CASES[case]) for case in arguments.cases.split(",")}
    if arguments.json:
        arguments.json.write_text(json.dumps(_document(results), indent=2) + "\n")


def _document(results: dict) -> dict:
    def column(key: Callable[[dict], float]) -> dict:
        return {case: {n: key(r) if not isinstance(r, str) else r for n, r in rows.items()}
                for case, rows in results.items()}

    return {
        "ratios": column(lambda r: r["ratio"]), "errors": column(lambda r: r["error"]),
        "us": column(lambda r: float(np.median(r["times"]))),
    }


if __name__ == "__main__":
    main()
