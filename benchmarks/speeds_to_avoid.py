"""Whether speeds that are not listed as to be avoided are ever contradicted, on random designs.

    python benchmarks/speeds_to_avoid.py --designs 300 --out build/speeds_to_avoid.jsonl

Each design has three torques and a range of speeds. At those of 50 random speeds that lie outside the listed ranges to
avoid, 64 other initial states are followed to their attractors: one in which the teeth separate is a contradiction. The
listed ranges are also compared with one scan of the same 60 speeds from rest. A repeated command adds what the file
lacks.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import gearchaos as gc
from gearchaos.errors import DesignWarning, InputError
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.speeds.speed_windows import Window

LINE_LOADS = (25.0, 90.0, 300.0)
"""Means of the three line loads, N/mm."""

CHECKED_SPEEDS, CHECKED_STARTS = 50, 64


def random_design(number: int) -> gc.GearDesign:
    """Spur and helical pairs of usual proportions; those that cannot run, or have no stiffness, are drawn again."""
    rng = np.random.default_rng([number, 2026])
    while True:
        teeth = int(rng.integers(17, 41))
        module = float(rng.choice([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]))
        try:
            design = gc.GearDesign(
                teeth=(teeth, int(rng.integers(teeth, 4 * teeth))), module=module * 1e-3,
                face_width=module * 1e-3 * float(rng.uniform(6, 14)),
                profile_shift=tuple(sorted(rng.uniform(-0.1, 0.5, 2), reverse=True)),
                helix_angle=f"{rng.choice([0.0, 0.0, rng.uniform(5, 20)])} deg", bore=module * 1e-3 * 0.4 * teeth,
                quality={"standard": "ISO 1328-1:1995", "grade": int(rng.integers(3, 10))},
                transmission_error="from quality", damping_ratio=float(rng.uniform(0.02, 0.1)),
                stiffness=str(rng.choice(["ISO 6336-1", "potential energy"])),
                backlash={"value": module * 1e-3 * float(rng.uniform(0.02, 0.08)), "of": "line of action, total"})
            design.at(speed="1000 rpm", torque=_torque(design, LINE_LOADS[0])).to_model()
        except InputError:
            continue
        return design


def _torque(design: gc.GearDesign, line_load: float) -> float:
    """The torque at wheel 1, N m, of a line load in N/mm."""
    return line_load * 1e3 * design.geometry.common_face_width * design.geometry.base_diameter[0] / 2


def trial(number: int, load: int, threads: int | None = None) -> dict[str, Any]:
    """The ranges of one design at one of its loads, and what contradicts them."""
    design, rng = random_design(number), np.random.default_rng([number, load])
    torque = _torque(design, LINE_LOADS[load] * float(rng.uniform(0.6, 1.6)))
    resonance = 1000 / design.at(speed="1000 rpm", torque=torque).to_model().omega
    stop = resonance * float(rng.uniform(0.15, 1.5))
    axis = Axis("speed", stop * float(rng.uniform(0.06, 0.7)), stop, 60)
    begin = time.process_time()
    found = gc.speeds_to_avoid(design, axis, torque, threads=threads)
    spent = time.process_time() - begin
    old = gc.dynamic_factor(design, axis, torque, threads=threads)
    separated = old["speed"].values[old["contact"].values > 0]
    ranges = [(w.start - w.start_resolution, w.stop + w.stop_resolution) for w in found.windows]
    checked = [s for s in np.sort(rng.uniform(axis.start, stop, CHECKED_SPEEDS)).tolist()
               if not any(low <= s <= high for low, high in ranges)]
    outside = [(s, share) for s in checked if (share := _separated_share(design, s, torque, number, threads))]
    missed = [_window(w) for w, (low, high) in zip(found.windows, ranges, strict=True)
              if not np.any((separated >= low) & (separated <= high))]
    return {
        "number": number, "load": load, "torque": torque, "start": axis.start, "stop": stop, "seconds": spent,
        "speeds": found.dataset.sizes["speed"], "windows": [_window(w) for w in found.windows],
        "contradictions": outside, "missed": missed, "checked": len(checked), "coarse": found.coarse,
    }


def _window(window: Window) -> tuple[float, float, list[str]]:
    """Both ends of a range, and in which motions the teeth separate."""
    return window.start, window.stop, [each.motion for each in window.reached]


def _separated_share(design: gc.GearDesign, speed: float, torque: float, seed: int, threads: int | None) -> float:
    """The share of the checked initial states whose motion has the teeth separate."""
    found = gc.attractors(design.at(speed=f"{speed!r} rpm", torque=torque), CHECKED_STARTS, seed=seed + 1000,
                          threads=threads)
    separated = np.isin(found["attractor_contact"].values, (1, 2))
    return float(found["attractor_fraction"].values[separated].sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=300)
    parser.add_argument("--out", type=Path, default=Path("build/speeds_to_avoid.jsonl"))
    parser.add_argument("--threads", type=int)
    chosen = parser.parse_args()
    warnings.simplefilter("ignore", DesignWarning)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    known = [json.loads(line) for line in chosen.out.read_text().splitlines()] if chosen.out.exists() else []
    done = {(each["number"], each["load"]) for each in known}
    for number in range(chosen.designs):
        for load in range(len(LINE_LOADS)):
            if (number, load) not in done:
                known.append(trial(number, load, chosen.threads))
                with chosen.out.open("a") as file:
                    file.write(json.dumps(known[-1]) + "\n")
    print(summary(known))


def summary(trials: list[dict[str, Any]]) -> str:
    """The counts in words."""
    none = [t for t in trials if not t["windows"]]
    total = {name: sum(len(t[name]) for t in trials) for name in ("windows", "missed", "contradictions")}
    checked = sum(t["checked"] for t in trials)
    contradicted = sum(bool(t["contradictions"]) for t in none)
    said_none = sum(len(t["missed"]) == len(t["windows"]) > 0 for t in trials)
    seconds = [t["seconds"] for t in trials]
    return (
        f"{len(trials)} trials: {len(none)} without speeds to avoid, of which {contradicted} contradicted; "
        f"{total['windows']} ranges in the others, and {total['contradictions']} of {checked} checked speeds outside "
        f"them with separation. One scan from rest at 60 speeds misses {total['missed']} ranges, and says none in "
        f"{said_none} trials that have some. "
        f"CPU seconds: median {np.median(seconds):.1f}, largest {max(seconds):.1f}.")


if __name__ == "__main__":
    main()
