"""Points per CPU second along a 1T branch, and the time that shooting with heyoka takes for the same orbits.

The branch is that of the 1T motion over ω from 0.85 to 2.4, q0 = 0.1, ε1 = 0.02, for d = 2, 4 and 7 coordinates. "Ours"
is the whole branch with its events. "Shooting" converges the same orbits from the previous point of the branch, by
Newton's method on the map of one mesh period, to a residual of 1e-10; the monodromy matrix is from forward
differences with heyoka, since its integrators with events have no variational equations. The time to compile heyoka's
integrators is left out. The peer follows nothing and looks for no events: it only converges orbits. The time is that of
the processor, on which a busy machine has less effect.
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.optimize  # noqa: F401 - locates events; loaded before the clock runs
from peers.heyoka_peer import Heyoka

import gearchaos as gc
from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import Branch, follow_branch
from gearchaos.continuation.orbit import find_cycle

KINDS: dict[str, dict[str, Any]] = {
    "d2": {"kind": "torsional"},
    "d4": {"kind": "full"},
    "d7": {"kind": "full", "beta1": 0.02, "kappa1": 0.4},
}
BOUNDS = (0.85, 2.4)
RESIDUAL = 1e-10


def follow(values: dict[str, Any]) -> tuple[Branch, float]:
    """The branch, and the CPU seconds that it took; once before for compilation."""
    family, cycle = find_cycle(gc.MeshModel.of(omega=1.5, q0=0.1, eps1=0.02, **values), ("omega",), None, None)
    follow_branch(family, cycle, BOUNDS, Settings(points=3))
    begin = time.process_time()
    branch = follow_branch(family, cycle, BOUNDS, Settings())
    return branch, time.process_time() - begin


def shoot(branch: Branch) -> tuple[int, int, float]:
    """Orbits that shooting converged, mesh periods integrated, and the CPU seconds that it took."""
    points, family = branch.points, branch.family
    converged, periods, seconds = 0, 0, 0.0
    for before, point in pairwise(points):
        peer = Heyoka(family.system(point.u[None, -1:]))
        begin = time.process_time()
        found, count = newton(peer, before.u[:-1].copy())
        seconds += time.process_time() - begin
        converged, periods = converged + found, periods + count
    return converged, periods, seconds


def newton(peer: Heyoka, w: np.ndarray) -> tuple[bool, int]:
    """Whether Newton's method converges from a state (d,), and the mesh periods that it integrated."""
    d, step = len(w), 1e-7
    for iteration in range(1, 9):
        images = [peer.advance((w + offset)[:, None], 1)[:, 0] for offset in (np.zeros(d), *step * np.eye(d))]
        defect = images[0] - w
        if np.abs(defect).max() < RESIDUAL:
            return True, (iteration - 1) * (d + 1) + 1
        monodromy = np.stack([(image - images[0]) / step for image in images[1:]], axis=1)
        w = w - np.linalg.solve(monodromy - np.eye(d), defect)
    return False, 8 * (d + 1)


def main() -> None:
    """Print one row for each number of coordinates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    print("      points  events  points/s  ms a point | shooting: orbits  periods  ms an orbit  ratio")
    for kind in parser.parse_args().kinds:
        branch, seconds = follow(KINDS[kind])
        count = len(branch.points)
        converged, periods, peer = shoot(branch)
        ours, theirs = 1e3 * seconds / count, 1e3 * peer / (count - 1)
        print(f"{kind}  {count:8d}{len(branch.events):8d}{count / seconds:10.0f}{ours:12.2f} |"
              f"{converged:17d}{periods:9d}{theirs:13.2f}{theirs / ours:7.2f}")


if __name__ == "__main__":
    main()
