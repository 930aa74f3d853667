"""A peer's own example beside the exact flow: the frequency response of an oscillator between two stops.

The peer is pyvib: harmonic balance with continuation, in NumPy. The example is its ``examples/contact/hb.py``,

    y'' + 0.05 y' + y + 3 f(y) = 0.03 sin ωt,   f(y) = y − clamp(y, −0.1745, 0.1745),   0.0063 <= ω <= 1.8,

with all its settings: corners of f rounded over 5e-4, 12 harmonics, 256 samples, stability by Hill's matrix at each
point; only its drawing is off. Ours is the branch of the same orbits, with multipliers and events. They take turns on
one core.

From each state of pyvib our orbit at the same ω is converged, and the amplitudes are compared. Beyond our fold there is
none. SciPy's DOP853, which shares no code with either, integrates some of our orbits, and should return to their start.

pyvib is in no package index: ``--pyvib FOLDER`` is a checkout of pawsen/pyvib from GitHub.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.linalg
from scipy.integrate import solve_ivp

import gearchaos as gc
from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import Branch, follow_branch
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, converge, count_unstable
from gearchaos.model.switched import SwitchedAffine, switched_system

DAMPING, STIFFNESS, GAP, FORCE = 0.05, 3.0, 0.1745, 0.03
LOW, HIGH = 2e-3 * np.pi, 1.8
ROUNDS = 7
CHECKED = 16  # every so manieth orbit is integrated by DOP853


class Stops(ParameterFamily):
    """The oscillator along ω with z = y/0.1745: a mesh without load and error, a spring to the ground and a force."""

    def __init__(self) -> None:
        super().__init__(gc.MeshModel.of(kind="single", zeta=DAMPING / 2, omega=LOW), ("omega",))

    def system(self, values: np.ndarray) -> SwitchedAffine:
        base, one = switched_system(self.batch(values), self.names), np.ones((len(values), 1))
        return replace(base, A=base.A - [[0.0, 0.0], [1.0, 0.0]], f0=0 * base.f0, f_cos=0 * one,
                       f_sin=FORCE / GAP * one, levels=STIFFNESS * one, starts=0 * one)


def ours() -> Branch:
    """The branch from the motion at the lowest ω, which touches no stop."""
    family = Stops()
    return follow_branch(family, converge(family, np.zeros((1, 2)), np.array([LOW])), (LOW, HIGH), Settings())


def pyvib() -> Any:
    """The example; what is not given here is its default, and the same there."""
    from pyvib.hb.hb import HB
    from pyvib.nlforce import NL_force, NL_piecewise_linear

    stops = NL_piecewise_linear(np.array([-GAP, GAP]), np.zeros(2), np.array([STIFFNESS, 0.0, STIFFNESS]),
                                np.array([[0, -1]]), [5e-4, 5e-4])
    found = HB(np.eye(1), DAMPING * np.eye(1), np.eye(1), NL_force(stops), NH=12, npow2=8, amp0=1e-4, tol_NR=1e-6,
               max_it_NR=25, anim=False)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints two lines a point
        found.periodic(LOW / (2 * np.pi), FORCE, 0)
        found.continuation(1e-4, HIGH, step=1e-3, step_min=1e-5, step_max=1e-2, it_cont_max=1e6)
    return found


def timed(run: Callable[[], Any]) -> tuple[Any, float]:
    """What it returns, and its CPU seconds."""
    begin = time.process_time()
    return run(), time.process_time() - begin


def converged(family: Stops, omega: float, coefficients: np.ndarray) -> Cycle:
    """Our orbit from the state of pyvib's, whose coefficients are the mean and a sine and a cosine of each harmonic."""
    sines, cosines = coefficients[1::2], coefficients[2::2]
    state = coefficients[0] + cosines.sum(), omega * sines @ np.arange(1, len(sines) + 1)
    return converge(family, np.array([state]) / GAP, np.array([omega]))


def amplitude(cycle: Cycle) -> float:
    """The largest y."""
    return GAP * float(cycle.extrema[:, 1].max())


def missed(cycle: Cycle) -> float:
    """How far from its start DOP853 ends after a period of an orbit, in z and z'."""
    omega = cycle.values[0]

    def slope(t: float, w: np.ndarray) -> tuple[float, float]:
        stop = STIFFNESS * (w[0] - min(max(w[0], -1.0), 1.0))
        return w[1], FORCE / GAP * np.sin(omega * t) - DAMPING * w[1] - w[0] - stop

    end = solve_ivp(slope, (0.0, 2 * np.pi / omega), cycle.points[0], "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return float(np.abs(end - cycle.points[0]).max())


def main() -> None:
    """Print the times, and how far the results differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pyvib", required=True)
    sys.path.insert(0, parser.parse_args().pyvib)
    scipy.linalg.kron = np.kron  # pyvib imports it; newer versions of SciPy do not have it
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    ours()  # compiles the kernels
    rounds = [(timed(ours), timed(pyvib)) for _ in range(ROUNDS)]
    times = np.array([(own, peer) for (_, own), (_, peer) in rounds])
    branch, found = rounds[-1][0][0], rounds[-1][1][0]
    counts = len(branch.points), len(found.omega_vec)
    for name, count, seconds in zip(("gearchaos", "pyvib"), counts, np.median(times, axis=0), strict=True):
        print(f"{name:10}{count:5d} points {seconds:7.3f} s {1e3 * seconds / count:7.2f} ms a point")
    ratios = times[:, 1] / times[:, 0]
    print(f"ratio {np.median(ratios):.1f} of the curves, {np.median(ratios) * counts[0] / counts[1]:.1f} of a point")
    turns = np.flatnonzero(np.diff(np.sign(np.diff(found.omega_vec)))) + 1
    print("folds", *(f"{e.point.u[-1]:.6f}" for e in branch.events if e.kind == "fold"),
          " pyvib turns at", *(f"{found.omega_vec[i]:.6f}" for i in turns))
    cycles = [converged(branch.family, *pair) for pair in zip(found.omega_vec, found.z_vec, strict=True)]
    pairs = [(own, float(peer[0]), bool(stable)) for own, peer, stable
             in zip(cycles, found.xamp_vec, found.stab_vec, strict=True) if own.converged]
    errors = [abs(peer / amplitude(own) - 1) for own, peer, _ in pairs]
    same = sum(stable == (count_unstable(own.multipliers) == 0) for own, _, stable in pairs)
    print(f"{len(pairs)} of pyvib's points have an orbit of ours at the same ω: {same} as stable or unstable as ours, "
          f"amplitude differing by {np.median(errors):.1e} in the median, {max(errors):.1e} at most")
    checked = [missed(own) for own in cycles[::CHECKED] if own.converged]
    print(f"DOP853 misses the start of {len(checked)} of ours by at most {max(checked):.1e}")


if __name__ == "__main__":
    main()
