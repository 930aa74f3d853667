"""Time of a mesh period with a stepped stiffness, compared with the two levels of the paper, on one core in one run.

The levels follow 1 + 0.25 cos 2πτ/T, in equal parts of the period. Parameters and initial motions are those of
``throughput.py``: ω from 0.4 to 3, after 200 mesh periods. The stiffnesses take turns in each round; a ratio is the
median over the rounds of the time with steps over the time with two levels.
"""

from __future__ import annotations

import argparse
import os

import numpy as np
from throughput import KINDS, SETTINGS, timed

from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, SteppedStiffness, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system

LEVELS = (4, 16, 64)
"""Numbers of levels that are compared with two."""

LANES, PERIODS, ROUNDS = 2048, 50, 9
"""Trajectories; mesh periods of each in a round; rounds."""


def steps(count: int) -> SteppedStiffness:
    """``count`` levels of equal duration, each the value of 1 + 0.25 cos 2πτ/T at its middle."""
    starts = np.arange(count) / count
    levels = 1 + 0.25 * np.cos(2 * np.pi * (starts + 0.5 / count))
    return SteppedStiffness(tuple(levels), tuple(starts))


class Motions:
    """Trajectories of one model, after their transients."""

    def __init__(self, model: MeshModel, omega: np.ndarray) -> None:
        batch = vary(model, {"omega": omega})
        system = switched_system(batch)
        self.flow = ExactFlow(system)
        self.w = self.flow.advance(initial_state(batch, system).T.copy(), 200).w
        self.steps = float(self.flow.step_count.mean())
        self.times: list[float] = []

    def run(self) -> None:
        """Time one round."""
        self.times.append(timed(lambda w, n: self.flow.advance(w, n), self.w, PERIODS))


def compare(kind: str, setting: str) -> None:
    """Print the times and ratios of one kind of model."""
    low, high, values = SETTINGS[setting]
    two = MeshModel.of(**KINDS[kind], **values)
    models = {"two levels": two, **{f"{n} steps": two.with_values({"stiffness": steps(n)}) for n in LEVELS}}
    motions = {name: Motions(model, np.linspace(low, high, LANES)) for name, model in models.items()}
    for _ in range(ROUNDS):
        for motion in motions.values():
            motion.run()
    base = np.array(motions["two levels"].times)
    for name, motion in motions.items():
        ratio = np.median(np.array(motion.times) / base)
        print(f"{kind} {name:10}  {motion.steps:5.1f} steps  {np.median(motion.times):7.3f} us  ratio {ratio:5.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", default=",".join(KINDS))
    parser.add_argument("--setting", default="mixed", choices=SETTINGS)
    given = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for kind in given.kinds.split(","):
        compare(kind, given.setting)


if __name__ == "__main__":
    main()
