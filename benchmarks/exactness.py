"""The error of a mesh period against heyoka, over 100 000 random states and parameters, grazing ones included.

A fifth of the states are made to graze: their velocity is chosen, by bisection, so that the largest z of the period is
1 plus a depth between -1e-6 and 1e-6. Another fifth start beside a boundary, slowly. Prints quantiles and the worst.
"""

from __future__ import annotations

import argparse

import numpy as np
from peers.heyoka_peer import Heyoka

from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import MeshModel, vary
from gearchaos.model.switched import SwitchedAffine, switched_system

KINDS = {
    "d2": ({"kind": "torsional"}, 0.5), "d4": ({"kind": "full"}, 0.3),
    "d7": ({"kind": "full", "beta1": 0.02, "kappa1": 0.7}, 0.2),
}
"""Models, and their shares of the states."""

RANGES = {"omega": (0.3, 3.0), "q0": (-0.1, 0.4), "eps1": (0.0, 0.3), "theta1": (0.0, 6.0), "zeta": (0.0, 0.1)}
_DEPTHS = np.array([1e-6, 1e-9, 1e-12, -1e-12, -1e-9, -1e-6])
_BISECTIONS = 50


def random_system(kind: dict, count: int, rng: np.random.Generator) -> SwitchedAffine:
    values = {name: rng.uniform(*ends, count) for name, ends in RANGES.items()}
    return switched_system(vary(MeshModel.of(**kind), values))


def grazing(flow: ExactFlow, w: np.ndarray, points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The states (d, L) whose velocity can be set so that z just reaches 1 in the period, so set."""
    w = w.copy()
    w[0] = rng.uniform(-0.9, 0.9, w.shape[1])
    target = 1.0 + rng.choice(_DEPTHS, w.shape[1])
    low, high = np.full(w.shape[1], -3.0), np.full(w.shape[1], 3.0)
    for _ in range(_BISECTIONS):
        w[1] = (low + high) / 2
        above = flow.advance(w, 1, points=points, measured=True).measures[Measure.Z_MAX] > target
        low, high = np.where(above, low, w[1]), np.where(above, w[1], high)
    reached = flow.advance(w, 1, points=points, measured=True).measures[Measure.Z_MAX]
    return w[:, np.abs(reached - target) < 1e-10], np.flatnonzero(np.abs(reached - target) < 1e-10)


def states(flow: ExactFlow, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random states (d, P), and how each was made: 0 at random, 1 beside a boundary, 2 grazing."""
    count = flow.system.points
    w, made = rng.uniform(-2, 2, (flow.dimension, count)), np.zeros(count, dtype=int)
    fifth = count // 5
    made[:fifth] = 1
    w[0, :fifth] = rng.choice([-1, 1], fifth) * (1 + rng.choice([1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3], fifth))
    w[1, :fifth] *= rng.choice([1e-6, 1e-3, 1], fifth)
    points = np.arange(fifth, 2 * fifth)
    chosen, which = grazing(flow, w[:, points], points, rng)
    w[:, points[which]], made[points[which]] = chosen, 2
    return w, made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--states", type=int, default=100_000)
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    for name, (kind, share) in KINDS.items():
        flow = ExactFlow(random_system(kind, int(share * given.states), rng))
        w, made = states(flow, rng)
        ours, theirs = flow.advance(w, 1).w, Heyoka(flow.system).advance(w, 1)
        error = np.abs(ours - theirs).max(axis=0)
        for code, words in enumerate(("random", "beside a boundary", "grazing")):
            part = error[made == code]
            marks = ", ".join(f"{q:g} %: {np.quantile(part, q / 100):.1e}" for q in (50, 99, 99.9))
            print(f"{name} {words:18} {len(part):6} states  {marks}, worst {part.max():.1e}", flush=True)
        if error.max() > 1e-12:
            worst = np.argsort(error)[-3:]
            print(f"   worst: {[(int(made[i]), float(error[i]), w[:2, i].tolist()) for i in worst]}")


if __name__ == "__main__":
    main()
