"""The error of the flow over one mesh period, compared with heyoka, for 100 000 random states and parameters.

A fifth of the states are made to graze: their initial velocity is found by bisection, such that the largest z of the
period is 1 plus a depth between -1e-6 and 1e-6. Another fifth start near a contact boundary with a small velocity.
Prints quantiles and the largest error.
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
"""Models, each with its share of the number of states."""

RANGES = {"omega": (0.3, 3.0), "q0": (-0.1, 0.4), "eps1": (0.0, 0.3), "theta1": (0.0, 6.0), "zeta": (0.0, 0.1)}
"""Ranges of the random parameters."""

_DEPTHS = np.array([1e-6, 1e-9, 1e-12, -1e-12, -1e-9, -1e-6])
"""How far the largest z of a grazing state exceeds 1."""

_BISECTIONS = 50


def random_system(kind: dict, count: int, rng: np.random.Generator) -> SwitchedAffine:
    """A system of ``count`` points with random parameters."""
    values = {name: rng.uniform(*ends, count) for name, ends in RANGES.items()}
    return switched_system(vary(MeshModel.of(**kind), values))


def grazing(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Grazing states (d, N), and their indices (N,) among the states ``w`` (d, L) of ``points`` (L,) to begin with.

    States for which bisection finds no velocity are left out.
    """
    w = w.copy()
    w[0] = rng.uniform(-0.9, 0.9, w.shape[1])
    target = 1.0 + rng.choice(_DEPTHS, w.shape[1])
    low, high = np.full(w.shape[1], -3.0), np.full(w.shape[1], 3.0)
    for _ in range(_BISECTIONS):
        w[1] = (low + high) / 2
        above = flow.advance(w, 1, points=points, measured=True).measures[Measure.Z_MAX] > target
        low, high = np.where(above, low, w[1]), np.where(above, w[1], high)
    reached = flow.advance(w, 1, points=points, measured=True).measures[Measure.Z_MAX]
    found = np.flatnonzero(np.abs(reached - target) < 1e-10)
    return w[:, found], found


def states(flow: ExactFlow, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Random states (d, P), and the kind (P,) of each: 0 random, 1 near a boundary, 2 grazing."""
    count = flow.system.points
    w, kind_of_state = rng.uniform(-2, 2, (flow.dimension, count)), np.zeros(count, dtype=int)
    fifth = count // 5
    kind_of_state[:fifth] = 1
    w[0, :fifth] = rng.choice([-1, 1], fifth) * (1 + rng.choice([1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3], fifth))
    w[1, :fifth] *= rng.choice([1e-6, 1e-3, 1], fifth)
    points = np.arange(fifth, 2 * fifth)
    chosen, which = grazing(flow, w[:, points], points, rng)
    w[:, points[which]], kind_of_state[points[which]] = chosen, 2
    return w, kind_of_state


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--states", type=int, default=100_000)
    given = parser.parse_args()
    rng = np.random.default_rng(1)
    for name, (kind, share) in KINDS.items():
        flow = ExactFlow(random_system(kind, int(share * given.states), rng))
        w, kind_of_state = states(flow, rng)
        ours, theirs = flow.advance(w, 1).w, Heyoka(flow.system).advance(w, 1)
        error = np.abs(ours - theirs).max(axis=0)
        for code, words in enumerate(("random", "near a boundary", "grazing")):
            part = error[kind_of_state == code]
            marks = ", ".join(f"{q:g} %: {np.quantile(part, q / 100):.1e}" for q in (50, 99, 99.9))
            print(f"{name} {words:18} {len(part):6} states  {marks}, worst {part.max():.1e}", flush=True)
        if error.max() > 1e-12:
            worst = np.argsort(error)[-3:]
            print(f"   worst: {[(int(kind_of_state[i]), float(error[i]), w[:2, i].tolist()) for i in worst]}")


if __name__ == "__main__":
    main()
