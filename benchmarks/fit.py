"""Whether the 95 % intervals of `gearchaos.fit` cover, on synthetic experiments.

    python benchmarks/fit.py --cases 100 --out build/fit.jsonl

Each case is a pair with a damping ratio, a backlash and an amplitude of the error drawn within the bounds of the fit,
run slowly up or down through its resonance, where contact is lost. The amplitudes of two harmonics of the mesh force
have 5 % of noise. A repeated command adds what the file lacks.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import gearchaos as gc
from gearchaos.studies.fit.fitted_motions import HISTORIES, PairsAtSpeeds

PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1="35.24 mm", R2="56.38 mm", c0="400 N/um", k="2000 N*s/m",
    chi1=0.1, chi2=0.1, backlash="0.03 mm", M10="85 N*m", speed=6000, error_amplitudes=["5 um"])
BOUNDS = {"damping_ratio": (0.03, 0.1, ""), "backlash": (15.0, 40.0, "um"), "error1": (3.0, 9.0, "um")}
SPEEDS = np.linspace(6000.0, 16000.0, 26)
NOISE = 0.05


def experiment(number: int, path: Path) -> dict[str, float]:
    """Write the measurement of a case, and return the parameters behind it, with the share of motions that are no
    periodic ones."""
    rng = np.random.default_rng([number, 2026])
    truth = {name: float(rng.uniform(low, high)) for name, (low, high, _) in BOUNDS.items()}
    pair = replace(PAIR, k=2 * PAIR.mass * PAIR.omega0 * truth["damping_ratio"], backlash=1e-6 * truth["backlash"],
                   error_amplitudes=(1e-6 * truth["error1"],))
    pairs = PairsAtSpeeds([pair], SPEEDS, "torsional")
    history = HISTORIES.index(str(rng.choice(["rising", "falling"])))
    motions = pairs.by_history().take(history * len(SPEEDS) + pairs.points)
    amplitudes, _ = pairs.harmonics(motions, pairs.points, 2)
    noisy = amplitudes["mesh force"] * (1 + NOISE * rng.standard_normal((len(SPEEDS), 2)))
    rows = [f"{speed!r},{25 * order},{value!r}" for speed, each in zip(SPEEDS.tolist(), noisy.tolist(), strict=True)
            for order, value in enumerate(each, 1)]
    path.write_text("\n".join(["speed [rpm],order,amplitude [N]", *rows]))
    return {**truth, "not_periodic": float(np.mean(motions.period == 0))}


def trial(number: int, starts: int = 4) -> dict[str, Any]:
    """A case: the truth, the estimates with their intervals, and the time, s."""
    with TemporaryDirectory() as folder:
        truth = experiment(number, Path(folder) / "orders.csv")
        began = time.perf_counter()
        vary = [f"{name}={low}:{high} {unit}" for name, (low, high, unit) in BOUNDS.items()]
        found = gc.fit(PAIR, f"{folder}/orders.csv", vary, uncertainty=f"{100 * NOISE} %", starts=starts)
        seconds = time.perf_counter() - began
    intervals = {name: [float(found[f"estimate{end}"].sel(varied=name)) for end in ("_lo", "", "_hi")]
                 for name in BOUNDS}
    return {"case": number, "truth": truth, "intervals": intervals, "seconds": seconds, "contact": sorted(
        set(found.contact.values.tolist())), "scatter": float(found.search_rms.min()),
        "there": int((found.search_rms < 1.001 * found.search_rms.min()).sum())}


def report(trials: list[dict[str, Any]]) -> None:
    """Print how many intervals cover the truth, of those parameters that were identified."""
    for name in BOUNDS:
        rows = [(t["truth"][name], *t["intervals"][name]) for t in trials if np.isfinite(t["intervals"][name][1])]
        covered = sum(low <= value <= high for value, low, _, high in rows)
        width = np.median([(high - low) / 2 / value for value, low, _, high in rows])
        print(f"{name}: {covered} of {len(rows)} identified are covered, median half width {100 * width:.2g} %")
    print(f"{len(trials)} fits, {np.mean([t['seconds'] for t in trials]):.3g} s each")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--starts", type=int, default=4)
    parser.add_argument("--out", type=Path, default=Path("build/fit.jsonl"))
    arguments = parser.parse_args()
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    done = [json.loads(line) for line in arguments.out.read_text().splitlines()] if arguments.out.exists() else []
    for case in range(len(done), arguments.cases):
        done.append(trial(case, arguments.starts))
        with arguments.out.open("a") as file:
            file.write(json.dumps(done[-1]) + "\n")
    report(done)
